//! One triangle subdivided: its sides arrive already cut into equal segments, its inside is filled to fit.
//!
//! The cuts of a side depend on the side alone, so neighbours that share it share the cuts: no T-junctions, whatever
//! is done inside. The inside is cut recursively, each new edge into segments of the allowed length, choosing among a
//! few patterns the one whose worst triangle is best.

use glam::DVec3;

/// How many equal segments an edge needs so that none is longer than `max_edge`.
pub fn segments(length: f64, max_edge: f64) -> u32 {
    // The slack keeps an edge of exactly n lengths from becoming n + 1 by rounding.
    (length / max_edge - 1e-6).ceil().clamp(1.0, f64::from(u32::MAX)) as u32
}

/// Scratch and result of subdividing one triangle; reused for many.
///
/// Local vertices: 0, 1, 2 are the corners; then the inner cuts of side 0 (from corner 0 to 1), of side 1 and of side
/// 2, each in that direction; then the interior.
#[derive(Debug, Default)]
pub struct Patch {
    pub vertices: Vec<LocalVertex>,
    pub triangles: Vec<[u32; 3]>,
    boundary_count: u32,
    /// Local vertices along sides, each side's run contiguous.
    runs: Vec<u32>,
    pending: Vec<Face>,
    max_edge: f64,
}

#[derive(Debug, Clone, Copy)]
pub struct LocalVertex {
    pub position: DVec3,
    /// Weights of the three corners.
    pub barycentric: DVec3,
}

/// A directed stretch of a run: from and to positions in `runs`, in either order.
#[derive(Debug, Clone, Copy)]
struct Side {
    from: u32,
    to: u32,
}

impl Side {
    fn segments(self) -> u32 {
        self.from.abs_diff(self.to)
    }

    /// Position in the run, `count` segments from the start.
    fn at(self, count: u32) -> u32 {
        if self.from < self.to { self.from + count } else { self.from - count }
    }

    fn cut(self, count: u32) -> [Self; 2] {
        let at = self.at(count);
        [Self { from: self.from, to: at }, Self { from: at, to: self.to }]
    }

    fn reversed(self) -> Self {
        Self { from: self.to, to: self.from }
    }
}

/// A triangle still to be cut; side k runs from corner k to corner k + 1.
type Face = [Side; 3];

/// A way to cut a face.
#[derive(Debug, Clone, Copy)]
enum Cut {
    /// One side, to the opposite corner.
    Bisect {
        side: usize,
        at: u32,
    },
    /// Side `side` and the next, and the quadrilateral left over by the diagonal from the corner before them
    /// (`from_first`) or the corner after.
    Two {
        side: usize,
        at: [u32; 2],
        from_first: bool,
    },
    Three {
        at: [u32; 3],
    },
}

/// Cutting all sides keeps triangles similar and valences even: another pattern must be this much better.
const REGULARITY: f64 = 1.1;

impl Patch {
    /// Subdivides the triangle of `corners`, side k already cut into `segments[k]`.
    pub fn subdivide(&mut self, corners: [DVec3; 3], segments: [u32; 3], max_edge: f64) {
        self.vertices.clear();
        self.triangles.clear();
        self.runs.clear();
        self.max_edge = max_edge;
        for (corner, &position) in corners.iter().enumerate() {
            self.vertices.push(LocalVertex { position, barycentric: DVec3::AXES[corner] });
        }
        let face = [0, 1, 2].map(|k| self.run(k as u32, (k as u32 + 1) % 3, segments[k]));
        self.boundary_count = self.vertices.len() as u32;
        self.pending.push(face);
        while let Some(face) = self.pending.pop() {
            self.step(face);
        }
    }

    /// Vertices that belong to no side.
    pub fn interior(&self) -> &[LocalVertex] {
        &self.vertices[self.boundary_count as usize..]
    }

    /// A new straight run of `count` segments between two local vertices.
    fn run(&mut self, start: u32, end: u32, count: u32) -> Side {
        let (a, b) = (self.vertices[start as usize], self.vertices[end as usize]);
        let from = self.runs.len() as u32;
        self.runs.push(start);
        for cut in 1..count {
            let t = f64::from(cut) / f64::from(count);
            self.runs.push(self.vertices.len() as u32);
            self.vertices.push(LocalVertex {
                position: a.position.lerp(b.position, t),
                barycentric: a.barycentric.lerp(b.barycentric, t),
            });
        }
        self.runs.push(end);
        Side { from, to: from + count }
    }

