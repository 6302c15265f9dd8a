//! Glossy leaves against plain versions: their lobes, what they send of direct light and of what arrived, what the eye sees.

use crate::common::TestContext;
use crate::common::lobe::{brdf, diffuse_albedo, even_albedo, specular_albedo};
use crate::common::scenes::{lambert, light, parallelogram, scene};
use crate::fixture::Fixture;
use crate::support::{by_node, entries, prepare, settings, solve};
use crate::twins;
use glam::{DVec3, UVec2, Vec3, Vec4};
use linklight::gpu::shaders::types::{HierarchyLeaf, LeafGloss};
use linklight::methods::antiradiance::{Antiradiance, Settings};
use linklight::scene::camera::View;
use linklight::scene::pose::Pose;
use linklight::scene::{LightKind, Material, Scene};
use linklight::stages::emitters::EmitterChoice;
use linklight::stages::hierarchy::NONE;
use linklight::stages::world::World;
use std::f64::consts::PI;

const LAMP: Vec3 = Vec3::new(0.4, 1.8, 0.3);
const COLOR: Vec3 = Vec3::new(0.9, 0.6, 0.3);

/// A metal floor and a white wall, lit by a point or by a small plate of the same intensity.
fn metal_floor(plate: bool) -> Scene {
    let metal = Material {
        base_color: Vec4::new(COLOR.x, COLOR.y, COLOR.z, 1.0),
        metallic: 1.0,
        roughness: 0.6,
        double_sided: true,
        ..Material::default()
    };
    let glow = Material { emission: Vec3::splat(5.0 / 0.0004), double_sided: false, ..lambert(Vec3::ZERO) };
    let floor = parallelogram(Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, 6, 0);
    let wall = parallelogram(Vec3::new(-2.0, 0.0, -2.01), Vec3::X * 4.0, Vec3::Y * 3.0, 5, 1);
    let mut primitives = vec![floor, wall];
    let lamps = if plate {
        // Looks down, 2 cm a side.
        primitives.push(parallelogram(LAMP - Vec3::new(0.01, 0.0, 0.01), Vec3::X * 0.02, Vec3::Z * 0.02, 1, 2));
        vec![]
    } else {
        vec![(light(LightKind::Point, 5.0), LAMP, Vec3::NEG_Y)]
    };
    scene(vec![metal, lambert(Vec3::splat(0.7)), glow], primitives, &lamps)
}

fn glossy_fixture(context: &TestContext, scene: Scene) -> Fixture {
    let mut fixture = Fixture::new(context, scene, None);
    let pose = Pose::rest(&fixture.scene);
    fixture.world = World::new(context, &fixture.scene, &fixture.geometry, &pose, &fixture.environment, false).unwrap();
    fixture
}

/// What a method's glossy leaves are made of.
struct State {
    leaves: Vec<HierarchyLeaf>,
    glossy: Vec<u32>,
    lobes: Vec<LeafGloss>,
    directions: Vec<Vec3>,
    norms: Vec<f32>,
    incident: Vec<Vec3>,
    parents: Vec<u32>,
    scales: Vec<f32>,
    means: Vec<Vec3>,
    peaks: Vec<f32>,
}

impl State {
    fn of(context: &TestContext, method: &Antiradiance) -> Self {
        let tables = method.tables();
        let nodes = context.download(&method.hierarchy().nodes).unwrap();
        Self {
            leaves: context.download(&method.hierarchy().leaves).unwrap(),
            glossy: context.download(&tables.gloss.leaves).unwrap(),
            lobes: context.download(&tables.gloss.lobes).unwrap(),
            directions: method.bins().bins.directions.clone(),
            norms: context.download(&tables.cosine_norms).unwrap(),
            incident: entries(context, tables, |window| &window.incident),
            parents: nodes.iter().map(|node| node.parent).collect(),
            scales: context.download(&tables.scales).unwrap(),
            means: context.download(&tables.means).unwrap(),
            peaks: by_node(&context.download(&tables.peaks).unwrap(), tables.bin_count),
        }
    }

    /// No lobe is narrower than a bin.
    fn alpha(&self, leaf: usize) -> f64 {
        (f64::from(self.lobes[leaf].alpha).powi(2) + 1.0 / self.directions.len() as f64).sqrt()
    }

