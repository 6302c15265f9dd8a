//! Packing charts into a square of texels: shelves, tallest chart first, at the largest scale that fits.

use glam::{UVec2, Vec2};

/// How far inside its squares a chart lies, texels: rounding takes none of its places into a square beside it.
const INSET: f32 = 1.0 / 64.0;

/// Where each chart lies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Packing {
    /// Metres to texels.
    pub scale: f32,
    /// First texel of each chart, inside its gutter.
    places: Vec<UVec2>,
}

impl Packing {
    /// Where a chart's own origin lies, texels.
    pub fn origin(&self, chart: usize) -> Vec2 {
        self.places[chart].as_vec2() + INSET
    }
}

/// Texels that a chart of `size` (metres) touches at `scale`.
fn extent(size: Vec2, scale: f32) -> UVec2 {
    (size * scale + 2.0 * INSET).ceil().as_uvec2().max(UVec2::ONE)
}

/// Places charts on shelves at `scale`; `None` where they do not fit.
fn shelves(sizes: &[Vec2], order: &[usize], scale: f32, resolution: u32, gutter: u32) -> Option<Vec<UVec2>> {
    let mut places = vec![UVec2::ZERO; sizes.len()];
    let (mut x, mut y, mut height) = (gutter, gutter, 0);
    for &chart in order {
        let size = extent(sizes[chart], scale);
        if size.max_element().checked_add(2 * gutter)? > resolution {
            return None;
        }
        if x + size.x + gutter > resolution {
            (x, y, height) = (gutter, y + height + gutter, 0);
        }
        if y + size.y + gutter > resolution {
            return None;
        }
        places[chart] = UVec2::new(x, y);
        x += size.x + gutter;
        height = height.max(size.y);
    }
    Some(places)
}

/// The largest scale at which charts of these sizes (metres), `gutter` free texels apart, fit into `resolution` texels a
/// side, found by halving; `None` where even one texel a chart is too much.
pub(super) fn pack(sizes: &[Vec2], resolution: u32, gutter: u32) -> Option<Packing> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[b].y.total_cmp(&sizes[a].y).then(a.cmp(&b)));
    let largest = sizes.iter().map(|size| size.max_element()).fold(0.0, f32::max);
    let area: f32 = sizes.iter().map(|size| size.x * size.y).sum();
    let mut high = resolution as f32 / area.sqrt().max(largest).max(f32::MIN_POSITIVE);
    let mut best = None;
    let mut low = 0.0;
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        match shelves(sizes, &order, middle, resolution, gutter) {
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
        for gutter in [0, 1] {
            let packing = pack(&sizes, 128, gutter).unwrap();
            let mut is_taken = vec![false; 128 * 128];
            for (chart, &size) in sizes.iter().enumerate() {
                let (first, size) = (packing.places[chart], extent(size, packing.scale));
                let last = packing.origin(chart) + sizes[chart] * packing.scale;
                assert!(first.min_element() >= gutter && (first + size).max_element() + gutter <= 128);
                assert!((packing.origin(chart) - first.as_vec2()).min_element() > 0.01);
                assert!(((first + size).as_vec2() - last).min_element() > 0.01, "{last} of {first} and {size}");
                // The chart with its gutter to the right and below: no two of these overlap.
                for y in first.y..first.y + size.y + gutter {
                    for x in first.x..first.x + size.x + gutter {
                        assert!(!std::mem::replace(&mut is_taken[(y * 128 + x) as usize], true), "{x} {y}");
                    }
                }
            }
            let used: f32 = sizes.iter().map(|s| (s.x * s.y) * packing.scale.powi(2)).sum();
            assert!(used > 0.5 * 128.0 * 128.0, "half of the atlas is used: {used}");
        }
    }

    #[test]
    fn too_many_charts_do_not_fit() {
        assert!(pack(&vec![Vec2::ONE; 2000], 64, 1).is_none());
        assert!(pack(&vec![Vec2::ONE; 900], 64, 1).is_some());
        assert!(pack(&[Vec2::ZERO], 4, 1).is_some());
    }
}
