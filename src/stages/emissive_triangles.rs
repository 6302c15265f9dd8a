//! Emissive triangles: which there are, and an alias table to draw one of them by its weight in the present pose.
//!
//! A triangle emits where its material's emission factor is not black (textures may darken it in part) and it is not
//! unlit. Areas change with the pose: [`EmissiveTriangles::update`] measures them on the device and makes the table anew.

use crate::gpu::shaders::emissive_triangles::{Measure, MeasureParams};
use crate::gpu::shaders::types::{EmissiveMeasure, EmissiveTriangle};
use crate::gpu::{Buffer, Context, GpuError};
use crate::scene::Scene;
use crate::scene::alias::alias_table;
use crate::scene::geometry::Geometry;
use crate::stages::world::World;
use glam::Vec3;

/// The emissive triangles of a scene.
pub struct EmissiveTriangles {
    /// Entries of `table`; 0 where nothing can be drawn.
    pub count: u32,
    pub table: Buffer<EmissiveTriangle>,
    /// Density of drawn points on each triangle of the scene, m^-2; 0 where none is drawn.
    pub density: Buffer<f32>,
    triangles: Vec<u32>,
    emissive_triangles: Buffer<u32>,
    measures: Buffer<EmissiveMeasure>,
}

impl EmissiveTriangles {
    /// Finds the emissive triangles; [`Self::update`] makes the table.
    pub fn new(context: &Context, scene: &Scene, geometry: &Geometry) -> Result<Self, GpuError> {
        let emits = |triangle: &u32| {
            let part = &geometry.parts[geometry.triangle_part[*triangle as usize] as usize];
            let material = &scene.materials[part.material as usize];
            !material.unlit && material.emission != Vec3::ZERO
        };
        let triangles: Vec<u32> = (0..geometry.triangle_count()).filter(emits).collect();
        Ok(Self {
            count: 0,
            table: context.buffer("emissive triangles/table", triangles.len())?,
            density: context.upload("emissive triangles/density", &vec![0.0; geometry.triangles.len()])?,
            emissive_triangles: context.upload("emissive triangles/triangles", &triangles)?,
            measures: context.buffer("emissive triangles/measures", triangles.len())?,
            triangles,
        })
    }

    /// Makes the table for the world's present pose, each triangle drawn in proportion to `weight`; waits for the
    /// device.
    pub fn update(
        &mut self,
        context: &Context,
        world: &World,
        weight: impl Fn(&EmissiveMeasure) -> f64,
    ) -> Result<(), GpuError> {
        let emitter_count = self.triangles.len() as u32;
        let mut recorder = context.recorder("emissive triangles")?;
        recorder.dispatch(
            &Measure {
                emissive_triangles: &self.emissive_triangles,
                triangles: &world.triangles,
                triangle_materials: &world.triangle_materials,
                positions: &world.positions,
                attributes: &world.attributes,
                materials: &world.materials,
                measures: &self.measures,
                textures: &world.textures,
                params: MeasureParams { emitter_count },
            },
            emitter_count,
        );
        recorder.submit()?;

        let measures = context.download(&self.measures)?;
        let weights: Vec<f64> = measures.iter().map(|m| if m.area > 0.0 { weight(m) } else { 0.0 }).collect();
        let total: f64 = weights.iter().sum();
        self.count = if total > 0.0 && total.is_finite() { emitter_count } else { 0 };
        let probabilities: Vec<f64> =
            weights.iter().map(|weight| if self.count > 0 { weight / total } else { 0.0 }).collect();
        let mut density = vec![0.0; self.density.len()];
        let mut table = Vec::with_capacity(self.triangles.len());
        let entries = self.triangles.iter().zip(&measures).zip(probabilities.iter().zip(alias_table(&probabilities)));
        for ((&triangle, measure), (&probability, (threshold, alias))) in entries {
            let of_points = if probability > 0.0 { (probability / f64::from(measure.area)) as f32 } else { 0.0 };
            density[triangle as usize] = of_points;
            table.push(EmissiveTriangle { triangle, threshold, alias, density: of_points });
        }
        context.write(&self.table, &table)?;
        context.write(&self.density, &density)
    }
}
