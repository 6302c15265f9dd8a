//! What a loaded scene promises.

use linklight::scene::{self, Scene};

/// What [`Scene`] promises: indices in range, parents first, array lengths equal, unit vectors, finite numbers.
pub fn assert_sound(scene: &Scene, name: &str) {
    assert!(!scene.materials.is_empty(), "{name}");
    for (index, node) in scene.nodes.iter().enumerate() {
        assert!(node.parent.is_none_or(|parent| (parent as usize) < index), "{name}: node {index}");
        let in_range = |index: Option<u32>, count: usize| index.is_none_or(|index| (index as usize) < count);
        assert!(in_range(node.mesh, scene.meshes.len()) && in_range(node.skin, scene.skins.len()), "{name}");
        assert!(in_range(node.camera, scene.cameras.len()) && in_range(node.light, scene.lights.len()), "{name}");
        match node.transform {
            scene::Transform::Matrix(matrix) => assert!(matrix.is_finite(), "{name}"),
            scene::Transform::Trs { translation, rotation, scale } => {
                assert!(translation.is_finite() && rotation.is_normalized() && scale.is_finite(), "{name}");
            }
        }
    }
    for primitive in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        assert_sound_primitive(scene, primitive, name);
    }
    for texture in &scene.textures {
        assert!((texture.image as usize) < scene.images.len(), "{name}");
    }
    for image in &scene.images {
        assert_eq!(image.rgba.len() as u64, u64::from(image.width) * u64::from(image.height) * 4, "{name}");
    }
    for skin in &scene.skins {
        assert_eq!(skin.joints.len(), skin.inverse_bind.len(), "{name}");
        assert!(skin.joints.iter().all(|joint| (*joint as usize) < scene.nodes.len()), "{name}");
    }
    for channel in scene.clips.iter().flat_map(|clip| &clip.channels) {
        assert!((channel.node as usize) < scene.nodes.len(), "{name}");
        assert!(channel.times.windows(2).all(|pair| pair[0] < pair[1]), "{name}");
        let per_key = if channel.interpolation == scene::Interpolation::CubicSpline { 3 } else { 1 };
        let values = match &channel.track {
            scene::Track::Translation(values) | scene::Track::Scale(values) => values.len(),
            scene::Track::Rotation(values) => values.len(),
            scene::Track::MorphWeights { target_count, weights } => weights.len() / target_count,
        };
        assert_eq!(values, channel.times.len() * per_key, "{name}");
    }
}

fn assert_sound_primitive(scene: &Scene, primitive: &scene::Primitive, name: &str) {
    let count = primitive.positions.len();
    let fits = |len: usize| len == 0 || len == count;
    assert!(primitive.positions.iter().all(|position| position.is_finite()), "{name}");
    assert_eq!(primitive.normals.len(), count, "{name}");
    assert!(primitive.normals.iter().all(|normal| normal.is_normalized()), "{name}");
    assert!(fits(primitive.tangents.len()) && fits(primitive.colors.len()), "{name}");
    assert!(primitive.tangents.iter().all(|t| t.truncate().is_normalized() && t.w.abs() == 1.0), "{name}");
    assert!(primitive.uv.iter().all(|uv| fits(uv.len())), "{name}");
    assert!(fits(primitive.joints.len()) && primitive.joints.len() == primitive.joint_weights.len(), "{name}");
    for weights in &primitive.joint_weights {
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{name}: {weights:?}");
    }
    for target in &primitive.morph_targets {
        assert!(fits(target.positions.len()) && fits(target.normals.len()) && fits(target.tangents.len()), "{name}");
    }
    let mut is_used = vec![false; count];
    for triangle in &primitive.triangles {
        triangle.iter().for_each(|vertex| is_used[*vertex as usize] = true);
    }
    assert!(is_used.iter().all(|used| *used), "{name}: a vertex that no triangle uses");
    assert!((primitive.material as usize) < scene.materials.len(), "{name}");
}