    /// Radiance towards `eye` of what arrived.
    fn radiance(&self, leaf: usize, eye: DVec3, undershoot: f32) -> DVec3 {
        let (own, m, lobe) = (&self.leaves[leaf], self.directions.len(), &self.lobes[leaf]);
        let side = usize::from(own.normal.as_dvec3().dot(eye) <= 0.0);
        let normal = own.normal.as_dvec3() * [1.0, -1.0][side];
        let (f0, f90, alpha) = (lobe.f0.as_dvec3(), f64::from(lobe.f90), self.alpha(leaf));
        let (mut sum, mut weights) = (DVec3::ZERO, DVec3::ZERO);
        for (bin, w) in self.directions.iter().enumerate().filter(|(_, w)| normal.dot(w.as_dvec3()) <= 0.0) {
            let held = twins::discrete_cosine(own.normal.dot(*w), self.norms[leaf], m as u32);
            let weight = f64::from(held) * brdf(f0, f90, alpha, normal, eye, -w.as_dvec3());
            let parent = self.parents[own.node as usize] as usize;
            let arriving = self.incident[own.node as usize * m + bin] + self.incident[parent * m + bin];
            let lowest = -undershoot * self.peaks[leaf * m + bin].max(1.0) * self.means[2 * leaf + side];
            sum += weight * arriving.max(lowest).as_dvec3();
            weights += weight;
        }
        sum *= f64::from(self.scales[2 * leaf + side]);
        (specular_albedo(f0, f90, alpha, normal.dot(eye)) * sum / weights.max(DVec3::splat(1e-20))).max(DVec3::ZERO)
    }
}

/// Largest difference, of the largest value.
fn difference(found: &[Vec3], expected: &[DVec3]) -> f64 {
    let largest = expected.iter().map(|e| e.max_element()).fold(1e-30, f64::max);
    let error = found.iter().zip(expected).map(|(f, e)| (f.as_dvec3() - e).abs().max_element());
    error.fold(0.0, |a, b| if b.is_nan() { f64::INFINITY } else { a.max(b) }) / largest
}

#[test]
fn lobes_and_what_they_reflect_agree_with_their_twins() {
    let context = TestContext::new();
    let fixture = glossy_fixture(&context, metal_floor(false));
    for undershoot in [0.1, 1e9] {
        let mut method = prepare(&context, &fixture, Settings { undershoot, ..settings(128) });
        solve(&context, &mut method, &fixture, 2);
        let (state, tables) = (State::of(&context, &method), method.tables());
        assert_eq!(state.glossy.len(), 49, "the floor alone");
        for &leaf in &state.glossy {
            let lobe = &state.lobes[leaf as usize];
            assert!((lobe.f0 - COLOR).abs().max_element() < 1e-5 && (lobe.f90 - 1.0).abs() < 1e-5);
            assert!((lobe.alpha - 0.36).abs() < 1e-5, "{}", lobe.alpha);
        }

        // Direct light of the point, then what came along links.
        let base = context.download(&tables.gloss.base).unwrap();
        let positions = context.download(&method.elements().positions).unwrap();
        let (mut direct, mut reflected) = (Vec::new(), Vec::new());
        for &leaf in &state.glossy {
            let (leaf, own) = (leaf as usize, &state.leaves[leaf as usize]);
            for w in state.directions.iter().map(|w| w.as_dvec3()) {
                let normal = own.normal.as_dvec3();
                let offset = (LAMP - positions[own.element as usize]).as_dvec3();
                let (to_lamp, squared) = (offset.normalize(), offset.length_squared());
                let lobe = &state.lobes[leaf];
                let lit = if normal.dot(w) > 0.0 {
                    let value = brdf(lobe.f0.as_dvec3(), 1.0, state.alpha(leaf), normal, w, to_lamp);
                    5.0 / squared * normal.dot(to_lamp) * value
                } else {
                    DVec3::ZERO
                };
                direct.push(lit);
                reflected.push(state.radiance(leaf, w, undershoot));
            }
        }
        println!("direct light in lobes differs by {:.1e}", difference(&base, &direct));
        assert!(difference(&base, &direct) < 1e-3);

        let mut recorder = context.recorder("test").unwrap();
        tables.gloss.reflect(&mut recorder, tables, method.hierarchy(), method.bins(), false, 1.0);
        recorder.submit().unwrap();
        let specular = context.download(&tables.gloss.specular).unwrap();
        let linked: Vec<Vec3> = specular.iter().zip(&base).map(|(all, base)| *all - *base).collect();
        println!("undershoot {undershoot}: linked light in lobes differs by {:.1e}", difference(&linked, &reflected));
        assert!(difference(&linked, &reflected) < 1e-3);
        // Another lobe would be seen.
        let wider: Vec<DVec3> = reflected.iter().map(|radiance| 1.01 * *radiance).collect();
        assert!(difference(&linked, &wider) > 5e-3);
    }
}

