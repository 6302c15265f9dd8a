//! The samples of one pixel, by the passes that drew the picture.

use glam::{DVec3, UVec2, Vec3};

use super::{Parts, add};
use crate::app::AppError;
use crate::app::stage::Stage;
use crate::display::PixelView;
use crate::display::direct::{Canvas, Lighting, Sample};
use crate::gpu::{Context, Recorder};
use crate::report::explanation::Light;
use crate::scene::LightKind;

/// Punctual lights that are told apart; more are told as one.
const MOST_LIGHTS: u32 = 64;

/// Draws a pixel's samples again, into a film of its own.
pub struct Probe<'a> {
    pub context: &'a Context,
    pub stage: &'a Stage,
    /// Its film is scratch.
    pub canvas: Canvas<'a>,
    pub pixel: UVec2,
    /// Of the world's vertices.
    pub positions: Vec<Vec3>,
}

/// What one sample of the pixel sees.
pub struct Seen {
    pub view: PixelView,
    /// `None`: the background.
    pub triangle: Option<u32>,
    /// Metres, world.
    pub position: Vec3,
    /// Towards the eye, unit.
    pub normal: Vec3,
    /// Of the triangle's corners.
    pub weights: [f32; 3],
    /// Diffuse reflectance, and whether the surface reflects nothing else.
    pub albedo: Vec3,
    pub is_diffuse: bool,
    pub reflects: bool,
    /// The triangle's back is seen.
    pub is_back: bool,
}

impl<'a> Probe<'a> {
    pub fn new(context: &'a Context, stage: &'a Stage, canvas: Canvas<'a>, pixel: UVec2) -> Result<Self, AppError> {
        let positions = context.download(&stage.world.positions)?;
        Ok(Self { context, stage, canvas, pixel, positions })
    }

    fn at(&self) -> usize {
        (self.pixel.y * self.canvas.film.width + self.pixel.x) as usize
    }

    /// Draws the G-buffer of sample `index`, adds the light that is there without the method to `parts`, and leaves the
    /// G-buffer as it is for [`Self::reflectance`].
    pub fn sample(&self, index: u32, parts: &mut Parts) -> Result<Seen, AppError> {
        let Canvas { lighting: Lighting { world, g_buffer, .. }, view, samples, film } = self.canvas;
        let size = UVec2::new(film.width, film.height);
        let view = PixelView::new(view, size, index, samples);
        let mut recorder = self.context.recorder("explain")?;
        g_buffer.draw(&mut recorder, world, &view);
        recorder.submit()?;

        let at = self.at();
        let four = |image| -> Result<[f32; 4], AppError> { Ok(self.context.download_image(image, 0)?[at]) };
        let triangle = self.context.download_image::<u32>(&g_buffer.visible_triangles, 0)?[at].checked_sub(1);
        let ([px, py, pz, v], [nx, ny, nz, _]) = (four(&g_buffer.position)?, four(&g_buffer.normal)?);
        let ([ar, ag, ab, f90], [fr, fg, fb, w]) = (four(&g_buffer.albedo)?, four(&g_buffer.specular)?);
        let reflects = triangle.is_some() && four(&g_buffer.emission)?[3] > 0.5;
        let (position, eye) = (Vec3::new(px, py, pz), Vec3::from_slice(&view.eye));
        let to_eye = if view.eye[3] == 0.0 { eye } else { eye - position };
        let is_back = triangle.is_some_and(|triangle| {
            let [a, b, c] = self.corners(triangle).map(|vertex| self.positions[vertex as usize]);
            (b - a).cross(c - a).dot(to_eye) < 0.0
        });
        let sample = Sample { index: 0, samples, is_unlit: false };
        self.add_lights(&view, sample, triangle.is_some(), parts)?;
        Ok(Seen {
            view,
            triangle,
            position,
            normal: Vec3::new(nx, ny, nz),
            weights: [1.0 - v - w, v, w],
            albedo: Vec3::new(ar, ag, ab),
            is_diffuse: f90 == 0.0 && [fr, fg, fb] == [0.0; 3],
            reflects,
            is_back,
        })
    }

    pub fn corners(&self, triangle: u32) -> [u32; 3] {
        self.stage.geometry.triangles[triangle as usize]
    }

    /// Emission or background, then light after light: what each changes of the picture.
    fn add_lights(&self, view: &PixelView, sample: Sample, hits: bool, parts: &mut Parts) -> Result<(), AppError> {
        let Canvas { lighting, film, .. } = self.canvas;
        let total = if hits { lighting.world.light_count } else { 0 };
        let steps: Vec<u32> = if total <= MOST_LIGHTS { (0..=total).collect() } else { vec![0, total] };
        let mut before = DVec3::ZERO;
        for count in steps {
            let mut recorder = self.context.recorder("explain")?;
            lighting.shade(&mut recorder, view, sample, count, film);
            recorder.submit()?;
            let at = self.at();
            let now = self.context.download_range(&film.direct, at..at + 1)?[0].as_dvec3();
            let source = match count {
                0 if hits => "emission of the surface itself".to_owned(),
                0 => "background".to_owned(),
                _ if total > MOST_LIGHTS => format!("{total} punctual lights"),
                _ => self.light_name(count - 1),
            };
            add(parts, (Light::Direct, Some(0), source, String::new()), now - before);
            before = now;
        }
        Ok(())
    }

    fn light_name(&self, posed: u32) -> String {
        let light = &self.stage.pose.lights[posed as usize];
        let kind = match light.kind {
            LightKind::Point => "point",
            LightKind::Spot { .. } => "spot",
            LightKind::Directional => "directional",
        };
        let name = self.stage.scene.lights.get(light.light as usize).map_or("", |light| light.name.as_str());
        format!("{kind} light {} `{name}`", light.light)
    }

    /// Radiance that the sample shows for irradiance 1 everywhere, 1/sr times the sample's share: `add` draws it into the
    /// film's indirect light.
    pub fn reflectance(
        &self,
        seen: &Seen,
        add: impl FnOnce(&mut Recorder<'_>, &PixelView, f32),
    ) -> Result<DVec3, AppError> {
        let film = self.canvas.film;
        let mut recorder = self.context.recorder("explain")?;
        recorder.fill(&film.direct, 0);
        recorder.fill(&film.indirect, 0);
        add(&mut recorder, &seen.view, 1.0 / self.canvas.samples as f32);
        recorder.submit()?;
        let at = self.at();
        Ok(self.context.download_range(&film.indirect, at..at + 1)?[0].as_dvec3())
    }

    /// What is seen, in words.
    pub fn name(&self, triangle: u32) -> String {
        let part = self.stage.geometry.parts[self.stage.geometry.triangle_part[triangle as usize] as usize];
        let scene = &self.stage.scene;
        let material = scene.materials.get(part.material as usize).map_or("", |material| material.name.as_str());
        let node = scene.nodes.get(part.node as usize).map_or("", |node| node.name.as_str());
        format!("triangle {triangle} of node {} `{node}`, material {} `{material}`", part.node, part.material)
    }
}
