//! A method's solution as plain numbers: irradiance of elements, and of the texels of an atlas.

use glam::Vec3;

use crate::app::AppError;
use crate::app::frame::Solved;
use crate::app::on_clusters::AtVertices;
use crate::app::on_elements::OnElements;
use crate::app::render::{LightParts, RenderRequest};
use crate::app::stage::Stage;
use crate::gpu::Context;
use crate::methods::surface_shadow_maps::SurfaceShadowMaps;
use crate::scene::atlas::{Atlas, NO_TEXEL};
use crate::stages::elements::{ElementTopology, Elements};
use crate::stages::irradiance_vector::ElementLight as LeafLight;

/// Rays start off their surface by so much of the scene's extent.
const RAY_OFFSET: f32 = 1e-5;

/// What the elements at the vertices receive, reflect and emit. Element `v` is the front of vertex `v`.
pub struct ElementLight {
    /// W/m2, of the parts of light that were asked for.
    pub irradiance: Vec<Vec3>,
    /// W/m2, all of it: what the surfaces reflect.
    pub whole_irradiance: Vec<Vec3>,
    pub albedo: Vec<Vec3>,
    /// W m^-2 sr^-1.
    pub emission: Vec<Vec3>,
    /// Per vertex; u32::MAX where the surface is one-sided.
    pub back_elements: Vec<u32>,
}

/// An atlas with what its texels receive, W/m2 each.
pub struct TexelLight {
    pub atlas: Atlas,
    pub irradiance: Vec<Vec3>,
}

impl ElementLight {
    /// The solution at the vertices, and at texels where the method has its own.
    pub fn of(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        solved: &Solved<'_>,
    ) -> Result<(Self, Option<TexelLight>), AppError> {
        match solved {
            Solved::Elements(method) => Ok((Self::of_elements(context, request, *method)?, None)),
            Solved::Texels(method) => Self::of_texels(context, request, stage, method),
            Solved::Clusters(method, solution) => {
                let light = method.light(solution);
                Ok((Self::of_clusters(context, request, stage, light)?, None))
            }
            Solved::Pixels => {
                Err(AppError::Usage(format!("{} has no solution on surfaces to bake", request.method.key)))
            }
        }
    }

    fn of_elements(context: &Context, request: &RenderRequest, method: &dyn OnElements) -> Result<Self, AppError> {
        let elements = method.elements();
        let direct =
            sum(&[context.download(method.punctual_irradiance())?, context.download(method.direct_irradiance())?]);
        let indirect = context.download(method.indirect_irradiance())?;
        Ok(Self {
            irradiance: parts(request, &direct, &indirect),
            whole_irradiance: sum(&[direct, indirect]),
            albedo: context.download(&elements.albedo)?,
            emission: context.download(&elements.emission)?,
            back_elements: elements.topology.back_elements.clone(),
        })
    }

    /// The vertices take what the leaves around them say, and shadow rays to punctual lights.
    fn of_clusters(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        light: LeafLight<'_>,
    ) -> Result<Self, AppError> {
        let at_vertices = AtVertices::new(context, stage)?;
        let mut recorder = context.recorder("bake")?;
        at_vertices.fill(&mut recorder, stage, light);
        recorder.submit()?;
        let AtVertices { elements, punctual, direct, indirect } = &at_vertices;
        let direct = sum(&[context.download(direct)?, context.download(punctual)?]);
        let indirect = context.download(indirect)?;
        Ok(Self {
            irradiance: parts(request, &direct, &indirect),
            whole_irradiance: sum(&[direct, indirect]),
            albedo: context.download(&elements.albedo)?,
            emission: context.download(&elements.emission)?,
            back_elements: elements.topology.back_elements.clone(),
        })
    }

