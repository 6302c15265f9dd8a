//! Every kernel of elements and their light against its twin, on elements that twins made.

use crate::common::Random;
use crate::grown::{
    FUNCTIONS, Grown, RADIOSITY_FUNCTIONS, RECEIVER, SHOOTER, as_words, check, flat, grown, random_vectors, vectors,
};
use crate::pair_twins::{self, IN_SHADOW};
use crate::twins::{self, NONE, Vectors};
use glam::{DVec3, Mat3, UVec2, Vec3};
use linklight::gpu::shaders::methods::face_cluster as passes;
use linklight::gpu::shaders::types::FaceElement;

fn numbers(e: &FaceElement) -> Vec<f32> {
    let mut out = Vec::new();
    for v in [e.center, e.axis_x, e.axis_y, e.axis_z, e.half_extent, e.albedo, e.emission] {
        out.extend(v.to_array());
    }
    out.extend([e.area, e.most_albedo, e.self_share]);
    out.extend(e.facing);
    out
}

fn whole_numbers(e: &FaceElement) -> [u32; 7] {
    [e.cluster, e.instance, e.parent, e.children, e.level, e.first_place, e.place_count]
}

fn check_elements(g: &Grown, found: &[FaceElement], expected: &[FaceElement]) {
    for ((f, e), is_clear) in found.iter().zip(expected).zip(&g.is_clear) {
        assert_eq!(whole_numbers(f), whole_numbers(e));
        // All of them unclear: what is hidden may be another share.
        if !is_clear.iter().any(|&clear| clear) {
            continue;
        }
        check("element", &numbers(f), &numbers(e).iter().map(|&v| f64::from(v)).collect::<Vec<_>>(), 1e-5);
    }
}

/// Every node lies where the twin says; a moved one is noticed.
fn check_nodes(g: &Grown, found: &[Vec3]) {
    let count = g.tables.rules.len() / 2;
    assert_eq!(found.len(), g.elements.len() * count);
    let mut compared = 0;
    for (e, found) in found.chunks(count).enumerate() {
        for (k, (p, place)) in found.iter().zip(&g.nodes[e]).enumerate().filter(|(k, _)| g.is_clear[e][*k]) {
            assert!(p.abs_diff_eq(*place, 1e-4), "node {k} of {e} at {p}, expected {place}");
            assert!(!(*p + 0.05).abs_diff_eq(*place, 1e-4), "a moved node is noticed");
            compared += 1;
        }
    }
    assert!(compared * 2 > found.len(), "{compared} of {} are no matter of rounding", found.len());
}

/// Faces' normals, a signed byte an axis; one that is turned is noticed.
fn check_normals(g: &Grown, found: &[u32]) {
    let byte = |word: u32, k: u32| f32::from((word >> (8 * k)) as u8 as i8) / 127.0;
    let is_clear: Vec<bool> = g.is_clear.iter().flatten().copied().collect();
    let expected = g.normals.iter().flatten();
    for ((&word, normal), _) in found.iter().zip(expected).zip(&is_clear).filter(|(_, is_clear)| **is_clear) {
        let n = Vec3::new(byte(word, 0), byte(word, 1), byte(word, 2));
        assert!(n.abs_diff_eq(*normal, 0.01), "{n}, expected {normal}");
        assert!(!n.abs_diff_eq(-*normal, 0.01), "a turned normal is noticed");
    }
}

/// What the kernels made of the functions of the elements that are no matter of rounding.
fn check_fits(g: &Grown, fits: &[f32], means: &[f32]) {
    let clear = |found: &[f32], own: &[f32]| {
        let row = found.len() / g.elements.len();
        let is_clear = |e: usize| !twins::is_flat(&g.elements[e]) || g.is_clear[e].iter().all(|&clear| clear);
        let chosen = (0..found.len()).filter(|k| is_clear(k / row));
        chosen.map(|k| (found[k], f64::from(own[k]))).unzip::<f32, f64, Vec<f32>, Vec<f64>>()
    };
    let (found, expected) = clear(fits, &g.fits);
    check("fits", &found, &expected, 2e-3);
    let (found, expected) = clear(means, &g.means);
    check("means of functions", &found, &expected, 1e-4);
}

