//! Small scenes made by hand, for closed forms.

use glam::{Vec2, Vec3, Vec4};
use linklight::scene::{Light, LightKind, Material, Mesh, Node, Primitive, Scene, Texture, Transform, Wrap};

/// A Lambertian two-sided material.
pub fn lambert(albedo: Vec3) -> Material {
    Material {
        name: "lambert".into(),
        base_color: albedo.extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        double_sided: true,
        ..Material::default()
    }
}

/// A parallelogram from `corner` along `u` and `v`, facing u x v, as `cells` x `cells` squares.
pub fn parallelogram(corner: Vec3, u: Vec3, v: Vec3, cells: u32, material: u32) -> Primitive {
    let normal = u.cross(v).normalize();
    let side = cells + 1;
    let at = |i: u32| Vec2::new((i % side) as f32, (i / side) as f32) / cells as f32;
    let count = side * side;
    let uv: Vec<Vec2> = (0..count).map(at).collect();
    let mut triangles = Vec::new();
    for y in 0..cells {
        for x in 0..cells {
            let a = y * side + x;
            triangles.extend([[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]);
        }
    }
    Primitive {
        positions: uv.iter().map(|t| corner + u * t.x + v * t.y).collect(),
        normals: vec![normal; count as usize],
        tangents: vec![u.normalize().extend(1.0); count as usize],
        uv: [uv.clone(), uv],
        colors: vec![Vec4::ONE; count as usize],
        triangles,
        material,
        ..Primitive::default()
    }
}

/// Sides and top of a box that stands, each as `cells` x `cells` squares, facing outwards, of material 0.
pub fn one_sided_box(low: Vec3, high: Vec3, cells: u32) -> Vec<Primitive> {
    let size = high - low;
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    vec![
        parallelogram(low + z, x, y, cells, 0),
        parallelogram(low + x, -x, y, cells, 0),
        parallelogram(low, z, y, cells, 0),
        parallelogram(low + x + z, -z, y, cells, 0),
        parallelogram(low + y + z, x, -z, cells, 0),
    ]
}

/// A strip of wall, 2 m by 12 cm and facing +z, between a rail and a sill that hide its four corners (its first four
/// vertices): from height .025 to .09 above its lower edge it lies in the open, of 2.5 cm and 7 cm of depth beside it.
pub fn strip_between_boards() -> Scene {
    let mut parts = vec![parallelogram(Vec3::Y, Vec3::X * 2.0, Vec3::Y * 0.12, 1, 0)];
    for (bottom, top, depth) in [(0.95, 1.025, 0.025), (1.09, 1.13, 0.07)] {
        let (low, high) = (Vec3::new(-0.1, bottom, -0.05), Vec3::new(2.1, top, depth));
        parts.extend(one_sided_box(low, high, 1));
        parts.push(parallelogram(low, Vec3::X * (high.x - low.x), Vec3::Z * (high.z - low.z), 1, 0));
    }
    scene(vec![Material { double_sided: false, ..lambert(Vec3::splat(0.5)) }], parts, &[])
}

/// What the corners of that strip receive of an even sky of radiance 1, by what the boards leave of it at a height, W/m2.
fn sky_on_the_strip(height: f32) -> f32 {
    let leaves = |reach: f32, depth: f32| reach / reach.hypot(depth);
    0.5 * std::f32::consts::PI * (leaves(0.09 - height, 0.07) + leaves(height - 0.025, 0.025))
}

/// Holds what the four corners of that strip receive (W/m2) to what its open part does under an even sky of radiance 1.
pub fn assert_as_in_the_open(direct: &[Vec3]) {
    // Of all heights in the open, the least and the most that arrives.
    let open: Vec<f32> = (30..=85).map(|height| sky_on_the_strip(height as f32 / 1000.0)).collect();
    let [least, most] = [open.iter().copied().fold(f32::MAX, f32::min), open.iter().copied().fold(0.0, f32::max)];
    for (corner, found) in direct.iter().take(4).enumerate() {
        println!("corner {corner}: {found} of {least} to {most}");
        assert!(found.x > 0.9 * least && found.x < 1.1 * most, "corner {corner}: {found}, {least} to {most} allowed");
    }
}

/// One node per primitive, one per light (at `position`, shining along `direction`).
pub fn scene(materials: Vec<Material>, primitives: Vec<Primitive>, lights: &[(Light, Vec3, Vec3)]) -> Scene {
    let mut scene = Scene { name: "test".into(), materials, ..Scene::default() };
    for primitive in primitives {
        scene.nodes.push(Node { mesh: Some(scene.meshes.len() as u32), ..Node::default() });
        scene.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
    }
    for (light, position, direction) in lights {
        let rotation = glam::Quat::from_rotation_arc(Vec3::NEG_Z, direction.normalize());
        let transform = Transform::Trs { translation: *position, rotation, scale: Vec3::ONE };
        scene.nodes.push(Node { transform, light: Some(scene.lights.len() as u32), ..Node::default() });
        scene.lights.push(light.clone());
    }
    scene
}

/// A punctual light of white light.
pub fn light(kind: LightKind, intensity: f32) -> Light {
    Light { name: "light".into(), kind, intensity: Vec3::splat(intensity), range: None }
}

/// Texels as they are, clamped at the edges.
pub fn nearest_texture(image: u32) -> Texture {
    Texture {
        image,
        wrap: [Wrap::ClampToEdge; 2],
        mag_linear: false,
        min_linear: false,
        mipmapped: false,
        mip_linear: false,
    }
}
