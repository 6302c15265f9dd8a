//! What the method offers the display: light, or false colours of its elements.

use super::{FaceClusterError, FaceClusters, Solution};
use crate::gpu::shaders::types::FaceElement;
use crate::gpu::{Buffer, Context};
use crate::stages::false_color;
use crate::stages::irradiance_vector::ElementLight;
use glam::{Mat3, Vec3};

crate::choice! {
    /// What a picture shows.
    pub enum Shown {
        /// Light
        Light = "light",
        /// Leaf elements, each in a colour of its own
        Elements = "elements",
        /// How deep the leaves lie in their trees
        Levels = "levels",
        /// How much functions beyond the first tell of the irradiance
        Orders = "orders",
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

impl FaceClusters {
    /// False colours of the leaves, as the settings ask.
    pub(super) fn colors(&self, context: &Context) -> Result<Buffer<Vec3>, FaceClusterError> {
        let (s, shown, count) = (&self.state, self.settings.show, self.report.elements as usize);
        let mut colors = vec![Vec3::ZERO];
        if shown != Shown::Light {
            let elements: Vec<FaceElement> = context.download_range(&s.elements, 0..count)?;
            let functions = self.settings.irradiance_basis.functions() as usize;
            let radiosity_functions = self.settings.radiosity_basis.functions() as usize;
            let light = match shown {
                Shown::Orders => {
                    let [direct, indirect] =
                        [&s.direct, &s.indirect].map(|of| context.download_range(of, 0..count * functions));
                    direct?.iter().zip(&indirect?).map(|(d, i)| of_array(d) + of_array(i)).collect()
                }
                _ => Vec::new(),
            };
            let unshot = match shown {
                Shown::Unshot => context.download_range(&s.next_unshot, 0..count * radiosity_functions)?,
                _ => Vec::new(),
            };
            let deepest = self.report.element_depth.max(1) as f32;
            let leaves = elements.iter().enumerate().filter(|(_, element)| element.children == u32::MAX);
            let color = |(index, element): (usize, &FaceElement)| match shown {
                Shown::Light => Vec3::ZERO,
                Shown::Elements => false_color::of_index(element.cluster.wrapping_add(7919 * element.instance)),
                Shown::Levels => false_color::of_amount(element.level as f32 / deepest),
                Shown::Orders => false_color::of_amount(beyond_first(&light[index * functions..][..functions])),
                Shown::Unshot => unshot[index * radiosity_functions].max(Vec3::ZERO) / std::f32::consts::PI,
            };
            colors = leaves.map(color).collect();
        }
        Ok(context.upload("face-cluster/colors", &colors)?)
    }

    /// For [`crate::display::irradiance_vector::draw`].
    pub fn light<'a>(&'a self, solution: &'a Solution) -> ElementLight<'a> {
        ElementLight {
            leaves: &solution.leaves,
            triangle_leaves: &self.state.triangle_leaves,
            direct: &solution.direct,
            indirect: &solution.indirect,
            unit: solution.unit,
            functions: self.settings.irradiance_basis.functions(),
            neighbour_offsets: &solution.neighbour_offsets,
            neighbours: &solution.neighbours,
            reach: self.settings.leaf_reach,
            colors: &solution.colors,
            shows_colors: self.settings.show != Shown::Light,
            least_alpha: self.settings.least_alpha,
            per_vertex: self.settings.shading == Shading::Vertex,
        }
    }
}

fn of_array(columns: &[[f32; 3]; 3]) -> Mat3 {
    Mat3::from_cols_array_2d(columns)
}

/// Share of the light that the functions after the first tell of, by size: they are orthonormal.
fn beyond_first(light: &[Mat3]) -> f32 {
    let size = |m: &Mat3| m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared();
    let (first, rest) = light.split_first().map_or((0.0, 0.0), |(f, rest)| (size(f), rest.iter().map(size).sum()));
    if first + rest > 0.0 { (rest / (first + rest)).sqrt() } else { 0.0 }
}