/// Half of what stands in the floor is no surface, and nor is the floor below it.
#[test]
fn what_is_hidden_is_no_surface() {
    let g = grown(300);
    let (low, high) = (Vec3::new(-0.8, -0.1, -0.7), Vec3::new(-0.35, 0.3, 0.1));
    let is_inside = |p: &Vec3| p.cmpge(low + 1e-3).all() && p.cmple(high - 1e-3).all();
    let all = |e: &FaceElement| {
        let (inst, c) = (&g.tables.instances[e.instance as usize], &g.tables.clusters[e.cluster as usize]);
        c.area * inst.scale * inst.scale
    };
    let mut counts = [0; 3];
    for (e, nodes) in g.elements.iter().zip(&g.nodes) {
        let share = e.area / all(e);
        let kind = usize::from(share <= 0.99) + usize::from(share <= 0.05);
        counts[kind] += 1;
        assert!(kind == 2 || !nodes.iter().any(is_inside), "{nodes:?}, share {share}");
    }
    println!("free, partly hidden, hidden: {counts:?}");
    assert!(counts[0] > 100 && counts[1] + counts[2] > 8, "{counts:?}");
}

#[test]
fn roots_and_children_are_made() {
    let g = grown(64);
    let (p, world) = (g.method.placement(), &g.fixture.world);
    let roots = g.tables.instances.len();
    let rules = g.table(&g.tables.rules);
    let rule_nodes = g.tables.rules.len() / 2;
    let node_normals = g.table(&vec![0u32; g.elements.len() * rule_nodes]);
    let fits = g.table(&vec![0f32; g.fits.len()]);
    let function_means = g.table(&vec![0f32; g.means.len()]);
    let (receiver_nodes, shooter_nodes) = (g.tables.receiver_nodes as u32, SHOOTER.nodes().len() as u32);
    let (irradiance_functions, ray_offset) = (FUNCTIONS as u32, g.tables.ray_offset);
    let (laid_functions, sent_functions) = (RECEIVER.functions(), SHOOTER.functions());
    // The children's claims are there, as `grow` leaves them.
    let claimed: Vec<FaceElement> = g
        .elements
        .iter()
        .map(|e| FaceElement {
            cluster: e.cluster,
            parent: e.parent,
            children: e.children,
            ..bytemuck::Zeroable::zeroed()
        })
        .collect();
    let (elements, nodes) = (g.table(&claimed), g.table(&vec![Vec3::ZERO; claimed.len() * rule_nodes]));
    let pool = g.pool(roots, 0);
    let mut recorder = g.context.recorder("test").unwrap();
    recorder.dispatch(
        &passes::MakeRoots {
            clusters: &p.clusters,
            cluster_skips: &p.skips,
            instances: &p.instances,
            tree_faces: &p.faces,
            triangles: &world.triangles,
            positions: &world.positions,
            rules: &rules,
            elements: &elements,
            element_nodes: &nodes,
            node_normals: &node_normals,
            fits: &fits,
            function_means: &function_means,
            pool: &pool,
            bvh_nodes: g.fixture.bvh.nodes(),
            bvh_triangles: g.fixture.bvh.triangles(),
            solids: &p.solids,
            params: passes::MakeRootsParams { instance_count: roots as u32, ray_offset },
            constants: passes::MakeRootsConstants {
                receiver_nodes,
                shooter_nodes,
                irradiance_functions,
                laid_functions,
                sent_functions,
            },
        },
        roots,
    );
    recorder.submit().unwrap();
    let mut made = g.read(&elements);
    made.truncate(roots);
    let as_leaves: Vec<_> = g.elements[..roots].iter().map(|e| FaceElement { children: NONE, ..*e }).collect();
    check_elements(&g, &made, &as_leaves);

    // Level by level: a child's parent is made before it, as in the steps of a solve.
    let (mut first, mut wanted) = (roots, made);
    while first < g.elements.len() {
        let last = (first + 2).min(g.elements.len());
        let pool = g.pool(last, first);
        let counters = g.counters(1);
        let mut recorder = g.context.recorder("test").unwrap();
        recorder.dispatch(
            &passes::MakeChildren {
                clusters: &p.clusters,
                cluster_skips: &p.skips,
                instances: &p.instances,
                tree_faces: &p.faces,
                triangles: &world.triangles,
                positions: &world.positions,
                rules: &rules,
                elements: &elements,
                element_nodes: &nodes,
                node_normals: &node_normals,
                fits: &fits,
                function_means: &function_means,
                pool: &pool,
                bvh_nodes: g.fixture.bvh.nodes(),
                bvh_triangles: g.fixture.bvh.triangles(),
                solids: &p.solids,
                counters: &counters,
                params: passes::MakeChildrenParams { capacity: g.elements.len() as u32, ray_offset },
                constants: passes::MakeChildrenConstants {
                    receiver_nodes,
                    shooter_nodes,
                    irradiance_functions,
                    laid_functions,
                    sent_functions,
                },
            },
            64u32,
        );
        recorder.submit().unwrap();
        wanted.extend(g.elements[first..last].iter().map(|e| FaceElement { children: NONE, ..*e }));
        first = last;
    }
    check_elements(&g, &g.read(&elements), &wanted);
    check_nodes(&g, &g.read(&nodes));
    check_normals(&g, &g.read(&node_normals));
    check_fits(&g, &g.read(&fits), &g.read(&function_means));
}

