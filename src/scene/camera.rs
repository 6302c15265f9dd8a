//! The view: a glTF camera in a pose, or one that frames the scene's bounds.
//!
//! Conventions. Clip space is Vulkan's: x right, y **down**, depth 0..1. Depth is **reversed**: the near plane is at
//! 1, the far plane (or infinity) at 0, so clear depth to 0 and keep the greater; float depth is then evenly precise
//! over the whole distance. Picture coordinates are in pixels from the top left corner, pixel centres at +0.5.
//!
//! The vertical field of view is the file's; the horizontal one follows from the picture's shape. Rays and
//! [`View::clip_from_world`] agree: every point of a ray projects to the pixel it was made for.

use glam::{Mat4, UVec2, Vec2, Vec3, Vec4, vec2};
use thiserror::Error;

use super::pose::{Pose, PosedCamera};
use super::{Projection, Scene};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Metres.
    pub position: Vec3,
    /// Unit and perpendicular: `right` x `up` = -`forward`.
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    pub lens: Lens,
    /// Metres along `forward`, more than 0 (perspective) or any (orthographic).
    pub near: f32,
    /// Metres along `forward`; `None` is infinity.
    pub far: Option<f32>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Tangents of half the horizontal and half the vertical field of view.
    Perspective { tan_half: Vec2 },
    /// Half the width and height seen, metres.
    Orthographic { half_extent: Vec2 },
}

/// What a pixel sees: points `origin + t * direction` for `t_min <= t <= t_max`, the near and far plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    pub origin: Vec3,
    /// Unit.
    pub direction: Vec3,
    pub t_min: f32,
    /// May be infinite.
    pub t_max: f32,
}

#[derive(Debug, Clone, PartialEq, Error)]
pub enum CameraError {
    #[error("no camera {wanted:?} in the scene; {}", offered(.available))]
    Unknown { wanted: String, available: Vec<String> },
}

fn offered(available: &[String]) -> String {
    match available {
        [] => "it has none: leave the camera out to frame the whole scene".into(),
        names => format!("it has {}", names.join(", ")),
    }
}

/// Vertical field of view of a framed view, radians.
const FRAMED_FOV_Y: f32 = 0.7;
/// From the middle of the bounds towards a framed view's eye: from the front, the right and somewhat above.
const FRAMED_SIDE: Vec3 = Vec3::new(0.55, 0.4, 1.0);
/// Room left around the bounds, as a factor of the distance.
const FRAMED_MARGIN: f32 = 1.05;

/// The near plane of a view towards a place, as a share of the distance to it.
const NEAR_SHARE: f32 = 1e-3;

impl View {
    /// The view of camera `wanted` (name of a camera or of its node, or position among the nodes with cameras), of
    /// the first camera when nothing is wanted, and framed on `bounds` when the scene has none.
    pub fn of_scene(
        scene: &Scene,
        pose: &Pose,
        wanted: Option<&str>,
        bounds: Option<[Vec3; 2]>,
        size: UVec2,
    ) -> Result<Self, CameraError> {
        let Some(wanted) = wanted else {
            let framed = || Self::framed(bounds.unwrap_or([Vec3::NEG_ONE, Vec3::ONE]), size);
            return Ok(pose.cameras.first().map_or_else(framed, |camera| Self::of_camera(camera, size)));
        };
        let named = |camera: &&PosedCamera| names(scene, camera).contains(&wanted);
        let at_index = || wanted.parse::<usize>().ok().and_then(|index| pose.cameras.get(index));
        match pose.cameras.iter().find(named).or_else(at_index) {
            Some(camera) => Ok(Self::of_camera(camera, size)),
            None => {
                let name = |(index, camera)| format!("{index} {:?}", names(scene, camera)[1]);
                let available = pose.cameras.iter().enumerate().map(name).collect();
                Err(CameraError::Unknown { wanted: wanted.into(), available })
            }
        }
    }

    pub fn of_camera(camera: &PosedCamera, size: UVec2) -> Self {
        let world = camera.world_from_camera;
        let forward = (-world.z_axis.truncate()).try_normalize().unwrap_or(Vec3::NEG_Z);
        let eye = world.w_axis.truncate();
        let aspect = aspect(size);
        match camera.projection {
            Projection::Perspective { fov_y, near, far } => {
                let near = near.max(f32::MIN_POSITIVE);
                let far = far.filter(|&far| far > near);
                Self::looking(eye, forward, world.y_axis.truncate(), perspective(fov_y, aspect), near, far)
            }
            Projection::Orthographic { half_width, half_height, near, far } => {
                // Shows at least what the file's frame shows, without stretching.
                let half_height = half_height.abs().max(half_width.abs() / aspect).max(f32::MIN_POSITIVE);
                let lens = Lens::Orthographic { half_extent: vec2(half_height * aspect, half_height) };
                Self::looking(eye, forward, world.y_axis.truncate(), lens, near, Some(far).filter(|&far| far > near))
            }
        }
    }

