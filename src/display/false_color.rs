//! Debug views: colours for indices and amounts, and the element seen through a pixel.
//!
//! A method that has a view gives a colour per element to [`super::vertex::VertexLight::colors`], which shows them unlit.
//! Everything here runs on the host: a view is looked at, not measured.

use crate::methods::pick::Pick;
use crate::scene::camera::View;
use glam::{UVec2, UVec3, Vec2, Vec3};

/// What no other colour says: nothing here, not concerned.
pub const NEUTRAL: Vec3 = Vec3::splat(0.05);
/// The picked element itself.
pub const PICKED: Vec3 = Vec3::ONE;

/// A colour for an index: neighbours differ, the same index always looks the same.
pub fn of_index(index: u32) -> Vec3 {
    // Steps of the golden ratio around the hue circle, in three brightnesses.
    let hue = (f64::from(index) * 0.618_033_988_749_894_9).fract() as f32;
    let brightness = [0.8, 0.5, 0.3][(index % 3) as usize];
    let channel = |shift: f32| (((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0).clamp(0.05, 1.0);
    brightness * Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}

/// From blue at 0 over green to red at 1 and beyond.
pub fn of_amount(amount: f32) -> Vec3 {
    let t = if amount.is_finite() { amount.clamp(0.0, 1.0) } else { 1.0 };
    let hump = |centre: f32| (1.5 - (4.0 * (t - centre)).abs()).clamp(0.0, 1.0);
    0.8 * Vec3::new(hump(0.875), hump(0.5), hump(0.125))
}

/// The element that `pick` names, if there is one. `positions` and `triangles` are the world's, `back_elements` as of
/// [`super::vertex::VertexLight`].
pub fn picked_element(
    pick: Pick,
    positions: &[Vec3],
    triangles: &[UVec3],
    back_elements: &[u32],
    view: &View,
    size: UVec2,
) -> Option<u32> {
    let (x, y) = match pick {
        Pick::Nothing => return None,
        Pick::Element(element) => return Some(element),
        Pick::Pixel { x, y } => (x, y),
    };
    let ray = view.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), size);
    let mut nearest: Option<(f32, u32)> = None;
    for triangle in triangles {
        let [a, b, c] = triangle.to_array().map(|v| positions[v as usize]);
        let across = (b - a).cross(c - a);
        let t = across.dot(a - ray.origin) / across.dot(ray.direction);
        if !(t > ray.t_min && t < nearest.map_or(ray.t_max, |(t, _)| t)) {
            continue;
        }
        // Shares of the area across from each corner: all of one sign inside.
        let at = ray.origin + t * ray.direction;
        let shares = [(b, c), (c, a), (a, b)].map(|(p, q)| (p - at).cross(q - at).dot(across));
        if shares.iter().all(|&share| share >= 0.0) {
            let corner = (0..3).reduce(|best, k| if shares[k] > shares[best] { k } else { best }).unwrap_or(0);
            let vertex = triangle.to_array()[corner];
            let back = back_elements.get(vertex as usize).copied().filter(|&back| back != u32::MAX);
            let is_back = across.dot(ray.direction) > 0.0;
            nearest = Some((t, back.filter(|_| is_back).unwrap_or(vertex)));
        }
    }
    nearest.map(|(_, element)| element)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::Lens;

    #[test]
    fn colours_differ_and_amounts_rise() {
        assert!((1..50).all(|index| of_index(index).distance(of_index(index - 1)) > 0.1));
        let (low, middle, high) = (of_amount(0.0), of_amount(0.5), of_amount(1.0));
        assert!(low.z > low.x && middle.y > middle.x.max(middle.z) && high.x > high.z);
        assert_eq!(of_amount(7.0), high);
        assert_eq!(of_amount(f32::NAN), high);
    }

    #[test]
    fn the_nearest_surface_under_the_pixel_is_picked() {
        // Two triangles one behind the other across the view, the nearer one seen from its back.
        let corners = |z: f32| [Vec3::new(-3.0, -3.0, z), Vec3::new(3.0, -3.0, z), Vec3::new(0.0, 3.0, z)];
        let positions = [corners(0.0), corners(1.0)].concat();
        let triangles = [UVec3::new(0, 1, 2), UVec3::new(3, 5, 4)];
        let size = UVec2::new(40, 40);
        let view = View::framed([Vec3::splat(-1.0), Vec3::splat(1.0)], size);
        let lens = Lens::Perspective { tan_half: Vec2::splat(0.5) };
        let view = View { position: Vec3::Z * 5.0, forward: -Vec3::Z, right: Vec3::X, up: Vec3::Y, lens, ..view };
        let low = 39;
        let backs = [u32::MAX, u32::MAX, u32::MAX, 6, 7, 8];
        let pick = |pick| picked_element(pick, &positions, &triangles, &backs, &view, size);
        assert_eq!(pick(Pick::Pixel { x: 0, y: low }), Some(6));
        assert_eq!(pick(Pick::Pixel { x: 39, y: low }), Some(7));
        assert_eq!(pick(Pick::Nothing), None);
        assert_eq!(pick(Pick::Element(3)), Some(3));
    }
}
