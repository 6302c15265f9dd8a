//! Tangents for normal maps of surfaces that come without: the tangent space that MikkTSpace defines, which is what
//! normal maps are baked for and what glTF 2.0 (3.7.2.1) asks for.
//!
//! Differs from the published MikkTSpace code: triangles of one handedness around a vertex form one group even where
//! they do not share an edge. In return, time is linear in the triangles whatever the file holds (that code, and the
//! crates that port it, recurse along fans and take quadratic time at vertices of many triangles).

use super::surface::split_vertices;
use crate::scene::Primitive;
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// Computes tangents for the texture coordinates `uv` (one per vertex), doubling vertices along mirrored seams, where
/// the tangent space changes its hand.
pub fn generate(primitive: &mut Primitive, uv: &[Vec2]) {
    let classes = weld(primitive, uv);
    // Per class and hand, the sum over its corners of the texture's u direction weighted by the corner's angle.
    let mut sums = vec![[DVec3::ZERO; 2]; primitive.positions.len()];
    let mut hands = Vec::with_capacity(primitive.triangles.len());
    for triangle in &primitive.triangles {
        let corners = triangle.map(|vertex| primitive.positions[vertex as usize].as_dvec3());
        let mapped = triangle.map(|vertex| uv[vertex as usize].as_dvec2());
        let Some((direction, hand)) = u_direction(corners, mapped) else {
            hands.push(None);
            continue;
        };
        hands.push(Some(hand));
        for corner in 0..3 {
            let vertex = triangle[corner] as usize;
            let normal = primitive.normals[vertex].as_dvec3();
            let flatten = |vector: DVec3| (vector - normal * normal.dot(vector)).normalize_or_zero();
            let to_next = flatten(corners[(corner + 1) % 3] - corners[corner]);
            let to_previous = flatten(corners[(corner + 2) % 3] - corners[corner]);
            let angle = to_next.dot(to_previous).clamp(-1.0, 1.0).acos();
            sums[classes[vertex] as usize][hand as usize] += flatten(direction) * angle;
        }
    }

    let tangent = |vertex: u32, hand: Hand| -> Option<Vec4> {
        let normal = primitive.normals[vertex as usize].as_dvec3();
        let sum = sums[classes[vertex as usize] as usize][hand as usize];
        let direction = (sum - normal * normal.dot(sum)).try_normalize()?;
        Some(direction.as_vec3().extend(hand.sign()))
    };
    let corner_tangents: Vec<Vec4> = primitive
        .triangles
        .iter()
        .zip(&hands)
        .flat_map(|(triangle, hand)| triangle.map(|vertex| (vertex, *hand)))
        .map(|(vertex, hand)| match hand {
            Some(hand) => tangent(vertex, hand).unwrap_or_else(|| any_tangent(primitive, vertex, hand)),
            // A triangle without extent in the texture takes what its neighbours have.
            None => tangent(vertex, Hand::Right)
                .or_else(|| tangent(vertex, Hand::Left))
                .unwrap_or_else(|| any_tangent(primitive, vertex, Hand::Right)),
        })
        .collect();

    split_vertices(primitive, |corner| corner_tangents[corner], |a, b| a == b);
    primitive.tangents = vec![Vec4::ZERO; primitive.positions.len()];
    for (tangent, vertex) in corner_tangents.iter().zip(primitive.triangles.as_flattened()) {
        primitive.tangents[*vertex as usize] = *tangent;
    }
}

fn any_tangent(primitive: &Primitive, vertex: u32, hand: Hand) -> Vec4 {
    primitive.normals[vertex as usize].any_orthonormal_vector().extend(hand.sign())
}

/// Whether the bitangent, which points against the v axis of the texture, is `cross(normal, tangent)` or its opposite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hand {
    Right = 0,
    Left = 1,
}

impl Hand {
    /// glTF's tangent.w.
    fn sign(self) -> f32 {
        match self {
            Self::Right => 1.0,
            Self::Left => -1.0,
        }
    }
}

