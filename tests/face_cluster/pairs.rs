//! The kernels that decide pairs against their twins: what is split, and what arrives.

use crate::common::Random;
use crate::grown::{FUNCTIONS, Grown, RADIOSITY_FUNCTIONS, SHOOTER, check, flat, grown_over};
use crate::pair_twins::{self, IN_SHADOW, Outcome, Way};
use crate::way_twins::Blockers;
use glam::{UVec2, Vec3};
use linklight::gpu::Buffer;
use linklight::gpu::shaders::methods::face_cluster as passes;
use linklight::gpu::shaders::types::PoolCounters;

/// W/m2: more than some bent receivers of the scene get, and less than others.
const BENT_LIGHT: f64 = 0.3;

/// As if every fifth element stood partly in another body.
fn hide_parts(g: &mut Grown) {
    g.elements.iter_mut().step_by(5).for_each(|e| e.is_part_hidden = 1);
}

/// Runs all pairs that are clear in one step; returns decisions and sums beside the twin's.
fn compare_outcomes(
    g: &Grown,
    pairs: &[UVec2],
    outcomes: &[Outcome],
    units: f32,
    run: impl Fn(&Buffer<UVec2>, &Buffer<i32>, &Buffer<u32>, &Buffer<PoolCounters>),
) {
    let clear: Vec<usize> = (0..pairs.len()).filter(|&i| outcomes[i].is_clear()).collect();
    assert!(clear.len() * 100 > 95 * pairs.len(), "{} of {} are clear", clear.len(), pairs.len());
    let taken: Vec<UVec2> = clear.iter().map(|&i| pairs[i]).collect();
    let arriving = g.table(&vec![0i32; g.elements.len() * FUNCTIONS * 9]);
    let decisions = g.table(&vec![99u32; taken.len()]);
    let pool = g.pool(g.elements.len(), g.elements.len());
    run(&g.table(&taken), &arriving, &decisions, &pool);
    let mut counts = [0; 5];
    let mut sums = vec![0.0f64; g.elements.len() * FUNCTIONS * 9];
    for (&i, &found) in clear.iter().zip(&g.read(&decisions)) {
        let Outcome { decision, arrives, quotients } = &outcomes[i];
        assert_eq!(found, *decision, "pair {}: {quotients:?}", pairs[i]);
        counts[if arrives.is_some() { 4 } else { (found & !IN_SHADOW) as usize }] += 1;
        if let Some(arrives) = arrives {
            let first = pairs[i].x as usize * FUNCTIONS * 9;
            sums[first..].iter_mut().zip(flat(arrives)).for_each(|(sum, v)| *sum += v);
        }
    }
    println!("dropped, receiver, shooter, both split, transported: {counts:?}");
    assert!(counts[1] > 5 && counts[4] > 50, "{counts:?}");
    let found: Vec<f32> = g.read(&arriving).iter().map(|&v| v as f32 / units).collect();
    check("arriving", &found, &sums, 2e-4);
    assert_eq!(g.read(&pool)[0].transfers as usize, counts[4]);
}

