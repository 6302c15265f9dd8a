//! Error maps as pictures: 0 is black, 1 and more is the bright end of the magma colours.

/// sRGB bytes, three a value, of an error map. Values are clamped to 0..=1.
pub fn to_bytes(errors: &[f32]) -> Vec<u8> {
    let colors = nv_flip::magma_lut().to_vec();
    let last = colors.len() / 3 - 1;
    errors
        .iter()
        .flat_map(|error| {
            let index = (error.clamp(0.0, 1.0) * last as f32).round() as usize;
            [colors[3 * index], colors[3 * index + 1], colors[3 * index + 2]]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_rise_from_black_to_bright_and_clamp() {
        let bytes = to_bytes(&[0.0, 0.5, 1.0, 7.0, f32::NAN]);
        let sum = |pixel: usize| bytes[3 * pixel..3 * pixel + 3].iter().map(|byte| u32::from(*byte)).sum::<u32>();
        assert!(sum(0) < 16 && sum(0) < sum(1) && sum(1) < sum(2));
        assert_eq!(bytes[6..9], bytes[9..12]);
        assert_eq!(bytes[12..15], bytes[0..3]);
    }
}
