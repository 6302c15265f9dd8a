//! Glossy elements: their lobes reflect what arrives bin by bin, into tables of directions that travel along the same
//! links, and towards the eye.                                                                  [Dong2007 4.3, 4.4]
//!
//! A table holds the radiance that a node sends along each of `6 M M` directions beside its even light; nodes above glossy
//! leaves have the area-weighted mean of their children's.
//!
//! Differs from [Dong2007]: there glossy surfaces only reflect towards the eye. No lobe is narrower than a bin, so that
//! mirrors show a blur of that size.
//!
//! [Dong2007]: crate::methods::PAPERS

use super::{ImplicitVisibility, Linking, Window};
use crate::gpu::shaders::elements::{Add, AddParams, VertexGloss, VertexGlossParams};
use crate::gpu::shaders::methods::implicit_visibility as passes;
use crate::gpu::shaders::types::{GlossTarget, LeafGloss};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::camera::{Lens, View};
use crate::stages::elements::{BACK_SIDE, Elements};
use crate::stages::quadtree::Quadtrees;
use crate::stages::world::World;
use glam::{Vec3, Vec4};
use std::ops::Range;

const NONE: u32 = u32::MAX;

/// The glossy leaves of a scene, the nodes above them, and their light, W m^-2 sr^-1.
pub(super) struct Gloss {
    /// Glossy nodes in order: leaves first, then level by level.
    nodes: Vec<u32>,
    /// Of `nodes`, per level of the trees.
    levels: Vec<Range<u32>>,
    /// M.
    pub side: u32,
    /// Per vertex.
    lobes: Buffer<LeafGloss>,
    glossy_nodes: Buffer<u32>,
    /// Per node: its place among the glossy ones, or [`NONE`].
    pub glossy_of_node: Buffer<u32>,
    /// Per glossy node and direction: what was reflected last.
    pub specular: Buffer<Vec3>,
    /// The same, of all bounces that were gathered.
    total: Buffer<Vec3>,
    /// Per glossy leaf and direction: what is being reflected.
    next: Buffer<Vec3>,
    /// Per node, W/m2: even light of all bounces that were gathered.
    node_total: Buffer<Vec3>,
    /// Per glossy leaf.
    to_eye: Buffer<Vec3>,
}

impl Gloss {
    /// Leaves whose lobes reflect at least `threshold` at normal incidence, and the nodes above them.
    pub fn find(
        context: &Context,
        trees: &Quadtrees,
        elements: &Elements,
        world: &World,
        threshold: f32,
    ) -> Result<(Vec<u32>, Buffer<LeafGloss>), GpuError> {
        let lobes = context.buffer("implicit/lobes", world.vertex_count as usize)?;
        let mut recorder = context.recorder("implicit-visibility")?;
        measure(&mut recorder, elements, world, &lobes);
        recorder.submit()?;
        let f0: Vec<f32> = context.download(&lobes)?.iter().map(|lobe| lobe.f0.max_element()).collect();
        let topology = &trees.topology;
        let mut is_glossy = vec![false; topology.node_count() as usize];
        for (leaf, &element) in topology.leaf_elements.iter().enumerate() {
            let own = f0[(elements.topology.vertices[element as usize] & !BACK_SIDE) as usize];
            is_glossy[leaf] = own > 0.0 && own >= threshold;
        }
        for node in 0..topology.node_count() {
            if let (true, Some(parent)) = (is_glossy[node as usize], topology.parent(node)) {
                is_glossy[parent as usize] = true;
            }
        }
        Ok(((0..topology.node_count()).filter(|&node| is_glossy[node as usize]).collect(), lobes))
    }

    /// Bytes of the tables of [`Self::new`].
    pub fn bytes_needed(nodes: &[u32], trees: &Quadtrees, side: u32) -> u64 {
        if nodes.is_empty() {
            return 0;
        }
        let directions = u64::from(6 * side * side);
        size_of::<Vec3>() as u64 * (3 * directions * nodes.len() as u64 + u64::from(trees.topology.node_count()))
    }

