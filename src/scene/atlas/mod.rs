//! The atlas: charts packed into a square, and the surface in it cut into texels.                  [Ritschel2008 4.1]
//!
//! A texel is whatever part of a chart lies in its square, however little: nothing is lost at the borders of charts, and
//! the texels' areas, measured part by part, add up to the surface. A double-sided surface has texels on both sides.
//!
//! [Ritschel2008]: crate::methods::PAPERS

mod pack;
mod raster;

use super::Scene;
use super::charts::{Charts, Options, Surface, unwrap};
use super::geometry::Geometry;
use glam::{Mat4, UVec2, Vec2, Vec3};
use pack::Packing;

/// "No texel" of an entry of [`Atlas::texel_at`].
pub const NO_TEXEL: u32 = u32::MAX;
/// Texels a side of the finest atlas.
pub const MAX_RESOLUTION: u32 = 2048;

/// Texels that a chart has in the mean, at least, where the resolution is not given.
const TEXELS_PER_CHART: usize = 3;

/// Cells a side that a texel is cut into: what is hidden of it is told cell by cell.
fn cells_a_side(resolution: u32) -> u32 {
    (1024 / resolution.max(1)).clamp(1, 4)
}

/// How large an atlas is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Texels a side.
    pub resolution: u32,
    /// Free texels between charts: for filters that do not know what belongs to which.
    pub gutter: u32,
}

impl Size {
    /// Charts side by side.
    pub fn tight(resolution: u32) -> Self {
        Self { resolution, gutter: 0 }
    }
}

/// Why a surface has no atlas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AtlasError {
    #[error(
        "{charts} charts do not fit into an atlas of {resolution} texels a side; {}",
        match .fits { Some(fits) => format!("{fits} would do: set atlas_resolution={fits}"), None => "simplify the scene".into() }
    )]
    TooSmall { charts: usize, resolution: u32, fits: Option<u32> },
}

/// One texel with a surface in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texel {
    /// Column and row in the atlas.
    pub at: UVec2,
    /// Chart; the back of chart `c` counts as `chart_count + c`.
    pub chart: u32,
    /// Centroid of the surface in the texel, moved out of it where it is curved; metres.
    pub position: Vec3,
    /// Unit, of the surface itself, towards the texel's side.
    pub normal: Vec3,
    /// m2.
    pub area: f32,
    /// Sides of the parallelogram that stands for the texel, metres: as long as the area asks for.
    pub side_u: Vec3,
    pub side_v: Vec3,
    /// First of its parts; the next texel's first ends them.
    pub first_part: u32,
}

/// The part of one triangle in one cell of a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexelPart {
    pub triangle: u32,
    /// Of its centroid: weights of corners 1 and 2.
    pub barycentrics: Vec2,
    /// m2.
    pub area: f32,
    /// Its centroid and its mean squared coordinates, in texels from the texel's corner.
    local: Vec2,
    squares: Vec2,
}

/// The atlas as plain data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Atlas {
    /// Texels a side.
    pub resolution: u32,
    /// Texels per metre of chart.
    pub scale: f32,
    pub chart_count: u32,
    /// Row by row.
    pub texels: Vec<Texel>,
    /// In the order of their texels.
    pub parts: Vec<TexelPart>,
    /// Index of the texel at each place, row by row, or [`NO_TEXEL`].
    pub texel_at: Vec<u32>,
    /// Place of each triangle's corners in the atlas, texels: fronts, then backs (equal where the surface has none).
    pub corner_places: [Vec<[Vec2; 3]>; 2],
}

