//! Where light goes: what the solver says each part of a scene receives of each other part, beside a plain Monte Carlo
//! twin that sends rays off the faces themselves.

use crate::common::scenes::{light, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, leaves, received};
use crate::grown::closed_box;
use crate::physics::{around, one_sided};
use crate::twins;
use glam::Vec3;
use linklight::gpu::shaders::types::Ray;
use linklight::methods::face_cluster::Settings;
use linklight::methods::face_cluster::rules::Basis;
use linklight::scene::{LightKind, Material, Primitive, Scene};
use linklight::stages::trace::{self, BACK_FACE, NO_HIT, Tracer};
use std::f32::consts::PI;

/// W that the faces of a material receive: by the solver, and by rays.
#[derive(Clone, Copy, Default)]
struct Received {
    /// Of sides that are lit, m2.
    area: f64,
    solved: f64,
    by_rays: f64,
}

/// One row: `emitters` shine with radiance 1; what each material's faces get, and what is sent, W.
fn row(
    context: &TestContext,
    scene: &Scene,
    emitters: &[usize],
    settings: Settings,
    rays: usize,
) -> (f64, Vec<Received>) {
    let mut scene = scene.clone();
    emitters.iter().for_each(|&k| scene.materials[k].emission = Vec3::ONE);
    let fixture = Fixture::new(context, scene, None);
    let method = fixture.solve(context, settings, 0);
    let all = leaves(context, &method);
    let sides = context.download(method.state().triangle_leaves()).unwrap();
    let material_of = |triangle: usize| {
        let part = fixture.geometry.parts.iter().find(|p| {
            (p.triangle_offset as usize..(p.triangle_offset + p.triangle_count) as usize).contains(&triangle)
        });
        part.unwrap().material as usize
    };
    let corners = |t: usize| fixture.geometry.triangles[t].map(|v| fixture.positions[v as usize]);
    let material_of: Vec<usize> = (0..fixture.geometry.triangles.len()).map(material_of).collect();
    let mut table = vec![Received::default(); fixture.scene.materials.len()];
    let mut material_of_leaf = vec![usize::MAX; all.len()];
    for (t, s) in sides.iter().enumerate() {
        for leaf in [s.x, s.y] {
            if leaf != u32::MAX {
                material_of_leaf[leaf as usize] = material_of[t];
                let [a, b, c] = corners(t);
                table[material_of[t]].area += 0.5 * f64::from((b - a).cross(c - a).length());
            }
        }
    }
    for leaf in &all {
        let power = f64::from(leaf.element.area) * f64::from(leaf.direct.x);
        table[material_of_leaf[leaf.index as usize]].solved += power;
    }
    // Rays off the emitters' fronts.
    let faces: Vec<usize> = (0..material_of.len()).filter(|&t| emitters.contains(&material_of[t])).collect();
    let mut cumulative = vec![0.0f64];
    for &t in &faces {
        let [a, b, c] = corners(t);
        cumulative.push(cumulative.last().unwrap() + 0.5 * f64::from((b - a).cross(c - a).length()));
    }
    let area = *cumulative.last().unwrap();
    let mut random = Random(7);
    let rays: Vec<Ray> = (0..rays)
        .map(|k| {
            let at = area * (k as f64 + f64::from(random.unit())) / rays as f64;
            let face = (cumulative.partition_point(|&sum| sum <= at) - 1).min(faces.len() - 1);
            let [a, b, c] = corners(faces[face]);
            let (u, v) = (random.unit().sqrt(), random.unit());
            let origin = a * (1.0 - u) + b * (u * (1.0 - v)) + c * (u * v);
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
            Ray {
                origin: origin + 1e-5 * normal,
                t_min: 0.0,
                direction: around(normal, &mut random),
                t_max: f32::INFINITY,
            }
        })
        .collect();
    let (device_rays, hits) =
        (context.upload("test/rays", &rays).unwrap(), context.buffer("test/hits", rays.len()).unwrap());
    let mut recorder = context.recorder("test").unwrap();
    trace::closest_hit(&mut recorder, &Tracer::compute(&fixture.bvh, &fixture.world), &device_rays, &hits, rays.len());
    recorder.submit().unwrap();
    let power = f64::from(PI) * area / rays.len() as f64;
    for hit in context.download(&hits).unwrap() {
        if hit.triangle == NO_HIT {
            continue;
        }
        let t = (hit.triangle & !BACK_FACE) as usize;
        let leaf = if hit.triangle & BACK_FACE == 0 { sides[t].x } else { sides[t].y };
        if leaf != u32::MAX {
            table[material_of[t]].by_rays += power;
        }
    }
    (f64::from(PI) * area, table)
}

