//! Coherent surface shadow maps.
mod compress;
pub mod sequence;
pub use compress::{CompressedMaps, Compressor, Interval, MAX_PLACES, Run};