    /// A three-quarter view that just holds the box between the two corners.
    pub fn framed([low, high]: [Vec3; 2], size: UVec2) -> Self {
        let centre = low.midpoint(high);
        let half = ((high - low) * 0.5).max(Vec3::ZERO);
        let lens = perspective(FRAMED_FOV_Y, aspect(size));
        let forward = -FRAMED_SIDE.normalize();
        let view = Self::looking(centre, forward, Vec3::Y, lens, 1.0, None);
        let Lens::Perspective { tan_half } = lens else { return view };
        let mut distance = centre.abs().max_element().max(1.0) * 1e-6;
        let radius = half.length();
        for corner in 0..8u32 {
            let sign = Vec3::from_array([0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 }));
            let offset = half * sign;
            let across = vec2(offset.dot(view.right), offset.dot(view.up)).abs() / tan_half;
            distance = distance.max(across.max_element() - offset.dot(forward));
        }
        let distance = distance * FRAMED_MARGIN;
        let near = (distance - radius).max(distance * 1e-3) * 0.5;
        Self { position: centre - forward * distance, near, ..view }
    }

    /// From `eye` towards `target`, the world's up upwards, with a vertical field of view in radians.
    pub fn towards(eye: Vec3, target: Vec3, fov_y: f32, size: UVec2) -> Self {
        let forward = (target - eye).try_normalize().unwrap_or(Vec3::NEG_Z);
        // So near that what is looked at is never cut, and yet far from zero.
        let near = (eye.distance(target) * NEAR_SHARE).max(f32::MIN_POSITIVE);
        Self::looking(eye, forward, Vec3::Y, perspective(fov_y, aspect(size)), near, None)
    }

    fn looking(position: Vec3, forward: Vec3, up: Vec3, lens: Lens, near: f32, far: Option<f32>) -> Self {
        let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        Self { position, right, up: right.cross(forward), forward, lens, near, far }
    }

    /// Distances along right, up and backward from the eye.
    pub fn view_from_world(&self) -> Mat4 {
        let rotation = Mat4::from_cols(
            self.right.extend(0.0),
            self.up.extend(0.0),
            (-self.forward).extend(0.0),
            self.position.extend(1.0),
        );
        // Rows of an orthonormal basis: its transpose is its inverse.
        let linear = glam::Mat3::from_mat4(rotation).transpose();
        Mat4::from_mat3_translation(linear, -(linear * self.position))
    }

    /// Reversed depth, y down: see the module.
    pub fn clip_from_view(&self) -> Mat4 {
        let near = self.near;
        match self.lens {
            Lens::Perspective { tan_half } => {
                // depth = (a z + b) / -z with depth 1 at z = -near and 0 at z = -far.
                let (a, b) = match self.far {
                    None => (0.0, near),
                    Some(far) => (near / (far - near), near * far / (far - near)),
                };
                Mat4::from_cols(
                    Vec4::new(tan_half.x.recip(), 0.0, 0.0, 0.0),
                    Vec4::new(0.0, -tan_half.y.recip(), 0.0, 0.0),
                    Vec4::new(0.0, 0.0, a, -1.0),
                    Vec4::new(0.0, 0.0, b, 0.0),
                )
            }
            Lens::Orthographic { half_extent } => {
                // An infinite orthographic depth does not exist: 1e6 m stand for it.
                let far = self.far.unwrap_or(near + 1e6);
                Mat4::from_cols(
                    Vec4::new(half_extent.x.recip(), 0.0, 0.0, 0.0),
                    Vec4::new(0.0, -half_extent.y.recip(), 0.0, 0.0),
                    Vec4::new(0.0, 0.0, (far - near).recip(), 0.0),
                    Vec4::new(0.0, 0.0, far / (far - near), 1.0),
                )
            }
        }
    }

    pub fn clip_from_world(&self) -> Mat4 {
        self.clip_from_view() * self.view_from_world()
    }

    /// The ray through a place of the picture, `pixel` counted from the top left corner of a picture of `size`.
    pub fn ray(&self, pixel: Vec2, size: UVec2) -> Ray {
        let at = pixel / size.as_vec2().max(Vec2::ONE) * 2.0 - 1.0;
        let far = self.far.unwrap_or(f32::INFINITY);
        match self.lens {
            Lens::Perspective { tan_half } => {
                let along = self.forward + at.x * tan_half.x * self.right - at.y * tan_half.y * self.up;
                let slant = along.length();
                let (t_min, t_max) = (self.near * slant, far * slant);
                Ray { origin: self.position, direction: along / slant, t_min, t_max }
            }
            Lens::Orthographic { half_extent } => {
                let origin = self.position + at.x * half_extent.x * self.right - at.y * half_extent.y * self.up;
                Ray { origin, direction: self.forward, t_min: self.near, t_max: far }
            }
        }
    }

    /// Where a world point appears, in pixels, and its reversed depth; `None` behind a perspective eye.
    pub fn project(&self, point: Vec3, size: UVec2) -> Option<(Vec2, f32)> {
        let clip = self.clip_from_world() * point.extend(1.0);
        (clip.w > 0.0).then(|| {
            let device = clip.truncate() / clip.w;
            ((device.truncate() + 1.0) * 0.5 * size.as_vec2(), device.z)
        })
    }
}

/// Camera name and node name.
fn names<'a>(scene: &'a Scene, camera: &PosedCamera) -> [&'a str; 2] {
    let own = scene.cameras.get(camera.camera as usize).map_or("", |camera| camera.name.as_str());
    let node = scene.nodes.get(camera.node as usize).map_or("", |node| node.name.as_str());
    [own, node]
}

fn aspect(size: UVec2) -> f32 {
    size.x.max(1) as f32 / size.y.max(1) as f32
}

/// Fields of view that are no angle of a picture are brought within 0.0001 and 3.1 radians.
fn perspective(fov_y: f32, aspect: f32) -> Lens {
    let tan_half = (fov_y.clamp(1e-4, 3.1) * 0.5).tan();
    Lens::Perspective { tan_half: vec2(tan_half * aspect, tan_half) }
}
