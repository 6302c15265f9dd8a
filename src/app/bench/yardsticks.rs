//! What the machine can do at the time: a copy, multiply-adds, an empty dispatch and a loop on the CPU, once a round.

use std::hint::black_box;
use std::time::Instant;

use crate::app::measure::milliseconds;
use crate::app::{AppError, measure};
use crate::gpu::shaders::yardstick::{MultiplyAdd, MultiplyAddParams, Nothing, NothingParams};
use crate::gpu::{Buffer, Context};
use crate::report::bench_file;

/// Larger than caches, small enough for one storage buffer anywhere.
const COPY_BYTES: u64 = 64 << 20;
const MULTIPLY_ADD_VALUES: u32 = 1 << 14;
const MULTIPLY_ADD_ITERATIONS: u32 = 256;
/// Of `glsl/yardstick/multiply_add.comp`: chains, lanes, and two flops each.
const FLOPS_AN_ITERATION: u64 = 4 * 4 * 2;
const CPU_ITERATIONS: u32 = 1 << 18;

/// Buffers on one device, and what was measured with them.
pub struct Yardsticks {
    source: Buffer<u32>,
    target: Buffer<u32>,
    values: Buffer<f32>,
    measured: bench_file::Yardsticks,
}

impl Yardsticks {
    pub fn new(context: &Context) -> Result<Self, AppError> {
        let words = (COPY_BYTES / 4) as usize;
        let mut yardsticks = Self {
            source: context.buffer("yardsticks/source", words)?,
            target: context.buffer("yardsticks/target", words)?,
            values: context.upload("yardsticks/values", &vec![0.5; MULTIPLY_ADD_VALUES as usize])?,
            measured: bench_file::Yardsticks {
                device: measure::device(context.info()),
                copy_bytes: 2 * COPY_BYTES,
                copy_ms: Vec::new(),
                multiply_add_flops: u64::from(MULTIPLY_ADD_VALUES)
                    * u64::from(MULTIPLY_ADD_ITERATIONS)
                    * FLOPS_AN_ITERATION,
                multiply_add_ms: Vec::new(),
                empty_ms: Vec::new(),
                cpu_ms: Vec::new(),
            },
        };
        let mut recorder = context.recorder("yardsticks")?;
        recorder.fill(&yardsticks.source, 1);
        recorder.submit()?;
        // Once for the driver, to compile.
        yardsticks.round(context, false)?;
        Ok(yardsticks)
    }

    /// Each once; kept where the round counts.
    pub fn round(&mut self, context: &Context, counts: bool) -> Result<(), AppError> {
        let copy = timed(|| {
            let mut recorder = context.recorder("yardsticks")?;
            recorder.copy(&self.source, &self.target);
            Ok(recorder.submit()?)
        })?;
        let multiply_add = timed(|| {
            let mut recorder = context.recorder("yardsticks")?;
            let params = MultiplyAddParams { count: MULTIPLY_ADD_VALUES, iterations: MULTIPLY_ADD_ITERATIONS };
            recorder.dispatch(&MultiplyAdd { values: &self.values, params }, MULTIPLY_ADD_VALUES);
            Ok(recorder.submit()?)
        })?;
        let empty = timed(|| {
            let mut recorder = context.recorder("yardsticks")?;
            recorder.dispatch(&Nothing { values: &self.values, params: NothingParams { count: 0 } }, 1u32);
            Ok(recorder.submit()?)
        })?;
        let cpu = timed(|| {
            black_box(cpu_loop(black_box(0.5)));
            Ok(())
        })?;
        context.take_records();
        if counts {
            self.measured.copy_ms.push(copy);
            self.measured.multiply_add_ms.push(multiply_add);
            self.measured.empty_ms.push(empty);
            self.measured.cpu_ms.push(cpu);
        }
        Ok(())
    }

    pub fn finish(self) -> bench_file::Yardsticks {
        self.measured
    }
}

/// Eight chains of multiply-adds, as the kernel's.
fn cpu_loop(start: f32) -> f32 {
    let mut chains = [start; 8];
    for _ in 0..CPU_ITERATIONS {
        for chain in &mut chains {
            *chain = *chain * 0.999 + 0.001;
        }
    }
    chains.iter().sum()
}

fn timed(work: impl FnOnce() -> Result<(), AppError>) -> Result<f64, AppError> {
    let start = Instant::now();
    work()?;
    Ok(milliseconds(start))
}
