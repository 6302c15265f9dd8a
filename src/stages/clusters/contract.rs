//! Greedy contraction of the dual graph: every face starts as a cluster; of all pairs of neighbours the one whose
//! union costs least is joined, until none is left.                                        [Garland2001 3]
//!
//! Cost of a union, m2: its spread about its own plane, the spread of its normals, the square of its perimeter, and the
//! spread of its attributes. Large meshes are cut into pieces of neighbouring faces that are contracted side by side
//! down to a few clusters each, and those together: the same result on any number of cores.

use super::MeshFaces;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Faces of a piece, at most.
const PIECE_FACES: usize = 1 << 14;
/// Clusters of a piece that are left for the last contraction.
const PIECE_CLUSTERS: usize = 1 << 7;
/// Weight of the spread of normals against flatness.
const NORMAL_WEIGHT: f64 = 30.0;
/// Weight of the spread of albedo and (relative) emission.
const ATTRIBUTE_WEIGHT: f64 = 30.0;
/// Weight of the squared perimeter: a square's is 16 times its area.
const SHAPE_WEIGHT: f64 = 1.0 / 16.0;

/// Joins in order: entry `k` makes cluster `face_count + k` of two earlier ones; faces come first. The clusters nobody
/// joined are the mesh's components.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Merges {
    pub pairs: Vec<[u32; 2]>,
    /// Per pair: every edge inside is convex or flat.
    pub convex: Vec<bool>,
}

/// Sums over the faces of a cluster.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    area: f64,
    /// A n.
    normal: DVec3,
    /// A p over points of the faces.
    first: DVec3,
    /// A p p^T: xx, yy, zz and xy, yz, zx.
    squares: DVec3,
    products: DVec3,
    /// A rho and A e, and A (rho^2 + e^2).
    albedo: DVec3,
    emission: DVec3,
    attribute_squares: f64,
    perimeter: f64,
    is_convex: bool,
}

impl Sums {
    fn join(&self, other: &Self, edge: &Edge) -> Self {
        Self {
            area: self.area + other.area,
            normal: self.normal + other.normal,
            first: self.first + other.first,
            squares: self.squares + other.squares,
            products: self.products + other.products,
            albedo: self.albedo + other.albedo,
            emission: self.emission + other.emission,
            attribute_squares: self.attribute_squares + other.attribute_squares,
            perimeter: (self.perimeter + other.perimeter - 2.0 * f64::from(edge.length)).max(0.0),
            is_convex: self.is_convex && other.is_convex && edge.is_convex,
        }
    }

    /// m2; see the module.
    fn cost(&self) -> f64 {
        if self.area <= 0.0 {
            return 0.0;
        }
        let center = self.first / self.area;
        let squares = self.squares / self.area - center * center;
        let products = self.products / self.area - center * DVec3::new(center.y, center.z, center.x);
        let vector_area = self.normal.length();
        let flatness = if vector_area > 1e-9 * self.area {
            let n = self.normal / vector_area;
            (squares.dot(n * n) + 2.0 * products.dot(n * DVec3::new(n.y, n.z, n.x))).max(0.0)
        } else {
            squares.element_sum().max(0.0)
        };
        let mean = (self.albedo.length_squared() + self.emission.length_squared()) / self.area;
        let attributes = (self.attribute_squares - mean).max(0.0);
        flatness
            + NORMAL_WEIGHT * (self.area - vector_area).max(0.0)
            + ATTRIBUTE_WEIGHT * attributes
            + SHAPE_WEIGHT * self.perimeter * self.perimeter
    }
}

/// Border between a cluster and a neighbour.
#[derive(Debug, Clone, Copy)]
struct Edge {
    /// The neighbour's slot.
    other: u32,
    /// Metres.
    length: f32,
    is_convex: bool,
}

/// A dual edge between two faces.
#[derive(Debug, Clone, Copy)]
struct FaceEdge {
    faces: [u32; 2],
    length: f32,
    is_convex: bool,
}

