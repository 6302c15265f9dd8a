//! Packing charts into a square of texels: shelves, tallest chart first, at the largest scale that fits.

use glam::{UVec2, Vec2};

/// Free texels around every chart, so that filtering one never reads another.
pub(super) const GUTTER: u32 = 1;

/// Where each chart lies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Packing {
    /// Metres to texels.
    pub scale: f32,
    /// First texel of each chart, inside its gutter.
    pub places: Vec<UVec2>,
}

/// Texels that a chart of `size` (metres) touches at `scale`.
fn extent(size: Vec2, scale: f32) -> UVec2 {
    // Coordinates start at a texel's edge.
    (size * scale).ceil().as_uvec2().max(UVec2::ONE)
}

/// Places charts on shelves at `scale`; `None` where they do not fit.
fn shelves(sizes: &[Vec2], order: &[usize], scale: f32, resolution: u32) -> Option<Vec<UVec2>> {
    let mut places = vec![UVec2::ZERO; sizes.len()];
    let (mut x, mut y, mut height) = (GUTTER, GUTTER, 0);
    for &chart in order {
        let size = extent(sizes[chart], scale);
        if size.max_element().checked_add(2 * GUTTER)? > resolution {
            return None;
        }
        if x + size.x + GUTTER > resolution {
            (x, y, height) = (GUTTER, y + height + GUTTER, 0);
        }
        if y + size.y + GUTTER > resolution {
            return None;
        }
        places[chart] = UVec2::new(x, y);
        x += size.x + GUTTER;
        height = height.max(size.y);
    }
    Some(places)
}

/// The largest scale at which charts of these sizes (metres) fit into `resolution` texels a side, found by halving;
/// `None` where even one texel a chart is too much.
pub(super) fn pack(sizes: &[Vec2], resolution: u32) -> Option<Packing> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[b].y.total_cmp(&sizes[a].y).then(a.cmp(&b)));
    let largest = sizes.iter().map(|size| size.max_element()).fold(0.0, f32::max);
    let area: f32 = sizes.iter().map(|size| size.x * size.y).sum();
    let mut high = resolution as f32 / area.sqrt().max(largest).max(f32::MIN_POSITIVE);
    let mut best = None;
    let mut low = 0.0;
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        match shelves(sizes, &order, middle, resolution) {
            Some(places) => {
                best = Some(Packing { scale: middle, places });
                low = middle;
            }
            None => high = middle,
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_keep_apart_and_inside() {
        let sizes: Vec<Vec2> =
            (0..57).map(|i| Vec2::new(0.1 + (i % 7) as f32 * 0.3, 0.2 + (i % 5) as f32 * 0.4)).collect();
        let packing = pack(&sizes, 128).unwrap();
        let mut is_taken = vec![false; 128 * 128];
        for (place, &size) in packing.places.iter().zip(&sizes) {
            let size = extent(size, packing.scale);
            assert!((*place + size).max_element() < 128 && place.min_element() >= 1);
            // The chart with its gutter to the right and below: no two of these overlap.
            for y in place.y..=place.y + size.y {
                for x in place.x..=place.x + size.x {
                    assert!(!std::mem::replace(&mut is_taken[(y * 128 + x) as usize], true), "{x} {y}");
                }
            }
        }
        let used: f32 = sizes.iter().map(|s| (s.x * s.y) * packing.scale.powi(2)).sum();
        assert!(used > 0.5 * 128.0 * 128.0, "half of the atlas is used: {used}");
    }

    #[test]
    fn too_many_charts_do_not_fit() {
        assert!(pack(&vec![Vec2::ONE; 2000], 64).is_none());
        assert!(pack(&vec![Vec2::ONE; 900], 64).is_some());
        assert!(pack(&[Vec2::ZERO], 4).is_some());
    }
}