    pub fn new(
        context: &Context,
        trees: &Quadtrees,
        (nodes, lobes): (Vec<u32>, Buffer<LeafGloss>),
        side: u32,
    ) -> Result<Self, GpuError> {
        let node_count = trees.topology.node_count() as usize;
        let mut glossy_of_node = vec![NONE; if nodes.is_empty() { 0 } else { node_count }];
        nodes.iter().zip(0..).for_each(|(&node, index)| glossy_of_node[node as usize] = index);
        let place = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let levels: Vec<Range<u32>> = trees.topology.levels.iter().map(|l| place(l.start)..place(l.end)).collect();
        let directions = 6 * (side * side) as usize;
        let leaf_count = levels.first().map_or(0, |leaves| leaves.len());
        Ok(Self {
            lobes,
            glossy_nodes: context.upload("implicit/glossy nodes", &nodes)?,
            specular: context.buffer("implicit/specular", nodes.len() * directions)?,
            total: context.buffer("implicit/specular of all bounces", nodes.len() * directions)?,
            next: context.buffer("implicit/next specular", leaf_count * directions)?,
            node_total: context.buffer("implicit/node radiosity of all bounces", glossy_of_node.len())?,
            to_eye: context.buffer("implicit/specular to the eye", leaf_count)?,
            glossy_of_node: context.upload("implicit/glossy of node", &glossy_of_node)?,
            side,
            levels,
            nodes,
        })
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Leaves that are glossy.
    pub fn leaf_count(&self) -> u32 {
        self.levels.first().map_or(0, |leaves| leaves.end)
    }

    fn directions(&self) -> u32 {
        6 * self.side * self.side
    }

    /// Every vertex' lobe by the world's present materials. Which leaves are glossy stays.
    pub fn update_materials(&self, recorder: &mut Recorder<'_>, elements: &Elements, world: &World) {
        measure(recorder, elements, world, &self.lobes);
    }

    /// The glossy leaves of a window, among all.
    fn of_window(&self, window: &Window) -> Range<u32> {
        let leaves = window.plan.leaves();
        let place = |leaf: u32| self.nodes.partition_point(|&other| other < leaf) as u32;
        place(leaves.start)..place(leaves.end)
    }

    /// Tables of inner nodes from those of the leaves.
    fn pull(&self, recorder: &mut Recorder<'_>, trees: &Quadtrees) {
        for level in self.levels.iter().skip(1).filter(|level| !level.is_empty()) {
            let count = level.len() as u32;
            let pass = passes::PullSpecular {
                glossy_nodes: &self.glossy_nodes,
                glossy_of_node: &self.glossy_of_node,
                node_segments: &trees.node_segments,
                segments: &trees.segments,
                surfels: &trees.surfels,
                specular: &self.specular,
                params: passes::PullSpecularParams { first: level.start, count, directions: self.directions() },
            };
            recorder.dispatch(&pass, count * self.directions());
        }
    }

    /// The light that is about to be gathered, added up for the eye.
    pub fn send(&self, recorder: &mut Recorder<'_>, trees: &Quadtrees, node_radiosity: &Buffer<Vec3>) {
        if self.is_empty() {
            return;
        }
        self.pull(recorder, trees);
        for (term, sum) in [(&self.specular, &self.total), (node_radiosity, &self.node_total)] {
            let element_count = sum.len() as u32;
            recorder.dispatch(&Add { term, sum, params: AddParams { element_count } }, element_count);
        }
    }
}

fn measure(recorder: &mut Recorder<'_>, elements: &Elements, world: &World, lobes: &Buffer<LeafGloss>) {
    let pass = VertexGloss {
        triangles: &world.triangles,
        triangle_materials: &world.triangle_materials,
        incident_offsets: &elements.incident_offsets,
        incident_triangles: &elements.incident_triangles,
        positions: &world.positions,
        attributes: &world.attributes,
        materials: &world.materials,
        lobes,
        textures: &world.textures,
        params: VertexGlossParams { vertex_count: world.vertex_count },
    };
    recorder.dispatch(&pass, world.vertex_count);
}

/// What is reflected, and where to.
#[derive(Clone, Copy)]
struct Reflection<'a> {
    node_radiosity: &'a Buffer<Vec3>,
    /// Tables of the senders; `None`: they send evenly.
    specular: Option<&'a Buffer<Vec3>>,
    has_environment: bool,
    /// `None`: into tables.
    eye: Option<Vec4>,
    reflected: &'a Buffer<Vec3>,
}