/// Contracts the whole mesh.
pub fn contract(mesh: &MeshFaces<'_>) -> Merges {
    let face_count = mesh.triangles.len();
    let center = mean_position(mesh);
    let brightest = mesh.emission.iter().fold(0.0f32, |most, e| most.max(e.max_element()));
    let scale = if brightest > 0.0 { 1.0 / f64::from(brightest) } else { 0.0 };
    let sums: Vec<Sums> = (0..face_count).into_par_iter().map(|face| face_sums(mesh, face, center, scale)).collect();
    let edges = face_edges(mesh);
    let piece_of = pieces(mesh);
    let piece_count = piece_of.iter().max().map_or(0, |&last| last as usize + 1);
    if piece_count == 1 {
        let mut graph = Graph::new(sums, (0..face_count as u32).collect(), &edges);
        let mut merges = Merges::default();
        graph.contract(1, face_count as u32, &mut merges);
        return merges;
    }

    // Each piece by itself, over its own edges.
    let mut faces_of = vec![Vec::new(); piece_count];
    let mut slot_of = vec![0u32; face_count];
    for (face, &piece) in piece_of.iter().enumerate() {
        slot_of[face] = faces_of[piece as usize].len() as u32;
        faces_of[piece as usize].push(face as u32);
    }
    let mut edges_of = vec![Vec::new(); piece_count];
    for edge in &edges {
        let [a, b] = edge.faces.map(|face| face as usize);
        if piece_of[a] == piece_of[b] {
            edges_of[piece_of[a] as usize].push(FaceEdge { faces: [slot_of[a], slot_of[b]], ..*edge });
        }
    }
    let contracted: Vec<(Graph, Merges)> = faces_of
        .par_iter()
        .zip(&edges_of)
        .map(|(faces, edges)| {
            let mut graph = Graph::new(faces.iter().map(|&f| sums[f as usize]).collect(), faces.clone(), edges);
            let mut merges = Merges::default();
            graph.contract(PIECE_CLUSTERS, u32::MAX / 2, &mut merges);
            (graph, merges)
        })
        .collect();

    // Then what is left of all of them, with clusters numbered as if they had been joined piece after piece.
    let mut merges = Merges::default();
    let (mut left_sums, mut left_nodes) = (Vec::new(), Vec::new());
    let mut left_of = vec![0u32; face_count];
    for (mut graph, of_piece) in contracted {
        let first = (face_count + merges.pairs.len()) as u32;
        let global = |node: u32| if node >= u32::MAX / 2 { node - u32::MAX / 2 + first } else { node };
        merges.pairs.extend(of_piece.pairs.iter().map(|pair| pair.map(global)));
        merges.convex.extend(&of_piece.convex);
        for slot in 0..graph.nodes.len() as u32 {
            if graph.is_alive(slot) {
                graph.remap[slot as usize] = left_sums.len() as u32;
                left_sums.push(graph.sums[slot as usize]);
                left_nodes.push(global(graph.nodes[slot as usize]));
            }
        }
        for slot in 0..graph.nodes.len() as u32 {
            let survivor = graph.survivor(slot);
            left_of[graph.faces[slot as usize] as usize] = graph.remap[survivor as usize];
        }
    }
    let crossing = |edge: &FaceEdge| {
        let faces = edge.faces.map(|face| left_of[face as usize]);
        (faces[0] != faces[1]).then_some(FaceEdge { faces, ..*edge })
    };
    let edges: Vec<FaceEdge> = edges.iter().filter_map(crossing).collect();
    let mut graph = Graph::new(left_sums, left_nodes, &edges);
    let first = (face_count + merges.pairs.len()) as u32;
    graph.contract(1, first, &mut merges);
    merges
}

fn mean_position(mesh: &MeshFaces<'_>) -> DVec3 {
    let sum: DVec3 = mesh.triangles.iter().map(|t| mesh.positions[t[0] as usize].as_dvec3()).sum();
    sum / mesh.triangles.len() as f64
}

fn face_sums(mesh: &MeshFaces<'_>, face: usize, center: DVec3, emission_scale: f64) -> Sums {
    let [a, b, c] = mesh.triangles[face].map(|v| mesh.positions[v as usize].as_dvec3() - center);
    let normal = (b - a).cross(c - a) * 0.5;
    let area = normal.length();
    let albedo = mesh.albedo[face].as_dvec3();
    let emission = mesh.emission[face].as_dvec3() * emission_scale;
    let mut sums = Sums {
        area,
        normal,
        albedo: albedo * area,
        emission: emission * area,
        attribute_squares: area * (albedo.length_squared() + emission.length_squared()),
        perimeter: a.distance(b) + b.distance(c) + c.distance(a),
        is_convex: true,
        ..Sums::default()
    };
    for p in [a, b, c] {
        sums.first += p * (area / 3.0);
        sums.squares += p * p * (area / 3.0);
        sums.products += p * DVec3::new(p.y, p.z, p.x) * (area / 3.0);
    }
    sums
}

