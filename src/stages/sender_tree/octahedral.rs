//! Unit vectors in 32 bits: a sphere is laid on an octahedron, and that folded into a square.       [Meyer2010]
//!
//! [Meyer2010]: crate::methods::PAPERS

use super::Node;
use glam::{Vec2, Vec3};

/// Two signed coordinates of 16 bits, x in the lower ones.
pub(super) fn pack(v: Vec3) -> u32 {
    let on = v / v.abs().element_sum();
    let folded = |a: f32, b: f32| (1.0 - b.abs()).copysign(a);
    let place = if on.z < 0.0 { Vec2::new(folded(on.x, on.y), folded(on.y, on.x)) } else { on.truncate() };
    let [x, y] = place.to_array().map(|c| u32::from((c.clamp(-1.0, 1.0) * 32_767.0).round() as i16 as u16));
    x | y << 16
}

/// As shaders read it: `unpack_axis` of `lib/sender_pack.glsl`.
fn unpack(word: u32) -> Vec3 {
    let [x, y] = [word as u16, (word >> 16) as u16].map(|c| (f32::from(c as i16) / 32_767.0).max(-1.0));
    let z = 1.0 - x.abs() - y.abs();
    let below = (-z).max(0.0);
    let unfolded = |c: f32| if c >= 0.0 { c - below } else { c + below };
    Vec3::new(unfolded(x), unfolded(y), z).normalize()
}

/// Cosine of the cone about the packed axis that holds the node's.
pub(super) fn widened(node: &Node, axis: u32) -> f32 {
    let turned = node.axis.as_dvec3().angle_between(unpack(axis).as_dvec3());
    let angle = f64::from(node.cos_cone.clamp(-1.0, 1.0)).acos() + turned + 1e-6;
    if angle < std::f64::consts::PI { angle.cos() as f32 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_stays_within_its_cone() {
        for k in 0..5000 {
            let z = 1.0 - (k as f32 + 0.5) / 2500.0;
            let angle = 2.399_963 * k as f32;
            let axis = Vec3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z);
            let packed = pack(axis);
            assert!(axis.distance(unpack(packed)) < 1e-4, "{axis} for {}", unpack(packed));
            let cos_cone = 1.0 - (k % 200) as f32 / 100.0;
            let node = Node { axis, cos_cone, ..Node::default() };
            // A normal on the cone's border, away from where the axis went.
            let away = (axis - unpack(packed)).reject_from_normalized(axis).normalize_or(axis.any_orthonormal_vector());
            let border = cos_cone * axis + (1.0 - cos_cone * cos_cone).max(0.0).sqrt() * away;
            assert!(border.dot(unpack(packed)) >= widened(&node, packed) - 1e-6);
            assert!(widened(&node, packed) > cos_cone - 1e-3, "hardly wider than before");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!([unpack(pack(axis)), unpack(pack(-axis))], [axis, -axis]);
        }
    }
}