/// Claims are made once for each element that wants children, in whatever order; a pool that is full says so.
#[test]
fn children_are_claimed_once_and_pairs_expanded() {
    let g = grown(40);
    let leaves: Vec<usize> =
        g.leaves().into_iter().filter(|&e| g.tables.children(g.elements[e].cluster).is_some()).collect();
    let inner = (0..40).find(|&e| g.elements[e].children != NONE).unwrap();
    // Two ask for the first leaf; what has children, or waits, or is done, claims nothing. The last is of no step.
    let table: Vec<UVec2> = [
        (leaves[0], leaves[1]),
        (leaves[0], leaves[2]),
        (leaves[1], leaves[2]),
        (leaves[3], leaves[3]),
        (inner, leaves[4]),
        (leaves[4], leaves[5]),
        (leaves[5], leaves[4]),
        (leaves[6], leaves[4]),
    ]
    .map(|(a, b)| UVec2::new(a as u32, b as u32))
    .to_vec();
    // Marked: a shooter of a decision that is not, and one that waits.
    let table: Vec<UVec2> = (0..8).map(|k| table[k] + UVec2::Y * if k % 5 == 1 { IN_SHADOW } else { 0 }).collect();
    let (pairs, decisions) = (&table[..7], [1 | IN_SHADOW, 1, 2 | IN_SHADOW, 3, 1, 0, 4, 1]);
    for (capacity, room) in [(64usize, 3usize), (44, 2)] {
        let mut all = g.elements.clone();
        all.resize(64, bytemuck::Zeroable::zeroed());
        let (elements, pool) = (g.table(&all), g.pool(40, 40));
        let (taken, counters) = (g.table(&table), g.counters(pairs.len()));
        let (decided, stack) = (g.table(&decisions), g.table(&[UVec2::ZERO; 64]));
        let mut recorder = g.context.recorder("test").unwrap();
        recorder.dispatch(
            &passes::Grow {
                counters: &counters,
                taken_pairs: &taken,
                decisions: &decided,
                cluster_skips: &g.method.placement().skips,
                elements: &elements,
                pool: &pool,
                params: passes::GrowParams { capacity: capacity as u32 },
            },
            pairs.len(),
        );
        recorder.dispatch(
            &passes::Expand {
                taken_pairs: &taken,
                decisions: &decided,
                elements: &elements,
                counters: &counters,
                pair_stack: &stack,
                pool: &pool,
            },
            pairs.len(),
        );
        recorder.submit().unwrap();
        let found = g.read(&elements);
        let wanting = [leaves[0], leaves[2], leaves[3]];
        let granted: Vec<usize> = wanting.into_iter().filter(|&e| found[e].children != NONE).collect();
        assert_eq!(granted.len(), room);
        assert_eq!(found[leaves[6]].children, NONE, "a pair of no step claims nothing");
        let mut places: Vec<u32> = granted.iter().map(|&e| found[e].children).collect();
        places.sort_unstable();
        assert_eq!(places, (0..room as u32).map(|k| 40 + 2 * k).collect::<Vec<_>>(), "side by side, from the end");
        for &e in &granted {
            let own: Vec<_> = (0..2).map(|k| found[found[e].children as usize + k]).collect();
            assert_eq!([own[0].cluster, own[1].cluster], g.tables.children(found[e].cluster).unwrap());
            assert!(own.iter().all(|child| child.parent == e as u32));
        }
        assert_eq!(g.read(&pool)[0].is_full, u32::from(room < 3));

        // The twin of `expand`: a split pair's children, the pair itself where it waits.
        let mut expected = Vec::new();
        for (&pair, &decision) in pairs.iter().zip(&decisions) {
            let (decision, shadow, shooter) = (decision & !IN_SHADOW, decision & IN_SHADOW, pair.y & !IN_SHADOW);
            let halves = |e: u32| [found[e as usize].children, found[e as usize].children.wrapping_add(1)];
            let split = if decision == pair_twins::SPLIT_SHOOTER { shooter } else { pair.x };
            match decision {
                pair_twins::DONE => {}
                _ if decision == 4 || found[split as usize].children == NONE => expected.push(pair),
                pair_twins::SPLIT_RECEIVER => expected.extend(halves(pair.x).map(|x| UVec2::new(x, shooter | shadow))),
                pair_twins::SPLIT_SHOOTER => expected.extend(halves(shooter).map(|y| UVec2::new(pair.x, y | shadow))),
                _ => expected.extend(halves(pair.x).iter().flat_map(|&x| halves(pair.x).map(|y| UVec2::new(x, y)))),
            }
        }
        let mut stacked = g.read(&stack);
        stacked.truncate(g.read(&counters)[0].top as usize);
        let sorted = |mut pairs: Vec<UVec2>| {
            pairs.sort_by_key(|p| (p.x, p.y));
            pairs
        };
        assert_eq!(sorted(stacked.clone()), sorted(expected.clone()));
        assert_eq!(g.read(&pool)[0].made_count, g.read(&pool)[0].element_count);
        expected[0].x ^= 1;
        assert_ne!(sorted(stacked), sorted(expected), "a wrong pair is noticed");
    }
}

