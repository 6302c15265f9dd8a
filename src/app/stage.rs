//! Before the first frame: the scene loaded, tessellated, posed, placed on the device, with its hierarchy and view.

use glam::{UVec2, Vec3};

use super::cli::{Display, Rays};
use super::render::{FreeCamera, RenderRequest, displays};
use super::values::SceneSource;
use super::{AppError, edits};
use crate::gpu::{AccelerationStructure, Context};
use crate::report::profile::SceneFacts;
use crate::report::trace::TimeLine;
use crate::scene::camera::View;
use crate::scene::environment::Environment;
use crate::scene::environment::load::{self as environment, EnvironmentLimits, EnvironmentSource};
use crate::scene::geometry::Geometry;
use crate::scene::pose::Pose;
use crate::scene::tessellate::{Fineness, Tessellation, tessellate};
use crate::scene::{LoadOptions, Material, Scene, animation, builtin, deform};
use crate::stages::bvh::Bvh;
use crate::stages::trace::Tracer;
use crate::stages::world::World;

/// Host memory that a scene and what is computed from it may take where nothing else is said, bytes.
const DEFAULT_MEMORY_BYTES: u64 = 8 << 30;
/// Elements that methods solving on elements aim at where nothing else is asked for.
const DEFAULT_ELEMENTS: u32 = 20_000;
/// Of those, at most as long, as a share of the scene's diagonal: half a step of a stair in a house.
const DEFAULT_LONGEST_EDGE: f32 = 1.0 / 40.0;

/// The hierarchy is built anew where rays cost so many times what they did after the last building.
const WORST_REFIT: f32 = 1.5;

/// Everything a frame starts from.
pub struct Stage {
    pub scene: Scene,
    pub geometry: Geometry,
    /// World-space vertices at rest, bit-equal where vertices stand at one place.
    pub rest_positions: Vec<Vec3>,
    pub environment: Environment,
    pub pose: Pose,
    /// World-space corners of the posed scene.
    pub bounds: [Vec3; 2],
    pub view: View,
    pub world: World,
    pub bvh: Bvh,
    /// The device's own structure, where its traversal is used.
    pub acceleration: Option<AccelerationStructure>,
}

impl Stage {
    /// Loads and places what `request` asks for. What was skipped or repaired on the way is logged.
    pub fn new(context: &Context, request: &RenderRequest, time_line: &TimeLine) -> Result<Self, AppError> {
        let scene = time_line.span("load scene", || load_scene(&request.scene, context))?;
        let mut scene = scene;
        request.edits.iter().try_for_each(|edit| edits::apply(&mut scene, edit))?;
        Self::place(context, scene, request, time_line)
    }

    /// Takes over materials and lights of the scene, whose surfaces stand where they did.
    pub fn relight(&mut self, context: &Context, request: &RenderRequest) -> Result<(), AppError> {
        self.pose = Pose::at(&self.scene, request.seconds);
        let mut recorder = context.recorder("world")?;
        self.world.update_materials(&mut recorder, &self.scene, request.diffuse);
        self.world.pose(&mut recorder, &self.pose);
        Ok(recorder.submit()?)
    }

    /// Moves the scene to the time of `request`; what is on the device moves there. False where nothing is animated.
    pub fn follow(&mut self, context: &Context, request: &RenderRequest) -> Result<bool, AppError> {
        if self.scene.clips.is_empty() {
            return Ok(false);
        }
        self.pose = Pose::at(&self.scene, request.seconds);
        let vertices = deform::world_vertices(&self.geometry, &self.pose);
        let bounds = vertices.bounds().filter(|[low, high]| low.is_finite() && high.is_finite());
        let Some(bounds) = bounds else {
            let seconds = self.pose.seconds;
            return Err(AppError::failed(format!("at {seconds} s no vertex of the scene is at a finite place")));
        };
        self.bounds = bounds;
        let mut recorder = context.recorder("world")?;
        self.world.pose(&mut recorder, &self.pose);
        self.bvh.refit(&mut recorder, &self.world.positions).map_err(AppError::failed)?;
        if let Some(structure) = &self.acceleration {
            recorder.build_acceleration_structure(structure, &self.world.positions, &self.world.triangles);
        }
        recorder.submit()?;
        if self.bvh.needs_rebuild(context, WORST_REFIT).map_err(AppError::failed)? {
            self.bvh.rebuild(context, &self.world.positions).map_err(AppError::failed)?;
        }
        Ok(true)
    }

