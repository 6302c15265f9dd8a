//! Debug views: false colours per element that show the links.

use super::ExplicitVisibility;
use crate::gpu::{Context, GpuError};
use crate::stages::false_color::{self, NEUTRAL, PICKED};
use glam::Vec3;

crate::choice! {
    /// What a picture shows.
    pub enum Shown {
        /// Light
        Light = "light",
        /// How many frames ago the links of each element were made: blue this one, red the oldest
        LinkAge = "link-age",
        /// The senders that the picked element is linked with, by form factor: blue least, red most
        LinksIn = "links-in",
        /// The receivers that are linked with the picked element, by their form factor to it
        LinksOut = "links-out",
    }
}

impl ExplicitVisibility {
    /// Whether the settings ask for a view instead of light.
    pub fn shows_view(&self) -> bool {
        self.settings.show != Shown::Light
    }

    /// A colour per element for the view that the settings ask for; `None` for light.
    pub fn view_colors(&self, context: &Context, picked: Option<u32>) -> Result<Option<Vec<Vec3>>, GpuError> {
        let picked = picked.filter(|&element| element < self.elements.count);
        let weights: Vec<(u32, f32)> = match (self.settings.show, picked) {
            (Shown::Light, _) => return Ok(None),
            (Shown::LinkAge, _) => return Ok(Some(self.ages_as_colors())),
            (_, None) => Vec::new(),
            (Shown::LinksIn, Some(picked)) => {
                self.links.of_element(context, picked)?.iter().map(|link| (link.sender, link.weight)).collect()
            }
            (Shown::LinksOut, Some(picked)) => {
                let (links, offsets) = (self.links.download(context)?, context.download(&self.links.offsets)?);
                let to_picked = |(receiver, row): (usize, &[u32])| {
                    let own = &links[row[0] as usize..row[1] as usize];
                    own.iter().find(|link| link.sender == picked).map(|link| (receiver as u32, link.weight))
                };
                offsets.windows(2).enumerate().filter_map(to_picked).collect()
            }
        };
        let mut colors = vec![NEUTRAL; self.elements.count as usize];
        let most = weights.iter().map(|&(_, weight)| weight).fold(f32::MIN_POSITIVE, f32::max);
        for (element, weight) in weights {
            colors[element as usize] = false_color::of_amount(weight / most);
        }
        if let Some(picked) = picked {
            colors[picked as usize] = PICKED;
        }
        Ok(Some(colors))
    }

    fn ages_as_colors(&self) -> Vec<Vec3> {
        let (ages, oldest) = (self.link_ages(), self.oldest_link().max(1) as f32);
        let color = |age: u32| false_color::of_amount(age as f32 / oldest);
        if ages.is_empty() {
            return vec![color(0); self.elements.count as usize];
        }
        ages.into_iter().map(color).collect()
    }
}
