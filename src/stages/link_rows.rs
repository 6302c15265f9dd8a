//! Links read back: one receiver's, or a run of receivers' rows to be moved between devices.

use super::links::{Link, LinkSet, LinkWindow, LinkWords, Links};
use crate::gpu::{Context, GpuError};
use glam::Vec3;
use std::ops::Range;

/// Rows of consecutive receivers on the host, to be moved between devices.
pub struct Rows {
    /// One more than receivers, the first 0.
    pub(super) offsets: Vec<u32>,
    pub(super) words: RowWords,
}

pub(super) enum RowWords {
    Full(Vec<u64>),
    Packed(Vec<u32>),
}

impl Links {
    /// The links of one receiver.
    pub fn of_element(&self, context: &Context, element: u32) -> Result<Vec<Link>, GpuError> {
        let at = element as usize;
        let [first, last] = context.download_range(&self.offsets, at..at + 2)?[..] else { return Ok(Vec::new()) };
        fn of_set<W: bytemuck::Pod>(
            context: &Context,
            set: &LinkSet<W>,
            element: u32,
            (first, last): (u32, u32),
        ) -> Result<Vec<W>, GpuError> {
            let has_it = |w: &&LinkWindow<W>| (w.first_element..w.first_element + w.element_count).contains(&element);
            let Some(window) = set.windows.iter().find(has_it) else { return Ok(Vec::new()) };
            let place = |link: u32| (link - window.first_link) as usize;
            context.download_range(&window.words, place(first)..place(last))
        }
        Ok(match &self.words {
            LinkWords::Full(set) => {
                of_set(context, set, element, (first, last))?.into_iter().map(Link::from_word).collect()
            }
            LinkWords::Packed(set) => {
                of_set(context, set, element, (first, last))?.into_iter().map(Link::from_packed).collect()
            }
        })
    }

    /// The rows of a run of receivers, which lie in these links alone.
    pub fn rows(&self, context: &Context, receivers: Range<u32>) -> Result<Rows, GpuError> {
        fn all<W: bytemuck::Pod>(context: &Context, set: &LinkSet<W>) -> Result<Vec<W>, GpuError> {
            let mut words = Vec::new();
            for window in &set.windows {
                words.extend(context.download_range(&window.words, 0..window.link_count as usize)?);
            }
            Ok(words)
        }
        let offsets = match receivers.is_empty() {
            true => vec![0],
            false => context.download_range(&self.offsets, receivers.start as usize..receivers.end as usize + 1)?,
        };
        let words = match &self.words {
            LinkWords::Full(set) => RowWords::Full(all(context, set)?),
            LinkWords::Packed(set) => RowWords::Packed(all(context, set)?),
        };
        Ok(Rows { offsets, words })
    }

    /// Radiosity of every sender as it was last sent along the links, W/m2.
    pub fn sent(&self, context: &Context) -> Result<Vec<Vec3>, GpuError> {
        Ok(match &self.words {
            LinkWords::Full(set) => context.download(&set.sent)?.into_iter().map(from_shared_64).collect(),
            LinkWords::Packed(set) => context.download(&set.sent)?.into_iter().map(from_shared_32).collect(),
        })
    }
}

/// As `decode_64` of `lib/shared_exponent.glsl`.
fn from_shared_64(word: u64) -> Vec3 {
    let (x, y) = (word as u32, (word >> 32) as u32);
    let mantissas = [x >> 14, (x & 0x3fff) << 4 | y >> 28, y >> 10 & 0x3_ffff];
    f32::from_bits((y & 0x3ff) << 23) * Vec3::from_array(mantissas.map(|m| m as f32))
}

/// As `decode_32`.
fn from_shared_32(word: u32) -> Vec3 {
    let mantissas = [word >> 24, word >> 16 & 0xff, word >> 8 & 0xff];
    f32::from_bits((word & 0xff) << 23) * Vec3::from_array(mantissas.map(|m| m as f32))
}
