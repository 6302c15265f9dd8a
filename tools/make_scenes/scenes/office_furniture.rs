//! The pieces that stand in the office, each about its own origin on the floor or table, facing +Z.

use super::kit::{Dice, block, rod, slab};
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Shape, circle, smooth_path};

fn turned_about(shape: Shape, axis_at: Vec3, turn: impl Fn(Shape) -> Shape) -> Shape {
    turn(shape.moved(-axis_at)).moved(axis_at)
}

/// Table top, drawer unit: 1.5 m by 0.75 m, 0.75 m high, standing about the middle of its back half.
pub fn desk_wood() -> Shape {
    let drawers = (0..3).map(|k| {
        let y = 0.12 + 0.19 * k as f32;
        slab([0.3, 0.68], [y, y + 0.175], [0.255, 0.285], 0.006)
    });
    let top = slab([-0.75, 0.75], [0.715, 0.75], [-0.4, 0.35], 0.008);
    let unit = slab([0.28, 0.7], [0.1, 0.7], [-0.3, 0.27], 0.006);
    top.with(unit).with(Shape::union(drawers))
}

pub fn desk_steel() -> Shape {
    let mut steel = Shape::default();
    for [x, z] in [[-0.69, -0.34], [-0.69, 0.29], [0.69, -0.34], [0.69, 0.29]] {
        steel.append(slab([x - 0.02, x + 0.02], [0.0, 0.715], [z - 0.02, z + 0.02], 0.004));
    }
    for k in 0..3 {
        let y = 0.22 + 0.19 * k as f32;
        steel.append(slab([0.42, 0.56], [y - 0.006, y + 0.006], [0.28, 0.31], 0.003));
    }
    steel
}

/// Stand and housing, then the lit panel.
pub fn monitor() -> (Shape, Shape) {
    let foot = slab([-0.13, 0.13], [0.0, 0.012], [-0.08, 0.1], 0.005);
    let neck = slab([-0.03, 0.03], [0.0, 0.25], [-0.045, -0.02], 0.006);
    let housing = slab([-0.31, 0.31], [0.12, 0.5], [-0.025, 0.0], 0.008);
    let z = 0.0008;
    let panel =
        Shape::quad([[-0.295, 0.14, z], [0.295, 0.14, z], [0.295, 0.485, z], [-0.295, 0.485, z]].map(Vec3::from));
    (foot.with(neck).with(housing), panel)
}

pub fn mug() -> Shape {
    let outer: &[[f32; 2]] = &[[0.0, 0.0], [0.034, 0.0]];
    let side: &[[f32; 2]] = &[[0.034, 0.0], [0.038, 0.03], [0.039, 0.095]];
    let rim: &[[f32; 2]] = &[[0.039, 0.095], [0.0375, 0.097], [0.036, 0.095]];
    let inner: &[[f32; 2]] = &[[0.036, 0.095], [0.034, 0.012], [0.0, 0.01]];
    let ear = smooth_path(
        [[0.036, 0.078, 0.0], [0.062, 0.074, 0.0], [0.066, 0.045, 0.0], [0.036, 0.022, 0.0]].map(Vec3::from),
        3,
    );
    Shape::lathe(&[outer, side, rim, inner], 14).with(Shape::tube(&ear, |_| Vec2::new(0.007, 0.005), 6, false))
}

/// A jointed lamp whose shade looks forward and down.
pub fn desk_lamp() -> Shape {
    let foot =
        Shape::lathe(&[&[[0.0, 0.0], [0.085, 0.0]], &[[0.085, 0.0], [0.085, 0.012], [0.07, 0.022], [0.0, 0.026]]], 16);
    let lower = rod([[0.0, 0.02, 0.0], [0.0, 0.3, -0.12]], [0.008, 0.008], 6);
    let upper = rod([[0.0, 0.3, -0.12], [0.0, 0.44, 0.14]], [0.008, 0.008], 6);
    let joint = Shape::sphere(8).scaled(Vec3::splat(0.018)).moved(Vec3::new(0.0, 0.3, -0.12));
    // The shade is thin but closed: out along the outside, back along the inside.
    let outside: &[[f32; 2]] = &[[0.075, 0.0], [0.06, 0.06], [0.035, 0.1], [0.0, 0.11]];
    let inside: &[[f32; 2]] = &[[0.0, 0.104], [0.03, 0.095], [0.055, 0.056], [0.071, 0.0]];
    let lip: &[[f32; 2]] = &[[0.071, 0.0], [0.075, 0.0]];
    let shade = Shape::lathe(&[outside, inside, lip], 14).turned_x(-35.0).moved(Vec3::new(0.0, 0.36, 0.2));
    Shape::union([foot, lower, upper, joint, shade])
}