impl Atlas {
    /// Unwraps and cuts `geometry`, whose vertices stand at `positions`, into at most `size.resolution` texels a side.
    pub fn new(scene: &Scene, geometry: &Geometry, positions: &[Vec3], size: Size) -> Result<Self, AtlasError> {
        let Size { resolution, gutter } = size;
        let charts = unwrap(&Surface::of(geometry, positions), &Options::default());
        let has_back = |chart: usize| {
            let part = geometry.parts[charts.charts[chart].part as usize];
            scene.materials.get(part.material as usize).is_some_and(|material| material.double_sided)
        };
        let count = charts.charts.len();
        let backs: Vec<usize> = (0..count).filter(|&chart| has_back(chart)).collect();
        let sizes: Vec<Vec2> =
            (0..count).chain(backs.iter().copied()).map(|chart| charts.charts[chart].size.max(Vec2::ZERO)).collect();
        let packing = pack::pack(&sizes, resolution, gutter).ok_or_else(|| {
            let finer = std::iter::successors(Some(resolution.max(1).next_power_of_two()), |r| Some(r * 2));
            let fits = finer.take_while(|&r| r <= MAX_RESOLUTION).find(|&r| pack::pack(&sizes, r, gutter).is_some());
            AtlasError::TooSmall { charts: sizes.len(), resolution, fits }
        })?;
        let mut back_of = vec![None; count];
        for (index, &chart) in backs.iter().enumerate() {
            back_of[chart] = Some(packing.origin(count + index));
        }
        Ok(Self::cut(geometry, positions, &charts, &packing, &back_of, resolution))
    }

    /// The coarsest atlas, as large as `least` or twice, four times ... as many, whose charts have some texels each
    /// in the mean; beyond `enough` any that the charts fit into will do.
    pub fn fitting(
        scene: &Scene,
        geometry: &Geometry,
        positions: &[Vec3],
        least: Size,
        enough: u32,
    ) -> Result<Self, AtlasError> {
        let mut resolution = least.resolution;
        loop {
            match Self::new(scene, geometry, positions, Size { resolution, ..least }) {
                Ok(atlas)
                    if resolution >= enough || atlas.texels.len() >= TEXELS_PER_CHART * atlas.chart_count as usize =>
                {
                    return Ok(atlas);
                }
                Err(error) if resolution >= MAX_RESOLUTION => return Err(error),
                _ => resolution *= 2,
            }
        }
    }