/// The direction on a triangle in which the texture's u grows; `None` where the texture has no extent on it.
fn u_direction(corners: [DVec3; 3], uv: [DVec2; 3]) -> Option<(DVec3, Hand)> {
    let (edge_1, edge_2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let (uv_1, uv_2) = (uv[1] - uv[0], uv[2] - uv[0]);
    let twice_area = uv_1.perp_dot(uv_2);
    if twice_area == 0.0 {
        return None;
    }
    let direction = ((edge_1 * uv_2.y - edge_2 * uv_1.y) * twice_area.signum()).try_normalize()?;
    // v runs down in glTF: a texture seen unmirrored turns the other way round than its triangle.
    Some((direction, if twice_area < 0.0 { Hand::Right } else { Hand::Left }))
}

/// The first vertex with the same position, normal and texture coordinates, for every vertex.
fn weld(primitive: &Primitive, uv: &[Vec2]) -> Vec<u32> {
    // Adding zero makes -0 and 0 one key.
    let bits3 = |v: Vec3| (v + Vec3::ZERO).to_array().map(f32::to_bits);
    let bits2 = |v: Vec2| (v + Vec2::ZERO).to_array().map(f32::to_bits);
    let mut first = HashMap::with_capacity(uv.len());
    (0..uv.len())
        .map(|i| {
            let key = (bits3(primitive.positions[i]), bits3(primitive.normals[i]), bits2(uv[i]));
            *first.entry(key).or_insert(i as u32)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit square facing +Z, its texture upright (u to the right, v down), optionally mirrored left to right.
    fn square(mirrored: bool) -> (Primitive, Vec<Vec2>) {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let u = |x: f32| if mirrored { 1.0 - x } else { x };
        let uv = positions.iter().map(|p| Vec2::new(u(p.x), 1.0 - p.y)).collect();
        let normals = vec![Vec3::Z; 4];
        (Primitive { positions, normals, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Primitive::default() }, uv)
    }

    #[test]
    fn the_tangent_follows_u_and_its_bitangent_opposes_v() {
        let (mut primitive, uv) = square(false);
        generate(&mut primitive, &uv);
        assert_eq!(primitive.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
        let (mut primitive, uv) = square(true);
        generate(&mut primitive, &uv);
        assert_eq!(primitive.tangents, [Vec4::new(-1.0, 0.0, 0.0, -1.0); 4]);
    }

    #[test]
    fn vertices_are_doubled_where_the_hand_changes_and_only_there() {
        // Two squares side by side, the texture mirrored at their common edge.
        let positions: Vec<Vec3> = (0..6).map(|i| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
        let uv: Vec<Vec2> = positions.iter().map(|p| Vec2::new((p.x - 1.0).abs(), 1.0 - p.y)).collect();
        let normals = vec![Vec3::Z; 6];
        let triangles = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];
        let mut primitive = Primitive { positions, normals, triangles, ..Primitive::default() };
        generate(&mut primitive, &uv);
        assert_eq!(primitive.positions.len(), 8);
        for triangle in &primitive.triangles {
            let expected = match triangle.iter().all(|v| primitive.positions[*v as usize].x <= 1.0) {
                true => Vec4::new(-1.0, 0.0, 0.0, -1.0),
                false => Vec4::new(1.0, 0.0, 0.0, 1.0),
            };
            triangle.iter().for_each(|v| assert_eq!(primitive.tangents[*v as usize], expected));
        }
    }

    #[test]
    fn textures_without_extent_still_give_unit_tangents() {
        let (mut primitive, _) = square(false);
        generate(&mut primitive, &[Vec2::ZERO; 4]);
        for (tangent, normal) in primitive.tangents.iter().zip(&primitive.normals) {
            assert!((tangent.truncate().length() - 1.0).abs() < 1e-6 && tangent.truncate().dot(*normal).abs() < 1e-6);
        }
    }
}
