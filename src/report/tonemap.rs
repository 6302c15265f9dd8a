//! Scene-linear radiance to display bytes: the CPU twin of the display's tone-mapping pass.
//!
//! [`ToneSettings`] are what the user chose; [`ToneMap`] is the same fitted to one picture, four plain numbers a shader
//! takes as they are. Order: exposure (and key) scale, operator, clamp to 0..=1, sRGB encoding, eight bits.
//!
//! | operator | curve |
//! |---|---|
//! | `reinhard` | photographic operator on luminance, hue kept: `L (1 + L / white^2) / (1 + L)`   [Reinhard2002, Eq. 4] |
//! | `filmic` | per channel, a rational curve with toe and shoulder   [Hable2010] |
//! | `none` | clamp alone |
//!
//! `reinhard` and `filmic` first bring the picture's log-average luminance to `key` [Reinhard2002, Eq. 1, 2], so that
//! a scene in any unit shows; `none` leaves radiance as it is, for pictures that are to be compared by eye.
//!
//! [Hable2010]: crate::methods::PAPERS

use glam::Vec3;

/// Curve from scene to display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Operator {
    /// Photographic operator of Reinhard et al. 2002
    #[default]
    Reinhard,
    /// Film-like curve of Hable 2010
    Filmic,
    /// Clamp only
    None,
}

/// What the user chooses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToneSettings {
    pub operator: Operator,
    /// Stops: radiance is multiplied by 2^exposure.
    pub exposure: f32,
    /// Display luminance the log-average is brought to, 0..1.
    pub key: f32,
    /// Smallest scaled luminance shown as pure white (`reinhard`).
    pub white: f32,
}

impl Default for ToneSettings {
    fn default() -> Self {
        // The key of an average scene is the paper's; its white is the picture's maximum, which one bright emitter or
        // one noisy pixel would move, so a fixed 4.5 stops above the key stands here.
        Self { operator: Operator::default(), exposure: 0.0, key: 0.18, white: 4.0 }
    }
}

/// [`ToneSettings`] fitted to a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToneMap {
    pub operator: Operator,
    /// Factor on radiance: exposure and key together.
    pub scale: f32,
    /// As in [`ToneSettings`].
    pub white: f32,
}

/// Display bytes and how many pixels had no colour.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DisplayBytes {
    /// sRGB, three a pixel.
    pub bytes: Vec<u8>,
    /// Pixels holding NaN or infinity, shown in [`NON_FINITE_COLOR`].
    pub non_finite_count: usize,
}

/// A pixel that is NaN or infinite is shown in this colour, so that it cannot pass for black.
pub const NON_FINITE_COLOR: [u8; 3] = [255, 0, 255];

impl ToneSettings {
    /// Fit to a picture by its log-average luminance.
    pub fn fit(&self, rgb: &[Vec3]) -> ToneMap {
        self.fit_to_average(log_average_luminance(rgb))
    }

    /// Fit to a given log-average luminance, so that several pictures are shown alike.
    pub fn fit_to_average(&self, log_average: f32) -> ToneMap {
        let key = match self.operator {
            Operator::None => 1.0,
            Operator::Reinhard | Operator::Filmic if log_average > 0.0 => self.key / log_average,
            Operator::Reinhard | Operator::Filmic => 1.0,
        };
        ToneMap { operator: self.operator, scale: self.exposure.exp2() * key, white: self.white }
    }
}

