//! The tea service and the seats of the tea room, each about its own origin on the table or floor.

use super::kit::{profile, rod};
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Shape, circle, smooth_path};

fn sweep<const N: usize>(points: [[f32; 3]; N], steps: usize, segments: usize, radius: impl Fn(f32) -> Vec2) -> Shape {
    Shape::tube(&smooth_path(points.map(Vec3::from), steps), radius, segments, true)
}

/// A round-bellied teapot, 0.2 m high; its spout points to +X.
pub fn teapot() -> Shape {
    let foot = [[0.0, 0.0], [0.058, 0.0]];
    let ring = [[0.058, 0.0], [0.06, 0.004], [0.056, 0.01]];
    let belly = profile([[0.056, 0.01], [0.085, 0.03], [0.102, 0.068], [0.088, 0.11], [0.06, 0.134]], 4);
    let rim = [[0.06, 0.134], [0.061, 0.138], [0.056, 0.14]];
    let dome = profile([[0.056, 0.14], [0.045, 0.151], [0.026, 0.159], [0.012, 0.163]], 3);
    let knob = profile(
        [[0.012, 0.163], [0.009, 0.165], [0.008, 0.17], [0.016, 0.178], [0.0155, 0.187], [0.009, 0.193], [0.0, 0.194]],
        2,
    );
    let body = Shape::lathe(&[&foot, &ring, &belly, &rim, &dome, &knob], 28);
    let spout = sweep(
        [[0.07, 0.045, 0.0], [0.112, 0.058, 0.0], [0.138, 0.1, 0.0], [0.156, 0.134, 0.0], [0.178, 0.148, 0.0]],
        3,
        12,
        |t| {
            let slim = 0.027 - 0.026 * t + 0.009 * t * t;
            Vec2::new(slim * 0.85, slim)
        },
    );
    let handle = sweep(
        [
            [-0.068, 0.122, 0.0],
            [-0.105, 0.141, 0.0],
            [-0.152, 0.126, 0.0],
            [-0.158, 0.082, 0.0],
            [-0.125, 0.05, 0.0],
            [-0.085, 0.042, 0.0],
        ],
        2,
        8,
        |_| Vec2::new(0.0095, 0.007),
    );
    Shape::union([body, spout, handle])
}

/// A tall coffee pot with a straight neck, 0.26 m high.
pub fn tall_pot() -> Shape {
    let foot = [[0.0, 0.0], [0.05, 0.0]];
    let body = profile([[0.05, 0.0], [0.062, 0.01], [0.074, 0.05], [0.066, 0.11], [0.046, 0.165], [0.044, 0.2]], 3);
    let lid = profile([[0.047, 0.202], [0.036, 0.222], [0.012, 0.234]], 3);
    let knob = profile([[0.012, 0.234], [0.008, 0.236], [0.014, 0.247], [0.008, 0.258], [0.0, 0.26]], 2);
    let pot = Shape::lathe(&[&foot, &body, &[[0.044, 0.2], [0.047, 0.202]], &lid, &knob], 22);
    let spout = sweep([[0.055, 0.06, 0.0], [0.095, 0.085, 0.0], [0.1, 0.15, 0.0], [0.132, 0.188, 0.0]], 3, 10, |t| {
        Vec2::splat(0.02 - 0.012 * t)
    });
    let handle = sweep([[-0.042, 0.19, 0.0], [-0.1, 0.2, 0.0], [-0.118, 0.14, 0.0], [-0.065, 0.07, 0.0]], 3, 7, |_| {
        Vec2::splat(0.007)
    });
    Shape::union([pot, spout, handle])
}

