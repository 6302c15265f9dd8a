//! The shape of the quadtrees: which element is which leaf, and which nodes each chart has. Plain data, made once.
//!
//! A chart's nodes are stored by levels without pointers: the i-th node of a level has its parent at place i / 4 of the
//! next, and children 4 i to 4 i + 3. Here the levels of all charts stand together: first the leaves of all charts,
//! chart after chart, then all nodes above leaves, and so on. A *segment* is one chart's share of one level.

use crate::gpu::shaders::types::{QuadtreeSegment, WalkStep};
use crate::scene::charts::{Charts, NO_CHART};
use crate::stages::elements::BACK_SIDE;
use glam::Vec2;
use std::ops::Range;

/// "No parent" of a segment; the same constant stands in `lib/quadtree.glsl`.
pub const NO_PARENT: u32 = u32::MAX;

/// All quadtrees of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QuadtreeTopology {
    /// Element of each leaf. Elements that no triangle touches have none.
    pub leaf_elements: Vec<u32>,
    /// Nodes of each level, leaves first.
    pub levels: Vec<Range<u32>>,
    /// Segment of each node.
    pub node_segments: Vec<u32>,
    /// Chart by chart, leaves first.
    pub segments: Vec<QuadtreeSegment>,
    /// The root of each tree. Each chart has a tree, and one more for its back where it is double-sided.
    pub roots: Vec<u32>,
}

impl QuadtreeTopology {
    /// Trees over elements whose vertices are `element_vertices` (as of [`crate::stages::elements::ElementTopology`]).
    pub fn new(charts: &Charts, element_vertices: &[u32]) -> Self {
        // Members of each tree: fronts of a chart, then its backs.
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); 2 * charts.charts.len()];
        for (element, &entry) in element_vertices.iter().enumerate() {
            let chart = charts.vertex_chart[(entry & !BACK_SIDE) as usize];
            if chart != NO_CHART {
                members[2 * chart as usize + usize::from(entry & BACK_SIDE != 0)].push(element as u32);
            }
        }
        members.retain(|members| !members.is_empty());
        let place = |element: &u32| charts.vertex_uv[(element_vertices[*element as usize] & !BACK_SIDE) as usize];
        members.iter_mut().for_each(|members| sort_along(members, &place));
        let sizes: Vec<u32> = members.iter().map(|members| members.len() as u32).collect();
        Self { leaf_elements: members.concat(), ..Self::of_sizes(&sizes) }
    }

    /// Trees of so many leaves, without their elements.
    pub fn of_sizes(sizes: &[u32]) -> Self {
        let mut trees = Self::default();
        // Nodes of each tree on the present level; trees that have reached their root drop out.
        let mut counts: Vec<Option<u32>> = sizes.iter().map(|&size| Some(size).filter(|&size| size > 0)).collect();
        let mut by_level: Vec<Vec<Option<(u32, u32)>>> = Vec::new();
        let mut next = 0;
        while counts.iter().any(Option::is_some) {
            let first = next;
            let row = counts.iter_mut().map(|count| {
                let nodes = (*count)?;
                let place = (next, nodes);
                next += nodes;
                *count = (nodes > 1).then_some(nodes.div_ceil(4));
                Some(place)
            });
            by_level.push(row.collect());
            trees.levels.push(first..next);
        }
        trees.node_segments = vec![0; next as usize];
        for tree in 0..sizes.len() {
            let own: Vec<(u32, u32)> = by_level.iter().map_while(|row| row[tree]).collect();
            for (level, &(first, count)) in own.iter().enumerate() {
                let (child_first, child_count) = if level > 0 { own[level - 1] } else { (0, 0) };
                let segment = trees.segments.len() as u32;
                trees.node_segments[first as usize..(first + count) as usize].fill(segment);
                trees.segments.push(QuadtreeSegment {
                    first,
                    count,
                    parent_first: own.get(level + 1).map_or(NO_PARENT, |parents| parents.0),
                    child_first,
                    child_count,
                    level: level as u32,
                    tree: tree as u32,
                });
            }
            trees.roots.extend(own.last().map(|root| root.0));
        }
        trees
    }

    pub fn leaf_count(&self) -> u32 {
        self.levels.first().map_or(0, |leaves| leaves.end)
    }

    pub fn node_count(&self) -> u32 {
        self.levels.last().map_or(0, |level| level.end)
    }

    pub fn parent(&self, node: u32) -> Option<u32> {
        let segment = self.segment(node);
        (segment.parent_first != NO_PARENT).then(|| segment.parent_first + (node - segment.first) / 4)
    }

    /// Empty for leaves.
    pub fn children(&self, node: u32) -> Range<u32> {
        let segment = self.segment(node);
        let first = 4 * (node - segment.first);
        segment.child_first + first.min(segment.child_count)..segment.child_first + (first + 4).min(segment.child_count)
    }

    /// Leaves of the subtree of `node`.
    pub fn leaves_below(&self, node: u32) -> Range<u32> {
        let mut nodes = node..node + 1;
        while !self.children(nodes.start).is_empty() {
            nodes = self.children(nodes.start).start..self.children(nodes.end - 1).end;
        }
        nodes
    }

    pub fn segment(&self, node: u32) -> &QuadtreeSegment {
        &self.segments[self.node_segments[node as usize] as usize]
    }

    /// All nodes, each before its children, and where to go on without them.
    pub fn walk(&self) -> Vec<WalkStep> {
        let mut steps = Vec::with_capacity(self.node_count() as usize);
        let mut stack: Vec<u32> = self.roots.iter().rev().copied().collect();
        while let Some(node) = stack.pop() {
            let below = self.subtree_count(node);
            steps.push(WalkStep { node, skip: steps.len() as u32 + below });
            stack.extend(self.children(node).rev());
        }
        steps
    }

    /// Per node: the step of [`Self::walk`] of the node so many levels above it, or of its root.
    pub fn steps_above(&self, walk: &[WalkStep], levels: u32) -> Vec<u32> {
        let mut steps = vec![0; walk.len()];
        walk.iter().zip(0..).for_each(|(at, step)| steps[at.node as usize] = step);
        let above = |node: u32| (0..levels).fold(node, |node, _| self.parent(node).unwrap_or(node));
        (0..self.node_count()).map(|node| steps[above(node) as usize]).collect()
    }

    /// Nodes below and including a node.
    fn subtree_count(&self, node: u32) -> u32 {
        let mut count = 0;
        let mut level = node..node + 1;
        while !level.is_empty() {
            count += level.len() as u32;
            level = self.children(level.start).start..self.children(level.end - 1).end;
        }
        count
    }

    /// Leaves below (or equal to) a node.
    pub fn leaves(&self, node: u32) -> Range<u32> {
        let segment = self.segment(node);
        let leaves = &self.segments[(self.node_segments[node as usize] - segment.level) as usize];
        let span = 4u64.pow(segment.level);
        let at = |i: u64| leaves.first + (i * span).min(u64::from(leaves.count)) as u32;
        let index = u64::from(node - segment.first);
        at(index)..at(index + 1)
    }
}

