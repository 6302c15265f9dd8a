//! Writes the tessellated geometry, part by part: old vertices first, then those on edges, then those inside.

use glam::Vec3;

use super::blend::Source;
use super::patch::{Patch, segments};
use super::{Mesh, Tessellation};
use crate::scene::geometry::{Geometry, GeometryCounts, Part};

impl Mesh {
    pub(super) fn build(self, max_edge: f64, counts: GeometryCounts) -> Tessellation {
        let max_edge_kept = max_edge as f32;
        if counts.vertices == self.positions.len() as u64 {
            return Tessellation { geometry: self.geometry, rest_positions: self.positions, max_edge: max_edge_kept };
        }
        let mut builder = Builder {
            max_edge,
            result: Geometry::with_capacity(&counts),
            rest_positions: Vec::with_capacity(counts.vertices as usize),
            first_cut: vec![0; self.edges.ends.len()],
            sources: Vec::new(),
            patch: Patch::default(),
            mesh: &self,
        };
        // Edges are sorted by their lower vertex, so those of a part are contiguous.
        let mut edge = 0;
        for part in &self.geometry.parts {
            let first_edge = edge;
            let past = part.vertex_offset + part.vertex_count;
            while edge < self.edges.ends.len() && self.edges.ends[edge][0] < past {
                edge += 1;
            }
            builder.push_part(part, first_edge..edge);
        }
        let (geometry, rest_positions) = (builder.result, builder.rest_positions);
        Tessellation { geometry, rest_positions, max_edge: max_edge_kept }
    }
}

struct Builder<'a> {
    mesh: &'a Mesh,
    max_edge: f64,
    result: Geometry,
    rest_positions: Vec<Vec3>,
    /// New index of the first cut of each edge.
    first_cut: Vec<u32>,
    /// Where the new vertices of the current part come from.
    sources: Vec<Source>,
    patch: Patch,
}

impl Builder<'_> {
    fn push_part(&mut self, part: &Part, edges: std::ops::Range<usize>) {
        let (vertex_offset, triangle_offset) = (self.result.vertex_count(), self.result.triangle_count());
        let old = part.vertex_offset as usize..(part.vertex_offset + part.vertex_count) as usize;
        self.rest_positions.extend_from_slice(&self.mesh.positions[old.clone()]);
        self.sources.clear();
        let first_new = vertex_offset + part.vertex_count;
        for edge in edges {
            self.first_cut[edge] = first_new + self.sources.len() as u32;
            self.cut_edge(edge);
        }
        let triangles = part.triangle_offset..part.triangle_offset + part.triangle_count;
        for triangle in triangles {
            self.cut_triangle(triangle as usize, part, vertex_offset, first_new);
        }
        let mut cut = *part;
        cut.vertex_offset = vertex_offset;
        cut.vertex_count += self.sources.len() as u32;
        cut.triangle_offset = triangle_offset;
        cut.triangle_count = self.result.triangle_count() - triangle_offset;
        self.push_attributes(part, old, &mut cut);
        self.result.parts.push(cut);
    }

    fn cut_edge(&mut self, edge: usize) {
        let ends = self.mesh.edges.ends[edge];
        let count = segments(self.mesh.edges.lengths[edge], self.max_edge);
        let [from, to] = ends.map(|vertex| self.mesh.positions[vertex as usize]);
        for cut in 1..count {
            let t = cut as f32 / count as f32;
            self.rest_positions.push(from + (to - from) * t);
            self.sources.push(Source::between(ends, t));
        }
    }

    fn cut_triangle(&mut self, triangle: usize, part: &Part, vertex_offset: u32, first_new: u32) {
        let corners = self.mesh.geometry.triangles[triangle];
        let segments = self.mesh.side_segments(triangle, self.max_edge);
        self.patch.subdivide(self.mesh.corners(triangle), segments, self.max_edge);

        // New index of every local vertex, in the patch's order: corners, sides, interior.
        let mut index: Vec<u32> = corners.map(|vertex| vertex - part.vertex_offset + vertex_offset).to_vec();
        for k in 0..3 {
            let edge = self.mesh.edges.of_triangle[triangle][k] as usize;
            let (first, count) = (self.first_cut[edge], segments[k] - 1);
            let forward = self.mesh.edges.ends[edge][0] == corners[k];
            index.extend((0..count).map(|cut| first + if forward { cut } else { count - 1 - cut }));
        }
        let positions = corners.map(|vertex| self.mesh.positions[vertex as usize]);
        for vertex in self.patch.interior() {
            index.push(first_new + self.sources.len() as u32);
            let source = Source { vertices: corners, weights: vertex.barycentric.as_vec3().to_array() };
            let local = Source { vertices: [0, 1, 2], ..source };
            self.rest_positions.push(local.mix(&positions));
            self.sources.push(source);
        }
        let part_index = self.result.parts.len() as u32;
        for corners in &self.patch.triangles {
            self.result.triangles.push(corners.map(|local| index[local as usize]));
            self.result.triangle_part.push(part_index);
        }
    }

    /// Old vertices' attributes, then the new ones' from their sources; fills in the offsets of `cut`.
    fn push_attributes(&mut self, part: &Part, old: std::ops::Range<usize>, cut: &mut Part) {
        let (from, to, sources) = (&self.mesh.geometry, &mut self.result, &self.sources);
        let part_index = to.parts.len() as u32;
        to.vertex_part.extend(std::iter::repeat_n(part_index, cut.vertex_count as usize));
        extend(&mut to.local_positions, &from.local_positions, &old, sources, Source::mix);
        extend(&mut to.local_normals, &from.local_normals, &old, sources, Source::mix_unit);
        extend(&mut to.local_tangents, &from.local_tangents, &old, sources, Source::mix_tangent);
        for (to, from) in to.uv.iter_mut().zip(&from.uv) {
            extend(to, from, &old, sources, Source::mix);
        }
        extend(&mut to.colors, &from.colors, &old, sources, Source::mix);

        if let Some(first) = part.skin_offset {
            cut.skin_offset = Some(to.skin_joints.len() as u32);
            let influences = first as usize..(first + part.vertex_count) as usize;
            to.skin_joints.extend_from_slice(&from.skin_joints[influences.clone()]);
            to.skin_weights.extend_from_slice(&from.skin_weights[influences]);
            for source in sources {
                let (joints, weights) = source.mix_influences(from, first, part.vertex_offset);
                to.skin_joints.push(joints);
                to.skin_weights.push(weights);
            }
        }
        cut.morph_offset = to.morph_positions.len() as u32;
        for target in 0..part.morph_target_count {
            let first = (part.morph_offset + target * part.vertex_count) as usize;
            let deltas = first..first + part.vertex_count as usize;
            // Seen from the part's first displacement, vertices count from 0.
            let local = |source: &Source| Source {
                vertices: source.vertices.map(|vertex| vertex - part.vertex_offset + first as u32),
                ..*source
            };
            let mix = |source: &Source, values: &[Vec3]| local(source).mix(values);
            extend(&mut to.morph_positions, &from.morph_positions, &deltas, sources, mix);
            extend(&mut to.morph_normals, &from.morph_normals, &deltas, sources, mix);
            extend(&mut to.morph_tangents, &from.morph_tangents, &deltas, sources, mix);
        }
    }
}

fn extend<T: Copy>(
    to: &mut Vec<T>,
    from: &[T],
    old: &std::ops::Range<usize>,
    sources: &[Source],
    mix: impl Fn(&Source, &[T]) -> T,
) {
    to.extend_from_slice(&from[old.clone()]);
    to.extend(sources.iter().map(|source| mix(source, from)));
}
