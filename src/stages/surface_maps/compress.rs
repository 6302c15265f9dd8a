//! Depth intervals along a sequence as runs of constants: the fewest that tell every query right.   [Ritschel2008 3.1]
//!
//! Of each pixel of the cube maps, along the sequence of texels, any depth of an interval will do. The running
//! intersection is kept; where it becomes empty a run ends. No other cutting needs fewer runs.
//!
//! [Ritschel2008]: crate::methods::PAPERS

use rayon::prelude::*;

/// Depths from the nearest code to the farthest, both included, that answer every query of one pixel right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Interval {
    pub low: u16,
    pub high: u16,
}

impl Interval {
    /// Never asked: below the surface.
    pub const ANY: Self = Self { low: 0, high: u16::MAX };

    pub fn contains(self, depth: u16) -> bool {
        (self.low..=self.high).contains(&depth)
    }

    /// In the middle, as far as can be from both surfaces; or behind the first by the share `behind` of its distance, where
    /// the second is farther: what stands between both beside the pixel's ray is hidden then.
    fn depth(self, behind: Option<f32>) -> u16 {
        let middle = self.low.midpoint(self.high);
        let near = |behind| self.low.saturating_add((f32::from(self.low) * behind) as u16 + 1);
        behind.map_or(middle, |behind| middle.min(near(behind)))
    }

    fn intersection(self, other: Self) -> Option<Self> {
        let both = Self { low: self.low.max(other.low), high: self.high.min(other.high) };
        (both.low <= both.high).then_some(both)
    }
}

/// A depth that holds from a place in the sequence up to the next run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Run {
    pub depth: u16,
    /// Place in the sequence.
    pub first: u16,
}

/// Places that a sequence may have.
pub const MAX_PLACES: usize = 1 << 16;

/// Pixels that one thread compresses at a time.
const PIXEL_BLOCK: usize = 256;

/// Compresses maps that arrive place by place.
pub struct Compressor {
    pixels: Vec<PixelRuns>,
    place_count: usize,
    /// Of the first surface's distance, how far behind it depths stand.
    behind: Option<f32>,
}

#[derive(Clone)]
struct PixelRuns {
    runs: Vec<Run>,
    open: Interval,
    first: u16,
}

impl PixelRuns {
    fn push(&mut self, place: u16, next: Interval, behind: Option<f32>) {
        match self.open.intersection(next) {
            Some(both) => self.open = both,
            None => {
                self.runs.push(Run { depth: self.open.depth(behind), first: self.first });
                self.open = next;
                self.first = place;
            }
        }
    }
}

/// Runs of all pixels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CompressedMaps {
    /// Where each pixel's runs start, and their number at the end.
    pub offsets: Vec<u32>,
    pub runs: Vec<Run>,
    pub place_count: u32,
}

impl Compressor {
    /// Depths stand in the middle, or such a share of the first surface's distance `behind` that where that is nearer.
    pub fn new(pixel_count: usize, behind: Option<f32>) -> Self {
        let pixel = PixelRuns { runs: Vec::new(), open: Interval::ANY, first: 0 };
        Self { pixels: vec![pixel; pixel_count], place_count: 0, behind }
    }

    /// Appends whole maps, one after the other; at most [`MAX_PLACES`] in all.
    pub fn push(&mut self, maps: &[Interval]) {
        let pixel_count = self.pixels.len();
        let first_place = self.place_count;
        debug_assert!(maps.len().is_multiple_of(pixel_count) && first_place + maps.len() / pixel_count <= MAX_PLACES);
        self.place_count += maps.len() / pixel_count.max(1);
        let behind = self.behind;
        // Map after map over a block of pixels: what is read lies in one piece, what is written stays at hand.
        self.pixels.par_chunks_mut(PIXEL_BLOCK).enumerate().for_each(|(block, pixels)| {
            for (k, map) in maps.chunks_exact(pixel_count).enumerate() {
                let place = (first_place + k) as u16;
                pixels
                    .iter_mut()
                    .zip(&map[block * PIXEL_BLOCK..])
                    .for_each(|(pixel, &next)| pixel.push(place, next, behind));
            }
        });
    }