const SHELF_WIDTH: f32 = 1.6;
const SHELF_DEPTH: f32 = 0.32;
const BOARDS: [f32; 6] = [0.06, 0.46, 0.86, 1.26, 1.7, 2.1];

/// An open bookcase standing against a wall at z = 0.
pub fn shelf() -> Shape {
    let half = SHELF_WIDTH * 0.5;
    let sides = [-half, half - 0.03, -0.015].map(|x| block([x, x + 0.03], [0.0, 2.13], [0.0, SHELF_DEPTH]));
    let boards = BOARDS.map(|y| block([-half + 0.01, half - 0.01], [y, y + 0.028], [0.006, SHELF_DEPTH - 0.006]));
    let back = block([-half + 0.01, half - 0.01], [0.06, 2.12], [0.002, 0.012]);
    Shape::union(sides).with(Shape::union(boards)).with(back)
}

/// Rows of books on the shelf, some leaning; each joins the pile of its colour.
pub fn books(dice: &mut Dice, piles: &mut [Shape]) {
    for (row, board) in BOARDS.iter().take(5).enumerate() {
        for (start, end) in [(-0.76, -0.02), (0.02, 0.76)] {
            let mut x = start + 0.005;
            // Some compartments stay half empty.
            let stop =
                if (row + usize::from(start < 0.0)) % 3 == 0 { start + dice.within(0.36, 0.5) } else { end - 0.03 };
            while x < stop {
                let thick = dice.within(0.026, 0.07);
                let (tall, deep) = (dice.within(0.2, 0.32), dice.within(0.17, 0.24));
                let pile = (dice.unit() * piles.len() as f32) as usize;
                let book = block([0.0, thick], [0.0, tall], [SHELF_DEPTH - 0.03 - deep, SHELF_DEPTH - 0.03]);
                let last = x + thick + 0.02 > stop;
                let lean = if last && stop < end - 0.1 { 9.0 } else { 0.0 };
                let lift = if lean > 0.0 { 0.002 } else { 0.0 };
                let at = Vec3::new(x + lean * 0.006, board + 0.028 + lift, 0.0);
                piles[pile % piles.len().max(1)].append(book.turned_z(lean).moved(at));
                x += thick + 0.002;
            }
        }
    }
}

pub fn vase() -> Shape {
    let body: &[[f32; 2]] =
        &[[0.05, 0.0], [0.085, 0.05], [0.1, 0.11], [0.075, 0.19], [0.035, 0.25], [0.032, 0.29], [0.048, 0.32]];
    let inside: &[[f32; 2]] = &[[0.044, 0.319], [0.028, 0.29], [0.0, 0.27]];
    Shape::lathe(&[&[[0.0, 0.0], [0.05, 0.0]], body, &[[0.048, 0.32], [0.044, 0.319]], inside], 16)
}

/// Cushions, then the steel.
pub fn office_chair() -> (Shape, Shape) {
    let seat = slab([-0.25, 0.25], [0.43, 0.51], [-0.24, 0.26], 0.03);
    let back =
        slab([-0.22, 0.22], [0.0, 0.52], [-0.035, 0.035], 0.03).turned_x(-10.0).moved(Vec3::new(0.0, 0.6, -0.25));
    let mut steel = Shape::cylinder(0.028, 0.08, 0.43, 12);
    steel.append(Shape::cylinder(0.045, 0.06, 0.2, 12));
    for k in 0..5 {
        let arm = circle(k as f32 / 5.0 + 0.05);
        let tip = [arm.x * 0.31, 0.075, arm.y * 0.31];
        steel.append(rod([[0.0, 0.11, 0.0], tip], [0.026, 0.016], 6));
        let wheel = Shape::cylinder(0.032, -0.02, 0.02, 8).turned_z(90.0).turned_y(360.0 * (k as f32 / 5.0));
        steel.append(wheel.moved(Vec3::new(tip[0], 0.032, tip[2])));
    }
    let spine =
        smooth_path([[0.0, 0.42, -0.1], [0.0, 0.43, -0.27], [0.0, 0.6, -0.3], [0.0, 0.8, -0.325]].map(Vec3::from), 3);
    steel.append(Shape::tube(&spine, |_| Vec2::new(0.028, 0.012), 8, true));
    for x in [-0.29, 0.29] {
        let rest = smooth_path([[x * 0.7, 0.44, 0.0], [x, 0.48, 0.0], [x, 0.66, 0.0]].map(Vec3::from), 3);
        steel.append(Shape::tube(&rest, |_| Vec2::splat(0.014), 6, true));
        steel.append(slab([x - 0.03, x + 0.03], [0.655, 0.68], [-0.14, 0.16], 0.01));
    }
    (seat.with(back), steel)
}