#[test]
fn light_is_pushed_settled_pulled_and_emitted() {
    let g = grown(60);
    let mut random = Random(11);
    let (count, units) = (g.elements.len(), 1000.0f32);
    let arrives: Vec<i32> = (0..count * FUNCTIONS * 9).map(|_| random.below(4000) as i32 - 1500).collect();
    let before: Vec<Vec3> = (0..count * RADIOSITY_FUNCTIONS).map(|_| Vec3::splat(random.unit())).collect();
    let kept_before = random_vectors(&mut random, count * FUNCTIONS);
    let elements = g.table(&g.elements);
    let (arriving, irradiance) = (g.table(&arrives), g.table(&as_words(&kept_before)));
    let (next, pool) = (g.table(&before), g.pool(count, count));
    let mut recorder = g.context.recorder("test").unwrap();
    for level in 0..=g.deepest() {
        let pass = passes::Settle {
            elements: &elements,
            arriving: &arriving,
            irradiance: &irradiance,
            params: passes::SettleParams { element_count: count as u32, level, inverse_units: 1.0 / units, is_kept: 1 },
            constants: passes::SettleConstants { irradiance_functions: FUNCTIONS as u32 },
        };
        recorder.dispatch(&pass, count * FUNCTIONS);
    }
    // Even radiosity, which nothing else looks at here, and that on functions.
    let (even, means) = (g.table(&vec![Vec3::ZERO; count]), g.table(&g.means));
    for (next_unshot, functions) in [(&even, 1), (&next, RADIOSITY_FUNCTIONS as u32)] {
        let pass = passes::Reflect {
            elements: &elements,
            arriving: &arriving,
            function_means: &means,
            next_unshot,
            params: passes::ReflectParams { element_count: count as u32 },
            constants: passes::ReflectConstants {
                irradiance_functions: FUNCTIONS as u32,
                radiosity_functions: functions,
            },
        };
        recorder.dispatch(&pass, count);
    }
    for level in (0..=g.deepest()).rev() {
        let pass = passes::Pull {
            elements: &elements,
            next_unshot: &next,
            pool: &pool,
            params: passes::PullParams { element_count: count as u32, level },
            constants: passes::PullConstants { radiosity_functions: RADIOSITY_FUNCTIONS as u32 },
        };
        recorder.dispatch(&pass, count);
    }
    recorder.submit().unwrap();

    // The twin, parents first: elements come after their parents.
    let mut sums: Vec<Vec<Vectors>> = Vec::new();
    let (mut kept, mut unshot, mut evenly) = (Vec::new(), Vec::new(), Vec::new());
    for (e, element) in g.elements.iter().enumerate() {
        let own = |k: usize| {
            let at =
                |c: usize, axis: usize| f64::from(arrives[(e * FUNCTIONS + k) * 9 + 3 * c + axis]) / f64::from(units);
            [0, 1, 2].map(|c| DVec3::new(at(c, 0), at(c, 1), at(c, 2)))
        };
        let mut sum: Vec<Vectors> = (0..FUNCTIONS).map(own).collect();
        if element.parent != NONE {
            let parent = element.parent as usize;
            let pushed = twins::pushed(&g.elements[parent], element, &sums[parent]);
            sum.iter_mut().zip(&pushed).for_each(|(s, p)| (0..3).for_each(|c| s[c] += p[c]));
        }
        let is_leaf = element.children == NONE;
        for (k, sum) in sum.iter().enumerate() {
            let before = vectors(&kept_before[e * FUNCTIONS + k]);
            kept.push([0, 1, 2].map(|c| before[c] + if is_leaf { sum[c] } else { DVec3::ZERO }));
        }
        let normal = element.axis_z.as_dvec3() * (twins::vector_area(element) / f64::from(element.area));
        let mean = |c: usize| -> f64 {
            let values = sum.iter().zip(&g.means[e * FUNCTIONS..]).map(|(v, &mean)| f64::from(mean) * normal.dot(v[c]));
            f64::from(element.albedo[c]) * values.sum::<f64>()
        };
        evenly.extend([0, 1, 2].map(|c| if is_leaf { mean(c).max(0.0) } else { 0.0 }));
        for k in 0..RADIOSITY_FUNCTIONS {
            let value = |c: usize| f64::from(element.albedo[c]) * normal.dot(sum[k][c]);
            let reflected = DVec3::new(value(0), value(1), value(2));
            let reflected = if k == 0 { reflected.max(DVec3::ZERO) } else { reflected };
            unshot.push(before[e * RADIOSITY_FUNCTIONS + k].as_dvec3() + if is_leaf { reflected } else { DVec3::ZERO });
        }
        sums.push(sum);
    }
    for e in (0..count).rev().filter(|&e| g.elements[e].children != NONE) {
        let children = [0, 1].map(|k| g.elements[e].children as usize + k);
        let area = f64::from(g.elements[e].area);
        for k in 0..RADIOSITY_FUNCTIONS {
            unshot[e * RADIOSITY_FUNCTIONS + k] = DVec3::ZERO;
        }
        for c in children {
            // The child's function on its own square, against the parent's functions over that square.
            let own = unshot[c * RADIOSITY_FUNCTIONS..][..RADIOSITY_FUNCTIONS].to_vec();
            let share = f64::from(g.elements[c].area) / area;
            for k in 0..RADIOSITY_FUNCTIONS {
                let pulled = twins::pulled(&g.elements[e], &g.elements[c], &own, k);
                unshot[e * RADIOSITY_FUNCTIONS + k] += share * pulled;
            }
        }
    }
    let found: Vec<f32> = g.read(&arriving).iter().map(|&bits| f32::from_bits(bits as u32)).collect();
    check("pushed", &found, &sums.iter().flat_map(|sum| flat(sum)).collect::<Vec<_>>(), 2e-5);
    let found: Vec<f32> = g.read(&irradiance).iter().flatten().flatten().copied().collect();
    check("irradiance", &found, &flat(&kept), 2e-5);
    let found: Vec<f32> = g.read(&next).iter().flat_map(|v| v.to_array()).collect();
    let found_even: Vec<f32> = g.read(&even).iter().flat_map(|v| v.to_array()).collect();
    check("even radiosity", &found_even, &evenly, 2e-5);
    check("unshot", &found, &unshot.iter().flat_map(|v| v.to_array()).collect::<Vec<_>>(), 2e-5);
    let largest = unshot.iter().step_by(RADIOSITY_FUNCTIONS).fold(0.0, |most: f64, v| most.max(v.max_element()));
    check("largest unshot", &[f32::from_bits(g.read(&pool)[0].largest_unshot)], &[largest], 2e-5);

    let mut recorder = g.context.recorder("test").unwrap();
    let params = passes::EmitParams { element_count: count as u32, radiosity_functions: RADIOSITY_FUNCTIONS as u32 };
    recorder.dispatch(&passes::Emit { elements: &elements, unshot: &next, pool: &pool, params }, count);
    recorder.submit().unwrap();
    let emitted = g.elements.iter().flat_map(|e| {
        let emitted = std::f64::consts::PI * e.emission.as_dvec3();
        (0..RADIOSITY_FUNCTIONS).map(move |k| if k == 0 { emitted } else { DVec3::ZERO })
    });
    let found: Vec<f32> = g.read(&next).iter().flat_map(|v| v.to_array()).collect();
    check("emitted", &found, &emitted.flat_map(|v| v.to_array()).collect::<Vec<_>>(), 1e-6);
}

