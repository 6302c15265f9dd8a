//! Runs of depths as shaders read them.
//!
//! A look-up waits for memory: of look-ups between random points three quarters of the time goes by until what they ask for
//! has arrived, so what counts is how often they ask for something that they know only from the answer before. Where runs are
//! short, a bit for each place tells where they start: counting bits takes the place of a search.

use super::compress::CompressedMaps;

/// Places of a block of marks: four words but for the 16 bits that count the pixel's runs before it.
pub const MARKED_PLACES: u32 = 112;
/// Marks are worth one of so many parts of the bytes.
const WORTH: u64 = 16;

/// Where a look-up finds which run holds at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunLayout {
    /// Blocks of 112 places, with a bit for each place where a run starts: two fetches tell a depth, beside one from a table
    /// that is small enough to stay in the caches.
    Marked,
    /// Blocks of 256 places, with a byte for each run that tells its start, to be searched.
    Small,
    /// Blocks of 65536 places, two bytes for each run.
    Large,
}

impl RunLayout {
    pub const ALL: [Self; 3] = [Self::Marked, Self::Small, Self::Large];

    /// Of a place within a block; 0 with marks.
    pub fn block_bits(self) -> u32 {
        match self {
            Self::Marked => 0,
            Self::Small => 8,
            Self::Large => 16,
        }
    }

    fn block_places(self) -> u32 {
        match self {
            Self::Marked => MARKED_PLACES,
            searched => 1 << searched.block_bits(),
        }
    }
}

/// What a look-up fetches: a texel of four words, of one of the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fetch {
    Offsets(u32),
    Words(u32),
}

/// The tables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedRuns {
    pub layout: RunLayout,
    pub block_count: u32,
    /// Block after block of each pixel, pixel after pixel. Marked: the bits of the places where runs start, and in the last 16
    /// how many of its pixel's do before; of each pixel the number of its first run stands before all blocks. Else where the
    /// block's runs start: three blocks and the end of the third in each four words, so that one fetch tells where those of a
    /// block start and end.
    pub offsets: Vec<u32>,
    /// Depths, two a word; unless marked, from `firsts_at` where in its block each run starts, four or two a word.
    pub words: Vec<u32>,
    /// A multiple of four; marked: where in `offsets` the blocks are.
    pub firsts_at: u32,
}

/// Of [`PackedRuns`], what is not in their tables.
pub(super) struct Packing {
    pub layout: RunLayout,
    pub block_count: u32,
    /// Texels.
    pub firsts_at: u32,
}

impl Packing {
    pub fn of(packed: &PackedRuns) -> Self {
        Self { layout: packed.layout, block_count: packed.block_count, firsts_at: packed.firsts_at / 4 }
    }
}

impl PackedRuns {
    /// The smallest, but marked where that takes hardly more.
    pub fn best(maps: &CompressedMaps) -> Self {
        let [small, large] = [RunLayout::Small, RunLayout::Large].map(|layout| Self::of(maps, layout));
        let searched = if small.size_bytes() < large.size_bytes() { small } else { large };
        let most = searched.size_bytes() + searched.size_bytes() / WORTH;
        // Of long runs marks alone may take many times as much: they are not made to be thrown away.
        let marks = 16 * maps.pixel_count() as u64 * u64::from(maps.place_count.div_ceil(MARKED_PLACES));
        let marked = (marks <= most).then(|| Self::of(maps, RunLayout::Marked));
        marked.filter(|marked| marked.size_bytes() <= most).unwrap_or(searched)
    }

    pub fn of(maps: &CompressedMaps, layout: RunLayout) -> Self {
        match layout {
            RunLayout::Marked => Self::marked(maps),
            searched => Self::searched(maps, searched),
        }
    }

    /// A run that goes on in the next block has no mark there.
    fn marked(maps: &CompressedMaps) -> Self {
        let block_count = maps.place_count.div_ceil(MARKED_PLACES).max(1);
        let mut offsets = maps.offsets[..maps.pixel_count()].to_vec();
        offsets.resize(offsets.len().next_multiple_of(4), 0);
        let firsts_at = offsets.len() as u32;
        offsets.reserve_exact(4 * maps.pixel_count() * block_count as usize);
        for pixel in maps.offsets.windows(2) {
            let mut next = pixel[0] as usize;
            for block in 0..block_count {
                // No pixel has more runs before a block than places.
                let mut record = [0, 0, 0, (next as u32 - pixel[0]) << 16];
                let runs = maps.runs[next..pixel[1] as usize].iter().map(|run| u32::from(run.first));
                for first in runs.take_while(|first| first / MARKED_PLACES == block) {
                    let within = first % MARKED_PLACES;
                    record[within as usize / 32] |= 1 << (within % 32);
                    next += 1;
                }
                offsets.extend(record);
            }
        }
        let words = maps.runs.chunks(2).map(|pair| pack(pair.iter().map(|run| run.depth), 16)).collect();
        Self { layout: RunLayout::Marked, block_count, offsets, words, firsts_at }
    }

    /// A run that goes on in the next block starts there anew.
    fn searched(maps: &CompressedMaps, layout: RunLayout) -> Self {
        let block_bits = layout.block_bits();
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
        let mut words: Vec<u32> = depths.chunks(2).map(|pair| pack(pair.iter().copied(), 16)).collect();
        words.resize(words.len().next_multiple_of(4), 0);
        let firsts_at = words.len() as u32;
        words.extend(firsts.chunks(32 / block_bits as usize).map(|firsts| pack(firsts.iter().copied(), block_bits)));
        Self { layout, block_count, offsets, words, firsts_at }
    }