    /// The vertices take the mean of the texels at the corners around them.
    fn of_texels(
        context: &Context,
        request: &RenderRequest,
        stage: &Stage,
        method: &SurfaceShadowMaps,
    ) -> Result<(Self, Option<TexelLight>), AppError> {
        let texels = &method.texels;
        let mut recorder = context.recorder("bake")?;
        let punctual = context.buffer("bake/punctual", texels.count as usize)?;
        recorder.fill(&punctual, 0);
        let samples = method.settings().light_samples;
        texels.add_lights(&mut recorder, &stage.tracer(), &stage.world, samples, &punctual, None);
        recorder.submit()?;
        let direct = sum(&[context.download(&punctual)?, context.download(method.direct_irradiance())?]);
        let indirect = context.download(method.indirect_irradiance())?;

        let topology = ElementTopology::new(&stage.scene, &stage.geometry, &stage.rest_positions);
        let elements = Elements::new(context, topology, &stage.rest_positions, &stage.world, RAY_OFFSET)?;
        let shown = parts(request, &direct, &indirect);
        let whole = sum(&[direct, indirect]);
        let light = Self {
            irradiance: at_vertices(stage, &method.atlas, &elements.topology, &shown),
            whole_irradiance: at_vertices(stage, &method.atlas, &elements.topology, &whole),
            albedo: context.download(&elements.albedo)?,
            emission: context.download(&elements.emission)?,
            back_elements: elements.topology.back_elements.clone(),
        };
        let atlas = method.atlas.clone();
        Ok((light, Some(TexelLight { atlas, irradiance: shown })))
    }

    /// What every element sends: of its own, and reflected of the whole solution; W m^-2 sr^-1.
    pub fn exitant(&self, emits: bool, reflects: bool) -> Vec<Vec3> {
        let reflected = self.albedo.iter().zip(&self.whole_irradiance);
        let factors = [emits, reflects].map(|counts| if counts { 1.0 } else { 0.0 });
        (self.emission.iter().zip(reflected))
            .map(|(&emission, (&albedo, &e))| factors[0] * emission + factors[1] * albedo * e / std::f32::consts::PI)
            .collect()
    }
}

impl TexelLight {
    /// What the texels of `atlas` receive where only the elements know it: means over the texels' parts.
    pub fn between_elements(stage: &Stage, atlas: Atlas, light: &ElementLight) -> Self {
        let value = |index: usize| {
            let is_back = atlas.texels[index].chart >= atlas.chart_count;
            let (mut sum, mut area) = (Vec3::ZERO, 0.0);
            for part in atlas.parts_of(index) {
                let [a, b, c] = stage.geometry.triangles[part.triangle as usize].map(|vertex| {
                    let element = if is_back { light.back_elements[vertex as usize] } else { vertex };
                    light.irradiance[element as usize]
                });
                sum += part.area * (a + part.barycentrics.x * (b - a) + part.barycentrics.y * (c - a));
                area += part.area;
            }
            if area > 0.0 { sum / area } else { Vec3::ZERO }
        };
        let irradiance = (0..atlas.texels.len()).map(value).collect();
        Self { atlas, irradiance }
    }
}

/// Direct or indirect light, or both, as the request says.
fn parts(request: &RenderRequest, direct: &[Vec3], indirect: &[Vec3]) -> Vec<Vec3> {
    match request.light {
        LightParts::DirectOnly => direct.to_vec(),
        LightParts::IndirectOnly => indirect.to_vec(),
        LightParts::All => direct.iter().zip(indirect).map(|(d, i)| *d + *i).collect(),
    }
}

fn sum(lists: &[Vec<Vec3>; 2]) -> Vec<Vec3> {
    lists[0].iter().zip(&lists[1]).map(|(a, b)| *a + *b).collect()
}

/// Means over the corners of the triangles around each element, of the texels they lie in.
fn at_vertices(stage: &Stage, atlas: &Atlas, topology: &ElementTopology, texels: &[Vec3]) -> Vec<Vec3> {
    let mut sums = vec![(Vec3::ZERO, 0.0f32); topology.vertices.len()];
    for (side, places) in atlas.corner_places.iter().enumerate() {
        for (corners, places) in stage.geometry.triangles.iter().zip(places) {
            let centre = (places[0] + places[1] + places[2]) / 3.0;
            for (&vertex, &place) in corners.iter().zip(places) {
                let element = if side == 0 { vertex } else { topology.back_elements[vertex as usize] };
                // A corner lies on the border of its texels: a step towards the middle says which is meant.
                let inside = place + 0.25 * (centre - place).clamp_length_max(4.0);
                let at = inside.as_uvec2().min(glam::UVec2::splat(atlas.resolution - 1));
                let texel = atlas.texel_at[(at.y * atlas.resolution + at.x) as usize];
                if let (Some(sum), true) = (sums.get_mut(element as usize), texel != NO_TEXEL) {
                    sum.0 += texels[texel as usize];
                    sum.1 += 1.0;
                }
            }
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { Vec3::ZERO }).collect()
}
