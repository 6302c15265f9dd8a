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

/// Share of even light that the lobe sends to the eye.                                               [Karis2014]
pub fn specular_albedo(f0: DVec3, f90: f64, alpha: f64, cos_eye: f64) -> DVec3 {
    let roughness = alpha.sqrt();
    let r = [1.0 - roughness, 0.0425 - 0.0275 * roughness, 1.04 - 0.572 * roughness, 0.022 * roughness - 0.04];
    let a004 = (r[0] * r[0]).min((-9.28 * cos_eye.clamp(0.0, 1.0)).exp2()) * r[0] + r[1];
    (f0 * (r[2] - 1.04 * a004) + DVec3::splat(f90 * (r[3] + 1.04 * a004))).clamp(DVec3::ZERO, DVec3::ONE)
}
