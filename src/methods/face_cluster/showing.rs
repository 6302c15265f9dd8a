//! What the method offers the display: light, or false colours of its elements.

use super::{FaceClusterError, FaceClusters};
use crate::gpu::shaders::types::FaceElement;
use crate::gpu::{Buffer, Context};
use crate::stages::false_color;
use crate::stages::irradiance_vector::ElementLight;
use glam::Vec3;

crate::choice! {
    /// What a picture shows.
    pub enum Shown {
        /// Light
        Light = "light",
        /// Leaf elements, each in a colour of its own
        Elements = "elements",
        /// How deep the leaves lie in their trees
        Levels = "levels",
        /// What is left to shoot
        Unshot = "unshot",
    }
}

crate::choice! {
    /// Where light is turned into colour.
    pub enum Shading {
        /// At every pixel
        Pixel = "pixel",
        /// At every vertex, interpolated
        Vertex = "vertex",
    }
}

/// Colours of the elements where a picture shows them; one entry, not looked at, where it shows light.
pub type Colors = Buffer<Vec3>;

impl FaceClusters {
    /// False colours of the present elements, as the settings ask.
    pub fn colors(&self, context: &Context) -> Result<Colors, FaceClusterError> {
        let count = self.report.elements as usize;
        let colors = match self.settings.show {
            Shown::Light => vec![Vec3::ZERO],
            Shown::Elements => (0..count as u32).map(false_color::of_index).collect(),
            Shown::Levels => {
                let elements: Vec<FaceElement> = context.download_range(&self.state.elements, 0..count)?;
                let deepest = self.report.element_depth.max(1) as f32;
                elements.iter().map(|e| false_color::of_amount(e.level as f32 / deepest)).collect()
            }
            Shown::Unshot => {
                let functions = self.settings.radiosity_basis.functions() as usize;
                let unshot = context.download_range(&self.state.next_unshot, 0..count * functions)?;
                unshot.iter().step_by(functions).map(|&b| b.max(Vec3::ZERO) / std::f32::consts::PI).collect()
            }
        };
        Ok(context.upload("face-cluster/colors", &colors)?)
    }

    /// For [`crate::display::irradiance_vector::draw`].
    pub fn light<'a>(&'a self, colors: &'a Colors) -> ElementLight<'a> {
        ElementLight {
            elements: &self.state.elements,
            triangle_elements: &self.state.triangle_elements,
            direct: &self.state.direct,
            indirect: &self.state.indirect,
            functions: self.settings.irradiance_basis.functions(),
            colors,
            shows_colors: self.settings.show != Shown::Light,
            least_alpha: self.settings.least_alpha,
            per_vertex: self.settings.shading == Shading::Vertex,
        }
    }
}
