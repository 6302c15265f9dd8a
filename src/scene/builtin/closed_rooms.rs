//! Two closed rooms side by side, one of them lit: what light the dark one has came through the wall.

use super::gallery::{add, looking, material};
use crate::scene::shapes::Shape;
use crate::scene::{Camera, Node, Projection, Scene};
use glam::Vec3;

/// What can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClosedRooms {
    /// Between the rooms, millimetres.
    pub wall: u32,
    /// Walls are seen, and lit, from both sides. Without any thickness both rooms then share one polygon.
    pub two_sided: bool,
}

/// Thickest wall, millimetres.
pub const MAX_WALL: u32 = 1000;
/// Metres along each axis.
const ROOM: Vec3 = Vec3::new(3.0, 2.5, 3.0);
const LAMP_HALF_SIDE: f32 = 0.4;
/// W m^-2 sr^-1.
const LAMP_RADIANCE: f32 = 10.0;

impl Default for ClosedRooms {
    fn default() -> Self {
        Self { wall: 50, two_sided: false }
    }
}

impl ClosedRooms {
    /// `wall=MM` and `sides=one|two`, joined by `&`; `None` for anything else.
    pub fn parse(parameters: &str) -> Option<Self> {
        let mut rooms = Self::default();
        for parameter in parameters.split('&').filter(|parameter| !parameter.is_empty()) {
            match parameter.split_once('=')? {
                ("wall", mm) => rooms.wall = mm.parse().ok().filter(|mm| *mm <= MAX_WALL)?,
                ("sides", "one") => rooms.two_sided = false,
                ("sides", "two") => rooms.two_sided = true,
                _ => return None,
            }
        }
        Some(rooms)
    }

    /// The lit room lies towards +x. The cameras `main` (in the dark room) and `lit` are mirror images.
    pub fn scene(self) -> Scene {
        let mut white = material("white", [0.7; 3], 0.0, 1.0);
        white.double_sided = self.two_sided;
        let mut lamp = material("lamp", [0.0; 3], 0.0, 1.0);
        lamp.emission = Vec3::splat(LAMP_RADIANCE);
        let mut scene = Scene { name: "closed-rooms".into(), materials: vec![white, lamp], ..Scene::default() };
        let half_wall = 0.5e-3 * self.wall as f32;
        // Where walls lie in one place, the lit room's comes first: rays take the first of several at one distance.
        for (name, side) in [("lit room", 1.0), ("dark room", -1.0)] {
            let (near, far) = (side * half_wall, side * (half_wall + ROOM.x));
            let low = Vec3::new(near.min(far), 0.0, -0.5 * ROOM.z);
            let high = Vec3::new(near.max(far), ROOM.y, 0.5 * ROOM.z);
            let shares_wall = self.two_sided && self.wall == 0 && side < 0.0;
            add(&mut scene, name, 0, if shares_wall { without_wall(low, high) } else { Shape::room(low, high) });
        }
        for (name, side) in [("main", -1.0), ("lit", 1.0)] {
            let eye = Vec3::new(side * (half_wall + 0.9 * ROOM.x), 0.55 * ROOM.y, 0.4 * ROOM.z);
            let target = Vec3::new(side * half_wall, 0.4 * ROOM.y, -0.15 * ROOM.z);
            let projection = Projection::Perspective { fov_y: 70.0f32.to_radians(), near: 0.05, far: None };
            scene.cameras.push(Camera { name: name.into(), projection });
            let camera = Some(scene.cameras.len() as u32 - 1);
            let transform = looking(eye.to_array(), target.to_array());
            scene.nodes.push(Node { name: name.into(), transform, camera, ..Node::default() });
        }
        let at = Vec3::new(half_wall + 0.5 * ROOM.x, ROOM.y - 0.01, 0.0);
        let corner = |x: f32, z: f32| at + LAMP_HALF_SIDE * Vec3::new(x, 0.0, z);
        let down = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        add(&mut scene, "lamp", 1, Shape::quad(down));
        scene
    }
}

/// A room seen from inside, open towards +x.
fn without_wall(low: Vec3, high: Vec3) -> Shape {
    let mut room = Shape::room(low, high);
    room.triangles.retain(|corners| corners.iter().any(|&vertex| room.positions[vertex as usize].x < high.x));
    let mut kept = Shape::default();
    for corners in &room.triangles {
        let corners = corners.map(|vertex| {
            let v = vertex as usize;
            kept.vertex(room.positions[v], room.normals[v], room.uv[v])
        });
        kept.triangle(corners);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::geometry::Geometry;

    #[test]
    fn parameters_are_understood_or_refused() {
        assert_eq!(ClosedRooms::parse(""), Some(ClosedRooms::default()));
        assert_eq!(ClosedRooms::parse("wall=0&sides=two"), Some(ClosedRooms { wall: 0, two_sided: true }));
        for bad in ["wall", "wall=-1", "wall=1001", "sides=three", "door=open"] {
            assert_eq!(ClosedRooms::parse(bad), None, "{bad}");
        }
    }

    /// Every edge of a room has a triangle on both sides, and all triangles look inwards.
    #[test]
    fn rooms_are_closed() {
        for (wall, two_sided, walls) in [(0, false, 12), (0, true, 11), (80, true, 12)] {
            let scene = ClosedRooms { wall, two_sided }.scene();
            let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
            assert_eq!(geometry.triangles.len(), 2 * (walls + 1));
            let area = |material: u32| -> f32 {
                let of_material = |(_, part): &(&[u32; 3], &u32)| geometry.parts[**part as usize].material == material;
                let triangles = geometry.triangles.iter().zip(&geometry.triangle_part).filter(of_material);
                triangles
                    .map(|(corners, _)| {
                        let [a, b, c] = corners.map(|vertex| geometry.local_positions[vertex as usize]);
                        0.5 * (b - a).cross(c - a).length()
                    })
                    .sum()
            };
            let room = 2.0 * (ROOM.x * ROOM.y + ROOM.y * ROOM.z + ROOM.z * ROOM.x);
            let shared = if walls == 11 { ROOM.y * ROOM.z } else { 0.0 };
            assert!((area(0) - (2.0 * room - shared)).abs() < 1e-3);
            let lamp = &geometry.parts.iter().find(|part| part.material == 1).unwrap();
            assert_eq!(geometry.local_normals[lamp.vertex_offset as usize], Vec3::NEG_Y);
        }
    }
}
