//! What implicit visibility lets the user choose.

use super::DebugView;
use crate::methods::pick::Pick;
use crate::stages::emitters::EmitterChoice;

crate::choice! {
    /// Which bins a link goes into.
    pub enum Footprint {
        /// All whose central direction meets the sender
        Covered = "covered",
        /// The one towards the sender's centre
        Single = "single",
    }
}

crate::choice! {
    /// What a winner's light counts in its bin.
    pub enum Transport {
        /// As much as the bin: the winner covers it
        Coverage = "coverage",
        /// Form factor from point to disc, the paper's Eq. 5, with one bin a link
        Disc = "disc",
    }
}

crate::choice! {
    /// How the bins of leaves are turned.
    pub enum Frames {
        /// Along the world's axes
        World = "world",
        /// With the surface: along its normal and an edge
        Surface = "surface",
    }
}

crate::settings! {
    /// What implicit visibility lets the user choose.
    pub struct Settings {
        /// Direction bins along each side of a face of an element's cube map.
        bins: u32 = 12, range 2..=64, unit "bins", paper "8, 12 or 16";
        /// A flat node may fill so much of a bin's solid angle before it is refined, a bent one down to a quarter of it. With 1
        /// three quarters more links are proposed than with 2, and of 1,000 bins 5 instead of 7 are given to what stands beside.
        refinement: f32 = 2.0, range 0.01..=16.0, paper "1";
        /// Link all pairs of leaves instead of nodes of the hierarchy.
        brute_force: bool = false, paper "off; its Fig. 10 compares";
        /// Which bins a link goes into.
        footprint: Footprint = Footprint::Covered, paper "single";
        /// Close single empty bins between filled ones, which are gaps between surfels.
        fill_holes: bool = true, paper "off";
        /// What a winner's light counts in its bin.
        transport: Transport = Transport::Coverage, paper "disc";
        /// How the bins of leaves are turned.
        frames: Frames = Frames::World, paper "world";
        /// Turn all bins by this much. Another angle each frame trades bands for noise; averaging such frames was not found
        /// to calm what flickers around things that move.
        spin: f32 = 0.0, range -360.0..=360.0, unit "degrees", paper "0";
        /// How light of emissive surfaces reaches the elements directly.
        emitters: EmitterChoice = EmitterChoice::Auto, paper "along links";
        /// Points on sampled emitters, together; each is hidden by the surfaces that the bins around the way to it name, of the
        /// element and of the emitter.
        emitter_samples: u32 = 64, range 1..=1024, unit "points", paper "not given";
        /// Directions that stand for what is bright in the environment, at most; each is hidden by the surfaces that the bins
        /// around it name. With 0 all of the environment comes through the bins.
        sky_spots: u32 = 64, range 0..=1024, unit "directions", paper "0";
        /// Surfaces that reflect at least so much at normal incidence are glossy: they send their lobe along; 2 for none.
        glossy: f32 = 0.1, range 0.0..=2.0, paper "all";
        /// Directions along each side of a face of the cube in which glossy elements and nodes send.
        glossy_bins: u32 = 4, range 1..=16, unit "bins", paper "none on the GPU";
        /// Average indirect light over the one-ring.
        smoothing: bool = true, paper "off";
        /// Neighbours take part in smoothing where normals differ by less than this.
        feature_angle: f32 = 30.0, range 0.0..=180.0, unit "degrees", paper "not given";
        /// Take charts from the model's texture coordinates where they can serve.
        model_charts: bool = true, paper "on";
        /// Memory for the bins while links are made; more takes fewer windows.
        link_memory: u32 = 96, range 1..=4096, unit "MiB", paper "not given";
        /// How far off its surface an element looks from, as a share of the scene's extent.
        ray_offset: f32 = 1e-5, range 1e-7..=1e-2, paper "not given";
        /// What the picture shows.
        view: DebugView = DebugView::Radiance, paper "radiance";
        /// The element whose bins a view shows.
        pick: Pick = Pick::Nothing, paper "not given";
    }
}

impl Settings {
    /// Bins of one element.
    pub fn bin_count(&self) -> u32 {
        6 * self.bins * self.bins
    }

    /// Whether leaves' bins are not along the world's axes.
    pub(super) fn is_turned(&self) -> bool {
        self.frames != Frames::World || self.spin != 0.0
    }

    /// What a sender weighs, as `gather.comp` numbers it.
    pub(super) fn transport_kind(&self) -> u32 {
        match (self.transport, self.footprint) {
            (Transport::Coverage, Footprint::Covered) => 0,
            (Transport::Coverage, Footprint::Single) => 1,
            (Transport::Disc, _) => 2,
        }
    }

    pub(super) fn footprint(&self) -> Footprint {
        if self.transport == Transport::Disc { Footprint::Single } else { self.footprint }
    }
}
