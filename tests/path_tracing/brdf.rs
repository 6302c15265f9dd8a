//! The material model's kernels against textbook formulas in double precision.

use crate::common::{Random, TestContext};
use glam::{DVec3, Vec2, Vec3};
use linklight::gpu::shaders::probe::{Brdf, BrdfParams};
use linklight::gpu::shaders::types::{BrdfCase, BrdfResult};
use std::f64::consts::{PI, TAU};

/// The model, arranged as its papers do.                                                  [Walter2007; Heitz2014]
pub struct Twin {
    pub albedo: DVec3,
    pub f0: DVec3,
    pub f90: f64,
    pub alpha: f64,
    pub normal: DVec3,
}

impl Twin {
    fn fresnel(&self, cos_half: f64) -> DVec3 {
        self.f0 + (DVec3::splat(self.f90) - self.f0) * (1.0 - cos_half).powi(5)
    }

    /// GGX, Walter Eq. 33 with the normal in place of theta.
    fn distribution(&self, halfway: DVec3) -> f64 {
        let cosine = self.normal.dot(halfway);
        if cosine <= 0.0 {
            return 0.0;
        }
        let a2 = self.alpha * self.alpha;
        a2 / (PI * (cosine * cosine * (a2 - 1.0) + 1.0).powi(2))
    }

    /// Smith's Lambda, Heitz Eq. 72.
    fn lambda(&self, direction: DVec3) -> f64 {
        let cosine = self.normal.dot(direction);
        let tan2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    pub fn value(&self, to_eye: DVec3, to_light: DVec3) -> DVec3 {
        let (cos_eye, cos_light) = (self.normal.dot(to_eye), self.normal.dot(to_light));
        if cos_light <= 0.0 {
            return DVec3::ZERO;
        }
        let halfway = (to_eye + to_light).normalize();
        let fresnel = self.fresnel(to_eye.dot(halfway));
        let masking = 1.0 / (1.0 + self.lambda(to_eye) + self.lambda(to_light));
        let specular = fresnel * self.distribution(halfway) * masking / (4.0 * cos_eye * cos_light);
        self.albedo / PI * (1.0 - fresnel.max_element()) + specular
    }

    /// Share of the specular lobe among the samples, as the kernel defines it.
    fn share(&self, cos_eye: f64) -> f64 {
        if self.f0 == DVec3::ZERO && self.f90 == 0.0 {
            return 0.0;
        }
        let fresnel = self.fresnel(cos_eye);
        let diffuse = self.albedo.element_sum() * (1.0 - fresnel.max_element());
        let specular = fresnel.element_sum();
        if diffuse <= 0.0 { 1.0 } else { (specular / (specular + diffuse)).clamp(0.1, 0.9) }
    }

    fn density(&self, to_eye: DVec3, to_light: DVec3) -> f64 {
        let share = self.share(self.normal.dot(to_eye));
        let halfway = (to_eye + to_light).normalize();
        // Visible normals, Heitz Eq. 3; their reflection, Walter Eq. 14.
        let visible =
            to_eye.dot(halfway) * self.distribution(halfway) / ((1.0 + self.lambda(to_eye)) * self.normal.dot(to_eye));
        let cosine = self.normal.dot(to_light).max(0.0);
        (1.0 - share) * cosine / PI + share * visible / (4.0 * to_eye.dot(halfway))
    }

    /// Radiance reflected to the eye under a uniform environment of radiance 1.
    pub fn directional_albedo(&self, to_eye: DVec3) -> DVec3 {
        self.albedo_within(to_eye, 2048)
    }

    /// The same over a grid of `side` by `side` directions.
    fn albedo_within(&self, to_eye: DVec3, side: u32) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for_sphere(side, |to_light, solid_angle| {
            sum += self.value(to_eye, to_light) * self.normal.dot(to_light).max(0.0) * solid_angle;
        });
        sum
    }

    fn case(&self, to_eye: DVec3, to_light: DVec3, lobe: f32, place: Vec2) -> BrdfCase {
        BrdfCase {
            albedo: self.albedo.as_vec3(),
            f0: self.f0.as_vec3(),
            f90: self.f90 as f32,
            alpha: self.alpha as f32,
            normal: self.normal.as_vec3(),
            to_eye: to_eye.as_vec3(),
            to_light: to_light.as_vec3(),
            lobe,
            place,
        }
    }
}