/// A small plate with the intensity of the point sends glossy leaves the same light, by shadow rays.
#[test]
fn a_small_plate_shines_in_lobes_like_a_point() {
    let context = TestContext::new();
    let base_of = |plate: bool| {
        let fixture = glossy_fixture(&context, metal_floor(plate));
        let mut method = prepare(&context, &fixture, Settings { emitters: EmitterChoice::Sampled, ..settings(128) });
        solve(&context, &mut method, &fixture, 1);
        let state = State::of(&context, &method);
        let positions = context.download(&method.elements().positions).unwrap();
        let base = context.download(&method.tables().gloss.base).unwrap();
        let cosines: Vec<f32> = state
            .glossy
            .iter()
            .map(|&leaf| (LAMP - positions[state.leaves[leaf as usize].element as usize]).normalize().y)
            .collect();
        (base, cosines)
    };
    let ((point, _), (plate, cosines)) = (base_of(false), base_of(true));
    let largest = point.iter().map(|e| e.max_element()).fold(0.0, f32::max);
    for (k, (point, plate)) in point.iter().zip(&plate).enumerate() {
        // The plate is Lambertian, the point is not.
        let expected = *point * cosines[k / 128];
        assert!((*plate - expected).abs().max_element() < 0.02 * largest, "{plate} for {expected}");
    }
    assert!(largest > 0.0);
}

#[test]
fn the_eye_sees_the_lobes() {
    let context = TestContext::new();
    let fixture = glossy_fixture(&context, metal_floor(false));
    let mut method = prepare(&context, &fixture, Settings { undershoot: 1e9, ..settings(128) });
    let indirect = solve(&context, &mut method, &fixture, 2).indirect;
    let view = View::towards(Vec3::new(0.5, 1.5, 2.5), Vec3::ZERO, 0.8, UVec2::new(64, 64));
    let mut recorder = context.recorder("test").unwrap();
    method.look(&mut recorder, &fixture.world, &view);
    recorder.submit().unwrap();
    let shown = context.download(method.shown_irradiance().1).unwrap();
    let (state, positions) = (State::of(&context, &method), context.download(&fixture.world.positions).unwrap());
    let albedo = context.download(&method.elements().albedo).unwrap();
    let (mut found, mut expected) = (Vec::new(), Vec::new());
    for &leaf in &state.glossy {
        let (own, lobe) = (&state.leaves[leaf as usize], &state.lobes[leaf as usize]);
        let eye = (view.position - positions[own.element as usize]).as_dvec3().normalize();
        let element = own.element as usize;
        let diffuse = albedo[element].as_dvec3();
        let (f0, cos_eye) = (lobe.f0.as_dvec3(), own.normal.as_dvec3().dot(eye));
        let own = diffuse_albedo(diffuse, f0, 1.0, cos_eye) * indirect[element].as_dvec3();
        let sent = own + PI * state.radiance(leaf as usize, eye, 1e9);
        expected.push(sent / even_albedo(diffuse, f0, 1.0, lobe.alpha.into(), cos_eye).max(DVec3::splat(1e-4)));
        found.push(shown[element]);
    }
    assert!(difference(&found, &expected) < 1e-3, "{}", difference(&found, &expected));
    assert!(found.iter().any(|e| e.x > 0.0));
    // All others are as they were.
    let glossy: Vec<u32> = state.glossy.iter().map(|&leaf| state.leaves[leaf as usize].element).collect();
    assert!((0..indirect.len()).all(|e| glossy.contains(&(e as u32)) || shown[e] == indirect[e]));
    assert!(state.leaves.iter().all(|leaf| leaf.node != NONE));
}

