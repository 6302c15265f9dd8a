//! What the atlas and its maps look like: flat pictures, for debugging and for the paper's figures.

use super::SurfaceShadowMaps;
use crate::methods::pick::{Pick, SeenTriangle};
use crate::scene::atlas::NO_TEXEL;
use crate::stages::false_color;
use crate::stages::surface_maps::sequence::walk;
use glam::{UVec2, Vec3};

crate::choice! {
    /// What a picture shows.
    pub enum Shown {
        /// Light
        Light = "light",
        /// The atlas, each chart in a colour of its own
        Atlas = "atlas",
        /// The atlas, texels by their place in the walk that maps are compressed along: blue first, red last
        TraversalOrder = "traversal-order",
        /// The depth cube map of the picked texel, +x -x +y over -y +z -z: blue near, red far, black where nothing is
        DepthMap = "depth-map",
    }
}

/// Depth of a ray that met nothing, and of one that started inside something.
const NOTHING: u16 = 65_534;

/// A flat picture, rows from the top.
pub struct FlatPicture {
    pub size: UVec2,
    /// Linear.
    pub colors: Vec<Vec3>,
}

impl FlatPicture {
    /// As large as it goes into a picture of `size`, in its middle, on black.
    pub fn fitted(&self, size: UVec2) -> Vec<Vec3> {
        let scale = (size.as_vec2() / self.size.as_vec2()).min_element().max(f32::MIN_POSITIVE);
        let first = (size.as_vec2() - scale * self.size.as_vec2()) * 0.5;
        let at = |pixel: u32| {
            let place = (UVec2::new(pixel % size.x, pixel / size.x).as_vec2() + 0.5 - first) / scale;
            let place = place.floor().as_ivec2();
            let is_inside = place.min_element() >= 0 && place.as_uvec2().cmplt(self.size).all();
            is_inside.then(|| self.colors[(place.y as u32 * self.size.x + place.x as u32) as usize])
        };
        (0..size.x * size.y).map(|pixel| at(pixel).unwrap_or(Vec3::ZERO)).collect()
    }
}

impl SurfaceShadowMaps {
    /// The picture that the settings ask for; `None` shows light. `texel` is the picked one.
    pub fn flat_picture(&self, texel: Option<u32>) -> Option<FlatPicture> {
        match self.settings.show {
            Shown::Light => None,
            Shown::Atlas => Some(self.of_atlas(|texel| false_color::of_index(self.atlas.texels[texel].chart))),
            Shown::TraversalOrder => {
                let places = match &self.maps {
                    Some(placed) => placed.maps.places.clone(),
                    None => {
                        let mut places = vec![0; self.atlas.texels.len()];
                        let order = walk(&self.atlas, self.settings.sequence);
                        order.into_iter().zip(0..).for_each(|(texel, place)| places[texel as usize] = place);
                        places
                    }
                };
                let last = places.iter().copied().max().unwrap_or(0).max(1) as f32;
                Some(self.of_atlas(|texel| false_color::of_amount(places[texel] as f32 / last)))
            }
            Shown::DepthMap => Some(self.depth_map(texel)),
        }
    }

    fn of_atlas(&self, color: impl Fn(usize) -> Vec3) -> FlatPicture {
        let at = |&texel: &u32| if texel == NO_TEXEL { Vec3::ZERO } else { color(texel as usize) };
        let side = self.atlas.resolution;
        FlatPicture { size: UVec2::splat(side), colors: self.atlas.texel_at.iter().map(at).collect() }
    }

    /// Three faces over three; all black without a texel or without maps.
    fn depth_map(&self, texel: Option<u32>) -> FlatPicture {
        let side = self.settings.map_resolution;
        let size = UVec2::new(3 * side, 2 * side);
        let mut colors = vec![Vec3::ZERO; (size.x * size.y) as usize];
        let maps = self.maps.as_ref().map(|placed| &placed.maps);
        if let (Some(maps), Some(texel)) = (maps, texel.filter(|&texel| (texel as usize) < self.atlas.texels.len())) {
            let place = maps.places[texel as usize];
            let depth = |pixel: u32| maps.maps.depth(place, pixel as usize);
            let seen = (0..6 * side * side).map(depth).filter(|&depth| depth < NOTHING);
            let farthest = f32::from(seen.max().unwrap_or(1).max(1));
            for (at, color) in colors.iter_mut().enumerate() {
                let (x, y) = (at as u32 % size.x, at as u32 / size.x);
                let (face, x, y) = (x / side + 3 * (y / side), x % side, y % side);
                let depth = depth((face * side + y) * side + x);
                if depth < NOTHING {
                    *color = false_color::of_amount(f32::from(depth) / farthest);
                }
            }
        }
        FlatPicture { size, colors }
    }

    /// The texel that the setting `pick` names: its number, or the one nearest to what a pixel `sees` (where, and what).
    pub fn picked_texel(&self, sees: impl FnOnce(UVec2) -> Option<(Vec3, SeenTriangle)>) -> Option<u32> {
        let (x, y) = match self.settings.pick {
            Pick::Nothing => return None,
            Pick::Element(texel) => return Some(texel),
            Pick::Pixel { x, y } => (x, y),
        };
        let (place, seen) = sees(UVec2::new(x, y))?;
        let ends =
            self.atlas.texels.iter().skip(1).map(|texel| texel.first_part).chain([self.atlas.parts.len() as u32]);
        let has_part = |(texel, end): (&crate::scene::atlas::Texel, u32)| {
            let parts = &self.atlas.parts[texel.first_part as usize..end as usize];
            let is_own_side = (texel.chart >= self.atlas.chart_count) == seen.is_back;
            is_own_side && parts.iter().any(|part| part.triangle as usize == seen.triangle)
        };
        let mut nearest: Option<(f32, u32)> = None;
        for (index, (texel, end)) in self.atlas.texels.iter().zip(ends).enumerate() {
            let distance = texel.position.distance_squared(place);
            if nearest.is_none_or(|(least, _)| distance < least) && has_part((texel, end)) {
                nearest = Some((distance, index as u32));
            }
        }
        nearest.map(|(_, texel)| texel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_picture_stands_in_the_middle_as_large_as_it_goes() {
        let [red, blue] = [Vec3::X, Vec3::Z];
        let flat = FlatPicture { size: UVec2::new(2, 1), colors: vec![red, blue] };
        let fitted = flat.fitted(UVec2::new(4, 4));
        let row = |y: usize| fitted[4 * y..4 * y + 4].to_vec();
        assert_eq!((row(0), row(3)), (vec![Vec3::ZERO; 4], vec![Vec3::ZERO; 4]));
        assert_eq!((row(1), row(2)), (vec![red, red, blue, blue], vec![red, red, blue, blue]));
    }
}
