//! The setting of debug views that names one element: by its number, or by the pixel it is seen through.

use super::settings::{Kind, SettingValue};
use crate::scene::camera::View;
use glam::{UVec2, UVec3, Vec3};
use serde_json::Value;
use std::ops::RangeInclusive;

/// The element that a debug view is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pick {
    Nothing,
    Element(u32),
    /// From the top left corner of the picture.
    Pixel {
        x: u32,
        y: u32,
    },
}

impl SettingValue for Pick {
    fn kind(_: Option<RangeInclusive<Self>>) -> Kind {
        Kind::Text { form: "none, the number of an element, or a pixel as X,Y" }
    }

    fn parse(text: &str) -> Option<Self> {
        match text.split_once(',') {
            None if text == "none" => Some(Self::Nothing),
            None => text.parse().ok().map(Self::Element),
            Some((x, y)) => Some(Self::Pixel { x: x.trim().parse().ok()?, y: y.trim().parse().ok()? }),
        }
    }

    fn to_json(self) -> Value {
        match self {
            Self::Nothing => "none".into(),
            Self::Element(element) => element.to_string().into(),
            Self::Pixel { x, y } => format!("{x},{y}").into(),
        }
    }

    fn is_in(self, _: &Kind) -> bool {
        true
    }
}

/// The element that `pick` names, if there is one. `positions` and `triangles` are the world's, `back_elements` as of
/// [`crate::stages::elements::Elements::back_elements`].
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
    let seen = seen_triangle(positions, triangles, view, UVec2::new(x, y), size)?;
    let vertex = triangles[seen.triangle].to_array()[seen.corner];
    let back = back_elements.get(vertex as usize).copied().filter(|&back| back != u32::MAX);
    Some(back.filter(|_| seen.is_back).unwrap_or(vertex))
}

/// A triangle as a pixel sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenTriangle {
    pub triangle: usize,
    /// The nearest of its corners, 0..=2.
    pub corner: usize,
    pub is_back: bool,
    /// Metres along the pixel's ray.
    pub distance: f32,
}

/// The nearest triangle through the middle of `pixel`.
pub fn seen_triangle(
    positions: &[Vec3],
    triangles: &[UVec3],
    view: &View,
    pixel: UVec2,
    size: UVec2,
) -> Option<SeenTriangle> {
    let ray = view.ray(pixel.as_vec2() + 0.5, size);
    let mut nearest: Option<SeenTriangle> = None;
    for (index, triangle) in triangles.iter().enumerate() {
        let [a, b, c] = triangle.to_array().map(|v| positions[v as usize]);
        let across = (b - a).cross(c - a);
        let t = across.dot(a - ray.origin) / across.dot(ray.direction);
        if !(t > ray.t_min && t < nearest.map_or(ray.t_max, |seen| seen.distance)) {
            continue;
        }
        // Shares of the area across from each corner: all of one sign inside.
        let at = ray.origin + t * ray.direction;
        let shares = [(b, c), (c, a), (a, b)].map(|(p, q)| (p - at).cross(q - at).dot(across));
        if shares.iter().all(|&share| share >= 0.0) {
            let corner = (0..3).reduce(|best, k| if shares[k] > shares[best] { k } else { best }).unwrap_or(0);
            let is_back = across.dot(ray.direction) > 0.0;
            nearest = Some(SeenTriangle { triangle: index, corner, is_back, distance: t });
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::Lens;
    use glam::Vec2;

    #[test]
    fn picks_read_as_they_are_recorded() {
        for pick in [Pick::Nothing, Pick::Element(7), Pick::Pixel { x: 120, y: 0 }] {
            assert_eq!(Pick::parse(pick.to_json().as_str().unwrap()), Some(pick));
        }
        assert!(["", "7,", ",", "1,2,3", "-1", "x"].iter().all(|text| Pick::parse(text).is_none()));
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
