//! The ray-query kernels against our own traversal, on devices that have ray query.

use crate::common::{Random, TestContext};
use crate::meshes::{Mesh, cube, direction, point, ray, soup, sphere};
use crate::trace::cast_by;
use glam::UVec3;
use linklight::gpu::shaders::types::{Hit, Ray};
use linklight::stages::bvh::Bvh;
use linklight::stages::trace::{NO_HIT, OpaqueSurfaces, Tracer};

/// Hits by both; `None` without ray query.
fn cast_both(context: &TestContext, mesh: &Mesh, rays: &[Ray]) -> Option<[(Vec<Hit>, Vec<u32>); 2]> {
    let positions = context.upload("test/positions", &mesh.positions).unwrap();
    let triangles: Vec<UVec3> = mesh.triangles.iter().map(|&t| t.into()).collect();
    let triangles = context.upload("test/triangles", &triangles).unwrap();
    let structure = context.acceleration_structure("test/structure", &positions, &triangles).unwrap()?;
    let mut recorder = context.recorder("test").unwrap();
    recorder.build_acceleration_structure(&structure, &positions, &triangles);
    recorder.submit().unwrap();
    let bvh = Bvh::build(context, &mesh.positions, &mesh.triangles).unwrap();
    let opaque = OpaqueSurfaces::new(context).unwrap();
    let tracers = [Tracer::compute(&bvh, &opaque), Tracer::ray_query(&structure, &opaque)];
    Some(tracers.map(|tracer| cast_by(context, &tracer, rays)))
}

#[test]
fn both_tracers_agree() {
    let context = TestContext::new();
    let mut random = Random(21);
    for mesh in [cube(1), sphere(13, 29), soup(1009, 0.3, &mut random)] {
        let mut rays: Vec<Ray> = (0..4099).map(|_| ray(1.5 * point(&mut random), direction(&mut random))).collect();
        rays.iter_mut().step_by(3).for_each(|ray| ray.t_max = 0.5);
        rays.iter_mut().step_by(7).for_each(|ray| ray.t_max = -1.0);
        let Some([(ours, our_visibility), (theirs, their_visibility)]) = cast_both(&context, &mesh, &rays) else {
            println!("skipped: this device has no ray query");
            return;
        };
        assert!(ours.iter().filter(|hit| hit.triangle != NO_HIT).count() > 500, "too few hits to tell");
        // Rays through edges may fall either way.
        let mut differing = 0;
        for (ours, theirs) in ours.iter().zip(&theirs) {
            let same = ours.triangle == theirs.triangle && ours.barycentrics.abs_diff_eq(theirs.barycentrics, 1e-3);
            let near = (ours.t - theirs.t).abs() < 1e-4 * (1.0 + ours.t.abs());
            differing += u32::from(!((ours.t == theirs.t || near) && (same || ours.triangle != NO_HIT)));
            differing += u32::from(!same && !near);
        }
        assert!(differing <= 2, "{differing} of {} hits differ", rays.len());
        let differing = our_visibility.iter().zip(&their_visibility).filter(|(a, b)| a != b).count();
        assert!(differing <= 2, "{differing} of {} visibilities differ", rays.len());
        let same = ours.iter().zip(&theirs).filter(|(a, b)| a.triangle == b.triangle).count();
        assert!(same * 1000 >= rays.len() * 998, "{same} of {} triangles and sides agree", rays.len());
    }
}

#[test]
fn an_empty_scene_is_empty_for_both() {
    let context = TestContext::new();
    let nothing = Mesh { positions: Vec::new(), triangles: Vec::new() };
    let rays = [ray(glam::Vec3::ZERO, glam::Vec3::X)];
    for (hits, visibility) in cast_both(&context, &nothing, &rays).into_iter().flatten() {
        assert!(hits[0].triangle == NO_HIT && visibility == [1]);
    }
}