impl ImplicitVisibility {
    /// Reflects direct light into the tables: what came along links and from the environment (whose emitted light stands
    /// in `node_radiosity`), of points on emitters, of punctual lights.
    pub(super) fn reflect_direct(&self, recorder: &mut Recorder<'_>, world: &World) {
        if self.gloss.is_empty() {
            return;
        }
        let (gloss, s) = (&self.gloss, &self.state);
        recorder.fill(&gloss.total, 0);
        recorder.fill(&gloss.node_total, 0);
        if self.emitters.plan.linked_parts == 0 {
            recorder.fill(&s.node_radiosity, 0);
        }
        let has_environment = !self.sky.is_black();
        let reflected = &gloss.next;
        let (node_radiosity, specular, eye) = (&s.node_radiosity, None, None);
        self.reflect_bins(recorder, Reflection { node_radiosity, specular, has_environment, eye, reflected });
        self.reflect_lights(recorder, world, world.light_count, None, reflected);
        recorder.copy(reflected, &gloss.specular);
    }

    /// Reflects what the last gather brought into the tables.
    pub(super) fn reflect_bounce(&self, recorder: &mut Recorder<'_>) {
        if self.gloss.is_empty() {
            return;
        }
        let (gloss, node_radiosity) = (&self.gloss, &self.state.node_radiosity);
        let (specular, reflected) = (Some(&gloss.specular), &gloss.next);
        let reflection = Reflection { node_radiosity, specular, has_environment: false, eye: None, reflected };
        self.reflect_bins(recorder, reflection);
        recorder.copy(reflected, &gloss.specular);
    }

    fn target(&self, glossy: Range<u32>, eye: Option<Vec4>) -> (GlossTarget, [f32; 4], u32) {
        let (side, directions) = if eye.is_some() { (0, 1) } else { (self.gloss.side, self.gloss.directions()) };
        let count = glossy.len() as u32;
        (GlossTarget { side, first: glossy.start, count }, eye.unwrap_or(Vec4::ZERO).to_array(), count * directions)
    }

    fn reflect_bins(&self, recorder: &mut Recorder<'_>, what: Reflection<'_>) {
        let Linking { windows, receivers, bin_vectors, .. } = &self.linking;
        for window in windows {
            let (target, eye, threads) = self.target(self.gloss.of_window(window), what.eye);
            if threads == 0 {
                continue;
            }
            let leaves = window.plan.leaves();
            let pass = passes::ReflectGlossy {
                glossy_leaves: &self.gloss.glossy_nodes,
                winners: &window.winners,
                receivers,
                bin_vectors,
                bin_radiance: &self.sky.bin_radiance,
                node_radiosity: what.node_radiosity,
                glossy_of_node: &self.gloss.glossy_of_node,
                specular: what.specular.unwrap_or(&self.gloss.specular),
                lobes: &self.gloss.lobes,
                leaf_elements: &self.trees.leaf_elements,
                element_vertices: &self.elements.vertices,
                reflected: what.reflected,
                params: passes::ReflectGlossyParams {
                    target,
                    eye,
                    first_leaf: leaves.start,
                    leaf_count: leaves.len() as u32,
                    n: self.settings.bins,
                    table_side: if what.specular.is_some() { self.gloss.side } else { 0 },
                    has_environment: u32::from(what.has_environment),
                },
            };
            recorder.dispatch(&pass, threads);
        }
    }

