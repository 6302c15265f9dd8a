//! Links made by several devices: each casts the rays of a run of elements, as long as its measured rate allows, and
//! the main device puts their rows together.
//!
//! A [`Helper`] has the scene on a logical device of its own, of any driver. First every device makes a batch of one
//! size, which tells its rate; what is left is shared in proportion. Rows come in order of receivers and do not depend
//! on where they were made, so the links are those of one device, bit for bit, as far as the devices' arithmetic is the
//! same. [Schmitz2008] makes links on further devices in the same manner.
//!
//! [Schmitz2008]: crate::methods::PAPERS

use super::linking::{Linked, Linking, Sizes};
use super::{ExplicitError, Settings, Stage};
use crate::gpu::{Buffer, Context, Options};
use crate::scene::pose::Pose;
use crate::stages::bvh::Bvh;
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::link_rows::Rows;
use crate::stages::links::Outcomes;
use crate::stages::trace::Tracer;
use crate::stages::work::Unwatched;
use crate::stages::world::World;
use std::ops::Range;
use std::time::Instant;

/// Share of the elements that the first batch of every device has, at most.
const FIRST_SHARE: u32 = 16;

/// A further device with the scene on it.
pub struct Helper {
    settings: Settings,
    sizes: Sizes,
    elements: Elements,
    outcomes: Outcomes,
    linking: Linking,
    bvh: Bvh,
    world: World,
    // Dropped last: everything above is made on it.
    context: Context,
}

/// What was made for a run of elements.
struct Piece {
    elements: Range<u32>,
    rows: Rows,
    /// Words of [`Outcomes`].
    escaped: Vec<u32>,
    counts: Vec<u32>,
}

impl Helper {
    /// Opens a device and places the scene of `stage`, which stands as `pose` says.
    pub fn new(options: Options, stage: &Stage<'_>, pose: &Pose, settings: Settings) -> Result<Self, ExplicitError> {
        let context = Context::new(options)?;
        let world = World::new(&context, stage.scene, stage.geometry, pose, stage.environment, true)?;
        let positions = context.download(&world.positions)?;
        let bvh = Bvh::build(&context, &positions, &stage.geometry.triangles)?;
        let topology = ElementTopology::new(stage.scene, stage.geometry, stage.rest_positions);
        let sizes = Sizes::new(&context, &topology, world.light_count, &settings, u64::MAX)?;
        let own = Stage { world: &world, tracer: Tracer::compute(&bvh, &world), watch: &Unwatched, ..*stage };
        let elements = own.elements(&context, topology, settings.ray_offset)?;
        let outcomes = Outcomes::new(&context, elements.count, settings.rays_per_element.get())?;
        let linked = Linked { settings: &settings, elements: &elements, outcomes: &outcomes, sizes: &sizes };
        let linking = Linking::new(&context, linked)?;
        Ok(Self { settings, sizes, elements, outcomes, linking, bvh, world, context })
    }

    /// Takes over surfaces that moved from where they stand on the main device.
    pub(super) fn follow(&self, main: &Context, world: &World) -> Result<(), ExplicitError> {
        self.context.write(&self.world.positions, &main.download(&world.positions)?)?;
        self.context.write(&self.world.normals, &main.download(&world.normals)?)?;
        let mut recorder = self.context.recorder("explicit-visibility")?;
        self.bvh.refit(&mut recorder, &self.world.positions)?;
        self.elements.place(&mut recorder, &self.world);
        Ok(recorder.submit()?)
    }

    /// Of its device, oldest first.
    pub fn validation_messages(&self) -> Vec<String> {
        self.context.validation_messages()
    }

    fn make(&mut self, stage: &Stage<'_>, range: Range<u32>) -> Result<Piece, ExplicitError> {
        let own =
            Stage { world: &self.world, tracer: Tracer::compute(&self.bvh, &self.world), watch: &Unwatched, ..*stage };
        let Self { settings, elements, outcomes, sizes, linking, context, .. } = self;
        make(context, &own, Linked { settings, elements, outcomes, sizes }, linking, range)
    }
}

/// The links of a run of elements, read back.
fn make(
    context: &Context,
    stage: &Stage<'_>,
    linked: Linked<'_>,
    linking: &mut Linking,
    range: Range<u32>,
) -> Result<Piece, ExplicitError> {
    linking.start_at(range.start);
    let mut next = range.start;
    while next < range.end {
        next = linking.step(context, stage, linked, range.end - next)?.end;
    }
    let links = linking.builder.links();
    let words = linked.settings.rays_per_element.get().div_ceil(32);
    let part = |buffer: &Buffer<u32>, each: u32| {
        context.download_range(buffer, (range.start * each) as usize..(range.end * each) as usize)
    };
    Ok(Piece {
        rows: links.rows(context, range.clone())?,
        escaped: part(&linked.outcomes.escaped, words)?,
        counts: part(&linked.outcomes.counts, 1)?,
        elements: range,
    })
}

