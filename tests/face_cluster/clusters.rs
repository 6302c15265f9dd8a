//! The tree of face clusters: what a tree must be, bounds that are bounds, and which faces go together.

use crate::common::scenes::{lambert, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::Fixture;
use glam::Vec3;
use linklight::gpu::shaders::methods::face_cluster as passes;
use linklight::gpu::shaders::types::FaceCluster;
use linklight::stages::clusters::{
    ClusterTree, MAX_DEPTH, MeshFaces, axes, cache, face_count, first_face, least_projected_area, most_projected_area,
    normal_projected_area, self_shares,
};
use linklight::stages::world::World;

/// A mesh of one material.
struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    albedo: Vec<Vec3>,
}

impl Mesh {
    fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        let albedo = vec![Vec3::splat(0.5); triangles.len()];
        Self { positions, triangles, albedo }
    }

    fn faces<'a>(&'a self, dark: &'a [Vec3]) -> MeshFaces<'a> {
        MeshFaces {
            positions: &self.positions,
            triangles: &self.triangles,
            albedo: &self.albedo,
            reflectance: &self.albedo,
            emission: dark,
        }
    }

    fn tree(&self) -> ClusterTree {
        ClusterTree::build(&self.faces(&vec![Vec3::ZERO; self.triangles.len()]))
    }

    fn normal_area(&self, face: u32) -> Vec3 {
        let [a, b, c] = self.triangles[face as usize].map(|v| self.positions[v as usize]);
        (b - a).cross(c - a) * 0.5
    }
}

/// `side` x `side` squares over [0, 1]^2, raised by `height`.
fn sheet(side: u32, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let at = |i: u32| i as f32 / side as f32;
    let positions =
        (0..=side).flat_map(|y| (0..=side).map(move |x| (at(x), at(y)))).map(|(x, y)| Vec3::new(x, y, height(x, y)));
    let mut triangles = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let a = y * (side + 1) + x;
            let b = a + side + 1;
            triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    Mesh::new(positions.collect(), triangles)
}

/// The outside of a sphere of latitude bands.
fn sphere(bands: u32) -> Mesh {
    use std::f32::consts::{PI, TAU};
    let mut positions = Vec::new();
    for i in 0..=bands {
        for j in 0..2 * bands {
            let (theta, phi) = (PI * i as f32 / bands as f32, TAU * j as f32 / (2 * bands) as f32);
            positions.push(Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()));
        }
    }
    let mut triangles = Vec::new();
    let at = |i: u32, j: u32| i * 2 * bands + j % (2 * bands);
    for i in 0..bands {
        for j in 0..2 * bands {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            if i + 1 < bands {
                triangles.push([a, b, c]);
            }
            if i > 0 {
                triangles.push([a, c, d]);
            }
        }
    }
    // All vertices of a pole stand at one place.
    positions.iter_mut().for_each(|p| *p = if p.truncate().length() < 1e-6 { Vec3::Z * p.z.signum() } else { *p });
    Mesh::new(positions, triangles)
}

/// Triangles that have nothing to do with each other.
fn soup(count: u32) -> Mesh {
    let mut random = Random(7);
    let mut point = || Vec3::new(random.unit(), random.unit(), random.unit());
    let mut positions = Vec::new();
    for _ in 0..count {
        let center = point() * 10.0;
        positions.extend([center, center + point(), center + point()]);
    }
    Mesh::new(positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// A strip that a greedy contraction could peel from one end.
fn strip(count: u32) -> Mesh {
    let positions = (0..count + 2).map(|i| Vec3::new(1.01f32.powi(i as i32 / 2), (i % 2) as f32, 0.0)).collect();
    let triangle = |i: u32| if i.is_multiple_of(2) { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] };
    Mesh::new(positions, (0..count).map(triangle).collect())
}

fn meshes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("one face", sheet_of_one()),
        ("flat", sheet(12, |_, _| 0.0)),
        ("waves", sheet(40, |x, y| 0.1 * (9.0 * x).sin() * (7.0 * y).cos())),
        ("sphere", sphere(12)),
        ("soup", soup(150)),
        ("strip", strip(400)),
    ]
}

fn sheet_of_one() -> Mesh {
    Mesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])
}

