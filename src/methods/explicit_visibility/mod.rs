//! Explicit visibility [Schmitz2008]: light travels along vertex-to-vertex links found by casting rays.
//!
//! [Schmitz2008]: crate::methods::PAPERS

crate::settings! {
    /// What explicit visibility lets the user choose.
    pub struct Settings {
        /// Rays cast from every element over its hemisphere: a square number, in 4 x 4 blocks.
        rays_per_element: u32 = 256, range 16..=4096, unit "rays", paper "256, a 16 x 16 grid";
        /// Turn the ray grid of every element by its own offset, trading bands for noise.
        rotate_rays: bool = false, paper "off: every element casts the same directions";
        /// Average indirect light over the one-ring.
        smoothing: bool = true, paper "on";
        /// Neighbours take part in smoothing where normals differ by less than this.
        feature_angle: f32 = 30.0, range 0.0..=180.0, unit "degrees", paper "not given";
    }
}
