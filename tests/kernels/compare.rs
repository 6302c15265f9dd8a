//! The comparator of buffers. Every use of it is followed by wrong buffers that it has to report.

use bytemuck::Pod;

/// A value may be off by `absolute + relative * |expected|`.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    pub absolute: f32,
    pub relative: f32,
}

impl Tolerance {
    pub fn absolute(absolute: f32) -> Self {
        Self { absolute, relative: 0.0 }
    }
}

/// The first place where two buffers of floats differ by more than allowed, in words. NaN equals nothing.
pub fn difference(got: &[f32], expected: &[f32], tolerance: Tolerance) -> Option<String> {
    if got.len() != expected.len() {
        return Some(format!("{} values for {}", got.len(), expected.len()));
    }
    let is_close = |(g, e): (&f32, &f32)| (g - e).abs() <= tolerance.absolute + tolerance.relative * e.abs();
    let index = got.iter().zip(expected).position(|pair| !is_close(pair))?;
    Some(format!("value {index}: {} for {}", got[index], expected[index]))
}

/// Fails unless `got` holds the twin's values; and unless it would fail for a value moved, lost, added or NaN.
pub fn hold<T: Pod>(what: &str, got: &[T], expected: &[T], tolerance: Tolerance) {
    let (got, expected): (&[f32], &[f32]) = (bytemuck::cast_slice(got), bytemuck::cast_slice(expected));
    let found = difference(got, expected, tolerance);
    assert!(found.is_none(), "{what}: {} (allowed {tolerance:?})", found.unwrap_or_default());

    let mut longer = got.to_vec();
    longer.push(0.0);
    assert!(difference(&longer, expected, tolerance).is_some(), "{what}: a value too many");
    let Some(&last) = expected.last() else { return };
    assert!(difference(&got[1..], expected, tolerance).is_some(), "{what}: a value lost");
    let moved =
        last + 2.0 * (tolerance.absolute + tolerance.relative * last.abs()) + f32::EPSILON * last.abs().max(1.0);
    for wrong in [moved, f32::NAN] {
        let mut wrong_buffer = expected.to_vec();
        wrong_buffer[expected.len() - 1] = wrong;
        assert!(difference(&wrong_buffer, expected, tolerance).is_some(), "{what}: {wrong} for {last}");
    }
}

/// Fails if `expected` could not be told from `wrong`, the twin's values for a wrong input.
pub fn tells_apart<T: Pod>(what: &str, wrong: &[T], expected: &[T], tolerance: Tolerance) {
    let found = difference(bytemuck::cast_slice(wrong), bytemuck::cast_slice(expected), tolerance);
    assert!(found.is_some(), "{what} would go unnoticed");
}