/// Midpoints of a grid of equal solid angles about +Z, `side` along the cosine and around.
fn for_sphere(side: u32, mut visit: impl FnMut(DVec3, f64)) {
    for row in 0..side {
        let z = 1.0 - 2.0 * (f64::from(row) + 0.5) / f64::from(side);
        let sine = (1.0 - z * z).sqrt();
        for column in 0..side {
            let phi = TAU * (f64::from(column) + 0.5) / f64::from(side);
            visit(DVec3::new(sine * phi.cos(), sine * phi.sin(), z), 4.0 * PI / f64::from(side * side));
        }
    }
}

fn run(context: &TestContext, cases: &[BrdfCase]) -> Vec<BrdfResult> {
    let buffer = context.upload("test/cases", cases).unwrap();
    let results = context.buffer("test/results", cases.len()).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = BrdfParams { case_count: cases.len() as u32 };
    recorder.dispatch(&Brdf { cases: &buffer, results: &results, params }, cases.len());
    recorder.submit().unwrap();
    context.download(&results).unwrap()
}

fn direction(random: &mut Random, lowest: f64) -> DVec3 {
    let z = lowest + (1.0 - lowest) * f64::from(random.unit());
    let (sin_phi, cos_phi) = (TAU * f64::from(random.unit())).sin_cos();
    let sine = (1.0 - z * z).sqrt();
    DVec3::new(sine * cos_phi, sine * sin_phi, z)
}

/// A rough dielectric, a metal, a mixture and a matte.
fn materials(alpha: f64) -> [Twin; 4] {
    let twin = |albedo: [f64; 3], f0: [f64; 3], f90| Twin {
        albedo: albedo.into(),
        f0: f0.into(),
        f90,
        alpha,
        normal: DVec3::Z,
    };
    [
        twin([0.8, 0.5, 0.2], [0.04; 3], 1.0),
        twin([0.0; 3], [0.95, 0.64, 0.54], 1.0),
        twin([0.3, 0.4, 0.1], [0.3, 0.2, 0.25], 0.7),
        twin([0.5, 0.6, 0.7], [0.0; 3], 0.0),
    ]
}

#[test]
fn value_and_density_are_those_of_the_papers() {
    let context = TestContext::new();
    let mut random = Random(7);
    let (mut cases, mut expected) = (Vec::new(), Vec::new());
    for alpha in [0.01, 0.1, 0.3, 1.0] {
        for mut twin in materials(alpha) {
            for _ in 0..500 {
                // The kernel must not prefer an axis.
                let turn = glam::DQuat::from_rotation_arc(DVec3::Z, direction(&mut random, -0.99));
                let (to_eye, to_light) = (turn * direction(&mut random, 0.05), turn * direction(&mut random, 0.05));
                twin.normal = turn * DVec3::Z;
                cases.push(twin.case(to_eye, to_light, 0.5, Vec2::splat(0.5)));
                expected.push((twin.value(to_eye, to_light), twin.density(to_eye, to_light)));
            }
        }
    }
    for ((case, found), (value, density)) in cases.iter().zip(run(&context, &cases)).zip(expected) {
        // Narrow lobes amplify the rounding of the directions themselves by 1 / alpha.
        let relative = 2e-6 / f64::from(case.alpha).min(0.1) + 1e-5;
        let near = |found: f64, wanted: f64| (found - wanted).abs() <= relative * wanted.abs() + 1e-6;
        let values = found.value.as_dvec3().to_array().into_iter().zip(value.to_array());
        assert!(values.clone().all(|(f, w)| near(f, w)), "{case:?}: value {} for {value}", found.value);
        assert!(near(f64::from(found.density), density), "{case:?}: density {} for {density}", found.density);
    }
}

#[test]
fn densities_integrate_to_one() {
    let context = TestContext::new();
    for alpha in [0.3, 1.0] {
        for (index, twin) in materials(alpha).iter().enumerate() {
            for cos_eye in [0.9f64, 0.2] {
                let to_eye = DVec3::new((1.0 - cos_eye * cos_eye).sqrt(), 0.0, cos_eye);
                let mut cases = Vec::new();
                for_sphere(512, |to_light, _| cases.push(twin.case(to_eye, to_light, 0.5, Vec2::splat(0.5))));
                let sum: f64 = run(&context, &cases).iter().map(|result| f64::from(result.density)).sum();
                let integral = sum * 4.0 * PI / cases.len() as f64;
                println!("material {index}, alpha {alpha}, cos {cos_eye}: {integral:.5}");
                assert!((integral - 1.0).abs() < 2e-3, "material {index}, alpha {alpha}, cos {cos_eye}: {integral}");
            }
        }
    }
}

