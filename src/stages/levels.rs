//! The levels of a hierarchy: bottom-up and top-down sweeps over its nodes, level by level.
//!
//! The operator of a sweep is a kernel of whoever sweeps, with one thread per node of a level (or several).

use crate::gpu::{Buffer, Context, GpuError, Recorder};
use std::ops::Range;

/// Nodes sorted by depth.
pub struct Levels {
    /// Node indices, the root's level first, rising within a level.
    pub nodes: Buffer<u32>,
    /// Of each level, in [`Self::nodes`].
    pub ranges: Vec<Range<u32>>,
}

impl Levels {
    /// The nodes that `is_swept`; `depths[node]` is 0 for roots.
    pub fn new(
        context: &Context,
        owner: &str,
        depths: &[u32],
        is_swept: impl Fn(u32) -> bool,
    ) -> Result<Self, GpuError> {
        let (nodes, ranges) = by_depth(depths, is_swept);
        Ok(Self { nodes: context.upload(&format!("{owner}/level nodes"), &nodes)?, ranges })
    }

    /// Calls `level` for the deepest level first, the root's last: children are done before their parents.
    pub fn upwards(&self, recorder: &mut Recorder<'_>, mut level: impl FnMut(&mut Recorder<'_>, Range<u32>)) {
        self.ranges.iter().rev().for_each(|range| level(recorder, range.clone()));
    }

    /// Calls `level` for the root's level first: parents are done before their children.
    pub fn downwards(&self, recorder: &mut Recorder<'_>, mut level: impl FnMut(&mut Recorder<'_>, Range<u32>)) {
        self.ranges.iter().for_each(|range| level(recorder, range.clone()));
    }
}

/// Nodes sorted by depth, and where each depth's are.
fn by_depth(depths: &[u32], is_swept: impl Fn(u32) -> bool) -> (Vec<u32>, Vec<Range<u32>>) {
    let mut nodes: Vec<u32> = (0..depths.len() as u32).filter(|&node| is_swept(node)).collect();
    nodes.sort_by_key(|&node| depths[node as usize]);
    let ranges = nodes.chunk_by(|&a, &b| depths[a as usize] == depths[b as usize]);
    let mut first = 0;
    let ranges = ranges.map(|level| {
        let range = first..first + level.len() as u32;
        first = range.end;
        range
    });
    let ranges = ranges.collect();
    (nodes, ranges)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_stand_by_depth_and_rise_within_it() {
        let (nodes, ranges) = by_depth(&[0, 1, 2, 2, 1, 2], |_| true);
        assert_eq!(nodes, [0, 1, 4, 2, 3, 5]);
        assert_eq!(ranges, [0..1, 1..3, 3..6]);
        let (nodes, ranges) = by_depth(&[0, 1, 2, 2, 1, 2], |node| node % 2 == 0);
        assert_eq!((nodes, ranges), (vec![0, 4, 2], vec![0..1, 1..2, 2..3]));
        assert!(by_depth(&[], |_| true).1.is_empty());
    }
}