    /// A new inner edge, cut as its length asks.
    fn inner_edge(&mut self, start: u32, end: u32) -> Side {
        let length = self.position(start).distance(self.position(end));
        self.run(start, end, segments(length, self.max_edge))
    }

    fn position(&self, vertex: u32) -> DVec3 {
        self.vertices[vertex as usize].position
    }

    fn vertex(&self, run_position: u32) -> u32 {
        self.runs[run_position as usize]
    }

    fn corners(&self, face: &Face) -> [u32; 3] {
        face.map(|side| self.vertex(side.from))
    }

    fn step(&mut self, face: Face) {
        let counts = face.map(Side::segments);
        match counts {
            [1, 1, 1] => self.triangles.push(self.corners(&face)),
            [a, b, c] if a == b && b == c => self.grid(face, a),
            _ => {
                let cut = self.choose(&face, counts);
                self.apply(face, cut);
            }
        }
    }

    /// All sides in `count` segments: the regular grid.
    fn grid(&mut self, face: Face, count: u32) {
        let [c0, c1, c2] = self.corners(&face).map(|corner| self.vertices[corner as usize]);
        // Row `row` lies `row` segments from side 0 towards corner 2 and holds count + 1 - row vertices.
        let mut below: Vec<u32> = (0..=count).map(|column| self.vertex(face[0].at(column))).collect();
        for row in 1..=count {
            let mut current = Vec::with_capacity((count + 1 - row) as usize);
            for column in 0..=count - row {
                let vertex = if column == 0 {
                    self.vertex(face[2].at(count - row))
                } else if column == count - row {
                    self.vertex(face[1].at(row))
                } else {
                    let t = [column, row].map(|step| f64::from(step) / f64::from(count));
                    let mix = |a: DVec3, b: DVec3, c: DVec3| a + (b - a) * t[0] + (c - a) * t[1];
                    self.vertices.push(LocalVertex {
                        position: mix(c0.position, c1.position, c2.position),
                        barycentric: mix(c0.barycentric, c1.barycentric, c2.barycentric),
                    });
                    self.vertices.len() as u32 - 1
                };
                current.push(vertex);
            }
            for (column, pair) in below.windows(2).enumerate() {
                self.triangles.push([pair[0], pair[1], current[column]]);
                if let Some(&next) = current.get(column + 1) {
                    self.triangles.push([pair[1], next, current[column]]);
                }
            }
            below = current;
        }
    }

    fn choose(&self, face: &Face, counts: [u32; 3]) -> Cut {
        let corners = self.corners(face).map(|corner| self.position(corner));
        let lengths = [0, 1, 2].map(|k| corners[k].distance(corners[(k + 1) % 3]));
        // Only a side of two segments or more can be cut.
        let rank = |k: usize| (counts[k] > 1, lengths[k]);
        let longest = (1..3).fold(0, |best, k| if rank(k) > rank(best) { k } else { best });

        // A short base under two long sides: take one rung off the ladder, so that no edge runs along it.
        if let Some(base) = (0..3).find(|&k| counts[k] == 1 && counts[(k + 1) % 3] > 1 && counts[(k + 2) % 3] > 1) {
            let (side, next) = ((base + 1) % 3, (base + 2) % 3);
            return self.better_diagonal(face, side, [1, counts[next] - 1]);
        }
        let foot = self.foot(corners, longest, counts[longest]);
        let area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() * 0.5;
        let is_thin = 2.0 * area < lengths[longest] * self.max_edge * 0.5;
        if counts.contains(&1) || is_thin {
            return self.better_bisection(face, longest, counts[longest], foot, is_thin);
        }

        let [a, b, c] = counts.map(mids);
        let three = a
            .into_iter()
            .flat_map(|a| b.into_iter().flat_map(move |b| c.into_iter().map(move |c| Cut::Three { at: [a, b, c] })));
        let three = self.best_of(three, face);
        let one = self.better_bisection(face, longest, counts[longest], foot, false);
        let one_is_better = self.worst_shape(face, one) > REGULARITY * self.worst_shape(face, three);
        if one_is_better { one } else { three }
    }

    /// Segments from the start of side `k` to the cut nearest the foot of the opposite corner.
    fn foot(&self, corners: [DVec3; 3], k: usize, count: u32) -> u32 {
        let (a, b, opposite) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let along = (opposite - a).dot(b - a) / (b - a).length_squared();
        (along * f64::from(count)).round().clamp(1.0, f64::from(count.max(2) - 1)) as u32
    }