/// Makes the links of all elements, which `linking` holds then; how many elements each device had.
pub(super) fn build(
    context: &Context,
    stage: &Stage<'_>,
    linked: Linked<'_>,
    linking: &mut Linking,
    helpers: &mut [Helper],
) -> Result<Vec<u32>, ExplicitError> {
    let count = linked.elements.count;
    let devices = helpers.len() as u32 + 1;
    let first = (count / (FIRST_SHARE * devices)).min(linked.sizes.elements_at_once());
    // First batches stand at the start, one after another.
    let batches: Vec<Range<u32>> = (0..devices).map(|device| device * first..(device + 1) * first).collect();
    let (mut pieces, seconds) = make_all(context, stage, linked, (&mut *linking, &mut *helpers), &batches)?;
    let rates: Vec<f64> = seconds.iter().map(|seconds| f64::from(first) / seconds.max(1e-9)).collect();
    let shares = shares(devices * first..count, &rates);
    let (rest, _) = make_all(context, stage, linked, (&mut *linking, helpers), &shares)?;
    let made = |device: usize| batches[device].len() as u32 + shares[device].len() as u32;
    let device_elements = (0..devices as usize).map(made).collect();

    pieces.extend(rest);
    pieces.sort_by_key(|piece| piece.elements.start);
    linking.start_at(0);
    let words = linked.settings.rays_per_element.get().div_ceil(32);
    for piece in pieces.into_iter().filter(|piece| !piece.elements.is_empty()) {
        let mut recorder = context.recorder("links")?;
        recorder.write(&linked.outcomes.escaped, (piece.elements.start * words) as usize, &piece.escaped);
        recorder.write(&linked.outcomes.counts, piece.elements.start as usize, &piece.counts);
        recorder.submit()?;
        linking.builder.append_rows(context, piece.elements, &piece.rows)?;
    }
    Ok(device_elements)
}

/// All runs at once, the first on the main device; pieces and the seconds they took.
fn make_all(
    context: &Context,
    stage: &Stage<'_>,
    linked: Linked<'_>,
    (linking, helpers): (&mut Linking, &mut [Helper]),
    runs: &[Range<u32>],
) -> Result<(Vec<Piece>, Vec<f64>), ExplicitError> {
    fn timed(make: impl FnOnce() -> Result<Piece, ExplicitError>) -> Result<(Piece, f64), ExplicitError> {
        let start = Instant::now();
        let piece = make()?;
        Ok((piece, start.elapsed().as_secs_f64()))
    }
    // What a thread shares of the stage: all but who watches it.
    let Stage { scene, geometry, rest_positions, environment, world, tracer, .. } = *stage;
    std::thread::scope(|scope| {
        let others: Vec<_> = helpers
            .iter_mut()
            .zip(&runs[1..])
            .map(|(helper, run)| {
                scope.spawn(move || {
                    let watch = &Unwatched;
                    let stage = Stage { scene, geometry, rest_positions, environment, world, tracer, watch };
                    timed(|| helper.make(&stage, run.clone()))
                })
            })
            .collect();
        let own = timed(|| make(context, stage, linked, linking, runs[0].clone()));
        let mut all = vec![own?];
        for other in others {
            all.push(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
        }
        Ok(all.into_iter().unzip())
    })
}

/// `elements` in runs, one for each rate, in proportion.
fn shares(elements: Range<u32>, rates: &[f64]) -> Vec<Range<u32>> {
    let sum: f64 = rates.iter().sum();
    let mut before = 0.0;
    let mut start = elements.start;
    let runs = rates.iter().enumerate().map(|(index, rate)| {
        before += rate;
        let end = elements.start + (f64::from(elements.end - elements.start) * before / sum).round() as u32;
        let end = if index + 1 == rates.len() { elements.end } else { end.clamp(start, elements.end) };
        let run = start..end;
        start = end;
        run
    });
    runs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_as_long_as_rates_allow_and_leave_nothing_out() {
        assert_eq!(shares(10..110, &[1.0, 3.0]), [10..35, 35..110]);
        assert_eq!(shares(0..7, &[1.0, 1.0, 1.0]), [0..2, 2..5, 5..7]);
        assert_eq!(shares(3..3, &[2.0, 5.0]), [3..3, 3..3]);
        for rates in [[1e-9, 1.0, 1e9], [5.0, 0.0, 1.0]] {
            let runs = shares(4..1004, &rates);
            assert!(
                runs[0].start == 4 && runs[2].end == 1004 && runs.windows(2).all(|pair| pair[0].end == pair[1].start)
            );
        }
    }
}
