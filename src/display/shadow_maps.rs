//! Shadow maps of punctual lights: six views for a point light, one for a spot, one fitted to the scene's bounds for
//! a directional light. All are layers of one depth image; nothing is culled, since back faces block light too.

use crate::gpu::shaders::display::{ShadowMap, ShadowMapParams};
use crate::gpu::shaders::types::{ShadowLight, ShadowView};
use crate::gpu::{
    Buffer, Context, Format, GpuError, Image, ImageDescription, Load, RasterState, Recorder, Sampler,
    SamplerDescription, Shape, Target,
};
use crate::scene::LightKind;
use crate::scene::pose::{Pose, PosedLight};
use crate::stages::world::World;
use glam::{Mat4, Vec3, Vec4};

/// Depth memory that all layers together may take; the resolution is halved until they fit.
const MEMORY_BYTES: u64 = 256 << 20;
/// Texels a side where memory allows, for pictures that show them.
const FULL_EXTENT: u32 = 2048;
const LEAST_EXTENT: u32 = 128;
/// Texels a side for each pixel of the picture's longer side: where texels leave doubt rays decide, so that finer ones tell
/// more only in the shadow of what is thinner than a texel.
const TEXELS_PER_PIXEL: u32 = 8;
/// Faces of a point light see this much beyond 90 degrees, so that filtering never leaves a face.
const FACE_MARGIN: f32 = 1.02;

/// Depth of every view, with the tables that say whose is whose.
pub struct ShadowMaps {
    pub depth: Image,
    pub sampler: Sampler,
    pub views: Buffer<ShadowView>,
    /// One per light.
    pub lights: Buffer<ShadowLight>,
    view_count: u32,
    extent: u32,
}

impl ShadowMaps {
    /// Room for the lights of `pose`, as fine as a picture of `width` x `height` pixels asks for; more views than the device
    /// has image layers are refused.
    pub fn new(context: &Context, pose: &Pose, [width, height]: [u32; 2]) -> Result<Self, GpuError> {
        let view_count: u32 = pose.lights.iter().map(|l| view_count_of(l.kind)).sum();
        let mut extent = extent_for(width.max(height)).min(context.limits().image_extent);
        while extent > LEAST_EXTENT && u64::from(view_count) * u64::from(extent).pow(2) * 4 > MEMORY_BYTES {
            extent /= 2;
        }
        let depth = context.image(&ImageDescription {
            name: "shadow maps/depth",
            width: extent,
            height: extent,
            layers: view_count.max(1),
            mip_levels: 1,
            format: Format::Depth32,
            shape: Shape::Array,
        })?;
        Ok(Self {
            depth,
            sampler: context.sampler("shadow maps/texels", SamplerDescription::NEAREST_CLAMP)?,
            views: context.buffer("shadow maps/views", view_count.max(1) as usize)?,
            lights: context.buffer("shadow maps/lights", pose.lights.len().max(1))?,
            view_count,
            extent,
        })
    }

    /// Draws every view of the world as it stands; `bounds` are its world-space corners.
    pub fn draw(&self, recorder: &mut Recorder<'_>, world: &World, pose: &Pose, bounds: [Vec3; 2]) {
        let (mut views, mut lights) = (Vec::new(), Vec::new());
        for light in &pose.lights {
            let first = views.len() as u32;
            views.extend(views_of(light, bounds, self.extent));
            lights.push(ShadowLight { first, count: views.len() as u32 - first });
        }
        recorder.scope("shadow maps", |recorder| {
            recorder.write(&self.views, 0, &views);
            recorder.write(&self.lights, 0, &lights);
            for view in 0..self.view_count {
                let pass = ShadowMap {
                    triangles: &world.triangles,
                    positions: &world.positions,
                    attributes: &world.attributes,
                    shadow_views: &self.views,
                    triangle_materials: &world.triangle_materials,
                    materials: &world.materials,
                    textures: &world.textures,
                    params: ShadowMapParams { view },
                };
                let target = Target { color: Vec::new(), depth: Some((&self.depth, view, Load::Clear([0.0; 4]))) };
                let state = RasterState { depth_test: true, ..RasterState::default() };
                recorder.draw(&pass, &target, state, 3 * world.triangle_count, 1);
            }
        });
    }
}

/// Texels a side for a picture with so many pixels on its longer side.
fn extent_for(pixels: u32) -> u32 {
    TEXELS_PER_PIXEL.saturating_mul(pixels).clamp(LEAST_EXTENT, FULL_EXTENT).next_power_of_two()
}

fn view_count_of(kind: LightKind) -> u32 {
    match kind {
        LightKind::Point => 6,
        LightKind::Spot { .. } | LightKind::Directional => 1,
    }
}

/// Looks from `eye` along `forward`; x right, y down, reversed infinite depth `near / distance`.
fn perspective(eye: Vec3, forward: Vec3, up: Vec3, tan_half: f32, near: f32) -> Mat4 {
    let right = forward.cross(up).normalize_or(forward.any_orthonormal_vector());
    let up = right.cross(forward);
    let row = |axis: Vec3| axis.extend(-axis.dot(eye));
    Mat4::from_cols(row(right) / tan_half, -row(up) / tan_half, Vec4::new(0.0, 0.0, 0.0, near), row(forward))
        .transpose()
}