/// What is wrong with the tree, if anything.
fn fault(mesh: &Mesh, tree: &ClusterTree) -> Option<String> {
    let count = mesh.triangles.len();
    let mut sorted = tree.faces.clone();
    sorted.sort_unstable();
    if sorted != (0..count as u32).collect::<Vec<_>>() || tree.clusters.len() != 2 * count - 1 {
        return Some(format!("{} faces at {} places in {} clusters", count, tree.faces.len(), tree.clusters.len()));
    }
    if tree.depth > MAX_DEPTH {
        return Some(format!("{} levels", tree.depth));
    }
    for (i, cluster) in tree.clusters.iter().enumerate() {
        let (first, faces) = (first_face(cluster) as usize, face_count(cluster) as usize);
        let own = &tree.faces[first..first + faces];
        let area: f32 = own.iter().map(|&f| mesh.normal_area(f).length()).sum();
        if (cluster.area - area).abs() > 1e-4 * area.max(1e-6) {
            return Some(format!("cluster {i} has area {}, its faces {area}", cluster.area));
        }
        for &face in own {
            for v in mesh.triangles[face as usize] {
                let p = axes(cluster).transpose() * (mesh.positions[v as usize] - cluster.center);
                if !p.abs().cmple(cluster.half_extent + 1e-6).all() {
                    return Some(format!("cluster {i}: vertex {v} at {p} of a box of {}", cluster.half_extent));
                }
            }
        }
        if let Some([left, right]) = tree.children(i as u32) {
            let [a, b] = [left, right].map(|c| &tree.clusters[c as usize]);
            let split = first_face(a) == first_face(cluster)
                && first_face(b) == first_face(a) + face_count(a)
                && face_count(a) + face_count(b) == face_count(cluster);
            if !split {
                return Some(format!("cluster {i} is not its children {left} and {right}"));
            }
        }
    }
    None
}

#[test]
fn every_face_is_in_one_leaf_and_every_box_holds_its_faces() {
    for (name, mesh) in meshes() {
        let tree = mesh.tree();
        assert_eq!(fault(&mesh, &tree), None, "{name}");
        println!("{name}: {} faces, {} levels", mesh.triangles.len(), tree.depth);
    }
}

#[test]
fn a_broken_tree_is_noticed() {
    let mesh = sheet(6, |x, _| x * x);
    let tree = mesh.tree();
    let broken = |change: &dyn Fn(&mut ClusterTree)| {
        let mut tree = tree.clone();
        change(&mut tree);
        fault(&mesh, &tree)
    };
    assert!(broken(&|t| t.faces[3] = t.faces[4]).is_some());
    assert!(broken(&|t| t.clusters[5].area *= 1.01).is_some());
    assert!(broken(&|t| t.clusters[0].half_extent.x *= 0.9).is_some());
    assert!(broken(&|t| t.clusters[1].first_face += 1).is_some());
}

/// Sampled directions: the true area of all faces that look there lies between the bounds, and equals them where it must.
#[test]
fn projected_areas_lie_within_their_bounds() {
    let mut random = Random(3);
    for (name, mesh) in meshes() {
        let tree = mesh.tree();
        for (i, cluster) in tree.clusters.iter().enumerate().step_by(1 + tree.clusters.len() / 60) {
            for _ in 0..16 {
                let d = Vec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize();
                let first = first_face(cluster) as usize;
                let own = &tree.faces[first..first + face_count(cluster) as usize];
                let projected: f32 = own.iter().map(|&f| mesh.normal_area(f).dot(d).max(0.0)).sum();
                let (least, most) = (least_projected_area(cluster, d), most_projected_area(cluster, d));
                let slack = 1e-4 * cluster.area;
                assert!(
                    least <= projected + slack && projected <= most + slack,
                    "{name} {i}: {least} {projected} {most}"
                );
                if name == "flat" {
                    assert!((least - projected).abs() < slack, "{name} {i}: {least} {projected}");
                }
            }
        }
    }
}

#[test]
fn convex_is_what_cannot_see_itself() {
    let root = |mesh: &Mesh| self_shares(&mesh.tree().clusters[0])[0] == 0.0;
    assert!(root(&sheet(8, |_, _| 0.0)) && root(&sphere(8)));
    assert!(root(&sheet(8, |x, y| -(x - 0.5).powi(2) - (y - 0.5).powi(2))), "a dome seen from outside");
    assert!(!root(&sheet(8, |x, y| (x - 0.5).powi(2) + (y - 0.5).powi(2))), "a bowl seen from inside");
    assert!(!root(&soup(4)));
}