    fn cut(
        geometry: &Geometry,
        positions: &[Vec3],
        charts: &Charts,
        packing: &Packing,
        back_of: &[Option<Vec2>],
        resolution: u32,
    ) -> Self {
        let count = charts.charts.len() as u32;
        let mut atlas = Self { resolution, scale: packing.scale, chart_count: count, ..Self::default() };
        // Sums per place of the square; a place belongs to one chart, since charts keep apart.
        let cells = cells_a_side(resolution);
        let mut found: Vec<Found> = Vec::new();
        for (triangle, corners) in geometry.triangles.iter().enumerate() {
            let chart = charts.triangle_chart[triangle] as usize;
            let [a, b, c] = corners.map(|v| positions[v as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            let front = charts.corner_uv[triangle].map(|uv| uv * packing.scale + packing.origin(chart));
            let back = back_of[chart].map(|place| charts.corner_uv[triangle].map(|uv| uv * packing.scale + place));
            atlas.corner_places[0].push(front);
            atlas.corner_places[1].push(back.unwrap_or(front));
            let sides = std::iter::once((front, chart as u32)).chain(back.map(|back| (back, count + chart as u32)));
            for (places, chart) in sides {
                let [p, q, r] = places;
                let flat = (q - p).perp_dot(r - p);
                if flat == 0.0 || area <= 0.0 {
                    continue;
                }
                raster::cover(places.map(|place| place * cells as f32), |covered| {
                    let at = (covered.texel / cells).min(UVec2::splat(resolution - 1));
                    let offset = covered.centre / cells as f32 - p;
                    let barycentrics = Vec2::new(offset.perp_dot(r - p), (q - p).perp_dot(offset)) / flat;
                    let (corner, size) = (covered.texel.as_vec2(), cells as f32);
                    // Moments about the cell's corner, moved to the texel's.
                    let cell = corner - at.as_vec2() * size;
                    let squares =
                        (cell * cell + 2.0 * cell * (covered.centre - corner) + covered.squares) / (size * size);
                    let part = TexelPart {
                        triangle: triangle as u32,
                        barycentrics,
                        area: covered.share / (0.5 * flat.abs() * size * size) * area,
                        local: covered.centre / size - at.as_vec2(),
                        squares,
                    };
                    found.push(Found { place: at.y * resolution + at.x, chart, part });
                });
            }
        }
        found.sort_by_key(|found| found.place);

        atlas.texel_at = vec![NO_TEXEL; resolution as usize * resolution as usize];
        for found in found.chunk_by(|a, b| a.place == b.place) {
            let parts: Vec<TexelPart> = found.iter().map(|found| found.part).collect();
            let at = UVec2::new(found[0].place % resolution, found[0].place / resolution);
            atlas.push_texel(geometry, positions, &parts, (at, found[0].chart), false);
        }
        atlas
    }

    /// Appends the texel of `parts` at a place of a chart, if it has area.
    fn push_texel(
        &mut self,
        geometry: &Geometry,
        positions: &[Vec3],
        parts: &[TexelPart],
        (at, chart): (UVec2, u32),
        is_cut: bool,
    ) {
        let is_back = chart >= self.chart_count;
        let texel = texel(geometry, positions, self, parts, is_back, at, is_cut);
        if texel.area > 0.0 && texel.normal != Vec3::ZERO {
            self.texel_at[(at.y * self.resolution + at.x) as usize] = self.texels.len() as u32;
            self.texels.push(Texel { chart, first_part: self.parts.len() as u32, ..texel });
            self.parts.extend(parts);
        }
    }

    /// The same texels where `moved` (of each) took them.
    pub fn moved(&self, moved: impl Fn(usize) -> Mat4) -> Self {
        let mut atlas = self.clone();
        for (index, texel) in atlas.texels.iter_mut().enumerate() {
            let transform = moved(index);
            texel.position = transform.transform_point3(texel.position);
            texel.normal = transform.transform_vector3(texel.normal).normalize_or_zero();
            texel.side_u = transform.transform_vector3(texel.side_u);
            texel.side_v = transform.transform_vector3(texel.side_v);
        }
        atlas
    }

    /// Where each part stands in space (metres), and the unit normal of its side: what a test of each starts from.
    pub fn part_points(&self, geometry: &Geometry, positions: &[Vec3]) -> (Vec<Vec3>, Vec<Vec3>) {
        let of_texel = |index: usize| {
            let sign = if self.texels[index].chart >= self.chart_count { -1.0 } else { 1.0 };
            self.parts_of(index).iter().map(move |part| {
                let [a, b, c] = geometry.triangles[part.triangle as usize].map(|vertex| positions[vertex as usize]);
                (part_point(geometry, positions, part), sign * (b - a).cross(c - a).normalize_or_zero())
            })
        };
        (0..self.texels.len()).flat_map(of_texel).unzip()
    }

    /// Leaves out all parts that are not `kept`; texels shrink to what is left of them, and those without any are gone.
    pub fn keep_parts(&mut self, geometry: &Geometry, positions: &[Vec3], kept: &[bool]) {
        let old = Self { texel_at: vec![NO_TEXEL; self.texel_at.len()], ..self.clone() };
        self.texel_at.fill(NO_TEXEL);
        self.texels.clear();
        self.parts.clear();
        for (index, texel) in old.texels.iter().enumerate() {
            let parts = old.parts_of(index);
            let first = texel.first_part as usize;
            let left: Vec<TexelPart> =
                parts.iter().zip(&kept[first..]).filter(|(_, kept)| **kept).map(|(part, _)| *part).collect();
            self.push_texel(geometry, positions, &left, (texel.at, texel.chart), left.len() < parts.len());
        }
    }

    /// Parts of a texel.
    pub fn parts_of(&self, texel: usize) -> &[TexelPart] {
        let end = self.texels.get(texel + 1).map_or(self.parts.len(), |next| next.first_part as usize);
        &self.parts[self.texels[texel].first_part as usize..end]
    }
}

/// A part on its way into its texel.
struct Found {
    /// Row by row.
    place: u32,
    chart: u32,
    part: TexelPart,
}

fn part_point(geometry: &Geometry, positions: &[Vec3], part: &TexelPart) -> Vec3 {
    let [a, b, c] = geometry.triangles[part.triangle as usize].map(|vertex| positions[vertex as usize]);
    a + part.barycentrics.x * (b - a) + part.barycentrics.y * (c - a)
}

/// Sums the parts up: area, centroid, mean normal, and the mean of what a step of a texel to the right and down is in
/// space. Where parts were cut away the texel stands on the part nearest to the centroid: that itself may be hidden.
fn texel(
    geometry: &Geometry,
    positions: &[Vec3],
    atlas: &Atlas,
    parts: &[TexelPart],
    is_back: bool,
    at: UVec2,
    is_cut: bool,
) -> Texel {
    let (mut area, mut position, mut normal, mut u, mut v) = (0.0, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    let (mut local, mut squares) = (Vec2::ZERO, Vec2::ZERO);
    // What a step of a texel to the right and down is in space, on a part's triangle.
    let steps = |part: &TexelPart| {
        let triangle = part.triangle as usize;
        let [a, b, c] = geometry.triangles[triangle].map(|vertex| positions[vertex as usize]);
        let [p, q, r] = atlas.corner_places[usize::from(is_back)][triangle];
        let (e1, e2) = (q - p, r - p);
        [(b - a) * e2.y - (c - a) * e1.y, (c - a) * e1.x - (b - a) * e2.x].map(|step| step / e1.perp_dot(e2))
    };
    for part in parts {
        local += part.area * part.local;
        squares += part.area * part.squares;
        let [a, b, c] = geometry.triangles[part.triangle as usize].map(|vertex| positions[vertex as usize]);
        let [right, down] = steps(part);
        area += part.area;
        position += part.area * part_point(geometry, positions, part);
        normal += part.area * (b - a).cross(c - a).normalize_or_zero();
        u += part.area * right;
        v += part.area * down;
    }
    if area <= 0.0 || area.is_nan() {
        return Texel { at, chart: 0, position, normal: Vec3::ZERO, area: 0.0, side_u: u, side_v: v, first_part: 0 };
    }
    let normal = if is_back { -normal } else { normal }.normalize_or_zero();
    // Sides in the plane across the normal, around it the right way, as large as the area; in each direction as long as a
    // rectangle that spreads as far, so that a strip along a border stays on its side of the border.
    let spread = (12.0 * (squares / area - (local / area).powf(2.0))).max(Vec2::splat(1e-6));
    let [u, v] = [u, v].map(|side| (side - normal * side.dot(normal)) / area);
    let (u, v) = (u * spread.x.sqrt(), v * spread.y.sqrt());
    let across = u.cross(v).dot(normal);
    let (u, v) = if across < 0.0 { (v, u) } else { (u, v) };
    let (side_u, side_v) = if across.abs() > 1e-3 * u.length() * v.length() && across.is_finite() {
        let factor = (area / across.abs()).sqrt();
        (factor * u, factor * v)
    } else {
        let (u, v) = normal.any_orthonormal_pair();
        (area.sqrt() * u, area.sqrt() * v)
    };
    let points = || parts.iter().map(|part| part_point(geometry, positions, part));
    let centroid = position / area;
    let nearest = |a: Vec3, b: Vec3| if b.distance_squared(centroid) < a.distance_squared(centroid) { b } else { a };
    let stand = if is_cut { points().reduce(nearest).unwrap_or(centroid) } else { centroid };
    // On a curved surface the centroid lies under it, and would be hidden by it, and a flat texel's corners would reach through
    // a hollow one to its other side: out to the highest corner of any part, each a rectangle that spreads as far.
    let highest = |part: &TexelPart| {
        let half = (3.0 * (part.squares - part.local * part.local)).max(Vec2::ZERO).powf(0.5);
        let [right, down] = steps(part).map(|step| step.dot(normal).abs());
        (part_point(geometry, positions, part) - stand).dot(normal) + right * half.x + down * half.y
    };
    let height = parts.iter().map(highest).filter(|height| height.is_finite()).fold(0.0, f32::max);
    Texel { at, chart: 0, position: stand + height * normal, normal, area, side_u, side_v, first_part: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::pose::Pose;
    use crate::scene::{LoadOptions, builtin, deform};

    fn atlas(name: &str, resolution: u32) -> (Atlas, f32) {
        let scene = builtin::open(name, &LoadOptions::default()).unwrap();
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let positions = deform::world_positions(&geometry, &Pose::rest(&scene));
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        let atlas = Atlas::new(&scene, &geometry, &positions, Size { resolution, gutter: 1 }).unwrap();
        let sides = |t: usize| 1.0 + f32::from(u8::from(atlas.corner_places[0][t] != atlas.corner_places[1][t]));
        let total = geometry.triangles.iter().enumerate().map(|(t, v)| sides(t) * area(v)).sum();
        (atlas, total)
    }

    #[test]
    fn areas_add_up_to_the_surface() {
        for (name, resolution) in [("builtin:cornell-box", 64), ("builtin:cornell-box", 128), ("builtin:maze", 128)] {
            let (atlas, total) = atlas(name, resolution);
            let sum: f32 = atlas.texels.iter().map(|texel| texel.area).sum();
            println!(
                "{name} at {resolution}: {} texels, {} charts, {sum} m2 of {total}",
                atlas.texels.len(),
                atlas.chart_count
            );
            assert!((sum / total - 1.0).abs() < 1e-3, "{sum} for {total}");
            for (index, texel) in atlas.texels.iter().enumerate() {
                let across = texel.side_u.cross(texel.side_v);
                assert!((across.length() / texel.area - 1.0).abs() < 1e-3, "{texel:?}");
                assert!(across.normalize().dot(texel.normal) > 0.999, "{texel:?}");
                let parts: f32 = atlas.parts_of(index).iter().map(|part| part.area).sum();
                assert!((parts / texel.area - 1.0).abs() < 1e-4);
                assert_eq!(atlas.texel_at[(texel.at.y * resolution + texel.at.x) as usize], index as u32);
            }
            // Neighbours in the square belong to one chart.
            for texel in &atlas.texels {
                let right = atlas.texel_at[(texel.at.y * resolution + texel.at.x + 1) as usize];
                assert!(right == NO_TEXEL || atlas.texels[right as usize].chart == texel.chart);
            }
        }
    }

    /// A tube, seen from both sides: flat texels of its inside keep inside, corners and all.
    #[test]
    fn texels_of_a_hollow_do_not_reach_through_it() {
        use crate::scene::{Material, Mesh, Node, Primitive};
        let ring = 96u32;
        let at = |k: u32, height: f32| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / ring as f32).sin_cos();
            Vec3::new(cos, height, sin)
        };
        let positions: Vec<Vec3> = (0..=ring).flat_map(|k| [at(k % ring, 0.0), at(k % ring, 1.0)]).collect();
        let triangles =
            (0..ring).flat_map(|k| [[2 * k, 2 * k + 1, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 2]]).collect();
        let count = positions.len();
        let tube = Primitive {
            normals: positions.iter().map(|p| Vec3::new(p.x, 0.0, p.z)).collect(),
            tangents: vec![Vec3::Y.extend(1.0); count],
            uv: [vec![Vec2::ZERO; count], vec![Vec2::ZERO; count]],
            colors: vec![glam::Vec4::ONE; count],
            positions,
            triangles,
            ..Primitive::default()
        };
        let scene = Scene {
            materials: vec![Material { double_sided: true, ..Material::default() }],
            meshes: vec![Mesh { primitives: vec![tube], ..Mesh::default() }],
            nodes: vec![Node { mesh: Some(0), ..Node::default() }],
            ..Scene::default()
        };
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let positions = deform::world_positions(&geometry, &Pose::rest(&scene));
        let atlas = Atlas::new(&scene, &geometry, &positions, Size::tight(24)).unwrap();
        let is_inside = |texel: &&Texel| texel.normal.dot(Vec3::new(texel.position.x, 0.0, texel.position.z)) < 0.0;
        let farthest = atlas.texels.iter().filter(is_inside).flat_map(|texel| {
            let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
            corners.map(|(u, v)| (texel.position + u * texel.side_u + v * texel.side_v) * Vec3::new(1.0, 0.0, 1.0))
        });
        let farthest = farthest.map(Vec3::length).fold(0.0, f32::max);
        println!("{} texels, the farthest corner of the inner ones at {farthest}", atlas.texels.len());
        assert!(farthest > 0.9 && farthest < 1.0005, "{farthest}");
    }

    #[test]
    fn an_atlas_too_small_says_what_would_do() {
        let scene = builtin::open("builtin:office", &LoadOptions::default()).unwrap();
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        let positions = deform::world_positions(&geometry, &Pose::rest(&scene));
        let error = Atlas::new(&scene, &geometry, &positions, Size::tight(16)).unwrap_err();
        println!("{error}");
        let AtlasError::TooSmall { fits: Some(fits), .. } = error else { panic!("{error}") };
        let atlas = Atlas::new(&scene, &geometry, &positions, Size::tight(fits)).unwrap();
        println!("office at {fits}: {} texels, {} charts", atlas.texels.len(), atlas.chart_count);
        assert!(error.to_string().contains(&format!("atlas_resolution={fits}")));
    }
}