    fn better_bisection(&self, face: &Face, side: usize, count: u32, foot: u32, at_foot: bool) -> Cut {
        let middle = mids(count).map(|at| Cut::Bisect { side, at });
        let foot = Cut::Bisect { side, at: foot };
        if at_foot { foot } else { self.best_of([middle[0], middle[1], foot], face) }
    }

    fn better_diagonal(&self, face: &Face, side: usize, at: [u32; 2]) -> Cut {
        self.best_of([true, false].map(|from_first| Cut::Two { side, at, from_first }), face)
    }

    /// The first of the cuts whose worst triangle is best.
    fn best_of(&self, cuts: impl IntoIterator<Item = Cut>, face: &Face) -> Cut {
        let rated = cuts.into_iter().map(|cut| (cut, self.worst_shape(face, cut)));
        let best = rated.reduce(|best, other| if other.1 > best.1 { other } else { best });
        best.map_or(Cut::Bisect { side: 0, at: 1 }, |best| best.0)
    }

    fn worst_shape(&self, face: &Face, cut: Cut) -> f64 {
        let mut worst = f64::INFINITY;
        let mut take = |corners: [u32; 3]| worst = f64::min(worst, shape(corners.map(|corner| self.position(corner))));
        let corner = |k: usize| self.vertex(face[k % 3].from);
        let at = |k: usize, count: u32| self.vertex(face[k % 3].at(count));
        match cut {
            Cut::Bisect { side, at: count } => {
                let (m, tip) = (at(side, count), corner(side + 2));
                take([corner(side), m, tip]);
                take([m, corner(side + 1), tip]);
            }
            Cut::Two { side, at: [first, second], from_first } => {
                let (m, n, start, end) = (at(side, first), at(side + 1, second), corner(side), corner(side + 2));
                take([m, corner(side + 1), n]);
                take([start, m, if from_first { n } else { end }]);
                take([if from_first { start } else { m }, n, end]);
            }
            Cut::Three { at: counts } => {
                let m = [0, 1, 2].map(|k| at(k, counts[k]));
                take(m);
                take([corner(0), m[0], m[2]]);
                take([m[0], corner(1), m[1]]);
                take([m[2], m[1], corner(2)]);
            }
        }
        worst
    }

    fn apply(&mut self, face: Face, cut: Cut) {
        match cut {
            Cut::Bisect { side, at } => {
                let [start, end] = face[side].cut(at);
                let (next, last) = (face[(side + 1) % 3], face[(side + 2) % 3]);
                let across = self.inner_edge(self.vertex(start.to), self.vertex(last.from));
                self.pending.extend([[start, across, last], [end, next, across.reversed()]]);
            }
            Cut::Two { side, at, from_first } => {
                let [a, b] = face[side].cut(at[0]);
                let [c, d] = face[(side + 1) % 3].cut(at[1]);
                let last = face[(side + 2) % 3];
                let (m, n) = (self.vertex(a.to), self.vertex(c.to));
                let across = self.inner_edge(n, m);
                self.pending.push([b, c, across]);
                if from_first {
                    let diagonal = self.inner_edge(n, self.vertex(a.from));
                    self.pending.extend([[a, across.reversed(), diagonal], [diagonal.reversed(), d, last]]);
                } else {
                    let diagonal = self.inner_edge(m, self.vertex(last.from));
                    self.pending.extend([[a, diagonal, last], [across.reversed(), d, diagonal.reversed()]]);
                }
            }
            Cut::Three { at } => {
                let cuts = [0, 1, 2].map(|k| face[k].cut(at[k]));
                let m = cuts.map(|[start, _]| self.vertex(start.to));
                let across = [0, 1, 2].map(|k| self.inner_edge(m[k], m[(k + 1) % 3]));
                for k in 0..3 {
                    let (before, after) = (cuts[k][1], cuts[(k + 1) % 3][0]);
                    self.pending.push([before, after, across[k].reversed()]);
                }
                self.pending.push(across);
            }
        }
    }
}

/// Segments to the cut nearest the middle; for an odd count the two nearest.
fn mids(count: u32) -> [u32; 2] {
    [count / 2, count.div_ceil(2)]
}

/// 1 for an equilateral triangle, towards 0 as it degenerates.
pub fn shape([a, b, c]: [DVec3; 3]) -> f64 {
    let area = (b - a).cross(c - a).length() * 0.5;
    let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    if squares > 0.0 { 4.0 * 3.0f64.sqrt() * area / squares } else { 0.0 }
}
