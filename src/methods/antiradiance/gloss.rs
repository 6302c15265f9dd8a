//! Glossy leaves: their specular lobes, reflected bin by bin, and seen from the eye.

use super::Antiradiance;
use super::tables::Tables;
use crate::gpu::shaders::methods::antiradiance as passes;
use crate::gpu::shaders::types::LeafGloss;
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::camera::{Lens, View};
use crate::stages::direction_bins::DeviceBins;
use crate::stages::elements::Elements;
use crate::stages::hierarchy::{Hierarchy, NONE};
use crate::stages::world::World;
use glam::{Vec3, Vec4};

/// Bins of a thread, in `reflect_glossy.comp`.
const SENT_BINS: u32 = 8;

/// The glossy leaves of a scene.
pub struct Gloss {
    pub count: u32,
    /// Per leaf.
    pub lobes: Buffer<LeafGloss>,
    /// The leaves that are glossy.
    pub leaves: Buffer<u32>,
    /// Per leaf: its place among the glossy ones, or [`NONE`].
    pub glossy_of_leaf: Buffer<u32>,
    /// Per glossy leaf and bin: what the lobe sends, W m^-2 sr^-1.
    pub specular: Buffer<Vec3>,
    /// Per glossy leaf and bin, words as in [`Tables`]: radiance that arrived last.
    pub(super) arrived: Buffer<u64>,
    /// The same of direct light that came along links.
    pub(super) arrived_directly: Buffer<u64>,
    /// What is sent of direct light that came along links, alone.
    pub base: Buffer<Vec3>,
}

impl Gloss {
    /// Bytes of the table of `count` glossy leaves.
    pub fn table_bytes(count: usize, bin_count: u32) -> u64 {
        count as u64 * u64::from(bin_count) * size_of::<Vec3>() as u64
    }

    /// Leaves whose lobes reflect at least `threshold` at normal incidence.
    pub fn new(
        context: &Context,
        hierarchy: &Hierarchy,
        elements: &Elements,
        world: &World,
        threshold: f32,
        (bin_count, half): (u32, bool),
    ) -> Result<Self, GpuError> {
        let leaf_count = hierarchy.leaf_count();
        let lobes = context.buffer("antiradiance/gloss", leaf_count as usize)?;
        let mut recorder = context.recorder("antiradiance")?;
        measure(&mut recorder, hierarchy, elements, world, &lobes);
        recorder.submit()?;
        let measured = context.download(&lobes)?;
        let glossy: Vec<u32> = (0..leaf_count)
            .filter(|&leaf| {
                let f0 = measured[leaf as usize].f0;
                f0.max_element() > 0.0 && f0.max_element() >= threshold
            })
            .collect();
        let mut glossy_of_leaf = vec![NONE; leaf_count as usize];
        glossy.iter().zip(0..).for_each(|(&leaf, index)| glossy_of_leaf[leaf as usize] = index);
        let entries = glossy.len() * bin_count as usize;
        let words = entries * Tables::words(half) as usize;
        Ok(Self {
            count: glossy.len() as u32,
            arrived: context.buffer("antiradiance/arrived at glossy leaves", words)?,
            arrived_directly: context.buffer("antiradiance/arrived directly at glossy leaves", words)?,
            leaves: context.upload("antiradiance/glossy leaves", &glossy)?,
            glossy_of_leaf: context.upload("antiradiance/glossy of leaf", &glossy_of_leaf)?,
            specular: context.buffer("antiradiance/specular", entries)?,
            base: context.buffer("antiradiance/specular of direct light", entries)?,
            lobes,
        })
    }

