//! The oracle's bound holds: no point of a sender brings more, whatever the receiver's gloss; and it is no looser than it
//! says.

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

/// Receivers at the origin, three of four glossy, and senders `size` of their distance wide and long, half of them where
/// the eye is mirrored.
fn cases(random: &mut Random, size: impl Fn(f32) -> f32) -> Vec<BoundCase> {
    let case = |i| {
        let normal = unit(random);
        let mut to_eye = unit(random);
        if to_eye.dot(normal) < 0.0 {
            to_eye = -to_eye;
        }
        let mirrored = 2.0 * to_eye.dot(normal) * normal - to_eye;
        let towards = if i % 2 == 0 { (mirrored + 0.2 * unit(random)).normalize() } else { unit(random) };
        let distance = 0.3 + 4.0 * random.unit();
        let side = size(random.unit()) * distance;
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
    };
    (0..4000).map(case).collect()
}

fn bounds(cases: &[BoundCase]) -> Vec<BoundResult> {
    let context = TestContext::new();
    let buffer = context.upload("test/cases", cases).unwrap();
    let results = context.buffer("test/results", cases.len()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = ReceiverBoundParams { case_count: cases.len() as u32, point_count: 256 };
    recorder.dispatch(&ReceiverBound { cases: &buffer, results: &results, params }, cases.len());
    recorder.submit().unwrap();
    context.download(&results).unwrap()
}

/// Bounds of the senders that are seen in parts of the largest radiance, ascending, of those that `takes` takes.
fn tightness(cases: &[BoundCase], results: &[BoundResult], takes: impl Fn(&BoundCase) -> bool) -> Vec<f32> {
    let seen = cases.iter().zip(results).filter(|(case, r)| takes(case) && r.largest > 0.0 && r.bound < 1e30);
    let mut ratios: Vec<f32> = seen.map(|(_, result)| result.bound / result.largest).collect();
    ratios.sort_by(f32::total_cmp);
    ratios
}

#[test]
fn no_point_of_a_sender_brings_more_than_its_bound() {
    let cases = cases(&mut Random(91), |share| (0.02 + share) * 0.4);
    let results = bounds(&cases);
    for (case, result) in cases.iter().zip(&results) {
        assert!(result.largest <= result.bound * 1.001, "{result:?} for {case:?}");
    }
    let ratios = tightness(&cases, &results, |_| true);
    let median = ratios[ratios.len() / 2];
    println!("{} senders that are seen: bounds are {median:.2} times the largest radiance in the median", ratios.len());
    assert!(ratios.len() > 500 && median < 20.0, "a bound that is never near would pass too: {median}");
}

/// Of a sender of a ten-thousandth of its distance the bound is what it brings; where lobes and the Fresnel term part ways by
/// channel, somewhat more.
#[test]
fn of_small_senders_the_bound_is_what_they_bring() {
    let cases = cases(&mut Random(92), |_| 1e-4);
    let results = bounds(&cases);
    let is_clear = |case: &BoundCase| {
        let towards = case.leaf.centre.normalize();
        case.normal.dot(towards) > 0.1 && case.normal.dot(case.to_eye) > 0.1
    };
    for (is_glossy, limits) in [(false, [1.001, 1.02]), (true, [1.02, 2.0])] {
        let ratios = tightness(&cases, &results, |case| (case.f90 > 0.0) == is_glossy && is_clear(case));
        let [median, most] = [ratios[ratios.len() / 2], ratios[ratios.len() - 1]];
        println!("glossy {is_glossy}: {} seen, bounds {median:.4} in the median, {most:.4} at most", ratios.len());
        assert!(ratios.len() > 150 && median < limits[0] && most < limits[1], "{is_glossy}: {median}, {most}");
    }
}
