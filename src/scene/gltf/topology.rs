//! Triangles from indices: lists, strips and fans; which vertices they use; which of them have no area.

use glam::{DVec3, Vec3};

/// How a primitive's corners form triangles, by glTF's `mode` numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    Triangles = 4,
    TriangleStrip = 5,
    TriangleFan = 6,
}

impl Mode {
    pub fn triangle_count(self, corner_count: usize) -> usize {
        match self {
            Self::Triangles => corner_count / 3,
            Self::TriangleStrip | Self::TriangleFan => corner_count.saturating_sub(2),
        }
    }

    /// The corners of triangle `triangle`, as positions in the index list, in the winding glTF 2.0 (3.7.2.1) gives.
    fn corners(self, triangle: usize) -> [usize; 3] {
        let t = triangle;
        match self {
            Self::Triangles => [3 * t, 3 * t + 1, 3 * t + 2],
            Self::TriangleStrip => [t, t + 1 + t % 2, t + 2 - t % 2],
            Self::TriangleFan => [t + 1, t + 2, 0],
        }
    }

    /// Corners left over at the end are ignored.
    pub fn triangles(self, indices: &[u32]) -> Vec<[u32; 3]> {
        (0..self.triangle_count(indices.len())).map(|t| self.corners(t).map(|corner| indices[corner])).collect()
    }
}

/// The distinct vertices of `triangles` in ascending order. All are below `vertex_count`.
pub fn used_vertices(triangles: &[[u32; 3]], vertex_count: usize) -> Vec<u32> {
    let corners = triangles.as_flattened();
    // A few triangles of a large shared buffer must not cost time and memory in the size of the buffer.
    if corners.len() < vertex_count / 8 {
        let mut used = corners.to_vec();
        used.sort_unstable();
        used.dedup();
        return used;
    }
    let mut is_used = vec![false; vertex_count];
    corners.iter().for_each(|vertex| is_used[*vertex as usize] = true);
    (0..vertex_count as u32).filter(|vertex| is_used[*vertex as usize]).collect()
}

/// Renumbers `triangles` to positions in `used`, which holds all their vertices in ascending order.
pub fn renumber(triangles: &mut [[u32; 3]], used: &[u32]) {
    let dense = used.last().is_none_or(|last| *last as usize + 1 == used.len());
    if dense {
        return;
    }
    for vertex in triangles.as_flattened_mut() {
        // Both sides are below 2^32 by construction; a vertex is always found.
        *vertex = used.partition_point(|other| other < vertex) as u32;
    }
}

/// A triangle is degenerate when its height is below this part of its longest edge: within the rounding of its
/// single-precision corners it is a line.
const FLATNESS: f64 = 1e-7;

/// Removes triangles that name a vertex twice and, when `by_area`, those without area. Returns how many.
pub fn drop_degenerate(triangles: &mut Vec<[u32; 3]>, positions: &[Vec3], by_area: bool) -> usize {
    let before = triangles.len();
    triangles.retain(|&[a, b, c]| {
        let repeats = a == b || b == c || c == a;
        let corners = || [a, b, c].map(|vertex| positions[vertex as usize].as_dvec3());
        !(repeats || by_area && is_flat(corners()))
    });
    before - triangles.len()
}

fn is_flat([a, b, c]: [DVec3; 3]) -> bool {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let longest_squared = ab.length_squared().max(bc.length_squared()).max(ca.length_squared());
    ab.cross(-ca).length() <= FLATNESS * longest_squared
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let indices = [10, 11, 12, 13, 14];
        assert_eq!(Mode::Triangles.triangles(&indices), [[10, 11, 12]]);
        assert_eq!(Mode::TriangleStrip.triangles(&indices), [[10, 11, 12], [11, 13, 12], [12, 13, 14]]);
        assert_eq!(Mode::TriangleFan.triangles(&indices), [[11, 12, 10], [12, 13, 10], [13, 14, 10]]);
        for mode in [Mode::Triangles, Mode::TriangleStrip, Mode::TriangleFan] {
            assert!(mode.triangles(&indices[..2]).is_empty());
            assert_eq!(mode.triangles(&indices[..3]).len(), 1);
        }
    }

    #[test]
    fn all_strip_triangles_of_a_flat_band_face_the_same_way() {
        let positions: Vec<Vec3> = (0..8).map(|i| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
        let normal = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|vertex| positions[vertex as usize]);
            (b - a).cross(c - a).z.signum()
        };
        let strip = Mode::TriangleStrip.triangles(&(0..8).collect::<Vec<_>>());
        assert_eq!(strip.len(), 6);
        assert!(strip.iter().all(|triangle| normal(*triangle) == normal(strip[0])));
    }

    #[test]
    fn sparse_and_dense_use_agree_and_renumber() {
        let triangles = [[900, 3, 70], [70, 3, 5]];
        assert_eq!(used_vertices(&triangles, 1000), [3, 5, 70, 900]);
        assert_eq!(used_vertices(&triangles, 901), used_vertices(&triangles, 300 * 6));
        assert_eq!(used_vertices(&triangles, 1 << 20), [3, 5, 70, 900]);
        let mut renumbered = triangles;
        renumber(&mut renumbered, &[3, 5, 70, 900]);
        assert_eq!(renumbered, [[3, 0, 2], [2, 0, 1]]);
    }

    #[test]
    fn degenerate_triangles_go_and_thin_ones_stay() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::new(0.5, 1e-5, 0.0), Vec3::X];
        let all = vec![[0, 1, 1], [0, 1, 2], [1, 4, 2], [0, 1, 3]];
        let mut triangles = all.clone();
        assert_eq!(drop_degenerate(&mut triangles, &positions, true), 3);
        assert_eq!(triangles, [[0, 1, 3]]);
        let mut triangles = all;
        assert_eq!(drop_degenerate(&mut triangles, &positions, false), 1);
    }
}