    fn reflect_lights(
        &self,
        recorder: &mut Recorder<'_>,
        world: &World,
        light_count: u32,
        eye: Option<Vec4>,
        reflected: &Buffer<Vec3>,
    ) {
        let (target, eye, threads) = self.target(0..self.gloss.leaf_count(), eye);
        let sample_count = self.emitters.plan.samples.len() as u32;
        let (sky, spot_count) = (&self.sky, self.sky.spot_count);
        if sample_count + light_count + spot_count == 0 {
            return;
        }
        let (elements, emitters) = (&self.elements, &self.emitters);
        let pass = passes::ReflectLights {
            glossy_leaves: &self.gloss.glossy_nodes,
            leaf_elements: &self.trees.leaf_elements,
            element_vertices: &elements.vertices,
            element_positions: &elements.positions,
            element_normals: &elements.normals,
            lobes: &self.gloss.lobes,
            samples: &emitters.samples,
            triangles: &world.triangles,
            positions: &world.positions,
            emission: &elements.emission,
            visible: &emitters.visible,
            lights: &world.lights,
            visibility: &self.state.visibility,
            spots: &sky.spots,
            spots_seen: &sky.spots_seen,
            reflected,
            params: passes::ReflectLightsParams {
                target,
                eye,
                element_count: elements.count,
                sample_count,
                light_count,
                spot_count,
                bin_count: self.settings.bin_count(),
            },
        };
        recorder.dispatch(&pass, threads);
    }

    /// Direct and indirect light as the eye of `view` sees it, after [`Self::solve`]: glossy leaves by their lobes.
    /// Punctual lights' direct reflection is the display's.
    pub fn look(&self, recorder: &mut Recorder<'_>, world: &World, view: &View) {
        let (gloss, s) = (&self.gloss, &self.state);
        if gloss.is_empty() {
            return;
        }
        let eye = Some(match view.lens {
            Lens::Perspective { .. } => view.position.extend(1.0),
            Lens::Orthographic { .. } => (-view.forward).extend(0.0),
        });
        let reflected = &gloss.to_eye;
        if self.emitters.plan.linked_parts > 0 {
            self.send_emission(recorder);
        } else {
            recorder.fill(&s.node_radiosity, 0);
        }
        let has_environment = !self.sky.is_black();
        let direct = Reflection { node_radiosity: &s.node_radiosity, specular: None, has_environment, eye, reflected };
        self.reflect_bins(recorder, direct);
        self.reflect_lights(recorder, world, 0, eye, reflected);
        self.show(recorder, eye, &s.direct, &s.shown_direct);

        let (node_radiosity, specular) = (&gloss.node_total, Some(&gloss.total));
        self.reflect_bins(recorder, Reflection { node_radiosity, specular, has_environment: false, eye, reflected });
        self.show(recorder, eye, Self::indirect_irradiance(self), &s.shown_indirect);
    }

    fn show(&self, recorder: &mut Recorder<'_>, eye: Option<Vec4>, irradiance: &Buffer<Vec3>, shown: &Buffer<Vec3>) {
        recorder.copy(irradiance, shown);
        let glossy_count = self.gloss.leaf_count();
        let pass = passes::ShowGlossy {
            glossy_leaves: &self.gloss.glossy_nodes,
            leaf_elements: &self.trees.leaf_elements,
            element_vertices: &self.elements.vertices,
            element_positions: &self.elements.positions,
            element_normals: &self.elements.normals,
            albedo: &self.elements.albedo,
            irradiance,
            lobes: &self.gloss.lobes,
            to_eye: &self.gloss.to_eye,
            shown,
            params: passes::ShowGlossyParams { eye: eye.unwrap_or(Vec4::ZERO).to_array(), glossy_count },
        };
        recorder.dispatch(&pass, glossy_count);
    }

    /// The specular lobe of each vertex.
    pub fn lobes(&self) -> &Buffer<LeafGloss> {
        &self.gloss.lobes
    }

    /// What [`Self::look`] left, direct and indirect, W/m2 per element.
    pub fn shown_irradiance(&self) -> (&Buffer<Vec3>, &Buffer<Vec3>) {
        if self.gloss.is_empty() {
            (self.direct_irradiance(), self.indirect_irradiance())
        } else {
            (&self.state.shown_direct, &self.state.shown_indirect)
        }
    }
}