#[test]
fn pairs_are_transported_or_split() {
    let mut g = grown_over(90, [0.5, 5.0]);
    hide_parts(&mut g);
    let mut random = Random(13);
    let count = g.elements.len();
    let unshot: Vec<Vec<Vec3>> = (0..count)
        .map(|_| {
            let first = Vec3::new(random.unit(), random.unit(), random.unit()) * random.below(4) as f32;
            vec![first, first * 0.3 * (random.unit() - 0.5), first * 0.3 * (random.unit() - 0.5)]
        })
        .collect();
    // Two thirds come of pairs that were partly blocked.
    let shadow = |a: u32, b: u32| if (a + b).is_multiple_of(3) { 0 } else { IN_SHADOW };
    let all = 0..count as u32;
    let pairs: Vec<UVec2> =
        all.clone().flat_map(|a| all.clone().map(move |b| UVec2::new(a, b | shadow(a, b)))).collect();
    let flat_unshot: Vec<Vec3> = unshot.iter().flatten().copied().collect();
    let flat_nodes: Vec<Vec3> = g.nodes.iter().flatten().copied().collect();
    let (p, world, units) = (g.method.placement(), &g.fixture.world, 1e7f32);
    let normals = g.read_normals();
    for (by, rays_per_node, wider, threshold, step) in [
        (Blockers::Triangles, 1, 16.0, 2e-3, 1),
        (Blockers::Triangles, 3, 1.0, 2e-2, 3),
        (Blockers::Clusters, 1, 6.0, 5e-3, 3),
    ] {
        let way = Way { threshold, bent_light: BENT_LIGHT, rays_per_node, wider, functions: FUNCTIONS, by };
        let pairs: Vec<UVec2> = pairs.iter().step_by(step).copied().collect();
        let of = |pair: &UVec2| {
            let (ends, shadow) = ([pair.x as usize, (pair.y & !IN_SHADOW) as usize], pair.y & IN_SHADOW);
            pair_twins::transport(&g.tables, &g.elements, (&g.nodes, &normals), &unshot, (ends, shadow), &way)
        };
        let outcomes: Vec<Outcome> = pairs.iter().map(of).collect();
        compare_outcomes(&g, &pairs, &outcomes, units, |taken, arriving, decisions, pool| {
            let mut recorder = g.context.recorder("test").unwrap();
            let pass = passes::Transport {
                bvh_nodes: g.fixture.bvh.nodes(),
                bvh_triangles: g.fixture.bvh.triangles(),
                triangles: &world.triangles,
                triangle_materials: &world.triangle_materials,
                attributes: &world.attributes,
                materials: &world.materials,
                triangle_places: &p.places,
                elements: &g.table(&g.elements),
                element_nodes: &g.table(&flat_nodes),
                node_normals: &g.table(&g.packed_normals()),
                fits: &g.table(&g.fits),
                rules: &g.table(&g.tables.rules),
                cluster_skips: &p.skips,
                clusters: &p.clusters,
                instances: &p.instances,
                tree_faces: &p.faces,
                positions: &world.positions,
                arriving,
                pool,
                textures: &world.textures,
                counters: &g.counters(taken.len()),
                taken_pairs: taken,
                unshot: &g.table(&flat_unshot),
                decisions,
                params: passes::TransportParams {
                    threshold: threshold as f32,
                    bent_light: BENT_LIGHT as f32,
                    units,
                    rays_per_node: rays_per_node as u32,
                    wider,
                },
                constants: passes::TransportConstants {
                    receiver_nodes: g.tables.receiver_nodes as u32,
                    shooter_nodes: SHOOTER.nodes().len() as u32,
                    irradiance_functions: FUNCTIONS as u32,
                    radiosity_functions: RADIOSITY_FUNCTIONS as u32,
                    alpha_test: false,
                    clusters_block: by == Blockers::Clusters,
                },
            };
            recorder.dispatch(&pass, taken.len());
            recorder.submit().unwrap();
        });
    }
}

#[test]
fn light_of_lamps_is_transported_or_split() {
    let mut g = grown_over(120, [0.5, 5.0]);
    hide_parts(&mut g);
    let (p, world, units) = (g.method.placement(), &g.fixture.world, 1e7f32);
    let normals = g.read_normals();
    let lights = g.read(&world.lights);
    let pairs: Vec<UVec2> =
        (0..g.elements.len() as u32).flat_map(|e| [0, 1, 2].map(|l| UVec2::new(e, l | 1 << 31))).collect();
    let flat_nodes: Vec<Vec3> = g.nodes.iter().flatten().copied().collect();
    let (threshold, far, ray_offset) = (0.05, 10.0f32, 1e-4f32);
    let by = Blockers::Triangles;
    let way = Way { threshold, bent_light: BENT_LIGHT, rays_per_node: 1, wider: 1.0, functions: FUNCTIONS, by };
    let of = |pair: &UVec2| {
        let (e, l) = (pair.x as usize, (pair.y & !(1 << 31)) as usize);
        let reach = [f64::from(far), f64::from(ray_offset)];
        pair_twins::transport_light(&g.tables, &g.elements[e], (&g.nodes[e], &normals[e]), &lights[l], &way, reach)
    };
    let outcomes: Vec<Outcome> = pairs.iter().map(of).collect();
    compare_outcomes(&g, &pairs, &outcomes, units, |taken, arriving, decisions, pool| {
        let mut recorder = g.context.recorder("test").unwrap();
        let pass = passes::TransportLights {
            bvh_nodes: g.fixture.bvh.nodes(),
            bvh_triangles: g.fixture.bvh.triangles(),
            triangles: &world.triangles,
            triangle_materials: &world.triangle_materials,
            attributes: &world.attributes,
            materials: &world.materials,
            triangle_places: &p.places,
            elements: &g.table(&g.elements),
            element_nodes: &g.table(&flat_nodes),
            node_normals: &g.table(&g.packed_normals()),
            fits: &g.table(&g.fits),
            rules: &g.table(&g.tables.rules),
            cluster_skips: &p.skips,
            clusters: &p.clusters,
            instances: &p.instances,
            tree_faces: &p.faces,
            positions: &world.positions,
            arriving,
            pool,
            textures: &world.textures,
            counters: &g.counters(taken.len()),
            taken_pairs: taken,
            lights: &world.lights,
            decisions,
            params: passes::TransportLightsParams {
                threshold: threshold as f32,
                bent_light: BENT_LIGHT as f32,
                units,
                far,
                ray_offset,
            },
            constants: passes::TransportLightsConstants {
                receiver_nodes: g.tables.receiver_nodes as u32,
                shooter_nodes: SHOOTER.nodes().len() as u32,
                irradiance_functions: FUNCTIONS as u32,
                alpha_test: false,
                clusters_block: false,
            },
        };
        recorder.dispatch(&pass, taken.len());
        recorder.submit().unwrap();
    });
}
