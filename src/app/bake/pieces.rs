//! The surfaces of a baked file: one primitive for each side of each part, with a vertex for every place in the atlas.

use std::collections::HashMap;

use glam::Vec2;

use crate::scene::Scene;
use crate::scene::atlas::Atlas;
use crate::scene::geometry::Geometry;

/// One side of one part.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    pub part: usize,
    pub is_back: bool,
    /// Vertex of the geometry, per vertex of the piece.
    pub vertices: Vec<u32>,
    /// Place in the lightmap, 0..1 from the top left corner; empty without one.
    pub places: Vec<Vec2>,
    /// Counter-clockwise seen from the piece's side.
    pub triangles: Vec<[u32; 3]>,
}

/// Both sides of double-sided parts: each is lit by what that side sees.
pub fn pieces(scene: &Scene, geometry: &Geometry, atlas: Option<&Atlas>) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (index, part) in geometry.parts.iter().enumerate() {
        let is_double_sided = scene.materials.get(part.material as usize).is_some_and(|material| material.double_sided);
        for is_back in [false, true] {
            if (is_back && !is_double_sided) || part.triangle_count == 0 {
                continue;
            }
            let mut piece = Piece { part: index, is_back, vertices: vec![], places: vec![], triangles: vec![] };
            let mut known = HashMap::new();
            for triangle in part.triangle_offset..part.triangle_offset + part.triangle_count {
                let mut corners = [0, 1, 2].map(|corner| {
                    let vertex = geometry.triangles[triangle as usize][corner];
                    let place = atlas.map(|atlas| {
                        atlas.corner_places[usize::from(is_back)][triangle as usize][corner] / atlas.resolution as f32
                    });
                    let key = (vertex, place.map(|place| place.to_array().map(f32::to_bits)));
                    *known.entry(key).or_insert_with(|| {
                        piece.vertices.push(vertex);
                        piece.places.extend(place);
                        piece.vertices.len() as u32 - 1
                    })
                });
                if is_back {
                    corners.swap(1, 2);
                }
                piece.triangles.push(corners);
            }
            pieces.push(piece);
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::geometry::Part;
    use crate::scene::{Material, shapes};

    #[test]
    fn sides_and_seams_get_vertices_of_their_own() {
        // Two triangles of a square; in the atlas they lie apart.
        let shape =
            shapes::Shape::quad([glam::Vec3::ZERO, glam::Vec3::X, glam::Vec3::ONE - glam::Vec3::Z, glam::Vec3::Y]);
        let part = Part {
            node: 0,
            mesh: 0,
            primitive: 0,
            material: 0,
            vertex_offset: 0,
            vertex_count: 4,
            triangle_offset: 0,
            triangle_count: 2,
            mirrored: false,
            skin_offset: None,
            morph_target_count: 0,
            morph_offset: 0,
            morph_weight_offset: 0,
        };
        let geometry = Geometry {
            local_positions: shape.positions.clone(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            parts: vec![part],
            ..Geometry::default()
        };
        let material = Material { double_sided: true, ..Material::default() };
        let scene = Scene { materials: vec![material], ..Scene::default() };
        let plain = pieces(&scene, &geometry, None);
        assert_eq!(plain.len(), 2);
        assert_eq!((plain[0].vertices.len(), plain[0].is_back, plain[1].is_back), (4, false, true));
        assert_eq!((plain[0].triangles[0], plain[1].triangles[0]), ([0, 1, 2], [0, 2, 1]));

        let corners = |x: f32| [Vec2::new(x, 0.0), Vec2::new(x + 1.0, 0.0), Vec2::new(x, 1.0)];
        let places = vec![corners(0.0), corners(4.0)];
        let atlas = Atlas { resolution: 8, corner_places: [places.clone(), places], ..Atlas::default() };
        let split = pieces(&scene, &geometry, Some(&atlas));
        assert_eq!(split[0].vertices, [0, 1, 2, 0, 2, 3]);
        assert_eq!(split[0].places[3], Vec2::new(0.5, 0.0));
    }
}
