//! `linklight bake SCENE -o baked.glb`: a method's solution into the scene, for programs that do not compute light.
//!
//! The file holds the surfaces as the method cut them, placed and posed, each side a primitive of its own.
//!
//! - `--into vertex-colors`: the attribute `_IRRADIANCE` (VEC3 of floats, W/m2), and COLOR_0 such that the unlit material
//!   shows base colour x irradiance / pi, divided by the scale.
//! - `--into lightmap`: a UV set with a place for every texel (row 0 at the top, as glTF), and beside the file an .exr of
//!   irradiance (W/m2; `coverage` is 1 where there is surface, its surroundings are filled for filters). Unlit materials
//!   show a picture of emission + albedo x irradiance / pi, divided by the scale; surfaces with holes keep their textures
//!   and are lit by their vertices.
//! - `--into irradiance-vectors`: the .exr has the layers `red`, `green` and `blue` (X, Y, Z; W/m2) on top: irradiance on
//!   a plane of normal n is about max(dot(n, vector), 0), channel by channel, exact for the surface's own normal.
//! - `--into spherical-harmonics`: the layers `sh.0`, `sh.y`, `sh.z`, `sh.x` (R, G, B): coefficients of arriving radiance
//!   in the orthonormal real functions 0.282095 and 0.488603 (y, z, x); irradiance on a plane of normal n is about
//!   pi 0.282095 c0 + 2/3 pi 0.488603 (n.y cy + n.z cz + n.x cx).                     [Ramamoorthi2001 Eq. 10 and 11]
//!
//! What depends on the eye is not baked: mirrors and glosses stay dark in unlit materials. Lights are in the light, and
//! in the file no longer. `asset.extras.linklight` says all of this, and the scale (radiance shown as white).
//!
//! [Ramamoorthi2001]: crate::methods::PAPERS

mod file;
mod pieces;
mod solution;

use std::io::Write;
use std::path::{Path, PathBuf};

use glam::Vec3;
use serde_json::{Value, json};

use super::cli::{BakeArgs, BakeForm, BakeMaterials, Global};
use super::compare::plan::{Plan, REFERENCE};
use super::console::{Console, Watcher};
use super::frame::Method;
use super::interrupt::Interrupt;
use super::output::Measured;
use super::render::{self, LightParts, RenderRequest};
use super::stage::Stage;
use super::{AppError, measure, output};
use crate::gpu::Context;
use crate::gpu::shaders::types::ArrivingLight;
use crate::methods::settings::Assignment;
use crate::report::image::{self, Picture};
use crate::report::trace::TimeLine;
use crate::report::write::{check_writable, write_bytes};
use crate::scene::Image;
use crate::scene::atlas::{Atlas, NO_TEXEL, Size};
use crate::scene::deform::{self, WorldVertices};
use crate::stages::arriving_light::{self, Surroundings, irradiance_vectors};
use crate::stages::surface_maps::map_offset;
use crate::stages::texels::Texels;
use crate::stages::work::Watch;
use file::Contents;
use solution::{ElementLight, TexelLight};

/// Share of the surface that unlit materials show darker than white, where no scale is given.
const DARKER_THAN_WHITE: f64 = 0.999;
/// Texels a side of the coarsest lightmap that is chosen, and of the one beyond which charts may be small.
const LIGHTMAP_SIZES: [u32; 2] = [256, 1024];
/// Texels around the filled ones that are filled too, for filters that look there.
const FILLED_RINGS: usize = 3;
/// Shadow rays of each texel to a punctual light, for light by direction.
const LIGHT_SAMPLES: u32 = 8;

pub fn run(
    args: &BakeArgs,
    global: &Global,
    console: &Console,
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<(), AppError> {
    if args.method.key == REFERENCE {
        let message = "path-tracing solves for pixels; bake a method that solves on surfaces";
        return Err(AppError::Usage(message.into()));
    }
    let default = if args.method.key == "surface-shadow-maps" { BakeForm::Lightmap } else { BakeForm::VertexColors };
    let form = args.into.unwrap_or(default);
    let exr = args.output.with_extension("exr");
    check_writable(&args.output)?;
    [&args.profile, &args.trace].into_iter().flatten().try_for_each(|path| check_writable(path))?;
    let mut set = args.set.clone();
    if args.method.key == "surface-shadow-maps" && !set.iter().any(|set| set.key == "atlas_gutter") {
        // Other programs filter over charts' borders.
        set.push(Assignment { key: "atlas_gutter".into(), value: "1".into() });
    }
    let plan = Plan { methods: vec![args.method], variations: &[], set: &set, options: &args.options, global };
    plan.check()?;
    let request = plan.run(&args.scene, args.method, &[], &exr)?.request;
    let run = RenderRequest { profile: args.profile.clone(), trace: args.trace.clone(), ..request };
    let bake = Bake { args, form, run };
    bake.run(global, console, interrupt, &exr, out)
}

struct Bake<'a> {
    args: &'a BakeArgs,
    form: BakeForm,
    run: RenderRequest,
}

