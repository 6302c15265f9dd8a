//! A hierarchy over leaf elements: one leaf per vertex of a mesh or per patch of a flat part ([`Patches`]), inner nodes of up
//! to four children, depth-first order.
//!
//! A leaf stands for both sides of its vertices' cells and sits at their centre of area, so that no two leaves of
//! neighbouring walls coincide on their common edge. Facets are kept apart first: a node above one facet alone holds
//! leaves that look the same way, as a quadtree where they lie in a plane. The topology is made once ([`HierarchyPlan`]); places, areas
//! and radii follow the world on the device ([`Hierarchy::place`]).

use super::elements::{BACK_SIDE, Elements, NO_ELEMENT};
use super::levels::Levels;
use super::world::World;
use crate::gpu::shaders::hierarchy as passes;
use crate::gpu::shaders::types::{HierarchyLeaf, HierarchyNode, LeafShare};
use crate::gpu::{Buffer, Context, GpuError, Recorder, TexelBuffer};
use crate::scene::facets::Facets;
use crate::scene::patches::Patches;
use crate::scene::surfaces::Surfaces;
use glam::Vec3;

/// Of [`HierarchyNode::leaf`] and [`HierarchyNode::surface`]; the same constant stands in `lib/hierarchy.glsl`.
pub const NONE: u32 = u32::MAX;
/// Of [`HierarchyLeaf::flags`]: light that meets the back is blocked.
pub const BLOCKS_BEHIND: u32 = 1;
/// Of [`HierarchyLeaf::flags`]: the back reflects like the front.
pub const REFLECTS_BEHIND: u32 = 2;
/// Children of a node, at most.
pub const MAX_CHILDREN: u32 = 4;
/// Texels of a node; the same constant stands in `lib/packed_hierarchy.glsl`.
const HIERARCHY_TEXELS: usize = 5;
/// Levels that [`HierarchyPlan::new`] may go down before it halves by count instead of by place.
const MIDPOINT_LEVELS: u32 = 24;

/// Topology of a hierarchy: plain data.
#[derive(Debug, Clone, Default)]
pub struct HierarchyPlan {
    /// Depth-first; places, radii and areas are still zero.
    pub nodes: Vec<HierarchyNode>,
    /// In order of their nodes.
    pub leaves: Vec<HierarchyLeaf>,
    /// Of each node; 0 for the root.
    pub depths: Vec<u32>,
    /// Leaf of each element, front or back.
    pub leaf_of_element: Vec<u32>,
    /// Vertices of each leaf, one leaf after the other.
    pub members: Vec<u32>,
    /// The leaves that each vertex takes light from, one vertex after the other, and where each vertex's start; one more.
    pub shares: Vec<LeafShare>,
    pub share_offsets: Vec<u32>,
}

/// What is behind surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Behind {
    /// Solids are never met from behind; all other surfaces block what meets their backs.
    BlockOpen,
    /// Every surface blocks what meets its back.
    BlockAll,
    /// Light passes backs, except of double-sided materials.
    Pass,
}

impl HierarchyPlan {
    /// `patches` holds every vertex that has triangles; `margin(vertex)`: how far the vertex may move from its place at
    /// rest, metres.
    pub fn new(
        elements: &Elements,
        surfaces: &Surfaces,
        facets: &Facets,
        patches: &Patches,
        behind: Behind,
        margin: impl Fn(u32) -> f32,
    ) -> Self {
        let topology = &elements.topology;
        let mut of_facet: Vec<&[u32]> = patches.of_facet.iter().map(Vec::as_slice).collect();
        of_facet.retain(|own| !own.is_empty());
        let world_place = |patch: u32| patches.world_places[patch as usize];
        let centers: Vec<Vec3> = of_facet
            .iter()
            .map(|own| own.iter().map(|&patch| world_place(patch)).sum::<Vec3>() / own.len() as f32)
            .collect();

        let mut plan = Self { leaf_of_element: vec![NONE; topology.vertices.len()], ..Self::default() };
        let mut order: Vec<u32> = (0..of_facet.len() as u32).collect();
        let mut leaf_of_patch = vec![NONE; patches.vertices.len()];
        let mut make = Maker { plan: &mut plan, places: &patches.places };
        let mut leaf = |plan: &mut Self, patch: u32| {
            let own = &patches.vertices[patch as usize];
            // Flat parts are of one material, and solid or not as a whole.
            let vertex = patches.middle_of(patch);
            let surface = surfaces.of_vertex[vertex as usize];
            let back_element = topology.back_elements[vertex as usize];
            let blocks = match behind {
                Behind::BlockOpen => !surfaces.is_solid[surface as usize],
                Behind::BlockAll => true,
                Behind::Pass => false,
            };
            let mut flags = if blocks || back_element != NO_ELEMENT { BLOCKS_BEHIND } else { 0 };
            if back_element != NO_ELEMENT {
                flags |= REFLECTS_BEHIND;
            }
            let index = plan.leaves.len() as u32;
            leaf_of_patch[patch as usize] = index;
            let facet = facets.of_vertex[vertex as usize];
            let node = plan.nodes.last_mut().expect("a leaf is added to its node");
            (node.leaf, node.shape) = (index, index);
            node.surface = if facets.is_flat[facet as usize] { facet } else { NONE };
            node.margin = own.iter().map(|&vertex| margin(vertex)).fold(0.0, f32::max);
            for &vertex in own {
                debug_assert_eq!(topology.vertices[vertex as usize] & BACK_SIDE, 0);
                plan.leaf_of_element[vertex as usize] = index;
                let back = topology.back_elements[vertex as usize];
                if back != NO_ELEMENT {
                    plan.leaf_of_element[back as usize] = index;
                }
            }
            plan.leaves.push(HierarchyLeaf {
                normal: Vec3::ZERO,
                area: 0.0,
                node: plan.nodes.len() as u32 - 1,
                element: vertex,
                back_element,
                flags,
                first_member: plan.members.len() as u32,
                member_count: own.len() as u32,
                along: patches.along[facet as usize],
            });
            plan.members.extend(own);
        };
        if !order.is_empty() {
            make.facets(&mut order, &centers, &of_facet, (NONE, 0), &mut leaf);
        }
        plan.share_upwards(facets);
        plan.share_offsets.push(0);
        for shares in &patches.shares {
            let leaves = shares.iter().map(|&(patch, share)| LeafShare { leaf: leaf_of_patch[patch as usize], share });
            plan.shares.extend(leaves);
            plan.share_offsets.push(plan.shares.len() as u32);
        }
        plan
    }