/// Orders members so that every aligned run of 4^k of them is a neighbourhood: cut across the longer side of the places,
/// at the multiple of the largest power of four that fits, and again.
fn sort_along(members: &mut [u32], place: &impl Fn(&u32) -> Vec2) {
    let count = members.len();
    if count <= 1 {
        return;
    }
    // The largest run that is cut: 4^k or 2 * 4^k below the count.
    let power = 4usize.pow((count - 1).ilog(4));
    let cut = if count > 2 * power { 2 * power } else { power };
    let (low, high) =
        members.iter().map(place).fold((Vec2::MAX, Vec2::MIN), |(low, high), at| (low.min(at), high.max(at)));
    let size = high - low;
    let along = |element: &u32| if size.x >= size.y { place(element).x } else { place(element).y };
    members.select_nth_unstable_by(cut, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
    let (left, right) = members.split_at_mut(cut);
    sort_along(left, place);
    sort_along(right, place);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What holds for all trees: each node once, parents and children agree, leaves counted.
    fn validate(trees: &QuadtreeTopology, sizes: &[u32]) {
        let mut is_child = vec![false; trees.node_count() as usize];
        for node in 0..trees.node_count() {
            for child in trees.children(node) {
                assert_eq!(trees.parent(child), Some(node));
                assert!(!std::mem::replace(&mut is_child[child as usize], true), "{child} has two parents");
            }
            let below: Vec<u32> = trees.children(node).collect();
            if below.is_empty() {
                assert_eq!(trees.leaves(node), node..node + 1);
            } else {
                assert_eq!(trees.leaves(node).start, trees.leaves(below[0]).start);
                assert_eq!(trees.leaves(node).end, trees.leaves(*below.last().unwrap()).end);
            }
            assert_eq!(trees.parent(node).is_none(), trees.roots.contains(&node));
        }
        // The walk meets all nodes, and what it skips below one are all that descend from it.
        let walk = trees.walk();
        let mut met: Vec<u32> = walk.iter().map(|step| step.node).collect();
        for (k, step) in walk.iter().enumerate() {
            let descends =
                |&node: &u32| std::iter::successors(Some(node), |&n| trees.parent(n)).any(|n| n == step.node);
            assert!(met[k..step.skip as usize].iter().all(descends));
            assert!(met.get(step.skip as usize).is_none_or(|node| !descends(node)));
        }
        met.sort_unstable();
        assert!(met.into_iter().eq(0..trees.node_count()));
        assert_eq!(is_child.iter().filter(|is_child| !**is_child).count(), trees.roots.len());
        let leaves: Vec<u32> = trees.roots.iter().map(|&root| trees.leaves(root).len() as u32).collect();
        assert_eq!(leaves, sizes.iter().copied().filter(|&size| size > 0).collect::<Vec<_>>());
    }

    #[test]
    fn trees_of_all_sizes_are_whole() {
        for sizes in [vec![16], vec![1], vec![17, 0, 1, 5], (1..40).collect(), vec![1025, 3, 256], vec![]] {
            validate(&QuadtreeTopology::of_sizes(&sizes), &sizes);
        }
        // The paper's example: 16 leaves, 4 nodes, 1 root.
        let trees = QuadtreeTopology::of_sizes(&[16]);
        assert_eq!(trees.levels, [0..16, 16..20, 20..21]);
        assert_eq!((trees.children(17), trees.parent(7)), (4..8, Some(17)));
    }

    #[test]
    fn aligned_runs_of_leaves_are_neighbourhoods() {
        // A grid of 16 x 16 places: runs of four are 2 x 2, runs of sixteen 4 x 4.
        let place = |element: &u32| Vec2::new((element % 16) as f32, (element / 16) as f32);
        let mut members: Vec<u32> = (0..256).map(|i| (i * 37) % 256).collect();
        sort_along(&mut members, &place);
        for (run, side) in [(4, 1.0), (16, 3.0), (64, 7.0)] {
            for chunk in members.chunks(run) {
                let places = || chunk.iter().map(place);
                let low = places().reduce(Vec2::min).unwrap();
                assert!(places().all(|at| (at - low).max_element() <= side), "{chunk:?}");
            }
        }
    }
}
