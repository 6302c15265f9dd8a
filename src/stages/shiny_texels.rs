//! Texels of the atlas that shine, and what arrives at them along each bin of their hemispheres.
//!
//! Which texels are shiny is decided once, by what they reflect then; their lobes follow the materials.

use super::sender_tree::ShinyLeaves;
use super::texels::Texels;
use crate::gpu::shaders::types::TexelGloss;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::atlas::Atlas;
use glam::Vec3;

/// Why there are none.
#[derive(Debug, thiserror::Error)]
pub enum ShinyTexelsError {
    #[error(
        "{needed} bytes for the directions of {texels} shiny texels, {allowed} are allowed; lower glossy_bins (0: shiny \
         texels send evenly) or atlas_resolution, or raise gloss_threshold"
    )]
    TooLarge { needed: u64, allowed: u64, texels: usize },
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Tables of `row_count` shiny texels, `side` x `side` bins each (`glsl/lib/hemisphere_bins.glsl`).
pub struct ShinyTexels {
    pub side: u32,
    /// Of each texel: its row from 1; 0 where it sends evenly.
    pub rows: Vec<u32>,
    pub row_count: u32,
    pub glossy_rows: Buffer<u32>,
    /// Whose each row is.
    pub glossy_texels: Buffer<u32>,
    /// Irradiance by row and bin, W/m2.
    pub arrived: Buffer<Vec3>,
}

/// Share of even light that a lobe reflects, nearly: Schlick's term in the mean over the hemisphere.
fn specular_share(gloss: &TexelGloss) -> f32 {
    let f0 = gloss.f0.max_element();
    f0 + (gloss.f90 - f0) / 21.0
}

impl ShinyTexels {
    /// Texels with an area whose lobes reflect `threshold` and more of even light; none where `side` is 0.
    pub fn find(
        context: &Context,
        texels: &Texels,
        atlas: &Atlas,
        [side, threshold]: [f32; 2],
    ) -> Result<Self, ShinyTexelsError> {
        let side = side as u32;
        let gloss = if side > 0 { context.download(&texels.gloss)? } else { Vec::new() };
        let mut rows = vec![0; texels.count as usize];
        let mut glossy = Vec::new();
        for (index, (gloss, texel)) in gloss.iter().zip(&atlas.texels).enumerate() {
            let share = specular_share(gloss);
            if share > 0.0 && share >= threshold && texel.side_u.cross(texel.side_v).length_squared() > 0.0 {
                glossy.push(index as u32);
                rows[index] = glossy.len() as u32;
            }
        }
        let entries = glossy.len() * (side * side) as usize;
        let needed = (entries * size_of::<Vec3>()) as u64;
        // What is sent takes as much again, in tables of its own.
        let allowed = context.limits().storage_buffer_bytes.min(context.available_bytes() / 3);
        if needed > allowed {
            return Err(ShinyTexelsError::TooLarge { needed, allowed, texels: glossy.len() });
        }
        Ok(Self {
            side,
            row_count: glossy.len() as u32,
            glossy_rows: context.upload("shiny_texels/rows", &rows)?,
            glossy_texels: context.upload("shiny_texels/texels", &glossy)?,
            arrived: context.buffer("shiny_texels/arrived", entries)?,
            rows,
        })
    }

    /// The same texels as senders.
    pub fn as_leaves(&self) -> ShinyLeaves<'_> {
        ShinyLeaves { rows: &self.rows, side: self.side }
    }

    /// Entries of a table by row and bin.
    pub fn entry_count(&self) -> usize {
        (self.row_count * self.side * self.side) as usize
    }

    /// Nothing has arrived yet.
    pub fn clear(&self, recorder: &mut Recorder<'_>) {
        if self.row_count > 0 {
            recorder.fill(&self.arrived, 0);
        }
    }
}
