//! The queue of node pairs: everything is visited once, within its memory, or refused.

use crate::common::TestContext;
use glam::UVec2;
use linklight::gpu::shaders::probe;
use linklight::gpu::shaders::types::PairCounters;
use linklight::gpu::{Context, GpuError};
use linklight::stages::pair_queue::{PairQueue, PairQueueError, PairQueuePlan};

/// Splits `seeds`, spans of whole numbers, into single ones; returns the counters and how often each was met.
fn split(
    context: &Context,
    plan: PairQueuePlan,
    ways: u32,
    seeds: &[UVec2],
) -> Result<(PairCounters, Vec<u32>), PairQueueError> {
    let count = seeds.iter().map(|span| span.y).max().unwrap_or(0);
    let queue = PairQueue::new(context, "test", plan)?;
    let seen = context.upload("test/seen", &vec![0u32; count as usize])?;
    let counters = queue.refine(context, "test", seeds, |recorder| {
        let pass = probe::PairQueue {
            taken_pairs: &queue.taken,
            counters: &queue.counters,
            pair_stack: &queue.stack,
            seen: &seen,
            params: probe::PairQueueParams { ways },
        };
        recorder.dispatch_indirect(&pass, &queue.groups);
    })?;
    Ok((counters, context.download(&seen)?))
}

#[test]
fn every_pair_is_visited_once_in_bounded_memory() {
    let context = TestContext::new();
    // (numbers, ways, batch): a step may take everything, some, or one pair.
    for (count, ways, batch) in [(1, 2, 64), (64, 2, 1), (1000, 2, 64), (10_007, 4, 64), (100_000, 9, 4096)] {
        let levels = (f64::from(count).log(f64::from(ways))).ceil() as u32 + 1;
        let plan = PairQueuePlan { batch, max_children: ways, levels, seeds: 1 };
        let (counters, seen) = split(&context, plan, ways, &[UVec2::new(0, count)]).unwrap();
        assert!(seen.iter().all(|&visits| visits == 1), "{count} numbers in {ways} ways, {batch} at a time");
        assert_eq!((counters.accepted, counters.top, counters.taken), (count, 0, 0));
        assert!(counters.visited >= count && counters.highest <= plan.capacity(), "{counters:?}");
    }
}

#[test]
fn several_seeds_and_none() {
    let context = TestContext::new();
    let plan = PairQueuePlan { batch: 64, max_children: 2, levels: 12, seeds: 3 };
    let seeds = [UVec2::new(0, 500), UVec2::new(500, 501), UVec2::new(501, 2000)];
    let (counters, seen) = split(&context, plan, 2, &seeds).unwrap();
    assert_eq!((counters.accepted, seen), (2000, vec![1; 2000]));
    let (counters, _) = split(&context, plan, 2, &[]).unwrap();
    assert_eq!((counters.visited, counters.accepted), (0, 0));
}

/// Too small a stack is told, never overrun.
#[test]
fn a_stack_without_room_is_refused() {
    let context = TestContext::new();
    // Made for two ways and one level; split in 64 it cannot hold the children of the first pair.
    let plan = PairQueuePlan { batch: 1, max_children: 64, levels: 0, seeds: 1 };
    assert!(split(&context, plan, 64, &[UVec2::new(0, 64)]).is_ok(), "one level fits");
    match split(&context, plan, 64, &[UVec2::new(0, 64 * 64 * 64)]) {
        Err(error @ PairQueueError::Full { capacity, max_children: 64, .. }) => {
            assert_eq!(capacity, plan.capacity());
            assert!(error.to_string().contains("more levels"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    let seeds = vec![UVec2::new(0, 1); plan.capacity() as usize + 1];
    match split(&context, plan, 2, &seeds) {
        Err(PairQueueError::Seeds { seeds: given, capacity }) => assert_eq!(given, capacity as usize + 1),
        other => panic!("{other:?}"),
    }
}

/// A table beyond what the device binds is an error of its name, before anything runs.
#[test]
fn a_queue_larger_than_a_binding_is_refused() {
    let context = TestContext::new();
    let plan = PairQueuePlan { batch: 1 << 22, max_children: 16, levels: 64, seeds: 1 };
    assert!(matches!(PairQueue::new(&context, "test", plan), Err(GpuError::StorageRange { .. })));
}
