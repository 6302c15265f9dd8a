//! What is kept of a solution against twins: which leaves there are, who finds them, and their light.

use crate::common::Random;
use crate::grown::{FUNCTIONS, as_words, check, flat, grown, random_vectors, vectors};
use crate::twins::{self, NONE, Vectors};
use glam::{DVec2, DVec3, Mat3, UVec2};
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
    let halves = [0, 1].map(|_| g.context.buffer("test/halves", leaves.len() * FUNCTIONS).unwrap());
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
            leaf_direct: &halves[0],
            leaf_indirect: &halves[1],
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
        assert_eq!(leaf.half_extent, element.half_extent.truncate());
    }
    for (halves, light) in halves.iter().zip(&light) {
        let found: Vec<f32> = g.read(halves).iter().flat_map(|h| crate::fixture::of_halves(h, unit)).collect();
        let expected = leaves.iter().flat_map(|e| light[e * FUNCTIONS..][..FUNCTIONS].iter().map(vectors));
        check("half floats", &found, &flat(&expected.collect::<Vec<_>>()), 5e-4);
    }
}

/// Corners of leaves against all leaves that meet there, found without the tree; and the bilinear light between them.
#[test]
fn corners_are_smoothed() {
    let g = grown(80);
    let (count, leaves) = (g.elements.len(), g.leaves());
    let mut random = Random(15);
    let light = [0, 1].map(|_| random_vectors(&mut random, count * FUNCTIONS));
    let tables = [0, 1].map(|k| g.table(&as_words(&light[k])));
    let numbers: Vec<u32> = (0..count).map(|e| leaves.iter().filter(|&&leaf| leaf < e).count() as u32).collect();
    let halves = [0, 1].map(|_| g.context.buffer("test/halves", leaves.len() * 4).unwrap());
    let unit = 1.0 / 512.0;
    let mut recorder = g.context.recorder("test").unwrap();
    let pass = passes::SmoothLeaves {
        elements: &g.table(&g.elements),
        leaf_indices: &g.table(&numbers),
        direct_irradiance: &tables[0],
        indirect_irradiance: &tables[1],
        leaf_direct: &halves[0],
        leaf_indirect: &halves[1],
        params: passes::SmoothLeavesParams { element_count: count as u32, inverse_unit: 1.0 / unit },
        constants: passes::SmoothLeavesConstants { irradiance_functions: FUNCTIONS as u32 },
    };
    recorder.dispatch(&pass, count);
    recorder.submit().unwrap();

    let of = |e: usize, point: DVec3, light: &[Mat3]| -> Vectors {
        let uv = twins::plane_coordinates(&g.elements[e], point).clamp(DVec2::ZERO, DVec2::ONE);
        let mut sum = [DVec3::ZERO; 3];
        for k in 0..FUNCTIONS {
            let v = vectors(&light[e * FUNCTIONS + k]);
            (0..3).for_each(|c| sum[c] += twins::basis(k, uv) * v[c]);
        }
        sum
    };
    let corners = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE];
    let mut met = 0;
    for (found, light) in halves.iter().zip(&light) {
        let found: Vec<f32> = g.read(found).iter().flat_map(|h| crate::fixture::of_halves(h, unit)).collect();
        let mut expected = Vec::new();
        for &leaf in &leaves {
            let own = &g.elements[leaf];
            let near = 0.1 * f64::from(own.half_extent.x.min(own.half_extent.y));
            let values = corners.map(|uv| {
                let point = twins::plane_point(own, uv);
                let holds = |e: &FaceElement| {
                    let d = point - e.center.as_dvec3();
                    let along = [e.axis_x, e.axis_y, e.axis_z].map(|axis| d.dot(axis.as_dvec3()).abs());
                    DVec3::from_array(along).cmple(e.half_extent.as_dvec3() + near).all()
                };
                // Found from the root down: all that hold it do.
                let is_found = |e: &FaceElement| {
                    let above = std::iter::successors(Some(e), |e| g.elements.get(e.parent as usize));
                    above.into_iter().all(holds)
                };
                let meets = |&&other: &&usize| {
                    let e = &g.elements[other];
                    let is_one_surface = e.instance == own.instance && e.axis_z.dot(own.axis_z) > 0.8;
                    other == leaf || (is_one_surface && is_found(e))
                };
                let meeting: Vec<Vectors> = leaves.iter().filter(meets).map(|&e| of(e, point, light)).collect();
                met += meeting.len() - 1;
                [0, 1, 2].map(|c| meeting.iter().map(|v| v[c]).sum::<DVec3>() / meeting.len() as f64)
            });
            // The function that is linear in u and in v between the corners, projected on each of four.
            for k in 0..4 {
                expected.push([0, 1, 2].map(|c| {
                    twins::mean(|uv| {
                        let w = [(1.0 - uv.x) * (1.0 - uv.y), uv.x * (1.0 - uv.y), (1.0 - uv.x) * uv.y, uv.x * uv.y];
                        twins::basis(k, uv) * (0..4).map(|i| w[i] * values[i][c]).sum::<DVec3>()
                    })
                }));
            }
        }
        check("smoothed", &found, &flat(&expected), 5e-4);
    }
    assert!(met > leaves.len(), "{met} meetings at the corners of {} leaves", leaves.len());
}
