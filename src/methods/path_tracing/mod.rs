//! The reference [Kajiya1986]: unidirectional paths with next-event estimation and multiple importance sampling
//! [Veach1995].
//!
//! [Kajiya1986]: crate::methods::PAPERS
//! [Veach1995]: crate::methods::PAPERS

crate::choice! {
    /// How next-event estimation picks an emissive triangle.
    pub enum EmitterSampling {
        /// In proportion to emitted power
        Power = "power",
        /// In proportion to area
        Area = "area",
    }
}

crate::settings! {
    /// What the reference lets the user choose.
    pub struct Settings {
        /// How next-event estimation picks an emissive triangle.
        emitter_sampling: EmitterSampling = EmitterSampling::Power, paper "not given";
    }
}
