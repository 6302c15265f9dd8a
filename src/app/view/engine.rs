//! From a request to a film, frame after frame: does again only what the request changed since the last one, by the
//! same code as `linklight render`.

use std::sync::Arc;

use crate::app::AppError;
use crate::app::bench::yardsticks::Yardsticks;
use crate::app::edits::{Edit, Originals};
use crate::app::explain;
use crate::app::frame::Method;
use crate::app::render::RenderRequest;
use crate::app::stage::{Stage, load_scene};
use crate::gpu::Context;
use crate::methods::pick::seen_triangle;
use crate::report::explanation::Explanation;
use crate::report::trace::TimeLine;
use crate::scene::pose::PosedLight;
use crate::scene::{LightKind, Material, Scene};
use crate::stages::film::Film;
use crate::stages::work::Watch;
use glam::{Mat3, UVec2, Vec3};

/// How deep a change of the request goes; each needs what stands after it too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Depth {
    /// The view, or what a frame solves.
    Frame,
    /// Albedo and intensities.
    Light,
    /// Where surfaces and lights are at another time.
    Follow,
    /// What the display stage keeps: buffers of the picture's size.
    Display,
    /// What the method prepares: links, maps, clusters.
    Method,
    /// Where the scene stands on the device.
    Stage,
    /// The scene's file.
    Scene,
}

/// What `new` asks to be done anew when `old` is there; `None` where only the tone mapping of the same film differs.
pub fn change(old: &RenderRequest, new: &RenderRequest) -> Option<Depth> {
    let tessellates = |r: &RenderRequest| r.display.is_some() && r.method.key != "surface-shadow-maps";
    let is_traced = new.method.key == "path-tracing";
    if old.scene != new.scene {
        Some(Depth::Scene)
    } else if old.environment != new.environment
        || old.environment_turn != new.environment_turn
        || old.diffuse != new.diffuse
        || old.elements != new.elements
        || old.rays != new.rays
        || tessellates(old) != tessellates(new)
        || (old.edits != new.edits && !keeps_links(&old.edits, &new.edits))
    {
        Some(Depth::Stage)
    } else if old.method.key != new.method.key || old.assignments != new.assignments || old.seed != new.seed {
        Some(Depth::Method)
    } else if (old.width, old.height) != (new.width, new.height)
        || old.display != new.display
        || old.display_assignments != new.display_assignments
        // The gather stops where the tone map shows no difference.
        || (old.tone != new.tone && shows_by_tone(new))
        || (is_traced && old.bounces != new.bounces)
    {
        Some(Depth::Display)
    } else if old.seconds != new.seconds {
        Some(Depth::Follow)
    } else if old.edits != new.edits {
        Some(Depth::Light)
    } else if old.camera != new.camera
        || old.free_camera != new.free_camera
        || old.bounces != new.bounces
        || old.spp != new.spp
        || old.shows_bad_values != new.shows_bad_values
    {
        Some(Depth::Frame)
    } else {
        None
    }
}

/// Whether the edits that are not in both lists leave links as they are.
fn keeps_links(old: &[Edit], new: &[Edit]) -> bool {
    let changed = |a: &[Edit], b: &[Edit]| a.iter().filter(|edit| !b.contains(edit)).all(|e| e.property.keeps_links());
    changed(old, new) && changed(new, old)
}

/// Whether the film itself depends on the tone map.
fn shows_by_tone(request: &RenderRequest) -> bool {
    request.display == Some(crate::app::cli::Display::FinalGather)
}

/// How far from a light's place a click still means the light, pixels.
const LIGHT_REACH: f32 = 8.0;
const YARDSTICK_ROUNDS: usize = 5;

/// What was clicked at.
pub enum Picked {
    /// Index in the scene's lights, and where it is held.
    Light(u32, Handle),
    Surface(Box<Surface>),
}

impl Picked {
    pub fn handle(&self) -> Handle {
        match self {
            Self::Light(_, handle) => *handle,
            Self::Surface(surface) => surface.handle,
        }
    }
}

/// How what was picked follows the mouse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Handle {
    pub node: u32,
    /// Metres from the eye's plane.
    pub depth: f32,
    /// Of directions: edits move nodes along their parents' axes.
    pub parent_from_world: Mat3,
}