/// Cushions, then the wooden frame.
pub fn easy_chair() -> (Shape, Shape) {
    let seat = slab([-0.29, 0.29], [0.3, 0.42], [-0.25, 0.33], 0.04);
    let back = slab([-0.29, 0.29], [0.0, 0.5], [-0.06, 0.06], 0.04);
    let back = turned_about(back, Vec3::ZERO, |b| b.turned_x(-18.0)).moved(Vec3::new(0.0, 0.39, -0.26));
    let mut wood = Shape::default();
    for x in [-0.33, 0.33] {
        wood.append(rod([[x, 0.0, 0.34], [x, 0.55, 0.26]], [0.016, 0.024], 8));
        wood.append(rod([[x, 0.0, -0.42], [x, 0.58, -0.24]], [0.016, 0.024], 8));
        let rest =
            smooth_path([[x, 0.54, -0.34], [x, 0.575, -0.1], [x, 0.575, 0.15], [x, 0.55, 0.36]].map(Vec3::from), 3);
        wood.append(Shape::tube(&rest, |_| Vec2::new(0.032, 0.014), 8, true));
        wood.append(rod([[x, 0.27, 0.31], [x, 0.27, -0.33]], [0.016, 0.016], 6));
    }
    for z in [0.28, -0.26] {
        wood.append(rod([[-0.33, 0.27, z], [0.33, 0.27, z]], [0.016, 0.016], 6));
    }
    (seat.with(back), wood)
}

/// Leaves (thin, two-sided), pot, soil.
pub fn plant(dice: &mut Dice) -> (Shape, Shape, Shape) {
    let pot = Shape::lathe(
        &[
            &[[0.0, 0.0], [0.12, 0.0]],
            &[[0.12, 0.0], [0.15, 0.12], [0.165, 0.3]],
            &[[0.165, 0.3], [0.15, 0.3]],
            &[[0.15, 0.3], [0.145, 0.24]],
        ],
        16,
    );
    let soil = Shape::lathe(&[&[[0.147, 0.26], [0.0, 0.27]]], 16);
    let mut leaves = Shape::default();
    for k in 0..15 {
        let turn = dice.within(0.0, 1.0) + k as f32 * 0.381_966;
        let (length, rise, droop) = (dice.within(0.35, 0.6), dice.within(0.35, 1.0), dice.within(0.1, 0.4));
        leaves.append(leaf(length, rise, droop).turned_y(360.0 * turn.fract()).moved(Vec3::new(0.0, 0.26, 0.0)));
    }
    (leaves, pot, soil)
}

/// A curved leaf growing along +X from the origin: `rise` is its slope at the root, `droop` how far it bends down.
fn leaf(length: f32, rise: f32, droop: f32) -> Shape {
    const STEPS: usize = 6;
    let mut leaf = Shape::default();
    for i in 0..=STEPS {
        let t = i as f32 / STEPS as f32;
        let spine = Vec3::new(
            length * t * (1.0 - 0.3 * rise * (1.0 - t)),
            length * (1.6 * rise * t - droop * 2.2 * t * t * t),
            0.0,
        );
        let half = 0.075 * length * (4.0 * t * (1.0 - t)).max(0.0).sqrt() + if i < STEPS { 0.006 } else { 0.001 };
        for side in [-1.0, 0.0, 1.0] {
            leaf.vertex(spine + Vec3::new(0.0, 0.35 * half * f32::abs(side), half * side), Vec3::Y, Vec2::ZERO);
        }
    }
    for i in 0..STEPS as u32 {
        for k in 0..2 {
            let [a, b] = [3 * i + k, 3 * i + k + 1];
            leaf.quad_of([a, b, b + 3, a + 3]);
        }
    }
    leaf.smoothed()
}
