//! What is kept of a solution against twins: which leaves there are, who finds them, and their light; and what is left.

use crate::common::Random;
use crate::grown::{FUNCTIONS, RADIOSITY_FUNCTIONS, as_words, check, flat, grown, random_vectors, vectors};
use crate::twins::{NONE, basis};
use glam::{DVec2, DVec3, UVec2, Vec3};
use linklight::gpu::Buffer;
use linklight::gpu::shaders::methods::face_cluster as passes;
use linklight::gpu::shaders::types::{FaceElement, LeafElement};

#[test]
fn leaves_are_numbered_found_and_kept() {
    let g = grown(80);
    let (p, count) = (g.method.placement(), g.elements.len());
    let triangle_count = g.tables.triangles.len();
    let (elements, flags) = (g.table(&g.elements), g.table(&vec![9u32; count]));
    let mut recorder = g.context.recorder("test").unwrap();
    let params = passes::FlagLeavesParams { element_count: count as u32 };
    recorder.dispatch(&passes::FlagLeaves { elements: &elements, leaf_indices: &flags, params }, count);
    recorder.submit().unwrap();
    let leaves = g.leaves();
    let expected: Vec<u32> = (0..count).map(|e| u32::from(leaves.contains(&e))).collect();
    assert_eq!(g.read(&flags), expected);

    let numbers: Vec<u32> = (0..count).map(|e| leaves.iter().filter(|&&leaf| leaf < e).count() as u32).collect();
    let (numbered, found) = (g.table(&numbers), g.table(&vec![UVec2::ZERO; triangle_count]));
    let mut random = Random(14);
    let light = [0, 1].map(|_| random_vectors(&mut random, count * FUNCTIONS));
    let tables = [0, 1].map(|k| g.table(&as_words(&light[k])));
    let kept: Buffer<LeafElement> = g.context.buffer("test/leaves", leaves.len()).unwrap();
    let records = [0, 1].map(|_| g.context.buffer("test/records", leaves.len() * FUNCTIONS).unwrap());
    let unit = 1.0 / 512.0;
    let mut recorder = g.context.recorder("test").unwrap();
    recorder.dispatch(
        &passes::Locate {
            elements: &elements,
            triangle_places: &p.places,
            triangle_roots: &p.triangle_roots,
            leaf_indices: &numbered,
            triangle_leaves: &found,
            params: passes::LocateParams { triangle_count: triangle_count as u32 },
        },
        triangle_count,
    );
    recorder.dispatch(
        &passes::KeepLeaves {
            elements: &elements,
            leaf_indices: &numbered,
            direct_irradiance: &tables[0],
            indirect_irradiance: &tables[1],
            leaves: &kept,
            leaf_direct: &records[0],
            leaf_indirect: &records[1],
            params: passes::KeepLeavesParams {
                element_count: count as u32,
                functions: FUNCTIONS as u32,
                inverse_unit: 1.0 / unit,
            },
        },
        count,
    );
    recorder.submit().unwrap();
    // Among the leaves of a side, the one whose places have the triangle's.
    for (triangle, sides) in g.read(&found).iter().enumerate() {
        let place = g.tables.places[triangle];
        for (side, is_back) in [(sides.x, 0), (sides.y, 1)] {
            let holds = |&(_, e): &(usize, &usize)| {
                let e = &g.elements[*e];
                let inst = &g.tables.instances[e.instance as usize];
                inst.is_back == is_back && place >= e.first_place && place < e.first_place + e.place_count
            };
            let expected = leaves.iter().enumerate().find(holds).map_or(NONE, |(number, _)| number as u32);
            assert_eq!(side, expected, "triangle {triangle}");
        }
    }
    for (leaf, &e) in g.read(&kept).iter().zip(&leaves) {
        let element = &g.elements[e];
        assert_eq!((leaf.center, leaf.axis_x, leaf.axis_y), (element.center, element.axis_x, element.axis_y));
        assert_eq!(leaf.half_extent, element.half_extent);
    }
    let mut limited = [0, 0];
    for (records, light) in records.iter().zip(&light) {
        let found: Vec<f32> = g.read(records).iter().flat_map(|h| crate::fixture::of_shared(h, unit)).collect();
        let mut expected = Vec::new();
        for &e in &leaves {
            let own: Vec<_> = light[e * FUNCTIONS..][..FUNCTIONS].iter().map(vectors).collect();
            let limit = limit_of(&own, &g.elements[e]);
            limited[usize::from(limit < 1.0)] += 1;
            let shares = std::iter::once(1.0).chain(std::iter::repeat(limit));
            expected.extend(own.iter().zip(shares).map(|(channels, share)| channels.map(|vector| share * vector)));
        }
        check("shared exponents", &found, &flat(&expected), 2e-3);
    }
    assert!(limited.iter().all(|&leaves| leaves > 0), "{limited:?}");
}