/// What the displays take for the reflection of even light is the integral of the model.
#[test]
fn even_light_is_reflected_as_the_model_integrates_to() {
    let context = TestContext::new();
    let (mut cases, mut expected) = (Vec::new(), Vec::new());
    for alpha in [0.1, 0.25, 0.5, 1.0] {
        for mut twin in materials(alpha) {
            for cos_eye in [0.15f64, 0.5, 0.95] {
                let to_eye = DVec3::new((1.0 - cos_eye * cos_eye).sqrt(), 0.0, cos_eye);
                cases.push(twin.case(to_eye, DVec3::Z, 0.5, Vec2::splat(0.5)));
                let whole = twin.albedo_within(to_eye, 384);
                twin.albedo = DVec3::ZERO;
                let specular = twin.albedo_within(to_eye, 384);
                expected.push((specular, whole - specular));
            }
        }
    }
    let found = run(&context, &cases);
    let off = |found: Vec3, wanted: DVec3| (found.as_dvec3() - wanted).abs().max_element();
    let errors = found.iter().zip(&expected);
    let (specular, diffuse) = errors.fold((0.0f64, 0.0f64), |worst, (found, (specular, diffuse))| {
        (worst.0.max(off(found.specular, *specular)), worst.1.max(off(found.diffuse, *diffuse)))
    });
    println!("at most {specular:.4} off by the specular lobe, {diffuse:.4} by the diffuse one");
    assert!(specular < 0.04 && diffuse < 0.002, "{specular} {diffuse}");
    // A lobe that is a little wider is told apart.
    let next = found.iter().skip(12).zip(&expected);
    assert!(next.fold(0.0f64, |worst, (found, (specular, _))| worst.max(off(found.specular, *specular))) > 0.1);
}

const ROWS: usize = 16;
const COLUMNS: usize = 24;

/// Cell of a direction in a grid of equal solid angles.
fn cell(direction: DVec3) -> usize {
    let row = ((1.0 - direction.z) * 0.5 * ROWS as f64) as usize;
    let turn = direction.y.atan2(direction.x) / TAU;
    let column = (turn - turn.floor()) * COLUMNS as f64;
    row.min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1)
}

/// How far drawn directions are from a density: chi-square less its mean, in standard deviations.
fn chi_square(drawn: &[Vec3], twin: &Twin, to_eye: DVec3) -> f64 {
    let (mut expected, mut found) = (vec![0.0; ROWS * COLUMNS], vec![0.0; ROWS * COLUMNS]);
    for_sphere(1536, |to_light, solid_angle| expected[cell(to_light)] += twin.density(to_eye, to_light) * solid_angle);
    drawn.iter().for_each(|drawn| found[cell(drawn.as_dvec3())] += 1.0);
    let (mut sum, mut degrees) = (0.0, -1.0);
    let mut rest = (0.0, 0.0);
    for (expected, found) in expected.iter().zip(found) {
        let expected = expected * drawn.len() as f64;
        if expected < 8.0 {
            rest = (rest.0 + expected, rest.1 + found);
            continue;
        }
        sum += (found - expected) * (found - expected) / expected;
        degrees += 1.0;
    }
    if rest.0 > 8.0 {
        sum += (rest.1 - rest.0) * (rest.1 - rest.0) / rest.0;
        degrees += 1.0;
    }
    (sum - degrees) / f64::sqrt(2.0 * degrees)
}

#[test]
fn drawn_directions_follow_the_density() {
    let context = TestContext::new();
    let mut random = Random(11);
    for alpha in [0.2, 0.6] {
        for (index, twin) in materials(alpha).iter().enumerate() {
            for cos_eye in [0.9f64, 0.3] {
                let to_eye = DVec3::new((1.0 - cos_eye * cos_eye).sqrt(), 0.0, cos_eye);
                let mut draw = || {
                    let (lobe, place) = (random.unit(), Vec2::new(random.unit(), random.unit()));
                    twin.case(to_eye, DVec3::Z, lobe, place)
                };
                let cases: Vec<BrdfCase> = (0..40_000).map(|_| draw()).collect();
                let drawn: Vec<Vec3> = run(&context, &cases).iter().map(|result| result.drawn).collect();
                let deviation = chi_square(&drawn, twin, to_eye);
                println!("material {index}, alpha {alpha}, cos {cos_eye}: {deviation:.2} standard deviations");
                assert!(deviation < 4.5, "material {index}, alpha {alpha}, cos {cos_eye}: {deviation}");
                // The comparison sees a density that is a little off.
                if index == 1 {
                    let wrong = Twin { alpha: alpha * 1.2, ..*twin };
                    let deviation = chi_square(&drawn, &wrong, to_eye);
                    assert!(deviation > 10.0, "a wrong density is only {deviation} off");
                }
            }
        }
    }
}
