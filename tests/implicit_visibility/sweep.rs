//! Refinement and push-down in one sweep against the paper's own rule.                    [Dong2007 4.2.3, 4.2.4]

use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, builtin_scene, winners};
use linklight::methods::implicit_visibility::Settings;
use linklight::stages::quadtree::topology::QuadtreeTopology;

/// Links of one bin, by node: length and sender; `None` where the bin is empty.
type Links = Vec<Option<(u32, u32)>>;

/// The sweep: top-down, each node keeps the shorter of its own link and its parent's.
fn sweep(trees: &QuadtreeTopology, links: &Links) -> Links {
    let mut links = links.clone();
    for node in (0..trees.node_count()).rev() {
        if let Some(parent) = trees.parent(node) {
            links[node as usize] = [links[node as usize], links[parent as usize]].into_iter().flatten().min();
        }
    }
    links[..trees.leaf_count() as usize].to_vec()
}

/// The paper's rule as it is written: breadth-first from the root; a node with a shorter link than one above it takes
/// that link away, and it is pushed to the siblings on the way; a node with a longer one loses its own. Then what is left
/// at inner nodes is pushed down to the leaves.
fn paper(trees: &QuadtreeTopology, links: &Links) -> Links {
    let mut links = links.clone();
    for node in (0..trees.node_count()).rev() {
        let path: Vec<u32> = std::iter::successors(trees.parent(node), |&above| trees.parent(above)).collect();
        let Some(above) = path.iter().copied().find(|&above| links[above as usize].is_some()) else { continue };
        let Some(own) = links[node as usize] else { continue };
        let of_above = links[above as usize];
        if Some(own) > of_above {
            links[node as usize] = None;
            continue;
        }
        // Taken from above; at each step down, all children but the one on the path get it unless theirs is shorter.
        links[above as usize] = None;
        let mut at = above;
        while at != node {
            let mut next = node;
            while trees.parent(next) != Some(at) {
                next = trees.parent(next).unwrap();
            }
            for sibling in trees.children(at).filter(|&sibling| sibling != next) {
                let kept = [links[sibling as usize], of_above].into_iter().flatten().min();
                links[sibling as usize] = kept;
            }
            at = next;
        }
    }
    push_to_leaves(trees, links)
}

fn push_to_leaves(trees: &QuadtreeTopology, mut links: Links) -> Links {
    for node in (trees.leaf_count()..trees.node_count()).rev() {
        let own = links[node as usize].take();
        for child in trees.children(node) {
            links[child as usize] = [links[child as usize], own].into_iter().flatten().min();
        }
    }
    links[..trees.leaf_count() as usize].to_vec()
}

#[test]
fn one_sweep_does_what_the_papers_rule_does() {
    let mut random = Random(11);
    let mut differing = 0;
    for round in 0..400 {
        let sizes: Vec<u32> = (0..1 + random.below(3)).map(|_| 1 + random.below(70)).collect();
        let trees = QuadtreeTopology::of_sizes(&sizes);
        let density = 1 + random.below(6);
        let links: Links = (0..trees.node_count())
            .map(|node| (random.below(density) == 0).then(|| (random.below(1000), node)))
            .collect();
        assert_eq!(sweep(&trees, &links), paper(&trees, &links), "round {round}, trees of {sizes:?}");
        // Pushing down without keeping the shorter would be noticed.
        let mut longest = links.clone();
        for node in (0..trees.node_count()).rev() {
            if let Some(parent) = trees.parent(node) {
                longest[node as usize] = links[node as usize].max(longest[parent as usize]);
            }
        }
        differing += u32::from(longest[..trees.leaf_count() as usize] != sweep(&trees, &links)[..]);
    }
    assert!(differing > 200);
}

/// What the windows are does not show: trees cut or whole, the same winners but for links that moved down a level.
#[test]
fn windows_of_receivers_change_next_to_nothing() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.4));
    let settings = Settings { bins: 8, link_memory: 96, ..Settings::default() };
    let whole = fixture.linked(&context, settings);
    let cut = fixture.linked(&context, Settings { link_memory: 1, ..settings });
    assert_eq!(whole.report().windows, 1);
    assert!(cut.report().windows > 2, "{:?}", cut.report());
    let (a, b) = (winners(&context, &whole), winners(&context, &cut));
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    let same = pairs().filter(|(a, b)| a == b).count();
    println!("{same} of {} winners are the same", pairs().count());
    assert!(same as f64 > 0.99 * pairs().count() as f64);
}