/// The small plate as it shines in the floor: like a point of its intensity.
#[test]
fn the_eye_sees_sampled_emitters_in_lobes() {
    let context = TestContext::new();
    let fixture = glossy_fixture(&context, metal_floor(true));
    let mut method = prepare(&context, &fixture, Settings { emitters: EmitterChoice::Sampled, ..settings(128) });
    let direct = solve(&context, &mut method, &fixture, 0).direct;
    let view = View::towards(Vec3::new(0.5, 1.5, 2.5), Vec3::ZERO, 0.8, UVec2::new(64, 64));
    let mut recorder = context.recorder("test").unwrap();
    method.look(&mut recorder, &fixture.world, &view);
    recorder.submit().unwrap();
    let shown = context.download(method.shown_irradiance().0).unwrap();
    let state = State::of(&context, &method);
    let (positions, albedo) =
        (context.download(&method.elements().positions).unwrap(), context.download(&method.elements().albedo).unwrap());
    let (mut found, mut expected, mut even) = (Vec::new(), Vec::new(), Vec::new());
    for &leaf in &state.glossy {
        let (own, lobe) = (&state.leaves[leaf as usize], &state.lobes[leaf as usize]);
        let (element, normal, f0) = (own.element as usize, own.normal.as_dvec3(), lobe.f0.as_dvec3());
        let offset = (LAMP - positions[element]).as_dvec3();
        let (to_lamp, squared) = (offset.normalize(), offset.length_squared());
        let arriving = 5.0 / squared * normal.dot(to_lamp) * to_lamp.y;
        let eye = (view.position - positions[element]).as_dvec3().normalize();
        let (cos_eye, own_albedo) = (normal.dot(eye), albedo[element].as_dvec3());
        let glossy = PI * arriving * brdf(f0, 1.0, state.alpha(leaf as usize), normal, eye, to_lamp);
        let sent = diffuse_albedo(own_albedo, f0, 1.0, cos_eye) * arriving + glossy;
        expected.push(sent / even_albedo(own_albedo, f0, 1.0, lobe.alpha.into(), cos_eye).max(DVec3::splat(1e-4)));
        found.push(shown[element]);
        even.push(direct[element]);
    }
    println!(
        "sampled light in lobes differs by {:.1e}, even light by {:.1e}",
        difference(&found, &expected),
        difference(&even, &expected)
    );
    assert!(difference(&found, &expected) < 0.02);
    assert!(difference(&even, &expected) > 0.1, "the lobe makes a difference");
}

/// A plate that sends along links shines in the floor as what arrived bin by bin says, with bounces as without.
#[test]
fn the_eye_sees_linked_emitters_in_lobes() {
    let context = TestContext::new();
    let fixture = glossy_fixture(&context, metal_floor(true));
    let linked = Settings { emitters: EmitterChoice::Linked, undershoot: 1e9, ..settings(128) };
    let mut method = prepare(&context, &fixture, linked);
    let view = View::towards(Vec3::new(0.5, 1.5, 2.5), Vec3::ZERO, 0.8, UVec2::new(64, 64));
    let direct = solve(&context, &mut method, &fixture, 0).direct;
    // Without bounces the tables hold what arrived directly.
    let state = State::of(&context, &method);
    let shown = |method: &Antiradiance| {
        let mut recorder = context.recorder("test").unwrap();
        method.look(&mut recorder, &fixture.world, &view);
        recorder.submit().unwrap();
        let (direct, indirect) = method.shown_irradiance();
        (context.download(direct).unwrap(), context.download(indirect).unwrap())
    };
    let (without, none) = shown(&method);
    solve(&context, &mut method, &fixture, 2);
    let (with, some) = shown(&method);
    assert!(with == without, "bounces change direct light");
    let power = |light: &[Vec3]| light.iter().map(|e| e.x).sum::<f32>();
    assert!(power(&none) == 0.0 && power(&some) > 0.0);

    let positions = context.download(&fixture.world.positions).unwrap();
    let albedo = context.download(&method.elements().albedo).unwrap();
    let (mut found, mut expected, mut even) = (Vec::new(), Vec::new(), Vec::new());
    for &leaf in &state.glossy {
        let (own, lobe) = (&state.leaves[leaf as usize], &state.lobes[leaf as usize]);
        let element = own.element as usize;
        let eye = (view.position - positions[element]).as_dvec3().normalize();
        let (diffuse, f0, cos_eye) = (albedo[element].as_dvec3(), lobe.f0.as_dvec3(), own.normal.as_dvec3().dot(eye));
        let sent = diffuse_albedo(diffuse, f0, 1.0, cos_eye) * direct[element].as_dvec3()
            + PI * state.radiance(leaf as usize, eye, 1e9);
        expected.push(sent / even_albedo(diffuse, f0, 1.0, lobe.alpha.into(), cos_eye).max(DVec3::splat(1e-4)));
        found.push(without[element]);
        even.push(direct[element]);
    }
    let [lobes, evenly] = [&found, &even].map(|light| difference(light, &expected));
    println!("linked light in lobes differs by {lobes:.1e}, even light by {evenly:.1e}");
    assert!(lobes < 1e-3 && evenly > 0.1, "{lobes}, {evenly}");
}
