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

/// Runs as shaders read them: of each pixel and each block of places its own, so that where a run starts takes the bits of
/// a place within a block alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedRuns {
    /// Places of a block are 2 to this; 8 or 16.
    pub block_bits: u32,
    pub block_count: u32,
    /// Where the runs of each pixel's blocks start, pixel after pixel: three of them and the end of the third in each four
    /// words, so that one fetch tells where those of a block start and end.
    pub offsets: Vec<u32>,
    /// Depths, two a word; from `firsts_at`, a multiple of four, where in its block each run starts, four or two a word.
    pub words: Vec<u32>,
    pub firsts_at: u32,
}

impl PackedRuns {
    /// In large blocks, or in small ones where many short runs make those smaller.
    pub fn smallest(maps: &CompressedMaps) -> Self {
        let [small, large] = [8, 16].map(|block_bits| Self::of(maps, block_bits));
        if small.size_bytes() < large.size_bytes() { small } else { large }
    }

    /// In blocks of 256 or 65536 places; a run that goes on in the next block starts there anew.
    pub fn of(maps: &CompressedMaps, block_bits: u32) -> Self {
        let block_count = maps.place_count.div_ceil(1 << block_bits).max(1);
        let (mut offsets, mut depths, mut firsts) = (vec![0], Vec::new(), Vec::new());
        for pixel in maps.offsets.windows(2) {
            let runs = &maps.runs[pixel[0] as usize..pixel[1] as usize];
            let mut next = 0;
            for block in 0..block_count {
                let start = block << block_bits;
                if next > 0 && runs.get(next).is_none_or(|run| u32::from(run.first) > start) {
                    depths.push(runs[next - 1].depth);
                    firsts.push(0);
                }
                while let Some(run) = runs.get(next).filter(|run| u32::from(run.first) >> block_bits == block) {
                    depths.push(run.depth);
                    firsts.push((u32::from(run.first) - start) as u16);
                    next += 1;
                }
                offsets.push(depths.len() as u32);
            }
        }
        let blocks = offsets.len() - 1;
        let fours = (0..blocks).step_by(3).flat_map(|block| (block..block + 4).map(|start| start.min(blocks)));
        let offsets = fours.map(|start| offsets[start]).collect();
        let mut words: Vec<u32> = depths.chunks(2).map(|pair| pack(pair, 16)).collect();
        words.resize(words.len().next_multiple_of(4), 0);
        let firsts_at = words.len() as u32;
        words.extend(firsts.chunks(32 / block_bits as usize).map(|firsts| pack(firsts, block_bits)));
        Self { block_bits, block_count, offsets, words, firsts_at }
    }

    pub fn size_bytes(&self) -> u64 {
        ((self.offsets.len() + self.words.len()) * size_of::<u32>()) as u64
    }

    /// As shaders look it up.
    #[cfg(test)]
    fn depth(&self, place: u32, pixel: usize) -> u16 {
        let at = pixel * self.block_count as usize + (place >> self.block_bits) as usize;
        let starts_at = &self.offsets[at / 3 * 4..][..4];
        let (mut low, mut high) = (starts_at[at % 3], starts_at[at % 3 + 1]);
        let per_word = 32 / self.block_bits;
        let first = |run: u32| {
            let word = self.words[(self.firsts_at + run / per_word) as usize];
            word >> (run % per_word * self.block_bits) & ((1 << self.block_bits) - 1)
        };
        while high - low > 1 {
            let middle = (low + high) / 2;
            if first(middle) <= place & ((1 << self.block_bits) - 1) { low = middle } else { high = middle }
        }
        (self.words[low as usize / 2] >> (16 * (low % 2))) as u16
    }
}

fn pack(values: &[u16], bits: u32) -> u32 {
    values.iter().rev().fold(0, |word, &value| word << (bits % 32) | u32::from(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(seed: u32, length: usize) -> Vec<Interval> {
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
    fn packed_runs_hold_the_same_depths() {
        for (length, count) in [(1, 1), (255, 2), (256, 3), (257, 2), (1000, 4)] {
            let signals: Vec<Vec<Interval>> = (0..count).map(|pixel| signal(pixel + 70, length)).collect();
            let mut compressor = Compressor::new(count as usize, None);
            for place in 0..length {
                compressor.push(&signals.iter().map(|signal| signal[place]).collect::<Vec<_>>());
            }
            let maps = compressor.finish();
            for block_bits in [8, 16] {
                let packed = PackedRuns::of(&maps, block_bits);
                for pixel in 0..count as usize {
                    for place in 0..length as u32 {
                        assert_eq!(packed.depth(place, pixel), maps.depth(place, pixel), "{block_bits} bits, {place}");
                    }
                }
                let mut spoilt = packed.clone();
                spoilt.words[0] ^= 0x40;
                assert_ne!(spoilt.depth(0, 0), maps.depth(0, 0));
            }
            let smallest = PackedRuns::smallest(&maps).size_bytes();
            // Each third start stands twice; fours and words are filled up.
            let twice = 4 * maps.offsets.len() as u64 / 3;
            assert!(smallest <= maps.size_bytes() + twice + 28, "{smallest} bytes for {}", maps.size_bytes());
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