    /// What the lobes send of the light that arrived last.
    pub fn reflect(
        &self,
        recorder: &mut Recorder<'_>,
        tables: &Tables,
        hierarchy: &Hierarchy,
        bins: &DeviceBins,
        has_environment: bool,
        bounces: f32,
    ) {
        let (words, bin_count) = (Tables::words(tables.half) as u32, tables.bin_count);
        self.arrive(recorder, tables, hierarchy, bins, has_environment, bounces);
        let reflect = passes::ReflectGlossy {
            glossy_leaves: &self.leaves,
            leaves: &hierarchy.leaves,
            gloss: &self.lobes,
            cosine_norms: &tables.cosine_norms,
            bin_directions: &bins.directions,
            arrived: &self.arrived,
            base: &self.base,
            specular: &self.specular,
            constants: passes::ReflectGlossyConstants { words, bin_count },
            params: passes::ReflectGlossyParams { glossy_count: self.count },
        };
        recorder.dispatch(&reflect, self.count * (bin_count / SENT_BINS));
    }

    /// What arrived last, in one table.
    fn arrive(
        &self,
        recorder: &mut Recorder<'_>,
        tables: &Tables,
        hierarchy: &Hierarchy,
        bins: &DeviceBins,
        has_environment: bool,
        bounces: f32,
    ) {
        for window in &tables.windows {
            let bin_count = window.bins.len() as u32;
            let pass = passes::ArriveGlossy {
                glossy_leaves: &self.leaves,
                leaves: &hierarchy.leaves,
                nodes: &hierarchy.nodes,
                bin_directions: &bins.directions,
                means: &tables.means,
                peaks: &tables.peaks,
                incident: &window.incident,
                environment: &tables.environment,
                scales: &tables.scales,
                arrived: &self.arrived,
                constants: passes::ArriveGlossyConstants {
                    words: Tables::words(tables.half) as u32,
                    bin_count: tables.bin_count,
                },
                params: passes::ArriveGlossyParams {
                    glossy_count: self.count,
                    leaf_count: hierarchy.leaf_count(),
                    node_count: hierarchy.node_count(),
                    first_bin: window.bins.start,
                    bin_count,
                    undershoot: bounces * tables.undershoot,
                    add_environment: u32::from(has_environment),
                },
            };
            recorder.dispatch(&pass, self.count * bin_count);
        }
    }
}

/// Every leaf's lobe by the world's present materials.
pub(super) fn measure(
    recorder: &mut Recorder<'_>,
    hierarchy: &Hierarchy,
    elements: &Elements,
    world: &World,
    lobes: &Buffer<LeafGloss>,
) {
    let leaf_count = hierarchy.leaf_count();
    let pass = passes::MeasureGloss {
        leaves: &hierarchy.leaves,
        members: &hierarchy.members,
        triangles: &world.triangles,
        triangle_materials: &world.triangle_materials,
        incident_offsets: &elements.incident_offsets,
        incident_triangles: &elements.incident_triangles,
        positions: &world.positions,
        attributes: &world.attributes,
        materials: &world.materials,
        gloss: lobes,
        textures: &world.textures,
        params: passes::MeasureGlossParams { leaf_count },
    };
    recorder.dispatch(&pass, leaf_count);
}

impl Antiradiance {
    /// What glossy leaves send of the light of punctual lights and sampled emitters, beside what came along links.
    pub(super) fn reflect_direct(&self, recorder: &mut Recorder<'_>, world: &World) {
        let (gloss, elements, emitters) = (&self.tables.gloss, &self.elements, &self.emitters);
        let pass = passes::ReflectDirect {
            glossy_leaves: &gloss.leaves,
            leaves: &self.hierarchy.leaves,
            gloss: &gloss.lobes,
            bin_directions: &self.bins.directions,
            element_positions: &elements.positions,
            lights: &world.lights,
            visibility: &self.state.visibility,
            samples: &emitters.samples,
            triangles: &world.triangles,
            positions: &world.positions,
            emission: &elements.emission,
            visible: &emitters.visible,
            members: &self.hierarchy.members,
            back_elements: &elements.back_elements,
            area: &elements.area,
            base: &gloss.base,
            constants: passes::ReflectDirectConstants { bin_count: self.tables.bin_count },
            params: passes::ReflectDirectParams {
                glossy_count: gloss.count,
                element_count: elements.count,
                light_count: world.light_count,
                sample_count: emitters.plan.samples.len() as u32,
            },
        };
        recorder.dispatch(&pass, gloss.count * self.tables.bin_count);
    }

