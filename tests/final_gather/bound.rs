//! The oracle's bound holds: no point of a sender brings more, whatever the receiver's gloss.

use crate::common::{Random, TestContext};
use glam::Vec3;
use linklight::gpu::shaders::probe::{ReceiverBound, ReceiverBoundParams};
use linklight::gpu::shaders::types::{BoundCase, BoundResult};
use linklight::stages::sender_tree::{corners, parallelogram};

fn unit(random: &mut Random) -> Vec3 {
    loop {
        let v = Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
        if v.length() > 0.1 && v.length() < 1.0 {
            return v.normalize();
        }
    }
}

#[test]
fn no_point_of_a_sender_brings_more_than_its_bound() {
    let context = TestContext::new();
    let random = &mut Random(91);
    let cases: Vec<BoundCase> = (0..4000)
        .map(|i| {
            let normal = unit(random);
            let mut to_eye = unit(random);
            if to_eye.dot(normal) < 0.0 {
                to_eye = -to_eye;
            }
            // Half of the senders stand where the eye is mirrored.
            let mirrored = 2.0 * to_eye.dot(normal) * normal - to_eye;
            let towards = if i % 2 == 0 { (mirrored + 0.2 * unit(random)).normalize() } else { unit(random) };
            let distance = 0.3 + 4.0 * random.unit();
            let side = (0.02 + random.unit()) * 0.4 * distance;
            let leaf = parallelogram(distance * towards, side * unit(random), side * unit(random));
            let radius = corners(&leaf).iter().map(|p| p.distance(leaf.centre)).fold(0.0, f32::max);
            let is_glossy = i % 4 != 3;
            let gloss = if is_glossy { Vec3::new(0.9, 0.5, 0.04) } else { Vec3::ZERO };
            BoundCase {
                normal,
                to_eye,
                albedo: Vec3::new(random.unit(), random.unit(), random.unit()),
                f0: gloss,
                f90: f32::from(u8::from(is_glossy)),
                alpha: 0.01 + 0.9 * random.unit().powi(2),
                leaf,
                radius,
            }
        })
        .collect();
    let buffer = context.upload("test/cases", &cases).unwrap();
    let results = context.buffer("test/results", cases.len()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = ReceiverBoundParams { case_count: cases.len() as u32, point_count: 256 };
    recorder.dispatch(&ReceiverBound { cases: &buffer, results: &results, params }, cases.len());
    recorder.submit().unwrap();
    let results: Vec<BoundResult> = context.download(&results).unwrap();
    let mut tightness = Vec::new();
    for (case, result) in cases.iter().zip(&results) {
        assert!(result.largest <= result.bound * 1.001, "{result:?} for {case:?}");
        if result.largest > 0.0 && result.bound < 1e30 {
            tightness.push(result.bound / result.largest);
        }
    }
    tightness.sort_by(f32::total_cmp);
    let median = tightness[tightness.len() / 2];
    println!(
        "{} senders that are seen: bounds are {median:.2} times the largest radiance in the median",
        tightness.len()
    );
    assert!(tightness.len() > 500 && median < 20.0, "a bound that is never near would pass too: {median}");
}