/// A surface of the scene as it is edited now.
pub struct Surface {
    pub material_index: u32,
    pub material: Material,
    pub handle: Handle,
    pub node: String,
    pub triangle: usize,
    /// Metres from the eye.
    pub distance: f32,
}

/// A scene on the device with a method prepared, and the films it renders into.
pub struct Engine<'c> {
    context: &'c Context,
    time_line: TimeLine,
    scene: Option<Scene>,
    /// What the file says where edits change it.
    originals: Option<Originals>,
    /// Those that stage and method have taken over.
    edits: Vec<Edit>,
    /// The time that they have.
    seconds: f32,
    stage: Option<Stage>,
    method: Option<Method>,
    /// What scene, stage and method were made for.
    last: Option<RenderRequest>,
    /// What an error left to be done.
    owed: Depth,
    films: Vec<Arc<Film>>,
}

impl<'c> Engine<'c> {
    pub fn new(context: &'c Context) -> Self {
        let time_line = TimeLine::default();
        Self {
            context,
            time_line,
            scene: None,
            originals: None,
            edits: Vec::new(),
            seconds: 0.0,
            stage: None,
            method: None,
            last: None,
            owed: Depth::Scene,
            films: Vec::new(),
        }
    }

    pub fn context(&self) -> &'c Context {
        self.context
    }

    /// What makes up a pixel of the picture of `request`, which is rendered again for it.
    pub fn explain(
        &mut self,
        request: &RenderRequest,
        pixel: UVec2,
        watch: &dyn Watch,
    ) -> Result<Explanation, AppError> {
        explain::check(request, pixel)?;
        let film = self.render(request, watch)?;
        let (Some(stage), Some(method)) = (&self.stage, &mut self.method) else {
            return Err(AppError::failed("there is no picture yet"));
        };
        let frame = explain::Frame { context: self.context, request, stage, film: &film, watch };
        explain::explain(frame, method, pixel)
    }

    /// Frames since the oldest links were made, where they are older than the surfaces' places: rendering the same
    /// picture again makes them younger.
    pub fn link_age(&self) -> Option<u32> {
        self.method.as_ref().and_then(Method::link_age)
    }

    pub fn is_lost(&self) -> bool {
        self.context.is_lost()
    }

    /// The scene as it stands for the last frame.
    pub fn stage(&self) -> Option<&Stage> {
        self.stage.as_ref()
    }

    /// Renders what `request` asks for. After an error what was whole before stays, and the rest is made when it is
    /// asked for again.
    pub fn render(&mut self, request: &RenderRequest, watch: &dyn Watch) -> Result<Arc<Film>, AppError> {
        let changed = self.last.as_ref().map_or(Some(Depth::Scene), |last| change(last, request));
        let depth = changed.unwrap_or(Depth::Frame).max(self.owed);
        self.owed = depth;
        self.last = Some(request.clone());
        // What is made anew goes first: two may not fit.
        if depth >= Depth::Method {
            self.method = None;
        }
        if depth >= Depth::Stage {
            self.scene = self.stage.take().map(|stage| stage.scene).or(self.scene.take());
        }
        if depth == Depth::Scene {
            self.scene = None;
        }

        if depth >= Depth::Stage {
            watch.step("placing the scene", 0, 1)?;
            let mut scene = match self.scene.take() {
                Some(scene) => scene,
                None => {
                    let scene = load_scene(&request.scene, self.context)?;
                    self.originals = Some(Originals::of(&scene));
                    scene
                }
            };
            if let Some(originals) = &self.originals {
                originals.edit(&mut scene, &request.edits)?;
            }
            self.stage = Some(Stage::place(self.context, scene, request, &self.time_line)?);
        }
        let film = self.film(request.width, request.height)?;
        let Some(stage) = &mut self.stage else { return Err(AppError::failed("the scene was not placed")) };
        if self.edits != request.edits && depth < Depth::Stage {
            if let Some(originals) = &self.originals {
                originals.edit(&mut stage.scene, &request.edits)?;
            }
            stage.relight(self.context, request)?;
            if let Some(method) = &self.method
                && !method.relight(self.context, stage)?
            {
                self.method = None;
            }
        }
        self.edits.clone_from(&request.edits);
        let is_later = self.seconds != request.seconds && depth < Depth::Stage;
        let has_moved = is_later && stage.follow(self.context, request)?;
        self.seconds = request.seconds;
        if let Some(method) = &mut self.method
            && (has_moved || method.link_age().is_some())
            && !method.follow(self.context, request, stage, has_moved, watch)?
        {
            self.method = None;
        }
        stage.look(request)?;
        match &mut self.method {
            Some(method) if depth >= Depth::Display => method.show(self.context, request, stage)?,
            Some(_) => {}
            none => {
                watch.step("preparing", 0, 1)?;
                *none = Some(Method::prepare(self.context, request, stage, watch)?);
            }
        }
        let Some(method) = &mut self.method else { return Err(AppError::failed("the method was not prepared")) };
        method.frame(self.context, request, stage, &film, watch)?;
        self.owed = Depth::Frame;
        Ok(film)
    }

    /// The method is prepared again for the next picture.
    pub fn prepare_anew(&mut self) {
        self.owed = self.owed.max(Depth::Method);
    }

    /// What a pixel of the picture of `request` shows: a light close by, else the nearest surface.
    pub fn pick(&mut self, request: &RenderRequest, pixel: UVec2) -> Result<Option<Picked>, AppError> {
        let Some(stage) = &mut self.stage else { return Ok(None) };
        stage.look(request)?;
        let size = UVec2::new(request.width, request.height);
        let near_pixel = |light: &&PosedLight| {
            let at = stage.view.project(light.position, size);
            light.kind != LightKind::Directional && at.is_some_and(|(at, _)| at.distance(pixel.as_vec2()) < LIGHT_REACH)
        };
        let handle = |node: u32, place: Vec3| {
            let parent = stage.scene.nodes[node as usize].parent;
            let world_from_parent = parent.map(|parent| stage.pose.world_from_node[parent as usize]);
            let inverse = world_from_parent.map(|matrix| Mat3::from_mat4(matrix).inverse());
            // A parent without extent moves nothing.
            let parent_from_world = inverse.map_or(Mat3::IDENTITY, |m| if m.is_finite() { m } else { Mat3::ZERO });
            Handle { node, depth: (place - stage.view.position).dot(stage.view.forward), parent_from_world }
        };
        if let Some(light) = stage.pose.lights.iter().find(near_pixel) {
            return Ok(Some(Picked::Light(light.light, handle(light.node, light.position))));
        }
        let positions = self.context.download(&stage.world.positions)?;
        let triangles = self.context.download(&stage.world.triangles)?;
        let Some(seen) = seen_triangle(&positions, &triangles, &stage.view, pixel, size) else { return Ok(None) };
        let part = &stage.geometry.parts[stage.geometry.triangle_part[seen.triangle] as usize];
        let material = stage.scene.materials[part.material as usize].clone();
        let node = stage.scene.nodes[part.node as usize].name.clone();
        let ray = stage.view.ray(pixel.as_vec2() + 0.5, size);
        Ok(Some(Picked::Surface(Box::new(Surface {
            material_index: part.material,
            material,
            handle: handle(part.node, ray.origin + seen.distance * ray.direction),
            node,
            triangle: seen.triangle,
            distance: seen.distance,
        }))))
    }

    /// What a copy moves on this device, bytes a millisecond.
    pub fn measure_bandwidth(&self) -> Result<f64, AppError> {
        let mut yardsticks = Yardsticks::new(self.context)?;
        for _ in 0..YARDSTICK_ROUNDS {
            yardsticks.round(self.context, true)?;
        }
        let mut measured = yardsticks.finish();
        measured.copy_ms.sort_by(f64::total_cmp);
        Ok(measured.copy_bytes as f64 / measured.copy_ms[YARDSTICK_ROUNDS / 2].max(1e-6))
    }

    /// A film of that size that nobody looks at.
    fn film(&mut self, width: u32, height: u32) -> Result<Arc<Film>, AppError> {
        self.films.retain(|film| (film.width, film.height) == (width, height));
        if let Some(film) = self.films.iter().find(|film| Arc::strong_count(film) == 1) {
            return Ok(Arc::clone(film));
        }
        let film = Arc::new(Film::new(self.context, width, height)?);
        self.films.push(Arc::clone(&film));
        Ok(film)
    }
}

#[cfg(test)]
#[path = "engine_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "soak_scenes.rs"]
mod soak_scenes;

#[cfg(test)]
#[path = "soak_tests.rs"]
mod soak_tests;