    /// Indirect light, and direct light but for that of punctual lights, as the eye of `view` sees them: glossy leaves by
    /// their lobes.
    pub fn look(&self, recorder: &mut Recorder<'_>, world: &World, view: &View) {
        let shown = &self.state.shown;
        recorder.copy(self.indirect_irradiance(), shown);
        recorder.copy(self.direct_irradiance(), &self.state.shown_direct);
        if self.tables.gloss.count == 0 {
            return;
        }
        let eye = match view.lens {
            Lens::Perspective { .. } => view.position.extend(1.0),
            Lens::Orthographic { .. } => (-view.forward).extend(0.0),
        };
        let (tables, gloss) = (&self.tables, &self.tables.gloss);
        if self.has_bounced {
            self.look_at_indirect(recorder, world, eye);
        }
        let (elements, emitters) = (&self.elements, &self.emitters);
        let pass = passes::DirectToEye {
            glossy_leaves: &gloss.leaves,
            leaves: &self.hierarchy.leaves,
            gloss: &gloss.lobes,
            element_positions: &elements.positions,
            samples: &emitters.samples,
            triangles: &world.triangles,
            positions: &world.positions,
            emission: &elements.emission,
            visible: &emitters.visible,
            albedo: &elements.albedo,
            members: &self.hierarchy.members,
            back_elements: &elements.back_elements,
            irradiance: self.direct_irradiance(),
            shown: &self.state.shown_direct,
            cosine_norms: &tables.cosine_norms,
            bin_directions: &self.bins.directions,
            arrived: &gloss.arrived_directly,
            constants: passes::DirectToEyeConstants {
                words: Tables::words(tables.half) as u32,
                bin_count: tables.bin_count,
            },
            params: passes::DirectToEyeParams {
                eye: eye.to_array(),
                glossy_count: gloss.count,
                sample_count: emitters.plan.samples.len() as u32,
                has_linked: u32::from(self.has_linked_light()),
            },
        };
        recorder.dispatch(&pass, gloss.count);
        self.stand_ins.take_over(recorder, shown);
        self.stand_ins.take_over(recorder, &self.state.shown_direct);
    }

    /// Indirect light: what arrived in the last step.
    fn look_at_indirect(&self, recorder: &mut Recorder<'_>, world: &World, eye: Vec4) {
        let (tables, gloss) = (&self.tables, &self.tables.gloss);
        gloss.arrive(recorder, tables, &self.hierarchy, &self.bins, false, self.bounced);
        let pass = passes::ToEye {
            glossy_leaves: &gloss.leaves,
            leaves: &self.hierarchy.leaves,
            gloss: &gloss.lobes,
            cosine_norms: &tables.cosine_norms,
            bin_directions: &self.bins.directions,
            arrived: &gloss.arrived,
            positions: &world.positions,
            albedo: &self.elements.albedo,
            irradiance: self.indirect_irradiance(),
            members: &self.hierarchy.members,
            back_elements: &self.elements.back_elements,
            shown: &self.state.shown,
            constants: passes::ToEyeConstants { words: Tables::words(tables.half) as u32, bin_count: tables.bin_count },
            params: passes::ToEyeParams { eye: eye.to_array(), glossy_count: gloss.count },
        };
        recorder.dispatch(&pass, gloss.count);
    }

    /// What [`Self::look`] left of direct and indirect light, W/m2 per element.
    pub fn shown_irradiance(&self) -> (&Buffer<Vec3>, &Buffer<Vec3>) {
        (&self.state.shown_direct, &self.state.shown)
    }
}