#[test]
fn children_inherit_light() {
    let g = grown(60);
    let mut random = Random(12);
    // The last pairs of children are new.
    let (count, made) = (g.elements.len(), g.elements.len() - 10);
    let of_functions = random_vectors(&mut random, count * FUNCTIONS);
    let others = random_vectors(&mut random, count * FUNCTIONS);
    let shoots: Vec<Vec3> = (0..count * RADIOSITY_FUNCTIONS).map(|_| Vec3::splat(random.unit())).collect();
    for is_emission in [0, 1] {
        let elements = g.table(&g.elements);
        let (direct, indirect) = (g.table(&as_words(&of_functions)), g.table(&as_words(&others)));
        let (unshot, next) = (g.table(&shoots), g.table(&shoots));
        let arriving = g.table(&vec![7i32; count * FUNCTIONS * 9]);
        let mut recorder = g.context.recorder("test").unwrap();
        let pass = passes::Inherit {
            counters: &g.counters(3),
            elements: &elements,
            pool: &g.pool(count, made),
            unshot: &unshot,
            next_unshot: &next,
            direct_irradiance: &direct,
            indirect_irradiance: &indirect,
            arriving: &arriving,
            params: passes::InheritParams { capacity: count as u32, is_emission },
            constants: passes::InheritConstants {
                irradiance_functions: FUNCTIONS as u32,
                radiosity_functions: RADIOSITY_FUNCTIONS as u32,
            },
        };
        recorder.dispatch(&pass, 3u32);
        recorder.submit().unwrap();
        let (mut expected, mut expected_unshot) = (Vec::new(), Vec::new());
        for e in 0..count {
            let (c, own) = (&g.elements[e], |of: &[Mat3], e: usize| -> Vec<Vectors> {
                of[e * FUNCTIONS..][..FUNCTIONS].iter().map(vectors).collect()
            });
            let radiosity = |e: usize| -> Vec<DVec3> {
                shoots[e * RADIOSITY_FUNCTIONS..][..RADIOSITY_FUNCTIONS].iter().map(|v| v.as_dvec3()).collect()
            };
            if e < made {
                expected.extend(flat(&own(&of_functions, e)));
                expected_unshot.extend(radiosity(e));
                continue;
            }
            let parent = &g.elements[c.parent as usize];
            expected.extend(flat(&twins::pushed(parent, c, &own(&of_functions, c.parent as usize))));
            let of_both: f32 = (0..2).map(|k| g.elements[parent.children as usize + k].area).sum();
            let share = c.albedo.as_dvec3() / parent.albedo.as_dvec3() * f64::from(parent.area / of_both).min(2.0);
            let values = twins::rebased(parent, c, &radiosity(c.parent as usize), RADIOSITY_FUNCTIONS);
            let emitted = std::f64::consts::PI * c.emission.as_dvec3();
            let of = |(k, v): (usize, DVec3)| match (is_emission, k) {
                (0, _) => share * v,
                (_, 0) => emitted,
                _ => DVec3::ZERO,
            };
            expected_unshot.extend(values.into_iter().enumerate().map(of));
        }
        let found: Vec<f32> = g.read(&direct).iter().flatten().flatten().copied().collect();
        check("inherited irradiance", &found, &expected, 2e-5);
        let found: Vec<f32> = g.read(&unshot).iter().flat_map(|v| v.to_array()).collect();
        check("inherited light", &found, &expected_unshot.iter().flat_map(|v| v.to_array()).collect::<Vec<_>>(), 2e-5);
        let expected: Vec<i32> =
            (0..count * FUNCTIONS * 9).map(|i| if i < made * FUNCTIONS * 9 { 7 } else { 0 }).collect();
        assert!(g.read(&arriving) == expected);
    }
}