/// What a cluster sends itself: all that does not leave a bowl's opening, nothing of its outside; and of waves, what rays
/// between all faces say.
#[test]
fn clusters_send_themselves_what_closed_forms_and_all_pairs_say() {
    let share = |mesh: &Mesh| {
        let root = mesh.tree().clusters[0];
        let turned = 1.0 - normal_projected_area(&root) / root.area;
        self_shares(&root).map(|share| share * turned)
    };
    let bowl = sheet(24, |x, y| 1.2 * ((x - 0.5).powi(2) + (y - 0.5).powi(2)));
    let rim = |mesh: &Mesh| {
        let area: f32 = (0..mesh.triangles.len() as u32).map(|f| mesh.normal_area(f).length()).sum();
        let opening: Vec3 = (0..mesh.triangles.len() as u32).map(|f| mesh.normal_area(f)).sum();
        1.0 - opening.length() / area
    };
    let [inside, outside] = share(&bowl);
    println!("a bowl: {inside} inside, {outside} outside, expected {} and nothing", rim(&bowl));
    assert!((inside / rim(&bowl) - 1.0).abs() < 0.2 && outside == 0.0, "{inside}, {outside}");

    let waves = sheet(24, |x, y| 0.08 * (9.0 * x).sin() * (11.0 * y).cos());
    let centers = |f: u32| waves.triangles[f as usize].iter().map(|&v| waves.positions[v as usize]).sum::<Vec3>() / 3.0;
    let (mut meets, mut area) = ([0.0f64; 2], 0.0f64);
    for f in 0..waves.triangles.len() as u32 {
        area += f64::from(waves.normal_area(f).length());
        for g in (0..waves.triangles.len() as u32).filter(|&g| g != f) {
            let d = centers(g) - centers(f);
            let (out, back) = (waves.normal_area(f).dot(d), -waves.normal_area(g).dot(d));
            if out * back > 0.0 {
                let value = f64::from(out * back / d.length_squared().powi(2)) / std::f64::consts::PI;
                meets[usize::from(out < 0.0)] += value;
            }
        }
    }
    let found = share(&waves);
    let expected = meets.map(|m| m / area);
    println!("waves: {found:?}, all pairs say {expected:?}");
    // Steps of half a power of two, and few pairs.
    assert!((0..2).all(|k| (0.7..1.4).contains(&(f64::from(found[k]) / expected[k]))), "{found:?}, {expected:?}");
}

/// A flat sheet of two colours is cut along their border first.
#[test]
fn colours_part_before_shapes() {
    let mut mesh = sheet(16, |_, _| 0.0);
    for (face, albedo) in mesh.albedo.iter_mut().enumerate() {
        let x = mesh.triangles[face].iter().map(|&v| mesh.positions[v as usize].x).sum::<f32>() / 3.0;
        *albedo = if x < 0.25 { Vec3::new(0.8, 0.1, 0.1) } else { Vec3::splat(0.7) };
    }
    let tree = mesh.tree();
    let children = tree.children(0).unwrap().map(|c| tree.clusters[c as usize]);
    let mut areas = children.map(|c| c.area);
    areas.sort_by(f32::total_cmp);
    assert!((areas[0] - 0.25).abs() < 1e-4, "{areas:?}");
}

/// Boxes at right angles: the first cuts are along the edges, so that pieces are flat.
#[test]
fn creases_part_before_sizes() {
    let mesh = sheet(16, |x, _| (x - 0.5).max(0.0) * 4.0);
    let tree = mesh.tree();
    for child in tree.children(0).unwrap() {
        let cluster = &tree.clusters[child as usize];
        assert!(cluster.half_extent.z < 1e-3, "{}", cluster.half_extent);
    }
}

/// The box is the smallest around its z: a turned rectangle's box is itself.
#[test]
fn boxes_are_tight() {
    let mut mesh = sheet(4, |_, _| 0.0);
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    mesh.positions.iter_mut().for_each(|p| *p = turn * (*p * Vec3::new(3.0, 1.0, 1.0)) + 5.0);
    let root: FaceCluster = mesh.tree().clusters[0];
    assert!((root.half_extent - Vec3::new(1.5, 0.5, 0.0)).abs().max_element() < 1e-3, "{}", root.half_extent);
    assert!((axes(&root).z_axis - turn * Vec3::Z).length() < 1e-5);
}

#[test]
fn the_same_faces_make_the_same_tree_on_any_number_of_cores() {
    let mesh = sheet(100, |x, y| 0.05 * (20.0 * x).sin() * (17.0 * y).sin());
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let alone = pool(1).install(|| mesh.tree());
    assert!(pool(3).install(|| mesh.tree()) == alone);
    assert_eq!(fault(&mesh, &alone), None);
    // Pieces were contracted apart here, and bounds hold across them.
    assert!(mesh.triangles.len() > 1 << 14);
}