/// The six directions of a point light's views with their ups, in the order of `cube_face` in `lib/shadow.glsl`.
const FACES: [(Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::Y, Vec3::Z),
    (Vec3::NEG_Y, Vec3::Z),
    (Vec3::Z, Vec3::Y),
    (Vec3::NEG_Z, Vec3::Y),
];

fn views_of(light: &PosedLight, [low, high]: [Vec3; 2], extent: u32) -> Vec<ShadowView> {
    let diagonal = (high - low).length().max(1e-6);
    // Nothing nearer than this casts a shadow; small against the scene, large enough for the depth's precision.
    let near = 1e-4 * diagonal;
    let seen = |clip_from_world: Mat4, tan_half: f32| ShadowView {
        clip_from_world: clip_from_world.to_cols_array_2d(),
        texel_angle: 2.0 * tan_half / extent as f32,
        texel_extent: 0.0,
    };
    match light.kind {
        LightKind::Point => FACES
            .iter()
            .map(|&(forward, up)| seen(perspective(light.position, forward, up, FACE_MARGIN, near), FACE_MARGIN))
            .collect(),
        LightKind::Spot { outer_angle, .. } => {
            // A cone of nearly 90 degrees cannot be seen flat; what lies beyond 85 degrees stays lit.
            let tan_half = outer_angle.min(85f32.to_radians()).tan() * FACE_MARGIN;
            let up = light.direction.any_orthonormal_vector();
            vec![seen(perspective(light.position, light.direction, up, tan_half, near), tan_half)]
        }
        LightKind::Directional => {
            let forward = light.direction;
            let right = forward.any_orthonormal_vector();
            let up = right.cross(forward);
            // Fit the box: the extent of its corners along the light's axes.
            let corners = (0..8).map(|i| {
                let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
                let corner = Vec3::new(pick(0), pick(1), pick(2));
                Vec3::new(corner.dot(right), corner.dot(up), corner.dot(forward))
            });
            let (least, most) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), c| (a.min(c), b.max(c)));
            let (centre, half) = (least.midpoint(most), (most - least) * 0.5 + 1e-3 * diagonal);
            let side = half.x.max(half.y);
            let row = |axis: Vec3, offset: f32, scale: f32| (axis * scale).extend(-offset * scale);
            let depth_scale = 1.0 / (2.0 * half.z);
            let clip_from_world = Mat4::from_cols(
                row(right, centre.x, 1.0 / side),
                -row(up, centre.y, 1.0 / side),
                // 1 at the near end, 0 at the far end.
                (-forward * depth_scale).extend((centre.z + half.z) * depth_scale),
                Vec4::W,
            )
            .transpose();
            vec![ShadowView {
                clip_from_world: clip_from_world.to_cols_array_2d(),
                texel_angle: 0.0,
                texel_extent: 2.0 * side / extent as f32,
            }]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: [Vec3; 2] = [Vec3::new(-3.0, 0.0, -2.0), Vec3::new(3.0, 4.0, 2.0)];

    fn light(kind: LightKind) -> PosedLight {
        PosedLight {
            node: 0,
            light: 0,
            position: Vec3::new(0.5, 3.0, 0.2),
            direction: Vec3::new(0.3, -0.9, 0.1).normalize(),
            kind,
            intensity: Vec3::ONE,
            range: None,
        }
    }

    fn project(view: &ShadowView, point: Vec3) -> Vec3 {
        let clip = Mat4::from_cols_array_2d(&view.clip_from_world) * point.extend(1.0);
        clip.truncate() / clip.w
    }

    #[test]
    fn small_pictures_have_small_maps() {
        let extents = [1, 16, 17, 80, 200, 256, 4000, u32::MAX].map(extent_for);
        assert_eq!(extents, [128, 128, 256, 1024, 2048, 2048, 2048, 2048]);
    }

    #[test]
    fn each_face_sees_its_own_direction_in_the_middle() {
        let light = light(LightKind::Point);
        for (view, (forward, _)) in views_of(&light, BOUNDS, 512).iter().zip(FACES) {
            let near = project(view, light.position + forward);
            let far = project(view, light.position + 2.0 * forward);
            assert!(near.truncate().length() < 1e-5 && far.truncate().length() < 1e-5, "{near} {far}");
            assert!(near.z > far.z && far.z > 0.0, "depth is reversed: {near} {far}");
        }
    }

    #[test]
    fn a_directional_view_holds_the_whole_box() {
        let view = &views_of(&light(LightKind::Directional), BOUNDS, 512)[0];
        let [low, high] = BOUNDS;
        for corner in [low, high, Vec3::new(low.x, high.y, low.z), Vec3::new(high.x, low.y, high.z)] {
            let at = project(view, corner);
            assert!(at.x.abs() <= 1.0 && at.y.abs() <= 1.0 && (0.0..=1.0).contains(&at.z), "{corner} at {at}");
        }
        let toward_light = project(view, Vec3::new(0.0, 4.0, 0.0));
        let away = project(view, Vec3::new(0.0, 0.0, 0.0));
        assert!(toward_light.z > away.z, "depth is reversed");
    }
}
