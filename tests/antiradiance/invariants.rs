//! What holds of the hierarchy and the links of any scene.

use crate::common::scenes::{lambert, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::fixture::{Fixture, builtin_scene};
use crate::support::{prepare, settings};
use crate::twins;
use glam::{UVec2, Vec3};
use linklight::gpu::shaders::types::{HierarchyLeaf, HierarchyNode};
use linklight::methods::antiradiance::{Antiradiance, AntiradianceError, BinCount, Leaves, Settings, link_solid_angle};
use linklight::scene::Scene;
use linklight::stages::hierarchy::NONE;

/// Patches of any size and direction, one through the other.
fn heap(seed: u64) -> Scene {
    let mut random = Random(seed);
    let mut vector = |scale: f32| scale * Vec3::from_array([(); 3].map(|()| 2.0 * random.unit() - 1.0));
    let patches = (0..12).map(|k| parallelogram(vector(2.0), vector(1.0), vector(1.0), 1 + k % 5, 0));
    scene(vec![lambert(Vec3::splat(0.5))], patches.collect(), &[])
}

/// Leaves below each node: first and one after the last.
fn leaf_ranges(nodes: &[HierarchyNode]) -> Vec<(usize, usize)> {
    let mut before = 0;
    let starts: Vec<usize> = nodes
        .iter()
        .map(|node| {
            let start = before;
            before += usize::from(node.leaf != NONE);
            start
        })
        .chain([0])
        .collect();
    let total = before;
    let start_of = |node: usize| if node == nodes.len() { total } else { starts[node] };
    nodes.iter().enumerate().map(|(index, node)| (start_of(index), start_of(node.skip as usize))).collect()
}

/// How many ordered pairs of leaves are covered wrongly: other than once, or at all within one flat surface; those below `may_lack`
/// may be left out.
fn wrongly_covered(nodes: &[HierarchyNode], shapes: &[HierarchyLeaf], links: &[UVec2], may_lack: &[UVec2]) -> usize {
    let ranges = leaf_ranges(nodes);
    let leaves: Vec<&HierarchyNode> = nodes.iter().filter(|node| node.leaf != NONE).collect();
    let cover_of = |links: &[UVec2]| {
        let mut cover = vec![0u32; leaves.len() * leaves.len()];
        for link in links {
            for (p, q) in [(link.x, link.y), (link.y, link.x)] {
                let (p, q) = (ranges[p as usize], ranges[q as usize]);
                for row in p.0..p.1 {
                    cover[row * leaves.len() + q.0..row * leaves.len() + q.1].iter_mut().for_each(|count| *count += 1);
                }
            }
        }
        cover
    };
    let (cover, may_lack) = (cover_of(links), cover_of(may_lack));
    let expected = |p: usize, q: usize| {
        let same_surface = leaves[p].surface != NONE && leaves[p].surface == leaves[q].surface;
        u32::from(p != q && !same_surface)
    };
    let is_right = |k: usize| {
        let expected = expected(k / leaves.len(), k % leaves.len());
        if cover[k] != 0 || expected == 0 {
            return cover[k] == expected;
        }
        // Of two nodes of one size either may be split first: not every pair of theirs is the twin's.
        let (p, q) = (leaves[k / leaves.len()], leaves[k % leaves.len()]);
        may_lack[k] == 1 || twins::are_back_to_back(p, q, shapes, 1.0)
    };
    (0..cover.len()).filter(|&k| !is_right(k)).count()
}

fn validate(context: &TestContext, name: &str, fixture: &Fixture, settings: Settings) {
    let method = prepare(context, fixture, settings);
    let hierarchy = method.hierarchy();
    let nodes = context.download(&hierarchy.nodes).unwrap();
    let leaves = context.download(&hierarchy.leaves).unwrap();

    // Depth-first, every element's leaf there, sums and bounds hold.
    assert_eq!(nodes[0].skip as usize, nodes.len());
    for (index, node) in nodes.iter().enumerate() {
        assert!(node.skip as usize > index && node.skip as usize <= nodes.len());
        assert_eq!(node.leaf != NONE, node.skip as usize == index + 1, "{name}: node {index}");
        let children: Vec<u32> = twins::children(&nodes, index as u32).collect();
        if node.leaf != NONE {
            assert_eq!(leaves[node.leaf as usize].node as usize, index);
            continue;
        }
        assert!((2..=4).contains(&children.len()), "{name}: {} children", children.len());
        let area: f32 = children.iter().map(|&c| nodes[c as usize].area).sum();
        assert!((area - node.area).abs() <= 1e-5 * area, "{name}: areas add up");
        for &child in &children {
            let child = &nodes[child as usize];
            assert_eq!(child.parent as usize, index);
            assert!(node.center.distance(child.center) + child.radius <= node.radius * 1.00001, "{name}: bounds hold");
        }
    }
    assert!(hierarchy.plan.leaf_of_element.iter().all(|&leaf| (leaf as usize) < leaves.len()));

    let links = method.links().download(context).unwrap();
    println!("{name}: {} leaves, {} links, depth {}", leaves.len(), links.len(), hierarchy.plan.depth());
    // Solids back to back, but for a rounding.
    let back_to_back = twins::pairs(&nodes, &leaves, link_solid_angle(&settings), 1e-3)[1].clone();
    let back_to_back: Vec<UVec2> = back_to_back.into_iter().map(UVec2::from_array).collect();
    assert_eq!(wrongly_covered(&nodes, &leaves, &links, &back_to_back), 0, "{name}");
    bins_are_covered_once(context, name, &method);
    // The check finds a link lost, and one too many.
    let faces = |link: &UVec2| {
        let [x, y] = link.to_array().map(|node| &nodes[node as usize]);
        !twins::are_back_to_back(x, y, &leaves, 2.0)
    };
    let mut without_one = links.clone();
    without_one.remove(links.iter().position(faces).unwrap());
    assert!(wrongly_covered(&nodes, &leaves, &without_one, &back_to_back) > 0);
    assert!(wrongly_covered(&nodes, &leaves, &[links.as_slice(), &links[..1]].concat(), &back_to_back) > 0);
}

/// The energy bound of the unoccluded operator: along one bin, a flat sender of radiance 1 brings a flat receiver no more than
/// what radiance 1 from all of the bin would.
fn bins_are_covered_once(context: &TestContext, name: &str, method: &Antiradiance) {
    let m = method.bins().bins.count();
    let nodes = context.download(&method.hierarchy().nodes).unwrap();
    let leaves = context.download(&method.hierarchy().leaves).unwrap();
    let norms = context.download(&method.tables().cosine_norms).unwrap();
    let held = |entry: u32| {
        let shape = nodes[(entry / m) as usize].shape as usize;
        let cosine = leaves.get(shape)?.normal.dot(method.bins().bins.directions[(entry % m) as usize]);
        Some(twins::discrete_cosine(cosine, norms[shape], m))
    };
    let transfers = method.transfers().download(context).unwrap();
    let most = transfers.iter().filter_map(|&(cell, entry, weight)| Some(weight * held(cell)? * held(entry)?));
    let (largest, sum) = most.fold((0.0, 0.0), |(largest, sum): (f32, f32), own| (largest.max(own), sum + own));
    println!("{name}: a bin is covered {largest:.4} times at most by one sender");
    assert!(largest <= 1.02 && sum > 0.0, "{name}: {largest}");
}

#[test]
fn every_pair_of_leaves_is_covered_once() {
    let context = TestContext::new();
    for (name, edge) in [("cornell-box", 0.9), ("two-rooms", 1.6)] {
        let fixture = Fixture::new(&context, builtin_scene(name), Some(edge));
        validate(&context, name, &fixture, settings(128));
        let by_patches = Settings { leaves: Leaves::Patches, patch_side: 0.1, ..settings(128) };
        validate(&context, name, &fixture, by_patches);
    }
    for seed in 0..3 {
        validate(&context, "heap", &Fixture::new(&context, heap(seed), None), settings(128));
    }
}

/// In a convex room every element sees one surface in each direction: all bins of its front are covered about once.
#[test]
fn a_room_covers_every_bin_once() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("furnace"), Some(0.5));
    let method = prepare(&context, &fixture, settings(128));
    let bins = &method.bins().bins;
    let (nodes, leaves) =
        (context.download(&method.hierarchy().nodes).unwrap(), context.download(&method.hierarchy().leaves).unwrap());
    let norms = context.download(&method.tables().cosine_norms).unwrap();
    // Radiance 1 leaves every front: exitant per area is the cosine.
    let mut exitant = vec![glam::DVec3::ZERO; nodes.len() * bins.count() as usize];
    for (leaf, norm) in leaves.iter().zip(&norms) {
        for (bin, w) in bins.directions.iter().enumerate() {
            if leaf.normal.dot(*w) > 0.0 {
                let cosine = twins::discrete_cosine(leaf.normal.dot(*w), *norm, bins.count());
                exitant[leaf.node as usize * bins.count() as usize + bin] = glam::DVec3::splat(cosine.into());
            }
        }
    }
    twins::pull(&nodes, bins.count(), &mut exitant);
    let exitant: Vec<Vec3> = exitant.iter().map(|e| e.as_vec3()).collect();
    let transfers = method.transfers().download(&context).unwrap();
    let incident = twins::gather_and_push(&nodes, bins.count(), &transfers, &exitant);
    // The energy that the unoccluded operator hands on is what there is, where nothing stands behind anything.
    let (mut received, mut sent) = (0.0, 0.0);
    for (leaf, norm) in leaves.iter().zip(&norms) {
        for (bin, w) in bins.directions.iter().enumerate() {
            let cosine = leaf.normal.dot(*w);
            let weight = f64::from(leaf.area * twins::discrete_cosine(cosine, *norm, bins.count()));
            if cosine <= 0.0 {
                received += weight * incident[leaf.node as usize * bins.count() as usize + bin].x;
                sent += weight;
            }
        }
    }
    println!("of the power sent in a closed room, {:.4} arrives", received / sent);
    assert!((received / sent - 1.0).abs() < 0.03, "{received} of {sent}");
}