/// Pairs of faces that share an edge by position. Where more than two share one, neighbours in face order do.
fn face_edges(mesh: &MeshFaces<'_>) -> Vec<FaceEdge> {
    let weld = crate::scene::adjacency::weld(mesh.positions).group_of;
    let mut sides: Vec<(u64, u32)> = mesh
        .triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(face, t)| {
            let v = t.map(|vertex| u64::from(weld[vertex as usize]));
            [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])]
                .into_iter()
                .map(move |(p, q)| (p.min(q) << 32 | p.max(q), face as u32))
        })
        .collect();
    sides.par_sort_unstable();
    let shared = sides.par_windows(2).filter(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1);
    shared.map(|pair| face_edge(mesh, &weld, pair[0].0, [pair[0].1, pair[1].1])).collect()
}

fn face_edge(mesh: &MeshFaces<'_>, weld: &[u32], side: u64, faces: [u32; 2]) -> FaceEdge {
    let [p, q] = [(side >> 32) as u32, side as u32];
    let triangle = |face: u32| mesh.triangles[face as usize];
    let corner = |face: u32, k: usize| mesh.positions[triangle(face)[k] as usize];
    let group = |face: u32, k: usize| weld[triangle(face)[k] as usize];
    let place = |face: u32, wanted: u32| (0..3).find(|&k| group(face, k) == wanted).unwrap_or(0);
    let opposite = |face: u32| (0..3).find(|&k| group(face, k) != p && group(face, k) != q).unwrap_or(0);
    let [a, b] = faces;
    let (from, to) = (corner(a, place(a, p)), corner(a, place(a, q)));
    // Faces of one orientation run along their edge in opposite directions.
    let runs = |face: u32| (place(face, p) + 1) % 3 == place(face, q);
    let normal = (corner(a, 1) - corner(a, 0)).cross(corner(a, 2) - corner(a, 0));
    let rise = normal.dot(corner(b, opposite(b)) - from);
    let tolerance = 1e-5 * normal.length() * from.distance(corner(b, opposite(b)));
    FaceEdge { faces, length: from.distance(to), is_convex: runs(a) != runs(b) && rise <= tolerance }
}

/// Piece of each face: halves at the median of the longest axis until they are small.
fn pieces(mesh: &MeshFaces<'_>) -> Vec<u32> {
    let centers: Vec<Vec3> =
        mesh.triangles.par_iter().map(|t| t.iter().map(|&v| mesh.positions[v as usize]).sum::<Vec3>() / 3.0).collect();
    let mut order: Vec<u32> = (0..centers.len() as u32).collect();
    let levels = centers.len().div_ceil(PIECE_FACES).next_power_of_two().trailing_zeros();
    halve(&centers, &mut order, levels);
    let mut piece_of = vec![0; centers.len()];
    // The same cuts as those of `halve`.
    fn number(range: &[u32], levels: u32, next: &mut u32, piece_of: &mut [u32]) {
        if levels == 0 {
            range.iter().for_each(|&face| piece_of[face as usize] = *next);
            *next += 1;
        } else {
            let (left, right) = range.split_at(range.len() / 2);
            number(left, levels - 1, next, piece_of);
            number(right, levels - 1, next, piece_of);
        }
    }
    number(&order, levels, &mut 0, &mut piece_of);
    piece_of
}

