//! What leaves gather by their bins, of winners and of the sky, against a plain version over tables drawn by chance.

use crate::common::{Random, TestContext};
use crate::compare::{hold, tells_apart};
use crate::gloss_twins::{Case, N, SIDE, TOLERANCE, unit_vector};
use crate::twins;
use bytemuck::Zeroable;
use glam::{DVec3, Quat, Vec3};
use linklight::gpu::Sampled;
use linklight::gpu::shaders::methods::implicit_visibility as passes;
use linklight::gpu::shaders::types::Surfel;
use linklight::methods::implicit_visibility::bins;
use linklight::scene::environment::Environment;
use linklight::stages::world::WorldEnvironment;
use std::f64::consts::PI;

const BINS: u32 = 6 * N * N;

/// By bins, by bins that a sender does not fill, by discs; as `gather` numbers them.
const TRANSPORTS: [u32; 3] = [0, 1, 2];

/// What the kernel reads beside the case's tables.
#[derive(Clone)]
struct Senders {
    surfels: Vec<Surfel>,
    light_bins: Vec<u32>,
}

impl Senders {
    fn new(case: &Case, random: &mut Random) -> Self {
        let surfel = |random: &mut Random| Surfel {
            centre: 2.0 * unit_vector(random),
            normal: unit_vector(random),
            // Of the bin's size, on either side of it.
            area: 0.3 * random.unit(),
            ..Surfel::zeroed()
        };
        Self {
            surfels: case.node_radiosity.iter().map(|_| surfel(random)).collect(),
            light_bins: (0..BINS.div_ceil(32) * case.leaf_count()).map(|_| random.below(u32::MAX)).collect(),
        }
    }
}

fn on_device(context: &TestContext, case: &Case, senders: &Senders, constants: passes::GatherConstants) -> Vec<Vec3> {
    let irradiance = context.buffer::<Vec3>("test/irradiance", case.receivers.len()).unwrap();
    let pass = passes::Gather {
        winners: &context.upload("test/winners", &case.winners).unwrap(),
        receivers: &context.upload("test/receivers", &case.receivers).unwrap(),
        leaf_elements: &context.upload("test/elements", &case.leaf_elements).unwrap(),
        bin_vectors: &context.upload("test/vectors", &bins::vectors(N)).unwrap(),
        surfels: &context.upload("test/surfels", &senders.surfels).unwrap(),
        node_radiosity: &context.upload("test/radiosity", &case.node_radiosity).unwrap(),
        glossy_of_node: &context.upload("test/glossy of node", &case.glossy_of_node).unwrap(),
        specular: &context.upload("test/specular", &case.specular).unwrap(),
        irradiance: &irradiance,
        light_bins: &context.upload("test/light bins", &senders.light_bins).unwrap(),
        constants,
        params: passes::GatherParams { first_leaf: case.first_leaf, leaf_count: case.leaf_count(), bin_count: BINS },
    };
    let mut recorder = context.recorder("test").unwrap();
    recorder.fill(&irradiance, 0);
    recorder.dispatch(&pass, case.leaf_count());
    recorder.submit().unwrap();
    context.download(&irradiance).unwrap()
}

/// The twin of `gather`.
fn gathered(case: &Case, senders: &Senders, constants: &passes::GatherConstants) -> Vec<Vec3> {
    let mut irradiance = vec![Vec3::ZERO; case.receivers.len()];
    for local in 0..case.leaf_count() {
        let at = &case.receivers[(case.first_leaf + local) as usize];
        let frame = Quat::from_array(at.frame);
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for (bin, vector) in (0u32..).zip(bins::vectors(N)) {
            let towards = (frame * vector).as_dvec3();
            let mut weight = towards.dot(at.normal.as_dvec3()).max(0.0);
            total += weight;
            let winner = case.winners[(bin * case.leaf_count() + local) as usize];
            let is_light = senders.light_bins[(bin / 32 * case.leaf_count() + local) as usize] >> (bin % 32) & 1 != 0;
            if weight <= 0.0 || winner >= twins::BACK || (constants.of_emitters != 0 && !is_light) {
                continue;
            }
            let s = &senders.surfels[winner as usize];
            let offset = (s.centre - at.origin).as_dvec3();
            let solid_angle = f64::from(s.area) * s.normal.as_dvec3().dot(-offset).max(0.0) / offset.length().powi(3);
            weight = match constants.transport {
                0 => weight,
                1 => weight * (solid_angle / towards.length()).min(1.0),
                _ => solid_angle * at.normal.as_dvec3().dot(offset).max(0.0) / offset.length(),
            };
            let mut sent = case.node_radiosity[winner as usize].as_dvec3();
            let glossy = case.glossy_of_node[winner as usize];
            if constants.table_side != 0 && glossy != u32::MAX {
                let entry = bins::bin_of(-towards.as_vec3(), constants.table_side);
                let directions = 6 * constants.table_side * constants.table_side;
                sent += PI * case.specular[(glossy * directions + entry) as usize].as_dvec3();
            }
            sum += weight * sent;
        }
        let whole = if constants.transport == 2 { PI } else { total };
        irradiance[case.leaf_elements[(case.first_leaf + local) as usize] as usize] = (sum / whole).as_vec3();
    }
    irradiance
}

