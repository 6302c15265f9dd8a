//! A dancing figure: body as one smooth isosurface over a skeleton of 17 joints, skin weights by nearness to the bones,
//! and the motion, a loop of sums of sines.

use glam::{Mat3, Vec3};
use linklight::scene::shapes::{Shape, isosurface, sin_cos};

/// A joint with its bone: from `head` to `tail` with a radius at each end, metres at rest, facing +Z, arms half raised.
pub struct Joint {
    pub name: &'static str,
    pub parent: Option<usize>,
    pub head: Vec3,
    tail: Vec3,
    radius: [f32; 2],
    motion: Motion,
}

/// Turns about x, y, z in degrees: a constant and, per axis, waves of (amplitude, cycles per loop, phase in turns).
struct Motion {
    rest: [f32; 3],
    waves: [&'static [(f32, f32, f32)]; 3],
}

const fn joint(
    name: &'static str,
    parent: usize,
    head: [f32; 3],
    tail: [f32; 3],
    radius: [f32; 2],
    motion: Motion,
) -> Joint {
    Joint { name, parent: Some(parent), head: Vec3::from_array(head), tail: Vec3::from_array(tail), radius, motion }
}

const fn moving(rest: [f32; 3], waves: [&'static [(f32, f32, f32)]; 3]) -> Motion {
    Motion { rest, waves }
}

/// Parents stand before their children.
pub const JOINTS: [Joint; 17] = [
    Joint {
        name: "hips",
        parent: None,
        head: Vec3::new(0.0, 0.97, 0.0),
        tail: Vec3::new(0.0, 1.06, 0.0),
        radius: [0.135, 0.115],
        motion: moving([0.0, 0.0, 0.0], [&[], &[(24.0, 1.0, 0.0)], &[(7.0, 1.0, 0.25)]]),
    },
    joint(
        "spine",
        0,
        [0.0, 1.1, 0.0],
        [0.0, 1.22, 0.005],
        [0.108, 0.118],
        moving([3.0, 0.0, 0.0], [&[(3.0, 2.0, 0.0)], &[(10.0, 1.0, 0.05)], &[(-9.0, 1.0, 0.22)]]),
    ),
    joint(
        "chest",
        1,
        [0.0, 1.24, 0.0],
        [0.0, 1.38, -0.01],
        [0.125, 0.12],
        moving([-5.0, 0.0, 0.0], [&[(-3.0, 2.0, 0.1)], &[(14.0, 1.0, 0.1)], &[(-8.0, 1.0, 0.2)]]),
    ),
    joint(
        "neck",
        2,
        [0.0, 1.44, -0.015],
        [0.0, 1.52, 0.0],
        [0.052, 0.046],
        moving([4.0, 0.0, 0.0], [&[], &[(-12.0, 1.0, 0.1)], &[(5.0, 1.0, 0.15)]]),
    ),
    joint(
        "head",
        3,
        [0.0, 1.56, 0.01],
        [0.0, 1.65, 0.012],
        [0.082, 0.1],
        moving([-4.0, 0.0, 0.0], [&[(4.0, 2.0, 0.2)], &[(-16.0, 1.0, 0.08)], &[(9.0, 1.0, 0.12)]]),
    ),
    joint(
        "left upper arm",
        2,
        [0.165, 1.39, -0.01],
        [0.35, 1.21, -0.01],
        [0.054, 0.042],
        moving([0.0, -10.0, 72.0], [&[(12.0, 1.0, 0.3)], &[(20.0, 1.0, 0.1)], &[(38.0, 1.0, 0.0)]]),
    ),
    joint(
        "left forearm",
        5,
        [0.35, 1.21, -0.01],
        [0.53, 1.04, 0.01],
        [0.042, 0.029],
        moving([0.0, -25.0, 32.0], [&[], &[(15.0, 2.0, 0.1)], &[(26.0, 1.0, 0.92)]]),
    ),
    joint(
        "left hand",
        6,
        [0.53, 1.04, 0.01],
        [0.625, 0.945, 0.02],
        [0.033, 0.022],
        moving([0.0, 0.0, -8.0], [&[], &[], &[(24.0, 1.0, 0.85)]]),
    ),
    joint(
        "right upper arm",
        2,
        [-0.165, 1.39, -0.01],
        [-0.35, 1.21, -0.01],
        [0.054, 0.042],
        moving([0.0, 10.0, -72.0], [&[(12.0, 1.0, 0.8)], &[(20.0, 1.0, 0.1)], &[(38.0, 1.0, 0.0)]]),
    ),
    joint(
        "right forearm",
        8,
        [-0.35, 1.21, -0.01],
        [-0.53, 1.04, 0.01],
        [0.042, 0.029],
        moving([0.0, 25.0, -32.0], [&[], &[(15.0, 2.0, 0.6)], &[(26.0, 1.0, 0.92)]]),
    ),
    joint(
        "right hand",
        9,
        [-0.53, 1.04, 0.01],
        [-0.625, 0.945, 0.02],
        [0.033, 0.022],
        moving([0.0, 0.0, 8.0], [&[], &[], &[(24.0, 1.0, 0.85)]]),
    ),
    joint(
        "left thigh",
        0,
        [0.095, 0.93, 0.0],
        [0.112, 0.52, 0.012],
        [0.1, 0.06],
        moving([-20.0, 8.0, 5.0], [&[(-24.0, 1.0, 0.0), (-8.0, 2.0, 0.25)], &[(-12.0, 1.0, 0.0)], &[(6.0, 1.0, 0.25)]]),
    ),
    joint(
        "left shin",
        11,
        [0.112, 0.52, 0.012],
        [0.118, 0.11, -0.02],
        [0.06, 0.037],
        moving([38.0, 0.0, 0.0], [&[(34.0, 1.0, 0.03), (6.0, 2.0, 0.25)], &[], &[]]),
    ),
    joint(
        "left foot",
        12,
        [0.118, 0.09, -0.025],
        [0.135, 0.035, 0.13],
        [0.04, 0.03],
        moving([-6.0, 0.0, 0.0], [&[(22.0, 1.0, 0.0)], &[], &[]]),
    ),
    joint(
        "right thigh",
        0,
        [-0.095, 0.93, 0.0],
        [-0.112, 0.52, 0.012],
        [0.1, 0.06],
        moving(
            [-20.0, -8.0, -5.0],
            [&[(24.0, 1.0, 0.0), (-8.0, 2.0, 0.25)], &[(-12.0, 1.0, 0.0)], &[(6.0, 1.0, 0.25)]],
        ),
    ),
    joint(
        "right shin",
        14,
        [-0.112, 0.52, 0.012],
        [-0.118, 0.11, -0.02],
        [0.06, 0.037],
        moving([38.0, 0.0, 0.0], [&[(-34.0, 1.0, 0.03), (6.0, 2.0, 0.25)], &[], &[]]),
    ),
    joint(
        "right foot",
        15,
        [-0.118, 0.09, -0.025],
        [-0.135, 0.035, 0.13],
        [0.04, 0.03],
        moving([-6.0, 0.0, 0.0], [&[(-22.0, 1.0, 0.0)], &[], &[]]),
    ),
];

/// Seconds of one loop.
pub const LOOP: f32 = 4.0;

impl Joint {
    /// Distance to the bone's axis and the bone's radius at the nearest point.
    fn near(&self, p: Vec3) -> (f32, f32) {
        let axis = self.tail - self.head;
        let t = ((p - self.head).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        ((p - self.head - axis * t).length(), self.radius[0] + (self.radius[1] - self.radius[0]) * t)
    }

    /// The joint's turn at a time of the loop, as a quaternion.
    pub fn rotation(&self, seconds: f32) -> [f32; 4] {
        let degrees = std::array::from_fn(|axis| {
            let waves = self.motion.waves[axis].iter();
            self.motion.rest[axis] + waves.map(|(a, n, phase)| a * sin_cos(seconds / LOOP * n + phase).0).sum::<f32>()
        });
        quaternion(degrees)
    }

    /// From the parent's joint.
    pub fn offset(&self) -> Vec3 {
        self.parent.map_or(self.head, |parent| self.head - JOINTS[parent].head)
    }
}

/// About x first, then y, then z.
fn quaternion(degrees: [f32; 3]) -> [f32; 4] {
    let [(sx, cx), (sy, cy), (sz, cz)] = degrees.map(|d| sin_cos(d / 720.0));
    [sx * cy * cz - cx * sy * sz, cx * sy * cz + sx * cy * sz, cx * cy * sz - sx * sy * cz, cx * cy * cz + sx * sy * sz]
}

fn matrix([x, y, z, w]: [f32; 4]) -> Mat3 {
    Mat3::from_cols(
        Vec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        Vec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        Vec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
}

/// Where the hips are at a time: swaying, and as high as the lower foot asks that stands on the floor.
pub fn hips_at(seconds: f32) -> Vec3 {
    let mut world: Vec<(Mat3, Vec3)> = Vec::new();
    let mut lowest = f32::MAX;
    for joint in &JOINTS {
        let (turn, at) = joint.parent.map_or((Mat3::IDENTITY, Vec3::ZERO), |parent| world[parent]);
        let here = at + turn * joint.offset();
        let turn = turn * matrix(joint.rotation(seconds));
        world.push((turn, here));
        if joint.name.ends_with("foot") {
            let tip = here + turn * (joint.tail - joint.head);
            lowest = lowest.min(here.y - joint.radius[0]).min(tip.y - joint.radius[1]);
        }
    }
    let sway = 0.09 * sin_cos(seconds / LOOP + 0.5).0;
    Vec3::new(sway, JOINTS[0].head.y - lowest, 0.02 * sin_cos(2.0 * seconds / LOOP).0)
}

/// Smooth minimum: the two shapes flow together within `k` metres.
fn blend(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// Signed distance to the body, roughly: the trunk is flatter from front to back than from side to side.
fn body(p: Vec3) -> f32 {
    let distance = |index: usize, p: Vec3| {
        let (d, r) = JOINTS[index].near(p);
        d - r
    };
    let flat = Vec3::new(p.x, p.y, p.z * 1.35);
    let trunk = blend(blend(distance(0, flat), distance(1, flat), 0.12), distance(2, flat), 0.12);
    let shoulders = {
        let reach = Vec3::new((p.x.abs() - 0.11).max(0.0), p.y - 1.385, (p.z + 0.01) * 1.2);
        reach.length() - 0.062
    };
    let bust = (Vec3::new(p.x.abs() - 0.062, p.y - 1.285, p.z - 0.075)).length() - 0.058;
    let trunk = blend(blend(trunk, shoulders, 0.1), bust, 0.06);
    let neck = distance(3, p);
    let nose = (p - Vec3::new(0.0, 1.605, 0.112)).length() - 0.011;
    let face = blend(blend(distance(4, p), (p - Vec3::new(0.0, 1.545, 0.05)).length() - 0.045, 0.06), nose, 0.03);
    // The hair is put up in a knot.
    let knot = (p - Vec3::new(0.0, 1.73, -0.07)).length() - 0.045;
    let head = blend(blend(neck, face, 0.035), knot, 0.02);
    let mut all = blend(trunk, head, 0.05);
    for limb in [[5, 6, 7], [8, 9, 10], [11, 12, 13], [14, 15, 16]] {
        let [upper, lower, end] = limb.map(|index| distance(index, p));
        let reach = if limb[0] < 11 { 0.05 } else { 0.08 };
        all = blend(all, blend(blend(upper, lower, 0.035), end, 0.04), reach);
    }
    all
}

/// The body at rest.
pub fn mesh() -> Shape {
    isosurface(Vec3::new(-0.74, -0.05, -0.26), Vec3::new(0.74, 1.84, 0.3), 0.026, body)
}

/// The four strongest joints at a point of the body and their weights in 255ths, which sum to 255.
pub fn skin(p: Vec3) -> ([u8; 4], [u8; 4]) {
    let mut near: Vec<(usize, f32)> =
        JOINTS.iter().map(|joint| joint.near(p)).map(|(d, r)| d / r).enumerate().collect();
    near.sort_by(|a, b| a.1.total_cmp(&b.1));
    let closest = near[0].1;
    let raw: [f32; 4] = std::array::from_fn(|k| {
        let fade = (1.0 - (near[k].1 - closest) / 0.75).max(0.0);
        fade * fade
    });
    let sum: f32 = raw.iter().sum();
    let mut weights = raw.map(|w| (w / sum * 255.0) as u8);
    // The first, strongest, takes what rounding down left over.
    weights[0] += 255 - weights.iter().sum::<u8>();
    (std::array::from_fn(|k| if weights[k] > 0 { near[k].0 as u8 } else { 0 }), weights)
}

/// Linear vertex colour: skin, costume, hair.
pub fn color(p: Vec3) -> [f32; 3] {
    const SKIN: [f32; 3] = [0.62, 0.36, 0.24];
    const COSTUME: [f32; 3] = [0.08, 0.26, 0.42];
    const SLIPPER: [f32; 3] = [0.72, 0.16, 0.12];
    const HAIR: [f32; 3] = [0.07, 0.04, 0.03];
    let hair_line = 1.615 + 0.75 * p.z.max(-0.09);
    if p.y > 1.5 && (p.y > hair_line || p.z < -0.03 && p.y > 1.56) {
        HAIR
    } else if p.y < 0.115 {
        SLIPPER
    } else if p.y < 1.36 + 0.3 * p.x.abs() && p.x.abs() < 0.2 && p.y > 0.5 {
        COSTUME
    } else {
        SKIN
    }
}