#[test]
fn no_faces_and_bad_faces_make_a_tree() {
    assert_eq!(Mesh::new(Vec::new(), Vec::new()).tree(), ClusterTree::default());
    let flat = Mesh::new(vec![Vec3::ONE; 6], vec![[0, 1, 2], [3, 4, 5], [0, 0, 0]]);
    let tree = flat.tree();
    assert_eq!((tree.clusters.len(), tree.clusters[0].area), (5, 0.0));
    assert!(tree.clusters.iter().all(|c| c.center.is_finite() && axes(c).z_axis.is_finite()));
    assert_eq!(size_of::<FaceCluster>(), 108, "the paper's cluster takes 110 bytes");
}

/// A tree is read back as it was; a damaged or foreign file is made anew, and a folder that cannot be is no obstacle.
#[test]
fn trees_are_kept_between_runs() {
    let mesh = sheet(50, |x, y| 0.1 * (5.0 * x).sin() * y);
    let dark = vec![Vec3::ZERO; mesh.triangles.len()];
    let faces = mesh.faces(&dark);
    assert!(mesh.triangles.len() >= cache::LEAST_FACES);
    let folder = tempfile::tempdir().unwrap();
    let built = cache::tree(&faces, Some(folder.path()));
    let path = cache::path_of(folder.path(), &faces);
    let whole = std::fs::read(&path).unwrap();
    assert!(cache::tree(&faces, Some(folder.path())) == built);

    // What is read is what is in the file: another tree, whole, is believed; a changed byte is not.
    for damage in [0, 9, whole.len() / 2, whole.len() - 1] {
        let mut bytes = whole.clone();
        bytes[damage] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        assert!(cache::tree(&faces, Some(folder.path())) == built, "byte {damage}");
        assert_eq!(std::fs::read(&path).unwrap(), whole, "byte {damage} was repaired");
    }
    std::fs::write(&path, &whole[..whole.len() / 3]).unwrap();
    assert!(cache::tree(&faces, Some(folder.path())) == built);
    assert!(cache::tree(&faces, Some(&path.join("below a file"))) == built);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left behind");

    // Another colour is another mesh.
    let mut other = sheet(50, |x, y| 0.1 * (5.0 * x).sin() * y);
    other.albedo[7] = Vec3::X;
    assert_ne!(cache::key(&other.faces(&dark)), cache::key(&faces));
}

/// Untextured materials: base colour less metal, what reflects along the normal, and emission, of every triangle.
#[test]
fn materials_of_faces_are_means() {
    let context = TestContext::new();
    let mut metal = lambert(Vec3::new(0.8, 0.6, 0.4));
    (metal.metallic, metal.specular) = (0.25, 1.0);
    metal.emission = Vec3::new(0.5, 2.0, 7.0);
    let sheets = [0u32, 1].map(|k| parallelogram(Vec3::X * k as f32, Vec3::X, Vec3::Z, 3, k));
    let fixture = Fixture::new(&context, scene(vec![lambert(Vec3::splat(0.5)), metal], sheets.to_vec(), &[]), None);
    let Fixture { scene, geometry, pose, environment, .. } = &fixture;
    let world = &World::new(&context, scene, geometry, pose, environment, false).unwrap();
    let count = geometry.triangles.len();
    let tables = [0, 1, 2].map(|_| context.upload("test/faces", &vec![Vec3::NAN; count]).unwrap());
    let mut recorder = context.recorder("test").unwrap();
    let pass = passes::FaceMaterials {
        triangles: &world.triangles,
        triangle_materials: &world.triangle_materials,
        attributes: &world.attributes,
        materials: &world.materials,
        albedo: &tables[0],
        reflectance: &tables[1],
        emission: &tables[2],
        textures: &world.textures,
        params: passes::FaceMaterialsParams { triangle_count: count as u32 },
    };
    recorder.dispatch(&pass, count);
    recorder.submit().unwrap();
    let [albedo, reflectance, emission] = tables.map(|table| context.download(&table).unwrap());
    let of_material: Vec<u32> = context.download(&world.triangle_materials).unwrap();
    for t in 0..count {
        let material = &fixture.scene.materials[of_material[t] as usize];
        let base = material.base_color.truncate();
        let diffuse = base * (1.0 - material.metallic);
        assert!(albedo[t].abs_diff_eq(diffuse, 1e-5), "{} expected {diffuse}", albedo[t]);
        assert!(emission[t].abs_diff_eq(material.emission, 1e-5));
        let specular = base * material.metallic + 0.04 * material.specular * (1.0 - material.metallic);
        assert!(reflectance[t].abs_diff_eq(diffuse + specular, 1e-5), "{} of {diffuse} and {specular}", reflectance[t]);
        assert!(!albedo[t].abs_diff_eq(diffuse * 1.01, 1e-5), "a wrong albedo is noticed");
    }
}
