//! How far senders reach: nodes above a plate's leaves end where the plate ends.

use crate::common::TestContext;
use crate::common::scenes::{lambert, parallelogram, scene};
use crate::fixture::{Fixture, winners};
use crate::twins;
use glam::{Quat, Vec3};
use linklight::methods::implicit_visibility::{Frames, Settings};
use linklight::scene::Material;

/// A plate turned aside over a small floor, linked by coarse nodes: bins are filled where their directions meet
/// it, and only there.
#[test]
fn nodes_of_a_mesh_in_rows_end_where_it_ends() {
    let context = TestContext::new();
    let material = Material { double_sided: false, ..lambert(Vec3::splat(0.5)) };
    let floor = parallelogram(Vec3::new(-0.3, 0.0, 0.3), Vec3::X * 0.6, Vec3::NEG_Z * 0.6, 3, 0);
    let turn = Quat::from_rotation_y(0.5);
    let (corner, u, v) = (turn * Vec3::new(-0.5, 1.0, -0.7), turn * Vec3::X, turn * (Vec3::Z * 1.4));
    let plate = parallelogram(corner, u, v, 7, 0);
    let fixture = Fixture::new(&context, scene(vec![material], vec![floor, plate], &[]), None);
    for frames in [Frames::World, Frames::Surface] {
        let settings = Settings { bins: 12, refinement: 16.0, fill_holes: false, frames, ..Settings::default() };
        let method = fixture.linked(&context, settings);
        let receivers = context.download(&method.linking().receivers).unwrap();
        let leaves = method.trees().topology.leaf_count();
        let (mut full, mut empty, mut wrong, mut by_nodes) = (0, 0, 0, 0);
        for (row, at) in winners(&context, &method).iter().zip(&receivers).filter(|(_, at)| at.normal.y > 0.5) {
            for (&winner, direction) in row.iter().zip(twins::directions(settings.bins)) {
                let direction = Quat::from_array(at.frame) * direction.as_vec3();
                if direction.y < 0.05 {
                    continue;
                }
                let offset = at.origin + direction * ((1.0 - at.origin.y) / direction.y) - corner;
                let place = [offset.dot(u), offset.dot(v) / 1.4 / 1.4];
                // How far inside of the plate; its rims are left to rounding.
                let inside = place.map(|x| x.min(1.0 - x)).into_iter().fold(f32::MAX, f32::min);
                if inside.abs() < 0.04 {
                    continue;
                }
                let (is_on, is_full) = (inside > 0.0, winner != twins::EMPTY);
                by_nodes += usize::from(is_full && winner & !twins::BACK >= leaves);
                *(if is_on { &mut full } else { &mut empty }) += 1;
                wrong += usize::from(is_on != is_full);
            }
        }
        println!("{frames:?}: {full} bins on the plate, {empty} beside it, {by_nodes} by nodes, {wrong} wrong");
        assert!(full > 100 && empty > 1000 && 2 * by_nodes > full, "{full} {empty} {by_nodes}");
        assert_eq!(wrong, 0);
    }
}