#[test]
fn what_does_not_fit_is_refused_with_figures() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("cornell-box"), Some(0.9));
    match Antiradiance::prepare_within(&context, &fixture.stage(), settings(128), 100_000).err() {
        Some(error @ AntiradianceError::OutOfMemory { needed, available: 100_000, .. }) => {
            assert!(needed > 100_000 && error.to_string().contains("half_tables=true"), "{error}");
            // The tables fit now; the links do not.
            let linking = Antiradiance::prepare_within(&context, &fixture.stage(), settings(128), needed + 1000).err();
            assert!(linking.unwrap().to_string().contains("need"), "links are refused too");
        }
        other => panic!("{other:?}"),
    }
}

/// The ends of every range are safe.
#[test]
fn extreme_settings_work() {
    let context = TestContext::new();
    let fixture = Fixture::new(&context, builtin_scene("parallel-plates"), Some(0.5));
    let base = settings(128);
    for settings in [
        Settings { refinement: 0.01, bins: BinCount::new(968).unwrap(), ..base },
        Settings { refinement: 100.0, bins: BinCount::new(72).unwrap(), ..base },
        Settings { motion_margin: 1e6, ..base },
        Settings { depth: 1, tolerance: 1.0, ..base },
        Settings { depth: 40, tolerance: 0.0, half_tables: true, ..base },
    ] {
        let mut method = prepare(&context, &fixture, settings);
        let solution = crate::support::solve(&context, &mut method, &fixture, 1);
        assert!(solution.indirect.iter().all(|e| e.is_finite()), "{settings:?}");
    }
}
