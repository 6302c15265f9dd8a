//! Small hand-made scenes for the tests.

use glam::{Vec2, Vec3, Vec4};
use linklight::scene::{Material, Mesh, Node, Primitive, Scene};

pub fn material() -> Material {
    Material {
        name: "white".into(),
        base_color: Vec4::ONE,
        base_color_texture: None,
        metallic: 0.0,
        roughness: 1.0,
        metallic_roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
        occlusion_texture: None,
        occlusion_strength: 1.0,
        emission: Vec3::ZERO,
        emission_texture: None,
        alpha_cutoff: None,
        double_sided: false,
        unlit: false,
        ior: 1.5,
        specular: 1.0,
        specular_color: Vec3::ONE,
    }
}

/// A scene of one primitive drawn by one node at the origin.
pub fn scene_of(primitive: Primitive) -> Scene {
    let mesh = Mesh { primitives: vec![primitive], ..Default::default() };
    Scene {
        nodes: vec![Node { mesh: Some(0), ..Default::default() }],
        meshes: vec![mesh],
        materials: vec![material()],
        ..Default::default()
    }
}

/// Triangles over positions, normals +Z.
pub fn primitive(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Primitive {
    Primitive { normals: vec![Vec3::Z; positions.len()], positions, triangles, ..Default::default() }
}

/// The unit square in z = 0, facing +Z, its uv equal to xy.
pub fn square() -> Primitive {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let mut square = primitive(corners.iter().map(|corner| corner.extend(0.0)).collect(), vec![[0, 1, 2], [0, 2, 3]]);
    square.uv[0] = corners.to_vec();
    square
}

/// The unit cube from the origin, facing out, six sides of four vertices each: every edge is hard.
pub fn cube() -> Primitive {
    let mut cube = Primitive::default();
    for axis in 0..3 {
        for end in [0.0, 1.0] {
            let (u, v) = (Vec3::AXES[(axis + 1) % 3], Vec3::AXES[(axis + 2) % 3]);
            let normal = Vec3::AXES[axis] * (2.0 * end - 1.0);
            let (u, v) = if end == 1.0 { (u, v) } else { (v, u) };
            let corner = Vec3::AXES[axis] * end;
            let first = cube.positions.len() as u32;
            cube.positions.extend([corner, corner + u, corner + u + v, corner + v]);
            cube.normals.extend([normal; 4]);
            cube.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    cube
}

pub fn assert_near(a: Vec3, b: Vec3, tolerance: f32) {
    assert!((a - b).abs().max_element() <= tolerance, "{a} against {b}, tolerance {tolerance}");
}
