//! What antiradiance lets the user choose.

use super::BinCount;
use super::views::DebugView;
use crate::methods::pick::Pick;
use crate::stages::direction_bins::Spread;
use crate::stages::emitters::EmitterChoice;

crate::choice! {
    /// The order of the steps.
    pub enum Scheme {
        /// For each bounce, antiradiance is moved on until it settles; then light is reflected. Bounces are exact
        Asymmetric = "asymmetric",
        /// Each step reflects light and moves antiradiance on. Holds light of all bounces up to the number of iterations
        Symmetric = "symmetric",
    }
}

crate::choice! {
    /// Which surfaces take away light that meets their backs.
    pub enum Backs {
        /// All but the outsides of closed meshes
        Open = "open",
        /// All
        All = "all",
        /// Double-sided materials alone, as in the paper
        None = "none",
    }
}

crate::choice! {
    /// What carries light on flat parts of meshes.
    pub enum Leaves {
        /// The cell of each vertex, as on other parts
        Vertices = "vertices",
        /// Patches of a quadtree, each of the cells of several vertices: fewer links and smaller tables
        Patches = "patches",
    }
}

impl Settings {
    /// Indirect bounces in the light of a solve that was asked for `bounces`: each symmetric step takes in one more.
    pub fn bounces_held(&self, bounces: u32) -> u32 {
        if bounces > 0 && self.scheme == Scheme::Symmetric { self.iterations } else { bounces }
    }
}

crate::settings! {
    /// What antiradiance lets the user choose.
    pub struct Settings {
        /// Direction bins over the sphere: 8 k^2.
        bins: BinCount = BinCount::of_octant_side(5), paper "128 (128 to 1024)";
        /// The order of the steps.
        scheme: Scheme = Scheme::Asymmetric, paper "symmetric; both are given";
        /// Steps of the symmetric scheme. What the last steps reflect has crossed walls, whose antiradiance is not yet under way: in the
        /// dark parts of a maze two steps have eight times the light of two bounces, and six sevenths of that of all. Direct light that comes along links (of the environment, and of emitters that are not
        /// sampled) settles before them, in at most `depth` steps of antiradiance alone.
        iterations: u32 = 8, range 1..=1000, unit "steps", paper "4 (8 for the finest pictures)";
        /// Share of each step that is taken; halved, down to 1/16, where changes grow.
        damping: f32 = 1.0, range 0.0625..=1.0, paper "1";
        /// Steps for antiradiance to settle, per bounce, at most: surfaces one behind the other that light crosses.
        depth: u32 = 8, range 1..=1000, unit "steps", paper "the scene's depth complexity";
        /// Antiradiance has settled where a step changes less than this share of the light.
        tolerance: f32 = 0.002, range 0.0..=1.0, paper "not given";
        /// How a sender spreads over the receiver's bins.
        spread: Spread = Spread::Cone, paper "gaussian";
        /// What carries light on flat parts of meshes.
        leaves: Leaves = Leaves::Vertices, paper "patches on flat parts, vertices elsewhere";
        /// Longest side of a patch of a flat part, as a share of the scene's diagonal.
        patch_side: f32 = 0.03, range 0.001..=1.0, paper "not given";
        /// Largest solid angle of a node of a link, in bins. Larger makes fewer, coarser links.
        refinement: f32 = 3.0, range 0.01..=100.0, unit "bins", paper "1";
        /// Scale what a leaf receives along links of the nodes above by what an even light would bring to the leaf itself, in place
        /// of the node's centre. Without it the edges of rooms are too bright (a furnace of 3400 leaves and 128 bins: up to 18 %, 6 % with it).
        even_receivers: bool = true, paper "not given";
        /// How far below zero the light of a bin may fall, of what the bin, and its side on average, received unoccluded:
        /// keeps the iteration from growing where many surfaces stand one behind the other. 0 also cuts noise, and leaks; 1e9
        /// never cuts, but for the steps of the asymmetric scheme that follow the first of a bounce.
        undershoot: f32 = 0.1, range 0.0..=1e9, paper "no limit";
        /// Which surfaces take away light that meets their backs.
        backs: Backs = Backs::Open, paper "none: solids only";
        /// Leaves whose specular lobe reflects at least this much at normal incidence reflect it bin by bin; others reflect
        /// diffusely alone.
        gloss_threshold: f32 = 0.1, range 0.0..=2.0, paper "per material";
        /// Keep the tables in f16: half of the memory, entries off by 1/2048 at most.
        half_tables: bool = true, paper "on";
        /// How far animated parts may move before links are made anew; form factors follow in between.
        motion_margin: f32 = 0.0, range 0.0..=1e6, unit "m", paper "bounds stated per object";
        /// Average indirect light over the one-ring.
        smoothing: bool = true, paper "splatting or vertex interpolation";
        /// Neighbours take part in smoothing where normals differ by less than this.
        feature_angle: f32 = 30.0, range 0.0..=180.0, unit "degrees", paper "not given";
        /// How light of emissive surfaces reaches the elements directly.
        emitters: EmitterChoice = EmitterChoice::Auto, paper "as elements";
        /// Points on sampled emitters, together; each element casts a shadow ray to every one.
        emitter_samples: u32 = 64, range 1..=1024, unit "points", paper "not given";
        /// How far shadow rays start off their surface, as a share of the scene's extent.
        ray_offset: f32 = 1e-5, range 1e-7..=1e-2, paper "not given";
        /// What the picture shows.
        view: DebugView = DebugView::Radiance, paper "radiance";
        /// The direction of propagation that views show, about the vertical.
        view_azimuth: f32 = 0.0, range -360.0..=360.0, unit "degrees", paper "not given";
        /// And above the horizon.
        view_elevation: f32 = -90.0, range -90.0..=90.0, unit "degrees", paper "not given";
        /// The element whose links a view shows.
        pick: Pick = Pick::Nothing, paper "not given";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetric_steps_hold_a_bounce_each() {
        let asymmetric = Settings { iterations: 5, scheme: Scheme::Asymmetric, ..Settings::default() };
        let symmetric = Settings { scheme: Scheme::Symmetric, ..asymmetric };
        assert_eq!([0, 1, 2].map(|bounces| asymmetric.bounces_held(bounces)), [0, 1, 2]);
        assert_eq!([0, 1, 2].map(|bounces| symmetric.bounces_held(bounces)), [0, 5, 5]);
    }
}