/// A cup on its saucer, then the tea in it.
pub fn cup() -> (Shape, Shape) {
    let under = profile([[0.0, 0.003], [0.04, 0.003], [0.062, 0.008], [0.079, 0.017]], 1);
    let over = profile([[0.079, 0.0185], [0.06, 0.011], [0.034, 0.0075], [0.0, 0.0075]], 1);
    let saucer = Shape::lathe(&[&under, &[[0.079, 0.017], [0.079, 0.0185]], &over], 22);
    let outside = profile([[0.021, 0.008], [0.023, 0.013], [0.036, 0.03], [0.0435, 0.058], [0.046, 0.066]], 2);
    let inside = profile([[0.0445, 0.0665], [0.042, 0.056], [0.034, 0.031], [0.018, 0.017], [0.0, 0.015]], 1);
    let lip = [[0.046, 0.066], [0.0455, 0.067], [0.0445, 0.0665]];
    let bowl = Shape::lathe(&[&outside, &lip, &inside], 22);
    let ear = sweep([[0.041, 0.056, 0.0], [0.062, 0.061, 0.0], [0.067, 0.043, 0.0], [0.037, 0.031, 0.0]], 2, 6, |_| {
        Vec2::new(0.0042, 0.003)
    });
    let tea = Shape::lathe(&[&[[0.0405, 0.052], [0.0, 0.052]]], 22);
    (Shape::union([saucer, bowl, ear]), tea)
}

/// A spoon lying along X.
pub fn spoon() -> Shape {
    let stem =
        [[-0.062, 0.006, 0.0], [-0.02, 0.005, 0.0], [0.03, 0.0045, 0.0], [0.052, 0.004, 0.0], [0.078, 0.006, 0.0]];
    sweep(stem, 3, 6, |t| {
        let bowl = ((t - 0.66) / 0.34).clamp(0.0, 1.0);
        let wide = 0.0028 + 0.003 * (1.0 - t * 2.0).max(0.0) + 0.0105 * (bowl * (1.0 - bowl) * 4.0).max(0.0).sqrt();
        Vec2::new(wide, 0.0016)
    })
}

/// A cake on a footed plate: plate, cake, berries.
pub fn cake() -> (Shape, Shape, Shape) {
    let foot = profile([[0.075, 0.0], [0.05, 0.01], [0.018, 0.035], [0.02, 0.07], [0.06, 0.082], [0.15, 0.088]], 2);
    let plate = Shape::lathe(
        &[&[[0.0, 0.0], [0.075, 0.0]], &foot, &[[0.15, 0.088], [0.15, 0.094]], &[[0.15, 0.094], [0.0, 0.092]]],
        28,
    );
    let crust = profile([[0.108, 0.1], [0.12, 0.11], [0.122, 0.15], [0.114, 0.163], [0.1, 0.166]], 2);
    let cake =
        Shape::lathe(&[&[[0.0, 0.0925], [0.108, 0.0925], [0.108, 0.1]], &crust, &[[0.1, 0.166], [0.0, 0.168]]], 28);
    let berries = (0..13).map(|k| {
        let at = if k < 10 { circle(k as f32 / 10.0) * 0.09 } else { circle(k as f32 / 3.0) * 0.03 };
        Shape::sphere(8).scaled(Vec3::splat(0.0145)).moved(Vec3::new(at.x, 0.178, at.y))
    });
    (plate, cake, Shape::union(berries))
}

/// A bulbous vase.
pub fn vase() -> Shape {
    let body = profile([[0.03, 0.0], [0.052, 0.03], [0.05, 0.075], [0.022, 0.12], [0.021, 0.15], [0.032, 0.166]], 2);
    let inside = profile([[0.03, 0.166], [0.019, 0.15], [0.0, 0.14]], 2);
    Shape::lathe(&[&[[0.0, 0.0], [0.03, 0.0]], &body, &[[0.032, 0.166], [0.03, 0.166]], &inside], 18)
}