fn halve(centers: &[Vec3], order: &mut [u32], levels: u32) {
    if levels == 0 || order.len() < 2 {
        return;
    }
    let bounds = order.iter().fold((Vec3::MAX, Vec3::MIN), |(low, high), &face| {
        let p = centers[face as usize];
        (low.min(p), high.max(p))
    });
    let axis = (bounds.1 - bounds.0).max_position();
    let middle = order.len() / 2;
    let place = |face: u32| centers[face as usize][axis];
    order.select_nth_unstable_by(middle, |&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
    let (left, right) = order.split_at_mut(middle);
    rayon::join(|| halve(centers, left, levels - 1), || halve(centers, right, levels - 1));
}

/// Clusters under contraction. A joined cluster lives on in the slot of its first half.
struct Graph {
    sums: Vec<Sums>,
    /// Node number of the cluster in each slot.
    nodes: Vec<u32>,
    /// Faces (or nodes) the slots started as.
    faces: Vec<u32>,
    edges: Vec<Vec<Edge>>,
    /// Slot that took this one in; itself while alive.
    joined_into: Vec<u32>,
    /// Joins so far: entries of the heap made before are stale.
    stamps: Vec<u32>,
    /// Scratch of the caller.
    remap: Vec<u32>,
}

impl Graph {
    fn new(sums: Vec<Sums>, nodes: Vec<u32>, face_edges: &[FaceEdge]) -> Self {
        let count = nodes.len();
        let mut edges: Vec<Vec<Edge>> = vec![Vec::new(); count];
        for &FaceEdge { faces: [a, b], length, is_convex } in face_edges {
            add_edge(&mut edges[a as usize], Edge { other: b, length, is_convex });
            add_edge(&mut edges[b as usize], Edge { other: a, length, is_convex });
        }
        Self {
            sums,
            faces: nodes.clone(),
            nodes,
            edges,
            joined_into: (0..count as u32).collect(),
            stamps: vec![0; count],
            remap: vec![0; count],
        }
    }

    fn is_alive(&self, slot: u32) -> bool {
        self.joined_into[slot as usize] == slot
    }

    fn survivor(&mut self, mut slot: u32) -> u32 {
        while !self.is_alive(slot) {
            let next = self.joined_into[slot as usize];
            self.joined_into[slot as usize] = self.joined_into[next as usize];
            slot = next;
        }
        slot
    }

    /// Joins until `least` clusters are left or no two are neighbours; new clusters are numbered from `first_node`
    /// plus the merges already there when `merges` came in empty, else on from `first_node`.
    fn contract(&mut self, least: usize, first_node: u32, merges: &mut Merges) {
        let before = merges.pairs.len();
        let mut heap = BinaryHeap::new();
        for a in 0..self.nodes.len() as u32 {
            for edge in &self.edges[a as usize] {
                if edge.other > a {
                    heap.push(self.entry(a, edge));
                }
            }
        }
        let mut alive = self.nodes.len();
        while alive > least
            && let Some(Reverse((_, a, b, stamp_a, stamp_b))) = heap.pop()
        {
            let fresh = |slot: u32, stamp: u32| self.is_alive(slot) && self.stamps[slot as usize] == stamp;
            if !fresh(a, stamp_a) || !fresh(b, stamp_b) {
                continue;
            }
            merges.pairs.push([self.nodes[a as usize], self.nodes[b as usize]]);
            self.join(a, b);
            self.nodes[a as usize] = first_node + (merges.pairs.len() - 1 - before) as u32;
            merges.convex.push(self.sums[a as usize].is_convex);
            alive -= 1;
            for edge in &self.edges[a as usize] {
                heap.push(self.entry(a, edge));
            }
        }
    }

    /// Heap entry of a pair: least cost first, then the lowest slots, so that ties do not depend on chance.
    fn entry(&self, a: u32, edge: &Edge) -> Reverse<(u32, u32, u32, u32, u32)> {
        let [a, b] = [a.min(edge.other), a.max(edge.other)];
        let cost = self.sums[a as usize].join(&self.sums[b as usize], edge).cost() as f32;
        // Bits of floats that are not negative rise with them.
        Reverse((cost.max(0.0).to_bits(), a, b, self.stamps[a as usize], self.stamps[b as usize]))
    }

    /// Joins `b` into `a`.
    fn join(&mut self, a: u32, b: u32) {
        let mut row = std::mem::take(&mut self.edges[a as usize]);
        let Some(at) = row.iter().position(|edge| edge.other == b) else { return };
        let between = row.swap_remove(at);
        self.sums[a as usize] = self.sums[a as usize].join(&self.sums[b as usize], &between);
        for edge in std::mem::take(&mut self.edges[b as usize]) {
            if edge.other == a {
                continue;
            }
            add_edge(&mut row, edge);
            let others = &mut self.edges[edge.other as usize];
            others.retain(|other| other.other != b);
            add_edge(others, Edge { other: a, ..edge });
        }
        self.edges[a as usize] = row;
        self.joined_into[b as usize] = a;
        self.stamps[a as usize] += 1;
    }
}

/// Adds a border; two with one neighbour are one.
fn add_edge(row: &mut Vec<Edge>, edge: Edge) {
    match row.iter_mut().find(|known| known.other == edge.other) {
        Some(known) => {
            known.length += edge.length;
            known.is_convex &= edge.is_convex;
        }
        None => row.push(edge),
    }
}