/// A closed body of the places that `at` gives a grid, wound outwards.
fn body(cells: u32, material: u32, at: impl Fn(f32, f32) -> Vec3) -> Primitive {
    let mut body = parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, cells, material);
    body.positions.iter_mut().for_each(|p| *p = at(p.x, p.y));
    let p = &body.positions;
    let volume: f32 = body.triangles.iter().map(|t| t.map(|v| p[v as usize])).map(|[a, b, c]| a.dot(b.cross(c))).sum();
    if volume < 0.0 {
        body.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    body
}

/// A room of side 2 with a ball and a post: walls, ball, post.
fn furnished_room() -> Scene {
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let wall = |corner: Vec3, u: Vec3, v: Vec3| parallelogram(corner, u, v, 10, 0);
    let zero = Vec3::ZERO;
    let walls = [wall(zero, x, y), wall(z, y, x), wall(zero, y, z), wall(x, z, y), wall(zero, z, x), wall(y, x, z)];
    let on_sphere = |u: f32, v: f32| {
        let (around, down) = (2.0 * PI * u, PI * v);
        Vec3::new(down.sin() * around.cos(), down.cos(), down.sin() * around.sin())
    };
    let ball = body(16, 1, |u, v| Vec3::new(0.6, 0.7, 0.7) + 0.35 * on_sphere(u, v));
    // A ball pressed into a box.
    let boxed = |p: Vec3| p.clamp(Vec3::splat(-0.5), Vec3::splat(0.5));
    let post = body(16, 2, |u, v| Vec3::new(1.4, 0.61, 1.3) + Vec3::new(0.4, 1.2, 0.4) * boxed(1.2 * on_sphere(u, v)));
    scene(vec![one_sided(0.7), one_sided(0.6), one_sided(0.5)], walls.into_iter().chain([ball, post]).collect(), &[])
}

/// Closed bodies send and take all their light, however little of it meets a shooter or receiver as a whole: their
/// vector areas are nothing.
#[test]
fn parts_receive_what_rays_off_the_faces_say() {
    let context = TestContext::new();
    let room = furnished_room();
    for (emitters, tolerance) in [(vec![0, 1, 2], 0.01), (vec![1], 0.02), (vec![2], 0.02)] {
        let (sent, table) = row(&context, &room, &emitters, Settings::default(), 100_000);
        let total = table.iter().fold(Received::default(), |sum, r| Received {
            area: sum.area + r.area,
            solved: sum.solved + r.solved,
            by_rays: sum.by_rays + r.by_rays,
        });
        println!("{emitters:?} send {sent:.3} W; rays say {:.3}, the solver {:.3}", total.by_rays, total.solved);
        for (part, r) in ["walls", "ball", "post"].iter().zip(&table) {
            println!("    {part}: {:.3} by rays, {:.3} solved, ratio {:.3}", r.by_rays, r.solved, r.solved / r.by_rays);
            // Where everything shines alike, every place receives pi times its radiance.
            let off = r.solved / (f64::from(PI) * r.area) - 1.0;
            assert!(emitters.len() < 3 || off.abs() < 0.01, "{part} is off by {off} where everything shines");
        }
        assert!((total.by_rays / sent - 1.0).abs() < 0.02, "the room is closed: {} of {sent}", total.by_rays);
        assert!((total.solved / total.by_rays - 1.0).abs() < tolerance, "{} of {}", total.solved, total.by_rays);
    }
}