impl Bake<'_> {
    fn run(
        &self,
        global: &Global,
        console: &Console,
        interrupt: &Interrupt,
        exr: &Path,
        out: &mut dyn Write,
    ) -> Result<(), AppError> {
        let request = &self.run;
        let time_line = TimeLine::default();
        let context = time_line.span("open device", || render::open_device(global, request.profile.is_some()))?;
        let watch = Watcher::new(console, interrupt);
        let stage = Stage::new(&context, request, &time_line)?;
        let vertices = deform::world_vertices(&stage.geometry, &stage.pose);
        let mut method = time_line.span("prepare method", || Method::prepare(&context, request, &stage, &watch))?;
        let solved = time_line.span("solve", || method.solve(&context, request, &stage, &watch))?;
        let (light, own_texels) = ElementLight::of(&context, request, &stage, &solved)?;

        let texels = match self.form {
            BakeForm::VertexColors => None,
            _ => Some(self.texels(&stage, &vertices, &light, own_texels)?),
        };
        let shown = texels.as_ref().map(|texels| shown_texels(&context, &stage, texels)).transpose()?;
        let pieces = pieces::pieces(&stage.scene, &stage.geometry, texels.as_ref().map(|texels| &texels.atlas));
        let scale = self.args.scale.unwrap_or_else(|| match (&texels, &shown) {
            (Some(texels), Some(shown)) => white_of_texels(&texels.atlas, shown),
            _ => white_of_vertices(&stage, &vertices, &light),
        });
        let lightmap = match (&texels, &shown) {
            (Some(texels), Some(shown)) => Some(display_picture(&texels.atlas, shown, scale)),
            _ => None,
        };
        let mut contents = Contents {
            stage: &stage,
            vertices: &vertices,
            light: &light,
            pieces: &pieces,
            scale,
            keeps_materials: self.args.materials == BakeMaterials::Original,
            is_diffuse: request.diffuse,
            lightmap,
            extras: Value::Null,
        };
        let picture = match &texels {
            Some(texels) => Some(self.picture(&context, &stage, &mut method, texels, &watch)?),
            None => None,
        };
        contents.extras = self.extras(&contents, picture.as_ref().map(|_| exr), context.info())?;
        let glb = contents.glb()?;
        render::check_validation(&context)?;
        // The picture first: a scene that names it is never without it.
        let mut written = Vec::new();
        if let Some(mut picture) = picture {
            picture.metadata = output::metadata(request, context.info())?;
            image::write_exr(exr, &picture)?;
            written.push(exr.to_owned());
        }
        write_bytes(&self.args.output, &glb)?;
        written.push(self.args.output.clone());
        let records = context.take_records();
        let (scene, facts) = (stage.facts(), method.report()?);
        let measured = Measured { context: &context, time_line: &time_line, records, scene, method: facts };
        output::write_measurements(request, measured, &mut std::io::sink())?;
        self.report(&stage, &pieces, scale, &written, out)
    }

    /// The method's own texels, or those of an atlas made for the purpose.
    fn texels(
        &self,
        stage: &Stage,
        vertices: &WorldVertices,
        light: &ElementLight,
        own: Option<TexelLight>,
    ) -> Result<TexelLight, AppError> {
        if let Some(own) = own {
            if self.args.lightmap_size.is_some() {
                return Err(AppError::Usage(format!(
                    "{} has an atlas of its own; set its size by --set atlas_resolution=N",
                    self.run.method.key
                )));
            }
            return Ok(own);
        }
        let (scene, geometry, positions) = (&stage.scene, &stage.geometry, &vertices.positions);
        let atlas = match self.args.lightmap_size {
            Some(resolution) => Atlas::new(scene, geometry, positions, Size { resolution, gutter: 1 }),
            None => {
                let least = Size { resolution: LIGHTMAP_SIZES[0], gutter: 1 };
                Atlas::fitting(scene, geometry, positions, least, LIGHTMAP_SIZES[1])
            }
        };
        let atlas = atlas.map_err(|error| {
            let advice = error.to_string().replace("atlas_resolution=", "--lightmap-size ").replace("set --", "use --");
            AppError::failed(advice)
        })?;
        Ok(TexelLight::between_elements(stage, atlas, light))
    }

    /// Irradiance, and light by direction where it was asked for.
    fn picture(
        &self,
        context: &Context,
        stage: &Stage,
        method: &mut Method,
        texels: &TexelLight,
        watch: &dyn Watch,
    ) -> Result<Picture, AppError> {
        let atlas = &texels.atlas;
        let size = atlas.resolution;
        let mut picture = Picture::new(size, size, filled(atlas, &texels.irradiance))?;
        let coverage = atlas.texel_at.iter().map(|&texel| f32::from(u8::from(texel != NO_TEXEL)));
        picture.add_channel("coverage", coverage.collect())?;
        if matches!(self.form, BakeForm::VertexColors | BakeForm::Lightmap) {
            return Ok(picture);
        }
        // The way from the surfaces to the texels is a bounce of its own.
        let before = RenderRequest { bounces: self.run.bounces.saturating_sub(1), ..self.run.clone() };
        let solved = method.solve(context, &before, stage, watch)?;
        let (light, _) = ElementLight::of(context, &before, stage, &solved)?;
        let is_direct = self.run.light != LightParts::IndirectOnly;
        let is_indirect = self.run.light != LightParts::DirectOnly && self.run.bounces > 0;
        let on_device = Texels::new(context, atlas, &stage.world, map_offset(stage.bounds))?;
        let surroundings = Surroundings {
            tracer: &stage.tracer(),
            world: &stage.world,
            exitant: &context.upload("bake/exitant", &light.exitant(is_direct, is_indirect))?,
            back_elements: &context.upload("bake/back elements", &light.back_elements)?,
            has_lights: is_direct,
        };
        let samples = [self.args.directions, LIGHT_SAMPLES];
        let arriving = arriving_light::gather(context, &on_device, surroundings, samples, self.run.seed, watch);
        let arriving: Vec<ArrivingLight> = context.download(&arriving.map_err(AppError::failed)?)?;
        match self.form {
            BakeForm::IrradianceVectors => {
                for (channel, layer) in ["red", "green", "blue"].into_iter().enumerate() {
                    let vectors: Vec<Vec3> = arriving.iter().map(|light| irradiance_vectors(light)[channel]).collect();
                    picture.add_xyz(layer, &filled(atlas, &vectors))?;
                }
            }
            _ => {
                let mut add = |layer: &str, coefficient: fn(&ArrivingLight) -> Vec3| {
                    let values: Vec<Vec3> = arriving.iter().map(coefficient).collect();
                    picture.add_rgb(layer, &filled(atlas, &values))
                };
                add("sh.0", |light| light.constant)?;
                add("sh.y", |light| light.along_y)?;
                add("sh.z", |light| light.along_z)?;
                add("sh.x", |light| light.along_x)?;
            }
        }
        Ok(picture)
    }

    fn extras(
        &self,
        contents: &Contents<'_>,
        exr: Option<&Path>,
        device: &crate::gpu::DeviceInfo,
    ) -> Result<Value, AppError> {
        let mut extras = json!({
            "scene": self.args.scene.to_string(),
            "form": self.form,
            "materials": self.args.materials,
            "device": measure::device(device),
            "settings": self.run.record()?,
            "radiance_shown_as_white": contents.scale,
            "attributes": { "_IRRADIANCE": "irradiance, W/m2, per vertex" },
        });
        if let Some(name) = exr.and_then(Path::file_name) {
            extras["lightmap"] = json!({
                "file": name.to_string_lossy(),
                "texCoord": contents.lightmap_set(),
                "channels": "RGB irradiance, W/m2; coverage",
            });
        }
        Ok(extras)
    }

    fn report(
        &self,
        stage: &Stage,
        pieces: &[pieces::Piece],
        scale: f32,
        written: &[PathBuf],
        out: &mut dyn Write,
    ) -> Result<(), AppError> {
        let vertices: usize = pieces.iter().map(|piece| piece.vertices.len()).sum();
        let triangles: usize = pieces.iter().map(|piece| piece.triangles.len()).sum();
        let name = &stage.scene.name;
        writeln!(out, "{name}: {vertices} vertices, {triangles} triangles, {} primitives", pieces.len())?;
        if self.args.materials == BakeMaterials::Unlit {
            writeln!(out, "white is {scale:.4} W m^-2 sr^-1 (--scale)")?;
        }
        for path in written {
            writeln!(out, "wrote {}", path.display())?;
        }
        Ok(())
    }
}

