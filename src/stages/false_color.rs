//! Colours of debug views, for indices and for amounts. A method that has a view gives a colour per element, which the
//! display shows unlit. Everything here runs on the host: a view is looked at, not measured.

use glam::Vec3;

/// What no other colour says: nothing here, not concerned.
pub const NEUTRAL: Vec3 = Vec3::splat(0.05);
/// The picked element itself.
pub const PICKED: Vec3 = Vec3::ONE;

/// A colour for an index: neighbours differ, the same index always looks the same.
pub fn of_index(index: u32) -> Vec3 {
    // Steps of the golden ratio around the hue circle, in three brightnesses.
    let hue = (f64::from(index) * 0.618_033_988_749_894_9).fract() as f32;
    let brightness = [0.8, 0.5, 0.3][(index % 3) as usize];
    let channel = |shift: f32| (((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0).clamp(0.05, 1.0);
    brightness * Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}

/// From blue at 0 over green to red at 1 and beyond.
pub fn of_amount(amount: f32) -> Vec3 {
    let t = if amount.is_finite() { amount.clamp(0.0, 1.0) } else { 1.0 };
    let hump = |centre: f32| (1.5 - (4.0 * (t - centre)).abs()).clamp(0.0, 1.0);
    0.8 * Vec3::new(hump(0.875), hump(0.5), hump(0.125))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_differ_and_amounts_rise() {
        assert!((1..50).all(|index| of_index(index).distance(of_index(index - 1)) > 0.1));
        let (low, middle, high) = (of_amount(0.0), of_amount(0.5), of_amount(1.0));
        assert!(low.z > low.x && middle.y > middle.x.max(middle.z) && high.x > high.z);
        assert_eq!(of_amount(7.0), high);
        assert_eq!(of_amount(f32::NAN), high);
    }
}