    /// Vertices of a leaf.
    pub fn members_of(&self, leaf: u32) -> &[u32] {
        let own = &self.leaves[leaf as usize];
        &self.members[own.first_member as usize..][..own.member_count as usize]
    }

    /// Inner nodes take over what all their children share.
    fn share_upwards(&mut self, facets: &Facets) {
        for node in (0..self.nodes.len() as u32).rev() {
            if self.nodes[node as usize].leaf != NONE {
                continue;
            }
            let children: Vec<u32> = self.children(node).collect();
            let first = self.nodes[children[0] as usize].surface;
            let same = children.iter().all(|&child| self.nodes[child as usize].surface == first);
            let margin = children.iter().map(|&child| self.nodes[child as usize].margin).fold(0.0, f32::max);
            let shape = match facets.middle.get(first as usize) {
                Some(&middle) if same => self.leaf_of_element[middle as usize],
                _ => NONE,
            };
            let inner = &mut self.nodes[node as usize];
            inner.shape = shape;
            inner.surface = if same { first } else { NONE };
            inner.margin = margin;
        }
    }

    /// Children of a node, in order.
    pub fn children(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let (mut next, end) = (node + 1, self.nodes[node as usize].skip);
        std::iter::from_fn(move || {
            let child = next;
            next = self.nodes.get(child as usize)?.skip;
            (child < end).then_some(child)
        })
    }

    /// Levels between the root and the deepest leaf.
    pub fn depth(&self) -> u32 {
        self.depths.iter().copied().max().unwrap_or(0)
    }
}

/// Builds nodes depth first.
struct Maker<'a> {
    plan: &'a mut HierarchyPlan,
    /// Of each patch.
    places: &'a [Vec3],
}

impl Maker<'_> {
    fn open(&mut self, (parent, depth): (u32, u32)) -> u32 {
        let node = self.plan.nodes.len() as u32;
        self.plan.nodes.push(HierarchyNode {
            center: Vec3::ZERO,
            radius: 0.0,
            area: 0.0,
            skip: node + 1,
            parent,
            leaf: NONE,
            shape: NONE,
            surface: NONE,
            margin: 0.0,
            half_u: Vec3::ZERO,
            half_v: Vec3::ZERO,
        });
        self.plan.depths.push(depth);
        node
    }

    fn close(&mut self, node: u32) {
        self.plan.nodes[node as usize].skip = self.plan.nodes.len() as u32;
    }

    /// The subtree of several facets.
    fn facets(
        &mut self,
        order: &mut [u32],
        centers: &[Vec3],
        of_facet: &[&[u32]],
        above: (u32, u32),
        leaf: &mut impl FnMut(&mut HierarchyPlan, u32),
    ) {
        if let [facet] = *order {
            return self.patches(&mut of_facet[facet as usize].to_vec(), above, leaf);
        }
        let node = self.open(above);
        for part in quarters(order, centers, above.1) {
            self.facets(part, centers, of_facet, (node, above.1 + 1), leaf);
        }
        self.close(node);
    }

    /// The subtree of leaves of one facet.
    fn patches(&mut self, patches: &mut [u32], above: (u32, u32), leaf: &mut impl FnMut(&mut HierarchyPlan, u32)) {
        let node = self.open(above);
        if let [patch] = *patches {
            return leaf(self.plan, patch);
        }
        let places = self.places;
        for part in quarters(patches, places, above.1) {
            self.patches(part, (node, above.1 + 1), leaf);
        }
        self.close(node);
    }
}