/// Emission, and what the diffuse surface reflects, W m^-2 sr^-1 per texel.
fn shown_texels(context: &Context, stage: &Stage, texels: &TexelLight) -> Result<Shown, AppError> {
    let on_device = Texels::new(context, &texels.atlas, &stage.world, map_offset(stage.bounds))?;
    let albedo = context.download(&on_device.albedo)?;
    let emission = context.download(&on_device.emission)?;
    let lit = albedo.iter().zip(&texels.irradiance).map(|(albedo, e)| albedo * e / std::f32::consts::PI);
    let radiance = lit.zip(&emission).map(|(lit, emission)| lit + emission).collect();
    Ok(Shown { radiance, emits: emission.into_iter().map(|emission| emission != Vec3::ZERO).collect() })
}

/// Per texel.
struct Shown {
    radiance: Vec<Vec3>,
    emits: Vec<bool>,
}

/// The radiance below which [`DARKER_THAN_WHITE`] of all surface stays that does not emit.
fn white_of_texels(atlas: &Atlas, shown: &Shown) -> f32 {
    let texels = atlas.texels.iter().zip(&shown.radiance).zip(&shown.emits);
    white(texels.filter(|(_, emits)| !**emits).map(|((texel, radiance), _)| (radiance.max_element(), texel.area)))
}

