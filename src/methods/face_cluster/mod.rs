//! Hierarchical higher-order face cluster radiosity [Gobbetti2003]: light is exchanged between clusters of faces as
//! vector irradiance on higher-order bases, so that the fine mesh is touched only when it is drawn.
//!
//! Every mesh is clustered once, down to its faces. Elements are clusters placed in the world, made only where a
//! transfer of light asks for them. Each iteration shoots all unshot light: pairs of a receiver and a shooter are split
//! until the bounds on what the receiver would reflect are tight, what arrives is pushed down to the leaves, reflected,
//! and pulled up as the next iteration's unshot light. No links are kept.
//!
//! | paper | here | unit | buffer |
//! |---|---|---|---|
//! | face cluster | [`FaceCluster`](crate::gpu::shaders::types::FaceCluster) | – | [`Placement::clusters`] |
//! | A_i, A_i^(n), D+, D- | area, `vector_area`, `facing` | m2 | of a cluster |
//! | element i | `FaceElement` | – | [`State::elements`] |
//! | Phi_a | `basis`, [`Settings::irradiance_basis`], [`Settings::radiosity_basis`] | 1 | `lib/cluster_basis.glsl` |
//! | m(x, y), K | made where needed | m^-2 | `transport` |
//! | E_i,a | irradiance vector, a column a channel; direct and indirect | W/m2 | `face-cluster/direct`, `face-cluster/indirect`; of leaves, kept: [`Solution`] |
//! | Delta E | arriving, whole units | W/m2 | `face-cluster/arriving` |
//! | Delta B, Delta B' | unshot, next unshot | W/m2 | `face-cluster/unshot`, `face-cluster/next unshot` |
//! | delta_ij | error against [`Settings::threshold`] | W | `transport` |
//! | F_ii | `self_share` | 1 | `transport` |
//! | – | `fits`: nodes to functions | 1 | `face-cluster/fits`, `face-cluster/function means` |
//!
//! **Per frame without new clusters:** lights, environment; everything is shot anew. **With new clusters:** surfaces
//! and materials.
//!
//! Differs from [Gobbetti2003]: pairs are refined level by level by all threads at once and their contributions summed
//! in whole units, so that the result does not depend on their order; punctual lights and an environment shine too;
//! cubature nodes are laid on the faces, on a single one by a rule for triangles, and count where they stand in a
//! flat element's square, each for as much as makes their sums right over its faces, where these do not fill it;
//! flat shooters of up to eight faces are measured exactly unless they are far; what lies inside other closed
//! bodies is no surface: it neither takes light nor weighs in a cluster's mean;
//! errors are judged against the light they belong to, as much of it as strikes surfaces, which a coarse look measures
//! where that light is kept;
//! what has faces that look many ways is split also where its power is too small to matter, since one normal would leave
//! half of them dark; what is near a large one is bounded by what that may fill of the hemisphere, since its nodes alone
//! say too little; rays decide whether a pair is split and others measure what is let pass, one a node unless told
//! otherwise, drawn by what would pass along them; the larger of both is split, but where an emitter's light is blocked
//! the receiver, until it is a quarter as wide;
//! transfers are made with the projected area expected between its bounds, not the lower bound, and what faces get beyond
//! their vector area lies along the mean normal; (1 - F_ii) is not applied to what is reflected: F_ii of it is shot at
//! the cluster itself, F_ii being what its nodes see of each other, below the bound; while light is shot, inner elements have room for
//! irradiance too, but a [`Solution`] is of leaves alone.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

mod lights;
mod placement;
mod report;
pub mod rules;
mod shooting;
pub mod showing;
mod solution;
mod state;
mod transfer;

pub use placement::Placement;
pub use report::Report;
pub use solution::Solution;
pub use state::State;

use crate::gpu::{Context, GpuError};
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::geometry::Geometry;
use crate::scene::pose::Pose;
use crate::stages::bvh::Bvh;
use crate::stages::pair_queue::{PairQueue, PairQueueError, PairQueuePlan};
use crate::stages::work::{Interrupted, Watch};
use crate::stages::world::World;
use glam::Vec3;
use rules::{Basis, Rule};
use showing::{Shading, Shown};
use std::path::Path;

/// Pairs of a step of refinement.
const BATCH: u32 = 1 << 12;
/// Pairs that refinement starts from at once.
const SEEDS: usize = 1 << 14;

crate::choice! {
    /// Ways to find what blocks light.
    pub enum Visibility {
        /// Rays at the faces: exact
        Rays = "rays",
        /// Clusters as small as their shadows matter, more or less opaque
        Clusters = "clusters",
    }
}

