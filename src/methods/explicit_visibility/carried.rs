//! What the links of one element carried in the last bounce.

use super::ExplicitVisibility;
use crate::gpu::{Context, GpuError};
use crate::methods::carried::{Carried, Sender};

impl ExplicitVisibility {
    /// By links, weights and radiosities as they were gathered; after a solve with bounces.
    pub fn carried_to(&self, context: &Context, element: u32) -> Result<Vec<Carried>, GpuError> {
        let at = element as usize;
        // As `elements/fill_unresolved` decides.
        let blocked = context.download_range(&self.outcomes.counts, at..at + 1)?[0] & 0xffff;
        if blocked * 2 > self.settings.rays_per_element.get() {
            let irradiance = context.download_range(&self.state.irradiance, at..at + 1)?[0];
            return Ok(vec![Carried { from: Sender::Neighbours, irradiance }]);
        }
        let links = self.links.of_element(context, element)?;
        let sent = self.links.sent(context)?;
        let carried = |link: crate::stages::links::Link| Carried {
            from: Sender::Element(link.sender),
            irradiance: link.weight * sent[link.sender as usize],
        };
        Ok(links.into_iter().map(carried).collect())
    }
}
