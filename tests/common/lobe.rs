//! The specular lobe in plain double precision, for twins.

use glam::DVec3;
use std::f64::consts::PI;

/// GGX with height-correlated Smith masking and Schlick's Fresnel term, sr^-1.
pub fn brdf(f0: DVec3, f90: f64, alpha: f64, normal: DVec3, eye: DVec3, light: DVec3) -> DVec3 {
    let cos_light = normal.dot(light);
    if cos_light <= 0.0 {
        return DVec3::ZERO;
    }
    let (h, a, cos_eye) = ((eye + light).normalize(), alpha * alpha, normal.dot(eye).max(1e-6));
    let fresnel = f0 + (DVec3::splat(f90) - f0) * (1.0 - eye.dot(h)).clamp(0.0, 1.0).powi(5);
    let d = a / (PI * (1.0 - normal.dot(h).powi(2) * (1.0 - a)).powi(2));
    let root = |cosine: f64| (a + (1.0 - a) * cosine * cosine).sqrt();
    fresnel * d * 0.5 / (cos_light * root(cos_eye) + cos_eye * root(cos_light))
}

/// Share of even light that the lobe sends to the eye, by the fit of `lib/specular_albedo.glsl`, which is held against
/// the integral in the tests of path tracing.
pub fn specular_albedo(f0: DVec3, f90: f64, alpha: f64, cos_eye: f64) -> DVec3 {
    let (x, y) = (cos_eye.clamp(0.0, 1.0), alpha);
    let terms = [1.0, x, y, x * y, x * x, y * y, x * x * y, x * y * y];
    let ratio = |above: [f64; 8], below: [f64; 8]| {
        let sum = |factors: [f64; 8]| factors.iter().zip(&terms).map(|(factor, term)| factor * term).sum::<f64>();
        sum(above) / sum(below)
    };
    let scale = ratio(
        [0.025, 3.069, 8.263, -11.689, 8.943, -4.913, -12.028, 11.896],
        [1.0, 0.685, 6.973, -3.716, 10.224, -4.316, -16.307, 17.3],
    );
    let bias = ratio(
        [0.994, -2.47, 3.751, -6.031, 1.504, -1.604, 2.208, 1.753],
        [1.0, 1.172, 19.384, -77.588, 11.729, 69.543, 112.796, 276.166],
    );
    (f0 * scale + DVec3::splat(f90 * bias.max(0.0))).clamp(DVec3::ZERO, DVec3::ONE)
}

/// And that the diffuse lobe sends, which the other lies above.
pub fn diffuse_albedo(albedo: DVec3, f0: DVec3, f90: f64, cos_eye: f64) -> DVec3 {
    let u = 1.0 - cos_eye.clamp(0.0, 1.0);
    let fresnel = f0 + (DVec3::splat(f90) - f0) * (0.0044 * u - 0.002 * u * u + 0.0257 * u.powi(3));
    albedo * (1.0 - fresnel.max_element())
}

/// And both.
pub fn even_albedo(albedo: DVec3, f0: DVec3, f90: f64, alpha: f64, cos_eye: f64) -> DVec3 {
    diffuse_albedo(albedo, f0, f90, cos_eye) + specular_albedo(f0, f90, alpha, cos_eye)
}