/// Two to four parts of at least two items: halves of halves, each across its longest side.
fn quarters<'i>(items: &'i mut [u32], centers: &[Vec3], depth: u32) -> Vec<&'i mut [u32]> {
    let (left, right) = halves(items, centers, depth);
    let mut parts = Vec::with_capacity(MAX_CHILDREN as usize);
    for half in [left, right] {
        if half.len() == 1 {
            parts.push(half);
        } else {
            let (left, right) = halves(half, centers, depth);
            parts.extend([left, right]);
        }
    }
    parts
}

/// Cuts at the middle of the longest side of the bounds; by count where that would leave one part all but empty.
fn halves<'i>(items: &'i mut [u32], centers: &[Vec3], depth: u32) -> (&'i mut [u32], &'i mut [u32]) {
    let at = |item: u32| centers[item as usize];
    let (low, high) =
        items.iter().fold((Vec3::MAX, Vec3::MIN), |(low, high), &item| (low.min(at(item)), high.max(at(item))));
    let axis = (high - low).max_position();
    let middle = 0.5 * (low[axis] + high[axis]);
    let count = items.len();
    items.sort_by(|&a, &b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b)));
    let mut cut = items.partition_point(|&item| at(item)[axis] < middle);
    if cut < count / 8 || cut > count - count / 8 || cut == 0 || cut == count || depth > MIDPOINT_LEVELS {
        cut = count / 2;
    }
    items.split_at_mut(cut)
}

/// The hierarchy on the device.
pub struct Hierarchy {
    pub plan: HierarchyPlan,
    pub nodes: Buffer<HierarchyNode>,
    pub leaves: Buffer<HierarchyLeaf>,
    /// The nodes and their shapes for kernels over links, `HIERARCHY_TEXELS` each (`lib/packed_hierarchy.glsl`).
    pub node_texels: TexelBuffer,
    /// See [`HierarchyPlan::members`] and [`HierarchyPlan::shares`].
    pub members: Buffer<u32>,
    pub shares: Buffer<LeafShare>,
    pub share_offsets: Buffer<u32>,
    /// Of inner nodes.
    pub levels: Levels,
}

impl Hierarchy {
    /// Uploads the topology and places it in the present world.
    pub fn new(context: &Context, plan: HierarchyPlan, elements: &Elements, world: &World) -> Result<Self, GpuError> {
        let hierarchy = Self {
            nodes: context.upload("hierarchy/nodes", &plan.nodes)?,
            leaves: context.upload("hierarchy/leaves", &plan.leaves)?,
            node_texels: context.texel_buffer("hierarchy/node texels", (HIERARCHY_TEXELS * plan.nodes.len()).max(1))?,
            members: context.upload("hierarchy/members", &plan.members)?,
            shares: context.upload("hierarchy/shares", &plan.shares)?,
            share_offsets: context.upload("hierarchy/share offsets", &plan.share_offsets)?,
            levels: Levels::new(context, "hierarchy", &plan.depths, |node| plan.nodes[node as usize].leaf == NONE)?,
            plan,
        };
        let mut recorder = context.recorder("hierarchy")?;
        hierarchy.place(&mut recorder, elements, world);
        recorder.submit()?;
        Ok(hierarchy)
    }

    pub fn node_count(&self) -> u32 {
        self.plan.nodes.len() as u32
    }

    pub fn leaf_count(&self) -> u32 {
        self.plan.leaves.len() as u32
    }

    /// Follows the world's vertices: leaves first, then nodes from the leaves up.
    pub fn place(&self, recorder: &mut Recorder<'_>, elements: &Elements, world: &World) {
        let leaf_count = self.leaf_count();
        let pass = passes::PlaceLeaves {
            positions: &world.positions,
            normals: &world.normals,
            triangles: &world.triangles,
            incident_offsets: &elements.incident_offsets,
            incident_triangles: &elements.incident_triangles,
            members: &self.members,
            leaves: &self.leaves,
            nodes: &self.nodes,
            params: passes::PlaceLeavesParams { leaf_count },
        };
        recorder.dispatch(&pass, leaf_count);
        self.levels.upwards(recorder, |recorder, level| {
            let params = passes::PullBoundsParams { first: level.start, count: level.len() as u32 };
            let pass = passes::PullBounds { level_nodes: &self.levels.nodes, nodes: &self.nodes, params };
            recorder.dispatch(&pass, level.len());
        });
        let pack = passes::PackNodes {
            nodes: &self.nodes,
            leaves: &self.leaves,
            node_texels: self.node_texels.buffer(),
            params: passes::PackNodesParams { node_count: self.node_count() },
        };
        recorder.dispatch(&pack, self.node_count());
    }
}