crate::settings! {
    /// What face-cluster radiosity lets the user choose.
    pub struct Settings {
        /// Error of a transfer that is let pass, as a share of what strikes surfaces of the light it belongs to: emitted,
        /// distant, or reflected once; of punctual light, which is shown per pixel, as a share of what is sent.
        threshold: f32 = 1e-5, range 1e-9..=1.0, paper "1e-5 of all emitted power";
        /// Light at which a receiver or shooter whose faces look many ways is split whatever its power, as a share of the
        /// mean irradiance that its pass of light would give all surfaces.
        bent_light: f32 = 0.002, range 0.0..=1e6, paper "not done";
        /// Functions that vector irradiance is stored on.
        irradiance_basis: Basis = Basis::Linear, paper "constant, linear or quadratic";
        /// Functions that unshot radiosity is stored on: no more than those of irradiance.
        radiosity_basis: Basis = Basis::Constant, paper "constant";
        /// Cubature rule on receivers; a cubic basis needs sixteen nodes.
        receiver_rule: Rule = Rule::Seven, paper "degree 5 (7 nodes)";
        /// Cubature rule on shooters.
        shooter_rule: Rule = Rule::Six, paper "degree 4 (6 nodes)";
        /// What says whether light passes.
        visibility: Visibility = Visibility::Rays, paper "clusters";
        /// Shadow rays from each receiver node, to shooter nodes drawn by what would pass; as many from each of the other
        /// nodes back measure what is let pass.
        rays_per_node: u32 = 1, range 1..=16, unit "rays", paper "one to every shooter node: 6";
        /// Iterations end when the largest unshot radiosity falls below this share of the first.
        convergence: f32 = 1e-3, range 0.0..=1.0, paper "a user-defined threshold; 10 iterations";
        /// Clusters are not split below this share of the scene's area.
        least_area: f32 = 1e-7, range 0.0..=1e-2, paper "down to faces";
        /// Elements that may be made, at most.
        max_elements: u32 = 262144, range 64..=1048576, paper "not limited";
        /// Distant emitters that stand for an environment.
        environment_directions: u32 = 128, range 8..=2048, paper "no environment";
        /// Where light is turned into colour.
        shading: Shading = Shading::Pixel, paper "vertex; pixel announced";
        /// GGX alpha of the narrowest lobe: one direction a channel stands for all light.
        least_alpha: f32 = 0.2, range 0.001..=1.0, paper "moderately glossy: a Phong exponent of 10, alpha 0.41";
        /// How far the light of a leaf reaches over its border, blended with that of the leaves there; 0: in steps.
        leaf_reach: f32 = 0.5, range 0.0..=1.0, unit "half sides", paper "not done; a post-pass is named";
        /// What the picture shows.
        show: Shown = Shown::Light, paper "light, and leaf clusters";
    }
}

/// Why the method cannot be prepared or solved.
#[derive(Debug, thiserror::Error)]
pub enum FaceClusterError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    #[error(transparent)]
    Queue(#[from] PairQueueError),
    #[error(
        "radiosity_basis={radiosity} has functions that irradiance_basis={irradiance} has not; choose a radiosity basis of \
         at most the irradiance's"
    )]
    Bases { radiosity: String, irradiance: String },
    #[error(
        "receiver_rule={rule} is of degree {degree}, but projecting on irradiance_basis={basis} needs degree {needed}; \
         choose a rule of more nodes (sixteen) or a lower basis"
    )]
    Rule { rule: String, degree: u32, basis: String, needed: u32 },
    #[error(
        "all {capacity} elements are in use and light asks for more; raise max_elements or threshold (now {threshold:e})"
    )]
    PoolFull { capacity: u32, threshold: f32 },
    #[error("face-cluster radiosity needs {needed} bytes, {available} are available; lower max_elements or the bases")]
    OutOfMemory { needed: u64, available: u64 },
}

/// What the method reads of the scene: plain data, and its form on the device in the present pose.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    pub scene: &'a Scene,
    pub geometry: &'a Geometry,
    /// World space, one per vertex; equal where vertices stand at one place.
    pub rest_positions: &'a [Vec3],
    pub pose: &'a Pose,
    /// World-space corners.
    pub bounds: [Vec3; 2],
    pub environment: &'a Environment,
    pub world: &'a World,
    pub bvh: &'a Bvh,
    /// Folder that keeps cluster trees between runs.
    pub cluster_cache: Option<&'a Path>,
    pub watch: &'a dyn Watch,
}

/// The method on one scene: its clusters, elements and light.
pub struct FaceClusters {
    settings: Settings,
    placement: Placement,
    state: State,
    queue: PairQueue,
    report: Report,
    /// Bounds all irradiance of the present solution, W/m2.
    most_light: f32,
}

impl FaceClusters {
    /// Clusters all meshes and makes room for their roots: everything but the light itself.
    pub fn prepare(context: &Context, stage: &Stage<'_>, settings: Settings) -> Result<Self, FaceClusterError> {
        let Settings { irradiance_basis, radiosity_basis, receiver_rule, .. } = settings;
        if radiosity_basis.functions() > irradiance_basis.functions() {
            return Err(FaceClusterError::Bases {
                radiosity: rules::name(radiosity_basis),
                irradiance: rules::name(irradiance_basis),
            });
        }
        let needed = 2 * irradiance_basis.degree();
        if receiver_rule.degree() < needed {
            let (rule, degree, basis) =
                (rules::name(receiver_rule), receiver_rule.degree(), rules::name(irradiance_basis));
            return Err(FaceClusterError::Rule { rule, degree, basis, needed });
        }
        stage.watch.step("clusters", 0, 1)?;
        let clock = std::time::Instant::now();
        let placement = Placement::new(context, stage, settings.least_area)?;
        let clustering = clock.elapsed();
        stage.watch.step("clusters", 1, 1)?;
        let state = State::new(context, &settings, &placement, stage.world.triangle_count)?;
        let levels = 2 * placement.depth + 1;
        let plan = PairQueuePlan { batch: BATCH, max_children: 4, levels, seeds: SEEDS as u32 };
        let queue = PairQueue::new(context, "face-cluster", plan)?;
        let report = Report::new(stage, &placement, clustering);
        Ok(Self { settings, placement, state, queue, report, most_light: 0.0 })
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    pub fn state(&self) -> &State {
        &self.state
    }

    pub fn report(&self) -> &Report {
        &self.report
    }
}