/// As [`white_of_texels`]; a vertex colour is multiplied with the base colour, so that it counts alone.
fn white_of_vertices(stage: &Stage, vertices: &WorldVertices, light: &ElementLight) -> f32 {
    let fronts_and_backs = stage.geometry.triangles.iter().flat_map(|&corners| {
        let [a, b, c] = corners.map(|vertex| vertices.positions[vertex as usize]);
        let third = (b - a).cross(c - a).length() / 6.0;
        corners.into_iter().flat_map(move |vertex| {
            let back = light.back_elements[vertex as usize];
            [Some(vertex), (back != u32::MAX).then_some(back)]
                .into_iter()
                .flatten()
                .map(move |element| (element, third))
        })
    });
    let lit = fronts_and_backs.filter(|&(element, _)| light.emission[element as usize] == Vec3::ZERO);
    white(lit.map(|(element, area)| (light.irradiance[element as usize].max_element() / std::f32::consts::PI, area)))
}

/// Of (value, area) pairs; 1 where all is dark.
fn white(values: impl Iterator<Item = (f32, f32)>) -> f32 {
    let mut values: Vec<(f32, f32)> = values.filter(|(value, _)| value.is_finite()).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = values.iter().map(|&(_, area)| f64::from(area)).sum();
    let mut below = 0.0;
    for (value, area) in values {
        below += f64::from(area);
        if below >= DARKER_THAN_WHITE * whole && value > 0.0 {
            return value;
        }
    }
    1.0
}

/// What unlit materials show, sRGB.
fn display_picture(atlas: &Atlas, shown: &Shown, scale: f32) -> Image {
    let encode = |value: f32| {
        let value = (value / scale).clamp(0.0, 1.0);
        let encoded = if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded + 0.5) as u8
    };
    let rgba = filled(atlas, &shown.radiance).into_iter();
    let rgba = rgba.flat_map(|c| [encode(c.x), encode(c.y), encode(c.z), 255]).collect();
    let side = atlas.resolution;
    Image { name: "lightmap".into(), width: side, height: side, rgba, srgb: true }
}

/// Values of texels as a picture; places around the filled ones take the mean of their neighbours, ring by ring.
fn filled(atlas: &Atlas, values: &[Vec3]) -> Vec<Vec3> {
    let side = atlas.resolution as usize;
    let at = |&texel: &u32| (texel != NO_TEXEL).then(|| values[texel as usize]);
    let mut places: Vec<Option<Vec3>> = atlas.texel_at.iter().map(at).collect();
    for _ in 0..FILLED_RINGS {
        let before = places.clone();
        for (index, place) in places.iter_mut().enumerate().filter(|(_, place)| place.is_none()) {
            let (x, y) = (index % side, index / side);
            let (mut sum, mut count) = (Vec3::ZERO, 0.0);
            for row in y.saturating_sub(1)..(y + 2).min(side) {
                for column in x.saturating_sub(1)..(x + 2).min(side) {
                    if let Some(value) = before[row * side + column] {
                        sum += value;
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 {
                *place = Some(sum / count);
            }
        }
    }
    places.into_iter().map(Option::unwrap_or_default).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_leaves_a_thousandth_of_the_surface_above() {
        let values = (1..=10_000).map(|i| (i as f32, 1.0));
        assert_eq!(white(values), 9990.0);
        assert_eq!(white([(0.0, 1.0)].into_iter()), 1.0);
        assert_eq!(white(std::iter::empty()), 1.0);
        assert_eq!(white([(5.0, 1.0), (f32::NAN, 9.0)].into_iter()), 5.0);
    }

    #[test]
    fn surroundings_are_filled_ring_by_ring() {
        let mut texel_at = vec![NO_TEXEL; 81];
        texel_at[40] = 0;
        let atlas = Atlas { resolution: 9, texel_at, ..Atlas::default() };
        let picture = filled(&atlas, &[Vec3::ONE]);
        let count = picture.iter().filter(|value| **value == Vec3::ONE).count();
        assert_eq!(count, (2 * FILLED_RINGS + 1).pow(2));
        assert_eq!(picture[0], Vec3::ZERO);
    }
}