impl ToneMap {
    /// Display-linear colour in 0..=1 of finite radiance.
    pub fn apply(&self, radiance: Vec3) -> Vec3 {
        // Far beyond every white; keeps the rational curves from dividing infinity by infinity.
        const BEYOND_WHITE: f32 = 1e15;
        let color = (radiance * self.scale).min(Vec3::splat(BEYOND_WHITE));
        let mapped = match self.operator {
            Operator::None => color,
            Operator::Reinhard => reinhard(color, self.white),
            Operator::Filmic => Vec3::from_array(color.to_array().map(filmic)),
        };
        mapped.clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// sRGB bytes of a whole picture.
    pub fn to_bytes(&self, rgb: &[Vec3]) -> DisplayBytes {
        let mut bytes = Vec::with_capacity(rgb.len() * 3);
        let mut non_finite_count = 0;
        for &radiance in rgb {
            if radiance.is_finite() {
                bytes.extend(self.apply(radiance).to_array().map(to_byte));
            } else {
                bytes.extend(NON_FINITE_COLOR);
                non_finite_count += 1;
            }
        }
        DisplayBytes { bytes, non_finite_count }
    }
}

/// Rec. 709 luminance of linear RGB.
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// exp(mean(log L)) over the pixels that are lit; 0 for a black picture.
///
/// Differs from [Reinhard2002]: black and non-finite pixels are left out and luminance is floored at 1e-4 of its
/// mean, so that a black background does not drive the average to zero (their small delta does not prevent that).
///
/// [Reinhard2002]: crate::methods::PAPERS
pub fn log_average_luminance(rgb: &[Vec3]) -> f32 {
    let lit =
        || rgb.iter().filter(|pixel| pixel.is_finite()).map(|pixel| f64::from(luminance(*pixel))).filter(|l| *l > 0.0);
    let (count, sum) = lit().fold((0usize, 0.0), |(count, sum), l| (count + 1, sum + l));
    if count == 0 {
        return 0.0;
    }
    let floor = 1e-4 * sum / count as f64;
    let log_sum: f64 = lit().map(|l| l.max(floor).ln()).sum();
    (log_sum / count as f64).exp() as f32
}

/// Tone-map luminance, keep hue. [Reinhard2002, Eq. 4]
fn reinhard(color: Vec3, white: f32) -> Vec3 {
    let scaled = luminance(color);
    if scaled <= 0.0 {
        return color;
    }
    color * ((1.0 + scaled / (white * white)) / (1.0 + scaled))
}

/// Hable's curve with its published constants, normalised to its white point. [Hable2010]
fn filmic(value: f32) -> f32 {
    const SHOULDER: f32 = 0.15;
    const LINEAR: f32 = 0.50;
    const LINEAR_ANGLE: f32 = 0.10;
    const TOE: f32 = 0.20;
    const TOE_NUMERATOR: f32 = 0.02;
    const TOE_DENOMINATOR: f32 = 0.30;
    const WHITE: f32 = 11.2;
    const EXPOSURE_BIAS: f32 = 2.0;
    let curve = |x: f32| {
        (x * (SHOULDER * x + LINEAR_ANGLE * LINEAR) + TOE * TOE_NUMERATOR)
            / (x * (SHOULDER * x + LINEAR) + TOE * TOE_DENOMINATOR)
            - TOE_NUMERATOR / TOE_DENOMINATOR
    };
    curve(EXPOSURE_BIAS * value.max(0.0)) / curve(WHITE)
}

/// Linear 0..=1 to sRGB 0..=1 (IEC 61966-2-1).
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB 0..=1 to linear 0..=1 (IEC 61966-2-1).
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Eight-bit sRGB of a display-linear value.
pub fn to_byte(linear: f32) -> u8 {
    (srgb_encode(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPERATORS: [Operator; 3] = [Operator::Reinhard, Operator::Filmic, Operator::None];

    #[test]
    fn srgb_round_trips_every_byte() {
        for byte in 0..=255u8 {
            assert_eq!(to_byte(srgb_decode(f32::from(byte) / 255.0)), byte);
        }
        assert_eq!(to_byte(0.214_041_14), 128, "half-way sRGB is 21.4 % linear");
    }

    #[test]
    fn every_operator_is_monotonic_and_ends_at_black_and_white() {
        for operator in OPERATORS {
            let map = ToneMap { operator, scale: 1.0, white: 4.0 };
            let mut last = map.apply(Vec3::ZERO).x;
            assert!(last.abs() < 1e-6, "{operator:?} shows black as {last}");
            for step in 1..=4000 {
                let value = map.apply(Vec3::splat(step as f32 * 0.01)).x;
                assert!(value >= last, "{operator:?} falls at {step}");
                last = value;
            }
            assert_eq!(last, 1.0, "{operator:?} reaches white");
        }
    }

    #[test]
    fn operators_match_their_published_points() {
        let reinhard = ToneMap { operator: Operator::Reinhard, scale: 1.0, white: 4.0 };
        assert!((reinhard.apply(Vec3::splat(4.0)).x - 1.0).abs() < 1e-6, "white maps to one");
        assert!((reinhard.apply(Vec3::ONE).x - 0.53125).abs() < 1e-6);
        let filmic = ToneMap { operator: Operator::Filmic, scale: 1.0, white: 4.0 };
        assert!((filmic.apply(Vec3::splat(5.6)).x - 1.0).abs() < 1e-6, "11.2 with the bias of 2 is white");
        assert!((filmic.apply(Vec3::splat(0.18)).x - 0.1284).abs() < 1e-3);
    }

    #[test]
    fn the_largest_radiance_is_white() {
        for operator in OPERATORS {
            let map = ToneMap { operator, scale: 10.0, white: 4.0 };
            assert_eq!(map.apply(Vec3::splat(f32::MAX)), Vec3::ONE, "{operator:?}");
            assert!(map.apply(Vec3::splat(f32::MIN)).max_element() < 1e-6, "{operator:?}");
        }
    }

    #[test]
    fn the_key_makes_units_irrelevant_and_exposure_doubles() {
        let picture: Vec<Vec3> = (1..50).map(|i| Vec3::splat(i as f32)).collect();
        let scaled: Vec<Vec3> = picture.iter().map(|rgb| *rgb * 1000.0).collect();
        let settings = ToneSettings::default();
        let (a, b) = (settings.fit(&picture), settings.fit(&scaled));
        assert!((a.scale / b.scale / 1000.0 - 1.0).abs() < 1e-4);
        let brighter = ToneSettings { exposure: 1.0, ..settings }.fit(&picture);
        assert!((brighter.scale / a.scale - 2.0).abs() < 1e-5);
        let raw = ToneSettings { operator: Operator::None, exposure: -1.0, ..settings }.fit(&picture);
        assert_eq!(raw.scale, 0.5);
    }

    #[test]
    fn background_and_bad_pixels_do_not_move_the_average() {
        let lit = vec![Vec3::splat(2.0); 10];
        let mut mixed = lit.clone();
        mixed.extend([Vec3::ZERO, Vec3::NAN, Vec3::splat(f32::INFINITY)]);
        assert!((log_average_luminance(&lit) - 2.0).abs() < 1e-5);
        assert_eq!(log_average_luminance(&lit), log_average_luminance(&mixed));
        assert_eq!(log_average_luminance(&[Vec3::ZERO; 4]), 0.0);
        assert_eq!(ToneSettings::default().fit(&[Vec3::ZERO; 4]).scale, 1.0);
    }

    #[test]
    fn non_finite_pixels_are_counted_and_shown() {
        let map = ToneSettings { operator: Operator::None, ..Default::default() }.fit(&[]);
        let shown = map.to_bytes(&[Vec3::ONE, Vec3::new(0.0, f32::NAN, 0.0), Vec3::splat(f32::NEG_INFINITY)]);
        assert_eq!(shown.non_finite_count, 2);
        assert_eq!(shown.bytes, [255, 255, 255, 255, 0, 255, 255, 0, 255]);
    }
}