    pub fn size_bytes(&self) -> u64 {
        ((self.offsets.len() + self.words.len()) * size_of::<u32>()) as u64
    }

    /// The depth at a place as shaders look it up, fetch by fetch: the twin of `surface_map_depth`.
    pub fn depth(&self, place: u32, pixel: usize, mut fetched: impl FnMut(Fetch)) -> u16 {
        let mut fetch = |fetch| {
            fetched(fetch);
            let (table, texel) = match fetch {
                Fetch::Offsets(texel) => (&self.offsets, texel),
                Fetch::Words(texel) => (&self.words, texel),
            };
            std::array::from_fn::<u32, 4, _>(|k| table.get(4 * texel as usize + k).copied().unwrap_or(0))
        };
        let (block, within) = (place / self.layout.block_places(), place % self.layout.block_places());
        let block = pixel as u32 * self.block_count + block;
        let run = if self.layout == RunLayout::Marked {
            let first = fetch(Fetch::Offsets(pixel as u32 / 4))[pixel % 4];
            let record = fetch(Fetch::Offsets(self.firsts_at / 4 + block));
            let marks = record.iter().zip([0, 32, 64, 96]).map(|(word, start)| match within.checked_sub(start) {
                None => 0,
                Some(upto) => (word & (u32::MAX >> (31 - upto.min(31)))).count_ones(),
            });
            first + (record[3] >> 16) + marks.sum::<u32>() - 1
        } else {
            let starts_at = fetch(Fetch::Offsets(block / 3));
            let [mut low, mut high] = [0, 1].map(|k| starts_at[(block % 3 + k) as usize]);
            let bits = self.layout.block_bits();
            let (per_word, per_texel) = (32 / bits, 128 / bits);
            let first = |firsts: [u32; 4], run: u32| {
                firsts[(run % per_texel / per_word) as usize] >> (run % per_word * bits) & ((1 << bits) - 1)
            };
            let (mut texel, mut last) = (low / per_texel, (high - 1) / per_texel);
            while texel < last {
                let middle = (texel + last).div_ceil(2);
                let starts = first(fetch(Fetch::Words(self.firsts_at / 4 + middle)), 0) <= within;
                (texel, last) = if starts { (middle, last) } else { (texel, middle - 1) };
            }
            let firsts = fetch(Fetch::Words(self.firsts_at / 4 + texel));
            (low, high) = (low.max(texel * per_texel), high.min((texel + 1) * per_texel));
            while high - low > 1 {
                let middle = u32::midpoint(low, high);
                (low, high) = if first(firsts, middle) <= within { (middle, high) } else { (low, middle) };
            }
            low
        };
        let depths = fetch(Fetch::Words(run / 8));
        (depths[(run / 2 % 4) as usize] >> (16 * (run % 2))) as u16
    }
}

fn pack(values: impl DoubleEndedIterator<Item = u16>, bits: u32) -> u32 {
    values.rev().fold(0, |word, value| word << (bits % 32) | u32::from(value))
}

#[cfg(test)]
mod tests {
    use super::super::compress::Compressor;
    use super::super::compress::tests::signal;
    use super::*;
    use crate::stages::surface_maps::Interval;

    fn maps(length: usize, count: u32) -> CompressedMaps {
        let signals: Vec<Vec<Interval>> = (0..count).map(|pixel| signal(pixel + 70, length)).collect();
        let mut compressor = Compressor::new(count as usize, None);
        for place in 0..length {
            compressor.push(&signals.iter().map(|signal| signal[place]).collect::<Vec<_>>());
        }
        compressor.finish()
    }

    #[test]
    fn packed_runs_hold_the_same_depths() {
        for (length, count) in [(1, 1), (96, 2), (111, 2), (112, 1), (113, 3), (255, 2), (256, 3), (257, 2), (1000, 4)]
        {
            let maps = maps(length, count);
            for layout in RunLayout::ALL {
                let packed = PackedRuns::of(&maps, layout);
                for pixel in 0..count as usize {
                    for place in 0..length as u32 {
                        let mut fetches = 0;
                        let depth = packed.depth(place, pixel, |_| fetches += 1);
                        assert_eq!(depth, maps.depth(place, pixel), "{layout:?}, {place}");
                        assert!(fetches == 3 || layout != RunLayout::Marked && fetches > 3, "{fetches}");
                    }
                }
                let mut spoilt = packed.clone();
                spoilt.words[0] ^= 0x40;
                assert_ne!(spoilt.depth(0, 0, |_| ()), maps.depth(0, 0));
            }
            let best = PackedRuns::best(&maps).size_bytes();
            // Each third start stands twice; fours and words are filled up.
            let twice = 4 * maps.offsets.len() as u64 / 3;
            let smallest = maps.size_bytes() + twice + 28;
            assert!(best <= smallest + smallest / WORTH, "{best} bytes for {}", maps.size_bytes());
        }
    }

    #[test]
    fn marks_are_for_short_runs() {
        let at = |step: usize| {
            let mut compressor = Compressor::new(1, None);
            for place in 0..3000 {
                let depth = (place / step) as u16 * 7;
                compressor.push(&[Interval { low: depth, high: depth }]);
            }
            PackedRuns::best(&compressor.finish()).layout
        };
        assert_eq!([1, 5, 7].map(at), [RunLayout::Marked; 3]);
        assert_eq!([12, 40].map(at), [RunLayout::Small; 2]);
        assert_eq!(at(500), RunLayout::Large);
    }
}