    /// Places a scene that was loaded, and edited, before.
    pub fn place(
        context: &Context,
        scene: Scene,
        request: &RenderRequest,
        time_line: &TimeLine,
    ) -> Result<Self, AppError> {
        let dark = EnvironmentSource::Constant(Vec3::ZERO);
        let environment = request.environment.as_ref().unwrap_or(&dark);
        let environment = time_line
            .span("load environment", || {
                let turn = request.environment_turn.to_radians();
                let max_memory_bytes = host_bytes(context).saturating_sub(scene.size_bytes());
                environment::load(environment, turn, &EnvironmentLimits { max_memory_bytes, ..Default::default() })
            })
            .map_err(AppError::failed)?;
        let notes = scene
            .notes
            .iter()
            .cloned()
            .chain(environment.notes.iter().cloned())
            .chain(animation::unplayed_channels(&scene));
        notes.for_each(|note| tracing::info!("{note}"));

        let (geometry, rest_positions) = time_line.span("tessellate", || {
            let held = scene.size_bytes().saturating_add(environment.environment.size_bytes());
            flatten(&scene, request, host_bytes(context).saturating_sub(held))
        })?;
        if geometry.triangle_count() == 0 {
            return Err(AppError::failed(format!("the scene {:?} has no triangles to render", scene.name)));
        }
        let pose = Pose::at(&scene, request.seconds);
        let vertices = time_line.span("place vertices", || deform::world_vertices(&geometry, &pose));
        let bounds = vertices.bounds().filter(|[low, high]| low.is_finite() && high.is_finite());
        let Some(bounds) = bounds else {
            return Err(AppError::failed(format!("at {} s no vertex of the scene is at a finite place", pose.seconds)));
        };
        let view = view(&scene, &pose, bounds, request)?;
        let bvh = time_line
            .span("build hierarchy", || Bvh::build(context, &vertices.positions, &geometry.triangles))
            .map_err(AppError::failed)?;
        let world = time_line.span("upload", || {
            World::new(context, &scene, &geometry, &pose, &environment.environment, request.diffuse)
        })?;
        if !scene.clips.is_empty() {
            // Where the device places them, to the bit: as a later pose will.
            let mut recorder = context.recorder("world")?;
            bvh.refit(&mut recorder, &world.positions).map_err(AppError::failed)?;
            recorder.submit()?;
        }
        tracing::debug!(
            "{} elements, {} triangles, {} lights",
            geometry.vertex_count(),
            geometry.triangle_count(),
            pose.lights.len()
        );
        let acceleration = build_acceleration(context, request.rays, &world)?;
        let environment = environment.environment;
        if is_dark(&scene, &geometry, &pose, &environment) {
            tracing::warn!(
                "the scene has no light: no lamp, nothing that emits, no environment, so the picture is black; \
                 --env 1,1,1 lights it evenly, --env FILE.hdr by a picture of the surroundings"
            );
        }
        Ok(Self { scene, geometry, rest_positions, environment, pose, bounds, view, world, bvh, acceleration })
    }

    /// Looks at the scene as `request` asks now.
    pub fn look(&mut self, request: &RenderRequest) -> Result<(), AppError> {
        self.view = view(&self.scene, &self.pose, self.bounds, request)?;
        Ok(())
    }

    /// How rays are cast at the scene.
    pub fn tracer(&self) -> Tracer<'_> {
        match &self.acceleration {
            Some(structure) => Tracer::RayQuery(structure, (&self.world).into()),
            None => Tracer::Compute(&self.bvh, (&self.world).into()),
        }
    }

    /// What was rendered, in numbers.
    pub fn facts(&self) -> SceneFacts {
        SceneFacts {
            name: self.scene.name.clone(),
            triangles: self.geometry.triangle_count().into(),
            elements: self.geometry.vertex_count().into(),
            lights: self.pose.lights.len() as u64,
        }
    }
}

/// Whether nothing shines: no light, no surface, no sky.
fn is_dark(scene: &Scene, geometry: &Geometry, pose: &Pose, environment: &Environment) -> bool {
    let shines = |material: &Material| material.unlit || material.emission != Vec3::ZERO;
    environment.is_black()
        && pose.lights.iter().all(|light| light.intensity == Vec3::ZERO)
        && !geometry.parts.iter().any(|part| shines(&scene.materials[part.material as usize]))
}

/// The free camera of the request, else the camera it names, else the scene's first, else one framed on the bounds.
fn view(scene: &Scene, pose: &Pose, bounds: [Vec3; 2], request: &RenderRequest) -> Result<View, AppError> {
    let size = UVec2::new(request.width, request.height);
    if let Some(FreeCamera { eye, look_at, fov }) = request.free_camera {
        return Ok(View::towards(eye, look_at, fov.to_radians(), size));
    }
    let camera = request.camera.as_ref().map(|camera| camera.name.as_str());
    View::of_scene(scene, pose, camera, Some(bounds), size).map_err(AppError::failed)
}