/// So much of the functions beyond the first that no channel's light on the mean plane is negative at nine places.
fn limit_of(light: &[[DVec3; 3]], element: &FaceElement) -> f64 {
    let vector_area = (element.facing[4] - element.facing[5]).max(0.0);
    if vector_area < 0.8 * element.area {
        return 1.0;
    }
    let along = element.axis_z.as_dvec3();
    let mut limit = 1f64;
    for uv in (0..9).map(|k| 0.5 * DVec2::new(f64::from(k % 3), f64::from(k / 3))) {
        for channel in 0..3 {
            let mean = along.dot(light[0][channel]);
            let slopes = light.iter().enumerate().skip(1);
            let there = mean + slopes.map(|(k, light)| basis(k, uv) * along.dot(light[channel])).sum::<f64>();
            if mean > 0.0 && there < 0.0 {
                limit = limit.min(mean / (mean - there));
            }
        }
    }
    limit
}

/// Rows of neighbours against all pairs of leaves, found without the tree.
#[test]
fn leaves_know_whose_light_reaches_them() {
    let g = grown(80);
    let (count, leaves) = (g.elements.len(), g.leaves());
    let numbers: Vec<u32> = (0..count).map(|e| leaves.iter().filter(|&&leaf| leaf < e).count() as u32).collect();
    let (elements, numbered) = (g.table(&g.elements), g.table(&numbers));
    let reach = 0.5;
    let run = |offsets: &Buffer<u32>, neighbours: &Buffer<u32>, writes: u32| {
        let mut recorder = g.context.recorder("test").unwrap();
        let pass = passes::FindNeighbours {
            elements: &elements,
            leaf_indices: &numbered,
            neighbour_offsets: offsets,
            neighbours,
            params: passes::FindNeighboursParams { element_count: count as u32, reach, writes },
        };
        recorder.dispatch(&pass, count);
        recorder.submit().unwrap();
    };
    let counts = g.table(&vec![7u32; leaves.len()]);
    run(&counts, &g.table(&[0u32]), 0);
    let counts = g.read(&counts);
    let mut offsets = vec![0u32];
    counts.iter().for_each(|n| offsets.push(offsets[offsets.len() - 1] + n));
    let rows = g.table(&vec![u32::MAX; offsets[leaves.len()] as usize]);
    run(&g.table(&offsets), &rows, 1);
    let rows = g.read(&rows);

    // How far apart the boxes are along the axis that parts them most, beyond the margin; metres.
    let gap = |a: &FaceElement, b: &FaceElement, is_leaf: bool| -> f64 {
        let h = b.half_extent;
        let margin = f64::from(reach * if is_leaf { h.x.min(h.y) } else { h.x.max(h.y) });
        let d = b.center.as_dvec3() - a.center.as_dvec3();
        let span = |e: &FaceElement, axis: DVec3| -> f64 {
            let along = [e.axis_x, e.axis_y, e.axis_z].map(|own| own.as_dvec3().dot(axis).abs());
            DVec3::from_array(along).dot(e.half_extent.as_dvec3())
        };
        let axes = [a.axis_x, a.axis_y, a.axis_z, b.axis_x, b.axis_y, b.axis_z].map(|axis| axis.as_dvec3());
        axes.map(|axis| d.dot(axis).abs() - span(a, axis) - span(b, axis) - margin).into_iter().fold(f64::MIN, f64::max)
    };
    let mut pairs = 0;
    for (leaf, &own) in leaves.iter().enumerate() {
        let row = &rows[offsets[leaf] as usize..offsets[leaf + 1] as usize];
        for (other, &e) in leaves.iter().enumerate().filter(|&(_, &e)| e != own) {
            let (a, b) = (&g.elements[own], &g.elements[e]);
            let above = std::iter::successors(Some(b), |e| g.elements.get(e.parent as usize));
            let apart = above.enumerate().map(|(k, e)| gap(a, e, k == 0)).fold(f64::MIN, f64::max);
            let alike = f64::from(a.axis_z.dot(b.axis_z)) - 0.8;
            if apart.abs() < 1e-5 || alike.abs() < 1e-5 {
                continue;
            }
            let expected = a.instance == b.instance && apart < 0.0 && alike > 0.0;
            assert_eq!(row.contains(&(other as u32)), expected, "leaf {other} beside {leaf}, {apart} m apart");
            pairs += usize::from(expected);
        }
    }
    assert!(pairs > leaves.len(), "{pairs} neighbours of {} leaves", leaves.len());
}

/// Shooting goes on while any colour is left to shoot.
#[test]
fn the_largest_unshot_light_is_of_any_colour() {
    let g = grown(60);
    let count = g.elements.len();
    let (leaf, element) = g.elements.iter().enumerate().find(|(_, element)| element.children == NONE).unwrap();
    for color in 0..3 {
        let mut unshot = vec![Vec3::ZERO; count * RADIOSITY_FUNCTIONS];
        unshot[leaf * RADIOSITY_FUNCTIONS][color] = 2.0;
        let (elements, next, pool) = (g.table(&g.elements), g.table(&unshot), g.pool(count, count));
        let mut recorder = g.context.recorder("test").unwrap();
        let pass = passes::Pull {
            elements: &elements,
            next_unshot: &next,
            pool: &pool,
            params: passes::PullParams { element_count: count as u32, level: element.level },
            constants: passes::PullConstants { radiosity_functions: RADIOSITY_FUNCTIONS as u32 },
        };
        recorder.dispatch(&pass, count);
        recorder.submit().unwrap();
        let found = f32::from_bits(g.read(&pool)[0].largest_unshot);
        assert!((found - 2.0).abs() < 1e-6, "colour {color}: {found}");
    }
}
