//! Exclusive prefix sums of u32 lists: counts become offsets.

use crate::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams, ScanBlocks, ScanBlocksParams};
use crate::gpu::{Buffer, Context, GpuError, Recorder};

/// Values per workgroup of `scan/scan_blocks`.
const BLOCK: usize = 1024;

/// Scratch for scans of up to `capacity` values: the totals of each level of blocks.
pub struct ScanScratch {
    levels: Vec<Buffer<u32>>,
}

impl ScanScratch {
    pub fn new(context: &Context, owner: &str, capacity: usize) -> Result<Self, GpuError> {
        let mut levels = Vec::new();
        let mut count = capacity;
        loop {
            count = count.div_ceil(BLOCK).max(1);
            levels.push(context.buffer(&format!("{owner}/scan level {}", levels.len()), count)?);
            if count == 1 {
                return Ok(Self { levels });
            }
        }
    }
}

/// Replaces each of the first `count` values by the sum of those before it. To get the total too, scan one value more
/// than there are counts (the last one any number).
pub fn exclusive(recorder: &mut Recorder<'_>, values: &Buffer<u32>, count: usize, scratch: &ScanScratch) {
    scan_level(recorder, values, count, &scratch.levels);
}

fn scan_level(recorder: &mut Recorder<'_>, values: &Buffer<u32>, count: usize, levels: &[Buffer<u32>]) {
    let Some((block_sums, above)) = levels.split_first() else { return };
    let value_count = count as u32;
    let blocks = count.div_ceil(BLOCK);
    let scan = ScanBlocks { values, block_sums, params: ScanBlocksParams { value_count } };
    recorder.dispatch(&scan, blocks * 256);
    if blocks > 1 {
        scan_level(recorder, block_sums, blocks, above);
        recorder.dispatch(&AddBlockSums { values, block_sums, params: AddBlockSumsParams { value_count } }, count);
    }
}