    /// Bytes that the runs so far take.
    pub fn size_bytes(&self) -> u64 {
        let runs: usize = self.pixels.iter().map(|pixel| pixel.runs.len() + 1).sum();
        (runs * size_of::<Run>() + (self.pixels.len() + 1) * size_of::<u32>()) as u64
    }

    pub fn finish(self) -> CompressedMaps {
        let mut maps = CompressedMaps { offsets: vec![0], runs: Vec::new(), place_count: self.place_count as u32 };
        for mut pixel in self.pixels {
            if self.place_count > 0 {
                pixel.runs.push(Run { depth: pixel.open.depth(self.behind), first: pixel.first });
            }
            maps.runs.extend(pixel.runs);
            maps.offsets.push(maps.runs.len() as u32);
        }
        maps
    }
}

impl CompressedMaps {
    pub fn pixel_count(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// The depth of `pixel` at `place`.
    pub fn depth(&self, place: u32, pixel: usize) -> u16 {
        let runs = &self.runs[self.offsets[pixel] as usize..self.offsets[pixel + 1] as usize];
        runs[runs.partition_point(|run| u32::from(run.first) <= place) - 1].depth
    }

    pub fn size_bytes(&self) -> u64 {
        (self.runs.len() * size_of::<Run>() + self.offsets.len() * size_of::<u32>()) as u64
    }

    /// Bytes of the maps in 16 bits a pixel, for each byte of runs.
    pub fn ratio(&self) -> f64 {
        let plain = self.pixel_count() as u64 * u64::from(self.place_count) * size_of::<u16>() as u64;
        plain as f64 / self.size_bytes() as f64
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn signal(seed: u32, length: usize) -> Vec<Interval> {
        let hash = |i: u32| {
            let x = (i ^ seed.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
            (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35) >> 16
        };
        (0..length as u32)
            .map(|i| {
                let low = (hash(2 * i) % 60) as u16;
                if hash(3 * i + 7) % 9 == 0 {
                    Interval::ANY
                } else {
                    Interval { low, high: low + (hash(2 * i + 1) % 40) as u16 }
                }
            })
            .collect()
    }

    /// The fewest runs, by trying every cut.
    fn fewest(signal: &[Interval]) -> usize {
        let mut best = vec![0];
        for end in 1..=signal.len() {
            let candidates = (0..end).filter(|&start| {
                let all = signal[start..end].iter().try_fold(Interval::ANY, |all, &next| all.intersection(next));
                all.is_some()
            });
            best.push(candidates.map(|start| best[start] + 1).min().unwrap());
        }
        best[signal.len()]
    }

    #[test]
    fn runs_are_the_fewest_and_hold() {
        for seed in 0..300 {
            let signal = signal(seed, 1 + seed as usize % 40);
            let mut compressor = Compressor::new(1, None);
            // In chunks of all lengths.
            for chunk in signal.chunks(1 + seed as usize % 7) {
                compressor.push(chunk);
            }
            let maps = compressor.finish();
            assert_eq!(maps.runs.len(), fewest(&signal), "{signal:?}");
            for (place, interval) in signal.iter().enumerate() {
                assert!(interval.contains(maps.depth(place as u32, 0)), "place {place} of {signal:?}");
            }
            // A comparator that could not fail would pass this too.
            let wrong =
                CompressedMaps { runs: maps.runs.iter().map(|run| Run { depth: 30_000, ..*run }).collect(), ..maps };
            let holds =
                signal.iter().enumerate().all(|(place, interval)| interval.contains(wrong.depth(place as u32, 0)));
            assert_eq!(holds, signal.iter().all(|&interval| interval == Interval::ANY));
        }
    }

    #[test]
    fn pixels_do_not_mix() {
        let (a, b) = (signal(5, 50), signal(6, 50));
        let maps: Vec<Interval> = a.iter().zip(&b).flat_map(|(&a, &b)| [a, b]).collect();
        let mut compressor = Compressor::new(2, None);
        compressor.push(&maps);
        let bytes = compressor.size_bytes();
        let maps = compressor.finish();
        assert_eq!(bytes, maps.size_bytes());
        assert_eq!(maps.place_count, 50);
        for place in 0..50 {
            assert!(a[place].contains(maps.depth(place as u32, 0)) && b[place].contains(maps.depth(place as u32, 1)));
        }
        assert_eq!(Compressor::new(3, None).finish().runs.len(), 0);
    }
}