/// A slab lies on a plinth, sunk into it by a little: what of its lower side shows takes the floor's light, though most
/// nodes there lie inside the plinth.
#[test]
fn what_shows_of_a_sunk_body_takes_its_light() {
    let context = TestContext::new();
    let floor = parallelogram(Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X, 32, 0);
    let plinth = closed_box(Vec3::new(-0.3, 0.001, -0.3), Vec3::new(0.3, 0.5, 0.3), 4, 1);
    let slab = closed_box(Vec3::new(-0.22, 0.49, -0.26), Vec3::new(0.36, 0.6, 0.34), 24, 2);
    let scene = scene(vec![one_sided(0.0), one_sided(0.5), one_sided(0.5)], vec![floor, plinth, slab], &[]);
    for threshold in [3e-2, 1e-2, 3e-3, 1e-3] {
        let (_, table) = row(&context, &scene, &[0], Settings { threshold, ..Settings::default() }, 1_000_000);
        let Received { solved, by_rays, .. } = table[2];
        println!("threshold {threshold:e}: the slab gets {solved:.4} W, by rays {by_rays:.4}, {:.3}", solved / by_rays);
        assert!((solved / by_rays - 1.0).abs() < 0.1, "threshold {threshold:e}: {solved} of {by_rays} W");
    }
}

/// A floor of side 2, a board at its middle and a lamp of its size above it: floor, board, lamp.
fn below_a_lamp(board: (Vec3, Vec3), at: Vec3, lamp_height: f32) -> Scene {
    let (x, z) = (Vec3::X, Vec3::Z);
    let mut materials = vec![one_sided(0.5), Material { double_sided: true, ..one_sided(0.25) }, one_sided(0.0)];
    materials[2].emission = Vec3::ONE;
    let floor = parallelogram(Vec3::new(-1.0, 0.0, -1.0), 2.0 * z, 2.0 * x, 32, 0);
    let lamp = parallelogram(Vec3::new(-1.0, lamp_height, -1.0), 2.0 * x, 2.0 * z, 16, 2);
    let (u, v) = board;
    scene(materials, vec![floor, parallelogram(at - 0.5 * (u + v), u, v, 8, 1), lamp], &[])
}

/// Shadows too small to matter to one piece of a lamp are not lost to all of them together.
#[test]
fn no_light_comes_into_the_core_of_a_small_shadow() {
    let context = TestContext::new();
    let (height, side) = (0.2, 0.4);
    let board = (Vec3::Z * side, Vec3::X * side);
    let fixture = Fixture::new(&context, below_a_lamp(board, Vec3::Y * height, 2.0), None);
    let method = fixture.solve(&context, Settings::default(), 0);
    let (all, sides) = (leaves(&context, &method), context.download(method.state().triangle_leaves()).unwrap());
    // Where the lamp's border is seen past none of the board's: half the board's side, less what its height lets in.
    let core = 0.5 * side - (1.0 - 0.5 * side) * height / (2.0 - height);
    let middle =
        |t: usize| fixture.geometry.triangles[t].map(|v| fixture.positions[v as usize]).iter().sum::<Vec3>() / 3.0;
    let (mut dark, mut lit, mut floor) = (0.0, 0.0, 0.0);
    let mut faces = 0;
    for (t, leaf) in sides.iter().enumerate().filter(|(t, _)| middle(*t).y < 1e-3) {
        let light = f64::from(all[leaf.x as usize].direct.x);
        if middle(t).abs().max_element() < core {
            (dark, faces) = (dark + light, faces + 1);
        }
        (lit, floor) = (lit + light, floor + 1.0);
    }
    let (dark, lit) = (dark / f64::from(faces), lit / floor);
    println!(
        "{faces} faces in the core get {dark:.4} W/m2, the floor {lit:.4}, {} transfers",
        method.report().transfers()
    );
    assert!(faces > 10 && dark < 0.05 * lit, "{dark} W/m2 in the core, {lit} on the floor");
}