/// Builds the device's own structure if it is to be used. A software driver's traversal is far slower than ours, so it
/// is used only when asked for by name.
fn build_acceleration(context: &Context, rays: Rays, world: &World) -> Result<Option<AccelerationStructure>, AppError> {
    let wanted = match rays {
        Rays::Compute => false,
        Rays::RayQuery => true,
        Rays::Auto => context.features().ray_query && context.info().kind != "CPU",
    };
    if !wanted {
        return Ok(None);
    }
    let structure = context.acceleration_structure("acceleration/scene", &world.positions, &world.triangles)?;
    let Some(structure) = structure else {
        let name = &context.info().name;
        return Err(AppError::failed(format!("{name} has no ray query (VK_KHR_ray_query); use --rays compute")));
    };
    let mut recorder = context.recorder("acceleration build")?;
    recorder.build_acceleration_structure(&structure, &world.positions, &world.triangles);
    recorder.submit()?;
    Ok(Some(structure))
}

/// Host memory that a scene and what is computed from it may take, bytes.
fn host_bytes(context: &Context) -> u64 {
    context.max_memory_bytes().unwrap_or(DEFAULT_MEMORY_BYTES)
}

/// Loads what `source` names, within the memory that `context` was given.
pub fn load_scene(source: &SceneSource, context: &Context) -> Result<Scene, AppError> {
    let options = LoadOptions { max_memory_bytes: host_bytes(context), ..LoadOptions::default() };
    match source {
        SceneSource::File(path) => crate::scene::load(path, &options).map_err(AppError::failed),
        SceneSource::Builtin(name) => {
            builtin::open(&format!("{}{name}", builtin::PREFIX), &options).map_err(AppError::failed)
        }
    }
}

/// The scene as one list of triangles, cut as fine as the request asks, and its vertices' places at rest. A method
/// with elements needs some by default, also on the large surfaces of a scene that has many small ones.
fn flatten(scene: &Scene, request: &RenderRequest, max_bytes: u64) -> Result<(Geometry, Vec<Vec3>), AppError> {
    let geometry = Geometry::flatten(scene, max_bytes).map_err(AppError::failed)?;
    let (rest, vertices) = (Pose::rest(scene), geometry.vertex_count());
    let fineness = match request.elements {
        Some(target) => Fineness::Elements(target),
        // A method on an atlas cuts the surface itself.
        None if request.display.is_some() && request.method.key != "surface-shadow-maps" => {
            Fineness::Balanced { elements: DEFAULT_ELEMENTS, longest_edge: DEFAULT_LONGEST_EDGE }
        }
        None => {
            let positions = deform::world_positions(&geometry, &rest);
            return Ok((geometry, positions));
        }
    };
    let cut = tessellate(geometry, &rest, fineness, max_bytes).map_err(AppError::failed)?;
    if displays(request.method).contains(&Display::Vertex)
        && let Some(warning) = left_uncut(&cut, request.elements, vertices)
    {
        tracing::warn!("{warning}");
    }
    Ok((cut.geometry, cut.rest_positions))
}

/// What to say where light is computed at vertices, fewer were asked for than the scene has, and large triangles stay whole.
fn left_uncut(cut: &Tessellation, asked: Option<u32>, vertices: u32) -> Option<String> {
    let asked = asked.filter(|&asked| asked <= vertices)?;
    let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [low, high] = cut.rest_positions.iter().fold(start, |[low, high], &p| [low.min(p), high.max(p)]);
    let longest = cut.max_edge / low.distance(high);
    (longest > DEFAULT_LONGEST_EDGE).then(|| {
        format!(
            "--elements {asked}: the scene has {vertices} vertices as it is, so none of its triangles is cut; some are \
             {:.2} m long ({:.0} % of the scene), with light at their corners alone. Ask for well over {vertices} \
             elements, or leave --elements away: then long edges are cut",
            cut.max_edge,
            100.0 * longest,
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(name: &str, fineness: Fineness) -> (u32, Tessellation) {
        let scene = builtin::open(&format!("{}{name}", builtin::PREFIX), &LoadOptions::default()).unwrap();
        let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
        (geometry.vertex_count(), tessellate(geometry, &Pose::rest(&scene), fineness, 1 << 30).unwrap())
    }

    #[test]
    fn walls_that_stay_whole_are_named() {
        let (vertices, few) = cut("gallery?triangles=20000", Fineness::Elements(500));
        let said = left_uncut(&few, Some(500), vertices).unwrap();
        for part in ["--elements 500", &format!("well over {vertices} elements"), "leave --elements away"] {
            assert!(said.contains(part), "{part:?} is not in: {said}");
        }
        // Where they are cut, or nothing was asked for, or all triangles are small as they are, there is nothing to say.
        assert_eq!(left_uncut(&few, Some(vertices + 1), vertices), None);
        assert_eq!(left_uncut(&few, None, vertices), None);
        assert_eq!(left_uncut(&Tessellation { max_edge: 0.01, ..few }, Some(500), vertices), None);
    }
}