/// Five tulips standing in [`vase`]: stems, then blossoms.
pub fn tulips() -> (Shape, Shape) {
    let (mut stems, mut blossoms) = (Shape::default(), Shape::default());
    for k in 0..5 {
        let lean = circle(k as f32 / 5.0 + 0.07) * (0.05 + 0.012 * (k % 3) as f32);
        let tip = [lean.x * 1.7, 0.3 + 0.02 * (k % 2) as f32, lean.y * 1.7];
        stems.append(sweep(
            [[0.0, 0.1, 0.0], [lean.x * 0.4, 0.18, lean.y * 0.4], [lean.x, 0.25, lean.y], tip],
            2,
            5,
            |_| Vec2::splat(0.0032),
        ));
        let bud = profile([[0.0, -0.004], [0.016, 0.006], [0.021, 0.022], [0.015, 0.044], [0.004, 0.053]], 2);
        let bud = Shape::lathe(&[&bud, &[[0.004, 0.053], [0.0, 0.046]]], 9);
        blossoms.append(bud.turned_x(lean.y * 300.0).turned_z(-lean.x * 300.0).moved(Vec3::from(tip)));
    }
    (stems, blossoms)
}

/// The round table: top (texture from above), then the turned column and its feet. 0.76 m high, 1.3 m across.
pub fn table() -> (Shape, Shape) {
    let edge = profile([[0.6, 0.722], [0.645, 0.728], [0.65, 0.742], [0.642, 0.757], [0.625, 0.76]], 2);
    let top = Shape::lathe(&[&[[0.0, 0.722], [0.6, 0.722]], &edge, &[[0.625, 0.76], [0.0, 0.76]]], 40);
    let column = profile(
        [
            [0.085, 0.2],
            [0.06, 0.24],
            [0.042, 0.32],
            [0.062, 0.42],
            [0.07, 0.47],
            [0.045, 0.55],
            [0.045, 0.66],
            [0.12, 0.722],
        ],
        2,
    );
    let mut leg = Shape::lathe(&[&[[0.0, 0.2], [0.085, 0.2]], &column], 14);
    for k in 0..4 {
        let foot = sweep(
            [[0.02, 0.27, 0.0], [0.15, 0.25, 0.0], [0.28, 0.12, 0.0], [0.4, 0.025, 0.0], [0.46, 0.022, 0.0]],
            2,
            7,
            |t| Vec2::new(0.03 - 0.008 * t, 0.04 - 0.018 * t),
        );
        leg.append(foot.turned_y(45.0 + 90.0 * k as f32));
    }
    (top, leg)
}

/// A bentwood chair facing +Z: frame, then the seat.
pub fn chair() -> (Shape, Shape) {
    let round = |r: f32| move |_: f32| Vec2::splat(r);
    let hoop = |half: f32, high: f32, lean: f32| {
        sweep(
            [
                [half, 0.44, -0.17],
                [half * 1.03, 0.44 + high * 0.5, -0.17 - lean * 0.5],
                [half * 0.75, 0.44 + high * 0.92, -0.17 - lean * 0.93],
                [0.0, 0.44 + high, -0.17 - lean],
                [-half * 0.75, 0.44 + high * 0.92, -0.17 - lean * 0.93],
                [-half * 1.03, 0.44 + high * 0.5, -0.17 - lean * 0.5],
                [-half, 0.44, -0.17],
            ],
            2,
            6,
            round(0.0135),
        )
    };
    let mut frame = hoop(0.19, 0.46, 0.12).with(hoop(0.11, 0.34, 0.085));
    for x in [-1.0, 1.0] {
        frame.append(rod([[x * 0.15, 0.45, 0.15], [x * 0.19, 0.0, 0.2]], [0.017, 0.011], 6));
        frame.append(rod([[x * 0.185, 0.45, -0.165], [x * 0.2, 0.0, -0.23]], [0.0135, 0.011], 6));
    }
    let brace: Vec<Vec3> =
        (0..=18).map(|k| circle((k % 18) as f32 / 18.0) * 0.165).map(|c| Vec3::new(c.x, 0.22, c.y)).collect();
    frame.append(Shape::tube(&brace, round(0.009), 5, false));
    let rim = profile([[0.17, 0.43], [0.205, 0.435], [0.21, 0.45], [0.2, 0.463]], 1);
    let dish = profile([[0.2, 0.463], [0.12, 0.456], [0.0, 0.453]], 1);
    (frame, Shape::lathe(&[&[[0.0, 0.43], [0.17, 0.43]], &rim, &dish], 20))
}