#[test]
fn leaves_gather_what_the_winners_of_their_bins_send() {
    let context = TestContext::new();
    let random = &mut Random(5);
    for (leaf_count, first_leaf) in [(1, 0), (65, 12)] {
        let case = Case::new(leaf_count, first_leaf, random);
        let senders = Senders::new(&case, random);
        for (transport, of_emitters, table_side) in
            TRANSPORTS.iter().flat_map(|&t| [(t, 0, 0), (t, 1, 0), (t, 0, SIDE)])
        {
            let what =
                format!("{leaf_count} leaves from {first_leaf}, transport {transport}, {of_emitters}, {table_side}");
            let constants = || passes::GatherConstants { transport, of_emitters, table_side };
            let twin = gathered(&case, &senders, &constants());
            hold(&what, &on_device(&context, &case, &senders, constants()), &twin, TOLERANCE);
        }
    }
    // Each table matters.
    let case = Case::new(40, 26, random);
    let senders = Senders::new(&case, random);
    let constants = |transport| passes::GatherConstants { transport, of_emitters: 1, table_side: SIDE };
    let differs = |what: &str, transport: u32, change: &dyn Fn(&mut Case, &mut Senders)| {
        let (mut other, mut others) = (case.clone(), senders.clone());
        change(&mut other, &mut others);
        let right = gathered(&case, &senders, &constants(transport));
        tells_apart(what, &gathered(&other, &others, &constants(transport)), &right, TOLERANCE);
    };
    differs("other winners", 0, &|case, _| case.winners.rotate_left(1));
    differs("other tables", 0, &|case, _| case.specular.rotate_left(1));
    differs("other light links", 0, &|_, senders| senders.light_bins.rotate_left(1));
    differs("frames left out", 0, &|case, _| case.receivers.iter_mut().for_each(|at| at.frame = [0.0, 0.0, 0.0, 1.0]));
    differs("larger senders", 1, &|_, senders| senders.surfels.iter_mut().for_each(|s| s.area *= 1.1));
    differs("turned senders", 2, &|_, senders| senders.surfels.iter_mut().for_each(|s| s.normal = -s.normal));
}

/// Bins along the world's axes take what was averaged over them; turned ones look into the sky.
#[test]
fn empty_bins_take_the_sky() {
    let context = TestContext::new();
    let random = &mut Random(6);
    let case = Case::new(33, 7, random);
    let even = Vec3::new(0.25, 0.5, 1.0);
    let sky = WorldEnvironment::new(&context, &Environment::Constant(even)).unwrap();
    let twin = |is_turned: bool, is_shut: bool| {
        let mut irradiance = vec![Vec3::ZERO; case.receivers.len()];
        for local in 0..case.leaf_count() {
            let at = &case.receivers[(case.first_leaf + local) as usize];
            let (mut sum, mut total) = (DVec3::ZERO, 0.0);
            for (bin, vector) in (0u32..).zip(bins::vectors(N)) {
                let weight = (Quat::from_array(at.frame) * vector).as_dvec3().dot(at.normal.as_dvec3()).max(0.0);
                total += weight;
                if is_shut || case.winners[(bin * case.leaf_count() + local) as usize] == twins::EMPTY {
                    sum += weight * if is_turned { even } else { case.bin_radiance[bin as usize] }.as_dvec3();
                }
            }
            irradiance[case.leaf_elements[(case.first_leaf + local) as usize] as usize] = (sum * PI / total).as_vec3();
        }
        irradiance
    };
    for is_turned in [false, true] {
        let irradiance = context.buffer::<Vec3>("test/irradiance", case.receivers.len()).unwrap();
        let pass = passes::Environment {
            winners: &context.upload("test/winners", &case.winners).unwrap(),
            receivers: &context.upload("test/receivers", &case.receivers).unwrap(),
            leaf_elements: &context.upload("test/elements", &case.leaf_elements).unwrap(),
            bin_vectors: &context.upload("test/vectors", &bins::vectors(N)).unwrap(),
            bin_radiance: &context.upload("test/sky", &case.bin_radiance).unwrap(),
            environment_info: &sky.info_buffer,
            environment_map: Sampled { image: &sky.map, sampler: &sky.sampler },
            irradiance: &irradiance,
            params: passes::EnvironmentParams {
                first_leaf: case.first_leaf,
                leaf_count: case.leaf_count(),
                n: N,
                is_turned: u32::from(is_turned),
            },
        };
        let mut recorder = context.recorder("test").unwrap();
        recorder.fill(&irradiance, 0);
        recorder.dispatch(&pass, case.leaf_count());
        recorder.submit().unwrap();
        let expected = twin(is_turned, false);
        hold("environment", &context.download(&irradiance).unwrap(), &expected, TOLERANCE);
        tells_apart("bins that are shut", &twin(is_turned, true), &expected, TOLERANCE);
    }
    tells_apart("the other sky", &twin(true, false), &twin(false, false), TOLERANCE);
}