/// Errors are judged by the light that strikes surfaces: a lamp that shines into the void makes nothing coarser.
#[test]
fn light_that_strikes_nothing_judges_nothing() {
    let context = TestContext::new();
    let board = (Vec3::Z * 0.4, Vec3::X * 0.4);
    let below = |lost: f32| {
        let mut scene = below_a_lamp(board, Vec3::Y * 0.2, 2.0);
        scene.materials.push(Material { emission: Vec3::splat(lost), ..one_sided(0.0) });
        let upwards = parallelogram(Vec3::new(-1.0, 2.1, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X, 4, 3);
        scene.meshes[0].primitives.push(upwards);
        let fixture = Fixture::new(&context, scene, None);
        let method = fixture.solve(&context, Settings::default(), 1);
        let report = method.report();
        println!("beside {lost} W/m2/sr: {} transfers, {} elements", report.transfers(), report.elements);
        report.transfers() as f64
    };
    let (alone, beside) = (below(0.0), below(10.0));
    assert!((beside / alone - 1.0).abs() < 0.2, "{alone} transfers without the other lamp, {beside} with it");
}

/// A bar that hangs close below a lamp is lit by all of it that it sees, however coarse the threshold: neither takes the
/// other for what its nodes see.
#[test]
fn a_bar_close_below_a_lamp_takes_its_light() {
    let context = TestContext::new();
    let (length, width, gap) = (1.0f32, 0.1f32, 0.05f32);
    let fixture =
        Fixture::new(&context, below_a_lamp((Vec3::Z * width, Vec3::X * length), Vec3::Y * (1.0 - gap), 1.0), None);
    // Of a rectangle with a corner above the place.                                               [common ground]
    let corner = |a: f64, b: f64| -> f64 {
        let one = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
        (one(a, b) + one(b, a)) / std::f64::consts::TAU
    };
    let cells = 64;
    let at = |k: i32, side: f32| (f64::from(k) + 0.5 - 0.5 * f64::from(cells)) / f64::from(cells) * f64::from(side);
    let gap = f64::from(gap);
    let sees = |x: f64, z: f64| -> f64 {
        [-1.0, 1.0].iter().flat_map(|s| [-1.0, 1.0].map(|t| corner((1.0 + s * x) / gap, (1.0 + t * z) / gap))).sum()
    };
    let mean: f64 = (0..cells * cells).map(|k| sees(at(k / cells, length), at(k % cells, width))).sum::<f64>();
    let expected = f64::from(PI) * mean / f64::from(cells * cells) * f64::from(length * width);
    for threshold in [2e-3, 1e-3, 3e-4] {
        let method = fixture.solve(&context, Settings { threshold, ..Settings::default() }, 0);
        let (power, _) =
            received(&leaves(&context, &method), |e| e.albedo.x < 0.4 && e.albedo.x > 0.1 && e.axis_z.y > 0.5);
        println!("the bar gets {power:.5} W at threshold {threshold:e}, expected {expected:.5}");
        assert!((power / expected - 1.0).abs() < 0.05, "threshold {threshold:e}: {power} W, expected {expected} W");
    }
}

/// Light that comes through openings which most rays miss is not lost: where all rays were blocked, no more passes unseen
/// than errors may be elsewhere.
#[test]
fn light_comes_through_small_openings() {
    let context = TestContext::new();
    let (x, z) = (Vec3::X, Vec3::Z);
    let materials = vec![one_sided(0.5), Material { double_sided: true, ..one_sided(0.0) }, one_sided(0.0)];
    let floor = parallelogram(Vec3::new(-1.0, 0.0, -1.0), 2.0 * z, 2.0 * x, 32, 0);
    let lamp = parallelogram(Vec3::new(-1.0, 2.0, -1.0), 2.0 * x, 2.0 * z, 16, 2);
    // Between them a plate, one in sixteen of whose cells is open.
    let mut plate = parallelogram(Vec3::new(-2.0, 1.0, -2.0), 4.0 * z, 4.0 * x, 32, 1);
    let (corners, cell) = (plate.positions.clone(), 4.0 / 32.0);
    plate.triangles.retain(|t| {
        let middle = t.map(|v| corners[v as usize]).iter().sum::<Vec3>() / 3.0 + 2.0;
        [middle.x, middle.z].iter().any(|&along| (along / cell) as u32 % 4 != 1)
    });
    let scene = scene(materials, vec![floor, lamp, plate], &[]);
    let mut mean = 0.0;
    // Each threshold meets other openings.
    for threshold in [1e-3, 3e-4, 1e-4, 3e-5, 1e-5] {
        let (_, table) = row(&context, &scene, &[2], Settings { threshold, ..Settings::default() }, 1_000_000);
        let Received { solved, by_rays, .. } = table[0];
        println!("threshold {threshold:e}: the floor gets {solved:.4} W, by rays {by_rays:.4}");
        mean += solved / by_rays / 5.0;
    }
    assert!((mean - 1.0).abs() < 0.08, "the floor gets {mean} of what comes through");
}

/// The sun through a grating: what the floor then sends to the roof is the same by all functions. Those of higher order
/// pass through lit and unlit nodes alike, and must not take a border of shadow for their own shape.
#[test]
fn borders_of_shadow_are_found_by_all_functions() {
    let context = TestContext::new();
    let (x, z) = (Vec3::X, Vec3::Z);
    let materials = vec![one_sided(0.5), Material { double_sided: true, ..one_sided(0.0) }, one_sided(0.02)];
    let floor = parallelogram(Vec3::new(-1.0, 0.0, -1.0), 2.0 * z, 2.0 * x, 64, 0);
    let roof = parallelogram(Vec3::new(-1.0, 1.0, -1.0), 2.0 * x, 2.0 * z, 16, 2);
    // Beside them, towards the sun: bars and gaps of a fifth of a metre.
    let mut grating = parallelogram(Vec3::new(1.0, 0.0, -1.0), 2.0 * z, Vec3::Y, 20, 1);
    let corners = grating.positions.clone();
    grating.triangles.retain(|t| {
        let middle = t.map(|v| corners[v as usize]).iter().sum::<Vec3>() / 3.0;
        (((middle.z + 1.0) / 0.2) as u32).is_multiple_of(2)
    });
    let sun = (light(LightKind::Directional, 3.0), Vec3::ZERO, Vec3::new(-1.0, -0.45, 0.3));
    let fixture = Fixture::new(&context, scene(materials, vec![floor, roof, grating], &[sun]), None);
    let roof_receives = |irradiance_basis: Basis| {
        let settings = Settings { irradiance_basis, threshold: 3e-5, ..Settings::default() };
        let method = fixture.solve(&context, settings, 1);
        let of_roof = |l: &crate::fixture::Leaf| l.element.albedo.x > 0.01 && l.element.albedo.x < 0.1;
        let power = |l: crate::fixture::Leaf| f64::from(l.element.area) * f64::from(l.indirect.x);
        leaves(&context, &method).into_iter().filter(of_roof).map(power).sum::<f64>()
    };
    let constant = roof_receives(Basis::Constant);
    for basis in [Basis::Linear, Basis::Quadratic] {
        let found = roof_receives(basis) / constant;
        println!("{basis:?}: the roof gets {found:.3} of what constant functions say, {constant:.4} W");
        assert!((found - 1.0).abs() < 0.03, "{basis:?}: {found} of what constant functions say");
    }
}

/// The same of a small lamp's light: quadratic functions see the grating's shadow where it lies.
#[test]
fn borders_of_a_lamps_shadow_are_found() {
    let context = TestContext::new();
    let (x, z) = (Vec3::X, Vec3::Z);
    let mut materials = vec![one_sided(0.5), Material { double_sided: true, ..one_sided(0.0) }, one_sided(0.0)];
    materials[2].emission = Vec3::ONE;
    let floor = parallelogram(Vec3::new(-1.0, 0.0, -1.0), 2.0 * z, 2.0 * x, 64, 0);
    let (lamp_height, side, height) = (4.0, 0.02, 0.5);
    let lamp = parallelogram(Vec3::new(-0.5 * side, lamp_height, -0.5 * side), side * x, side * z, 1, 2);
    // Bars and gaps of three tenths of a metre.
    let mut grating = parallelogram(Vec3::new(-1.5, height, -1.5), 3.0 * z, 3.0 * x, 40, 1);
    let (corners, is_bar) = (grating.positions.clone(), |z: f32| (((z + 1.5) / 0.3) as u32).is_multiple_of(2));
    grating.triangles.retain(|t| is_bar(t.map(|v| corners[v as usize]).iter().sum::<Vec3>().z / 3.0));
    let fixture = Fixture::new(&context, scene(materials, vec![floor, lamp, grating], &[]), None);
    let settings = Settings { irradiance_basis: Basis::Quadratic, ..Settings::default() };
    let method = fixture.solve(&context, settings, 0);
    let (state, count) = (method.state(), method.report().elements as usize);
    let vectors = context.download_range(state.direct(), 0..6 * count).unwrap();
    let elements = context.download_range(&state.elements, 0..count).unwrap();
    let of_leaf: Vec<usize> = (0..count).filter(|&e| elements[e].children == u32::MAX).collect();
    let sides = context.download(state.triangle_leaves()).unwrap();
    let (mut off, mut sum) = (0.0, 0.0);
    for (t, side_leaves) in fixture.geometry.triangles.iter().zip(&sides) {
        let p = t.map(|v| fixture.positions[v as usize]).iter().sum::<Vec3>() / 3.0;
        if p.y > 1e-3 {
            continue;
        }
        let (element, way) = (of_leaf[side_leaves.x as usize], Vec3::Y * lamp_height - p);
        let uv = twins::plane_coordinates(&elements[element], p.as_dvec3());
        let said: f32 = (0..6).map(|k| twins::basis(k, uv) as f32 * vectors[6 * element + k][0][1]).sum();
        let is_lit = !is_bar(p.z + way.z * height / lamp_height);
        let expected = if is_lit { (way.y * side / way.length_squared()).powi(2) } else { 0.0 };
        (off, sum) = (off + (said - expected).abs(), sum + expected);
    }
    println!("off by {:.3} of the light, {count} elements, {} transfers", off / sum, method.report().transfers());
    assert!(off / sum < 0.052, "off by {} of the light", off / sum);
}

/// A roof of two slopes of 40 degrees, lit from below its mean normal's horizon by less than errors may be: one slope is
/// lit as by itself, the other is dark. One element of both lays all of it along the mean normal.
#[test]
fn slopes_of_a_roof_are_lit_apart() {
    let context = TestContext::new();
    let mut roof = parallelogram(Vec3::new(-0.1, 0.0, 0.1), Vec3::X * 0.2, Vec3::NEG_Z * 0.2, 2, 0);
    roof.positions.iter_mut().for_each(|p| p.y = -p.x.abs() * 40f32.to_radians().tan());
    let panel = parallelogram(Vec3::new(6.0, -1.6, -0.5), Vec3::Z, Vec3::Y, 4, 1);
    let mut materials = vec![one_sided(0.5), one_sided(0.0)];
    materials[1].emission = Vec3::ONE;
    let fixture = Fixture::new(&context, scene(materials, vec![roof, panel], &[]), None);
    let settings = Settings { threshold: 1e-3, ..Settings::default() };
    let leaves = leaves(&context, &fixture.solve(&context, settings, 0));
    let irradiance = |side: f32| {
        let (power, area) = received(&leaves, |e| e.albedo.x > 0.2 && side * e.axis_z.x > 0.5);
        assert!(area > 0.02, "an element has both slopes");
        power / area
    };
    // From the middle of the lit slope to that of the panel.
    let way = Vec3::new(6.0, -1.1, 0.0) - Vec3::new(0.05, -0.05 * 40f32.to_radians().tan(), 0.0);
    let normal = Vec3::new(40f32.to_radians().sin(), 40f32.to_radians().cos(), 0.0);
    let expected = f64::from(normal.dot(way) * way.x / way.length_squared().powi(2));
    let (lit, dark) = (irradiance(1.0), irradiance(-1.0));
    println!("lit slope {lit} W/m2, expected {expected}; the other {dark}");
    assert!((lit / expected - 1.0).abs() < 0.03 && dark < 0.01 * lit, "{lit}, expected {expected}; {dark}");
}
