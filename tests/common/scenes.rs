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
