//! Receivers in windows: runs of leaves with all nodes above them, whose bins fit the memory there is.
//!
//! A link is received by a node and pushed down to its leaves, so a window needs the bins of its leaves and of the nodes
//! above them that receive. A tree too large for a window is cut: its upper nodes receive nothing, and links that they
//! would have received are made further down. Senders are never cut.

use crate::gpu::shaders::types::{ReceiverGroup, WindowLevel};
use crate::stages::quadtree::topology::QuadtreeTopology;
use std::ops::Range;

/// Which nodes receive in a window.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowPlan {
    /// The nodes whose subtrees receive.
    pub receivers: Vec<u32>,
    /// One per level of the trees, leaves first, and an empty one above.
    pub levels: Vec<WindowLevel>,
    /// Per level: the nodes in groups of neighbours.
    pub groups: Vec<Vec<ReceiverGroup>>,
}

impl WindowPlan {
    pub fn leaves(&self) -> Range<u32> {
        self.levels[0].first..self.levels[0].first + self.levels[0].count
    }

    /// Nodes of all levels.
    pub fn row_count(&self) -> u32 {
        self.levels.iter().map(|level| level.count).sum()
    }
}

/// Windows of at most `max_rows` nodes each (at least one leaf), in order of leaves.
pub fn plan(trees: &QuadtreeTopology, max_rows: u32) -> Vec<WindowPlan> {
    let mut cut = Vec::new();
    for &root in &trees.roots {
        cut_tree(trees, root, max_rows.max(1), &mut cut);
    }
    let mut windows: Vec<WindowPlan> = Vec::new();
    let (mut rows, mut receivers): (u32, Vec<u32>) = (0, Vec::new());
    for node in cut {
        let own = subtree_rows(trees, node);
        if !receivers.is_empty() && rows + own > max_rows {
            windows.push(window(trees, std::mem::take(&mut receivers)));
            rows = 0;
        }
        rows += own;
        receivers.push(node);
    }
    if !receivers.is_empty() {
        windows.push(window(trees, receivers));
    }
    windows
}

/// The highest nodes whose subtrees fit.
fn cut_tree(trees: &QuadtreeTopology, node: u32, max_rows: u32, cut: &mut Vec<u32>) {
    if subtree_rows(trees, node) <= max_rows || trees.children(node).is_empty() {
        cut.push(node);
    } else {
        trees.children(node).for_each(|child| cut_tree(trees, child, max_rows, cut));
    }
}

/// Nodes of each level below and including `node`, leaves first.
fn subtree_levels(trees: &QuadtreeTopology, node: u32) -> Vec<Range<u32>> {
    let mut levels = Vec::new();
    let mut level = node..node + 1;
    while !level.is_empty() {
        let below = trees.children(level.start).start..trees.children(level.end - 1).end;
        levels.push(level);
        level = below;
    }
    levels.reverse();
    levels
}

fn subtree_rows(trees: &QuadtreeTopology, node: u32) -> u32 {
    subtree_levels(trees, node).iter().map(|level| level.len() as u32).sum()
}

fn window(trees: &QuadtreeTopology, receivers: Vec<u32>) -> WindowPlan {
    let mut ranges: Vec<Option<Range<u32>>> = vec![None; trees.levels.len() + 1];
    for &node in &receivers {
        for (level, nodes) in subtree_levels(trees, node).into_iter().enumerate() {
            let range = ranges[level].get_or_insert(nodes.start..nodes.start);
            range.end = nodes.end;
        }
    }
    let mut row = 0;
    let levels = ranges.into_iter().map(|range| {
        let range = range.unwrap_or(0..0);
        let level = WindowLevel { first: range.start, count: range.len() as u32, row };
        row += level.count;
        level
    });
    let levels: Vec<WindowLevel> = levels.collect();
    let groups = (0..trees.levels.len()).map(|level| groups(trees, &levels, level)).collect();
    WindowPlan { receivers, levels, groups }
}

/// The nodes of a level in groups of the same grandparent.
fn groups(trees: &QuadtreeTopology, levels: &[WindowLevel], level: usize) -> Vec<ReceiverGroup> {
    let WindowLevel { first, count, .. } = levels[level];
    let up = |node: u32, steps: u32| (0..steps).fold(node, |node, _| trees.parent(node).unwrap_or(node));
    let above = &levels[level + 1];
    let is_above = |node: u32| (above.first..above.first + above.count).contains(&node);
    let mut groups: Vec<ReceiverGroup> = Vec::new();
    for node in first..first + count {
        if let Some(last) = groups.last_mut()
            && last.node == up(node, 2)
        {
            last.count += 1;
            continue;
        }
        let parent = trees.parent(node).filter(|&parent| is_above(parent));
        groups.push(ReceiverGroup {
            first: node,
            count: 1,
            node: up(node, 2),
            above_first: parent.unwrap_or(0),
            above_count: u32::from(parent.is_some()),
            above_node: parent.map_or(0, |parent| up(parent, 2)),
            row: levels[level].row + node - first,
        });
    }
    // The parents of a group are in one group, as a whole.
    for group in groups.iter_mut().filter(|group| group.above_count > 0) {
        let members = trees.segment(group.above_first);
        let place = (group.above_first - members.first) / 16 * 16;
        group.above_first = (members.first + place).max(above.first);
        group.above_count =
            (members.first + (place + 16).min(members.count)).min(above.first + above.count) - group.above_first;
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_hold_every_leaf_once_and_keep_to_their_size() {
        let sizes = [700, 1, 16, 17, 3, 0, 260, 1025];
        let trees = QuadtreeTopology::of_sizes(&sizes);
        for max_rows in [1, 7, 50, 400, 1000, 100_000] {
            let windows = plan(&trees, max_rows);
            let mut next = 0;
            for window in &windows {
                assert_eq!(window.leaves().start, next);
                next = window.leaves().end;
                assert!(window.row_count() <= max_rows, "{} rows, at most {max_rows}", window.row_count());
                // Exactly the subtrees of the receivers.
                let mut nodes: Vec<u32> =
                    window.receivers.iter().flat_map(|&node| subtree_levels(&trees, node)).flatten().collect();
                nodes.sort_unstable();
                let mut held: Vec<u32> = window.levels.iter().flat_map(|l| l.first..l.first + l.count).collect();
                held.sort_unstable();
                assert_eq!(nodes, held);
                // Groups hold the same nodes, each below its group's, in their rows, and their parents' groups are groups.
                let members = |group: &ReceiverGroup| group.first..group.first + group.count;
                assert!(window.groups.iter().flatten().all(|group| group.count <= 16));
                let mut grouped: Vec<u32> = window.groups.iter().flatten().flat_map(members).collect();
                grouped.sort_unstable();
                assert_eq!(held, grouped);
                for (level, group) in window.groups.iter().enumerate().flat_map(|(l, g)| g.iter().map(move |g| (l, g)))
                {
                    let leaves = trees.leaves(group.node);
                    let own = &window.levels[level];
                    assert_eq!(group.row - own.row, group.first - own.first);
                    assert!(members(group).all(|node| leaves.contains(&trees.leaves(node).start)));
                    let above = (group.above_first, group.above_count, group.above_node);
                    let is_group = |other: &ReceiverGroup| (other.first, other.count, other.node) == above;
                    assert!(group.above_count == 0 || window.groups[level + 1].iter().any(is_group), "{group:?}");
                }
            }
            assert_eq!(next, trees.leaf_count());
            assert_eq!(windows.len() == 1, max_rows >= trees.node_count());
        }
        assert!(plan(&QuadtreeTopology::of_sizes(&[]), 10).is_empty());
    }
}
