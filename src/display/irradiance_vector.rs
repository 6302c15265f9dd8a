//! Vector-irradiance display: every pixel (or every vertex) finds its leaf element, evaluates one irradiance vector a
//! channel, and is shaded as if light came along them; punctual light comes from shadow maps.  [Gobbetti2003 3.5]
//!
//! A vector has no angular spread, so lobes are never narrower than a setting.
//!
//! [Gobbetti2003]: crate::methods::PAPERS

use super::direct::{self, Sample};
use super::g_buffer::GBuffer;
use super::shadow_maps::ShadowMaps;
use super::{PixelView, sample_offset};
use crate::gpu::shaders::display::{IrradianceVector, IrradianceVectorConstants, IrradianceVectorParams};
use crate::gpu::shaders::types::FaceElement;
use crate::gpu::{Buffer, Recorder};
use crate::scene::camera::View;
use crate::stages::film::Film;
use crate::stages::world::World;
use glam::{UVec2, Vec3};

/// What a method offers per element.
#[derive(Clone, Copy)]
pub struct ElementLight<'a> {
    pub elements: &'a Buffer<FaceElement>,
    /// Per triangle: the elements of its front and back, u32::MAX where there is none.
    pub triangle_elements: &'a Buffer<UVec2>,
    /// From emitters and the environment, per element and function; a column a channel, W/m2.
    pub direct: &'a Buffer<[[f32; 3]; 3]>,
    /// Reflected at least once.
    pub indirect: &'a Buffer<[[f32; 3]; 3]>,
    /// Functions an element.
    pub functions: u32,
    /// False colours per element.
    pub colors: &'a Buffer<Vec3>,
    /// They are shown instead of all light, unlit.
    pub shows_colors: bool,
    /// GGX alpha of the narrowest lobe.
    pub least_alpha: f32,
    /// Shade at vertices and interpolate.
    pub per_vertex: bool,
}

/// Fills `film` with the mean of `samples` pictures, each shifted within the pixel.
#[expect(clippy::too_many_arguments, reason = "everything a picture is made of, each by its own type")]
pub fn draw(
    recorder: &mut Recorder<'_>,
    world: &World,
    light: ElementLight<'_>,
    shadow_maps: &ShadowMaps,
    g_buffer: &GBuffer,
    view: &View,
    samples: u32,
    film: &Film,
) {
    let size = UVec2::new(film.width, film.height);
    for sample in 0..samples {
        let pixel_view = PixelView::new(view, size, sample_offset(sample, samples));
        recorder.scope("sample", |recorder| {
            let sample = Sample { index: sample, samples, is_unlit: light.shows_colors };
            direct::draw(recorder, world, shadow_maps, g_buffer, &pixel_view, sample, film);
            let pass = IrradianceVector {
                visible_triangles: g_buffer.sampled(&g_buffer.visible_triangles),
                g_position: g_buffer.sampled(&g_buffer.position),
                g_normal: g_buffer.sampled(&g_buffer.normal),
                g_albedo: g_buffer.sampled(&g_buffer.albedo),
                g_specular: g_buffer.sampled(&g_buffer.specular),
                g_emission: g_buffer.sampled(&g_buffer.emission),
                triangles: &world.triangles,
                positions: &world.positions,
                normals: &world.normals,
                elements: light.elements,
                triangle_elements: light.triangle_elements,
                direct_irradiance: light.direct,
                indirect_irradiance: light.indirect,
                colors: light.colors,
                direct: &film.direct,
                indirect: &film.indirect,
                params: IrradianceVectorParams {
                    eye: pixel_view.eye,
                    weight: 1.0 / samples as f32,
                    least_alpha: light.least_alpha,
                    per_vertex: u32::from(light.per_vertex),
                    shows_colors: u32::from(light.shows_colors),
                },
                constants: IrradianceVectorConstants { irradiance_functions: light.functions },
            };
            recorder.dispatch(&pass, [film.width, film.height]);
        });
    }
}
