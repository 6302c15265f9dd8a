//! One gather for all texels: the kernel by what it sees with.

use super::{Lit, SurfaceShadowMaps, passes};
use crate::gpu::Recorder;
use crate::report::tonemap::Operator;
use crate::stages::surface_maps::PlacedMaps;
use crate::stages::trace::Tracer;

impl SurfaceShadowMaps {
    /// Refine and gather for all texels in one walk each.                          [Ritschel2008 4.3, Fig. 10]
    pub(super) fn gather(&self, recorder: &mut Recorder<'_>, lit: &Lit<'_>, bounce: u32) {
        let (texels, tree, s) = (&self.texels, &self.tree, &self.state);
        self.gloss.shiny.clear(recorder);
        let (operator, key) = match self.tone.operator {
            Operator::Reinhard => (0, self.tone.key),
            Operator::Filmic => (1, self.tone.key),
            Operator::None => (2, 0.0),
        };
        let (nodes, compact) = tree.nodes();
        macro_rules! gather {
            ($pass:ident, $params:ident, { $($field:ident: $value:expr),* $(,)? }) => {{
                let pass = passes::$pass {
                    $($field: $value,)*
                    texels: &texels.texels,
                    reflectance: &self.gloss.reflectance,
                    glossy_rows: &self.gloss.shiny.glossy_rows,
                    arrived: &self.gloss.shiny.arrived,
                    shapes: &texels.shapes,
                    sender_nodes: nodes,
                    sender_light: &tree.light,
                    sender_leaves: &tree.leaves,
                    sender_branches: &tree.branches,
                    adaptation: &tree.adaptation,
                    tree_frame: &tree.frame,
                    irradiance: &s.irradiance,
                    cut_sizes: &s.cut_sizes,
                    params: passes::$params {
                        texel_count: texels.count,
                        node_count: tree.node_count(),
                        seed: self.seed.wrapping_add(bounce.wrapping_mul(0x9e37_79b9)),
                        jitter: u32::from(self.settings.jitter),
                        ray_offset: texels.ray_offset,
                        threshold: self.settings.threshold,
                        chance_below: if self.settings.jitter { self.settings.chance } else { 0.0 },
                        exposure: self.tone.exposure.exp2(),
                        key,
                        white: self.tone.white,
                        operator,
                        map_stretch: self.settings.map_stretch,
                    },
                };
                recorder.dispatch(&pass, texels.count);
            }};
        }
        match (&self.maps, &lit.tracer) {
            (Some(PlacedMaps { maps, leaf_maps, frame, moving: Some(moving), .. }), tracer) => {
                let (Tracer::Compute(_, surfaces) | Tracer::RayQuery(_, surfaces)) = tracer;
                gather!(GatherMoving, GatherMovingParams, {
                    constants: passes::GatherMovingConstants { alpha_test: surfaces.has_holes, compact },
                    bvh_nodes: lit.bvh.nodes(),
                    bvh_triangles: lit.bvh.triangles(),
                    triangles: surfaces.triangles,
                    triangle_materials: surfaces.triangle_materials,
                    attributes: surfaces.attributes,
                    materials: surfaces.materials,
                    textures: surfaces.textures,
                    map_frame: frame,
                    run_offsets: &maps.run_offsets,
                    runs: &maps.runs,
                    map_origins: &maps.origins,
                    leaf_maps: leaf_maps,
                    rigid_words: &moving.words,
                    rigid_objects: &moving.present,
                });
            }
            (Some(PlacedMaps { maps, leaf_maps, frame, moving: None, .. }), tracer) => {
                let (Tracer::Compute(_, surfaces) | Tracer::RayQuery(_, surfaces)) = tracer;
                gather!(GatherMaps, GatherMapsParams, {
                    constants: passes::GatherMapsConstants { alpha_test: surfaces.has_holes, compact },
                    bvh_nodes: lit.bvh.nodes(),
                    bvh_triangles: lit.bvh.triangles(),
                    triangles: surfaces.triangles,
                    triangle_materials: surfaces.triangle_materials,
                    attributes: surfaces.attributes,
                    materials: surfaces.materials,
                    textures: surfaces.textures,
                    run_offsets: &maps.run_offsets,
                    runs: &maps.runs,
                    map_origins: &maps.origins,
                    leaf_maps: leaf_maps,
                    map_frame: frame,
                })
            }
            (None, Tracer::Compute(bvh, surfaces)) => gather!(GatherRays, GatherRaysParams, {
                constants: passes::GatherRaysConstants { alpha_test: surfaces.has_holes, compact },
                bvh_nodes: bvh.nodes(),
                bvh_triangles: bvh.triangles(),
                triangles: surfaces.triangles,
                triangle_materials: surfaces.triangle_materials,
                attributes: surfaces.attributes,
                materials: surfaces.materials,
                textures: surfaces.textures,
            }),
            (None, Tracer::RayQuery(structure, surfaces)) => gather!(GatherRayQuery, GatherRayQueryParams, {
                constants: passes::GatherRayQueryConstants { alpha_test: surfaces.has_holes, sees_through: false, compact },
                acceleration_structure: structure,
                triangles: surfaces.triangles,
                triangle_materials: surfaces.triangle_materials,
                attributes: surfaces.attributes,
                materials: surfaces.materials,
                textures: surfaces.textures,
            }),
        }
    }
}
