//! A small office: sun and sky through one window, a desk, shelves full of books, chairs, a plant. About 5,500
//! triangles.

use super::document::{Document, Material, Placement};
use super::kit::{self, Dice, block, rod, slab};
use super::office_furniture as furniture;
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Frame, Opening, Shape};

const LEFT: f32 = -2.5;
const RIGHT: f32 = 2.5;
const BACK: f32 = -2.0;
const FRONT: f32 = 2.5;
const HEIGHT: f32 = 2.75;
const WALL: f32 = 0.25;

pub fn office() -> Document {
    let mut document = Document::new("office");
    document.camera("main", [2.2, 1.5, 2.25], [-0.75, 0.95, -0.9], 56.0);
    document.camera("desk", [0.15, 1.35, 0.2], [-1.2, 0.82, -1.6], 50.0);
    document.camera("window", [1.6, 1.3, -1.2], [-2.5, 1.25, 0.1], 58.0);
    document.sun("sun", [0.62, -0.5, -0.3], [75.0, 66.0, 52.0]);
    shell(&mut document);
    window(&mut document);
    desk(&mut document);
    shelves(&mut document);
    seats(&mut document);
    small_things(&mut document);
    document
}

fn shell(document: &mut Document) {
    let boards = document.texture("oak boards", 256, kit::planks(8, [0.62, 0.46, 0.32], [0.82, 0.67, 0.5]));
    let floor = document.material("oak floor", Material::glossy(1.0, 1.0, 1.0, 0.55).textured(boards, 1.6));
    let plaster = document.material("plaster", Material::matte(0.78, 0.76, 0.71));
    let sage = document.material("sage wall", Material::matte(0.42, 0.5, 0.41));
    let paint = document.material("white paint", Material::matte(0.82, 0.81, 0.78));
    let [width, depth] = [RIGHT - LEFT, FRONT - BACK];
    let upright = |x: f32, z: f32, u: Vec3| Frame::new(Vec3::new(x, 0.0, z), u, Vec3::Y);
    let ground = Frame::new(Vec3::new(LEFT, 0.0, FRONT), Vec3::X, Vec3::NEG_Z);
    document.add("floor", floor, ground.wall(Vec2::new(width, depth), &[]));
    let above = Frame::new(Vec3::new(LEFT, HEIGHT, BACK), Vec3::X, Vec3::Z);
    document.add("ceiling", plaster, above.wall(Vec2::new(width, depth), &[]));
    document.add("back wall", sage, upright(LEFT, BACK, Vec3::X).wall(Vec2::new(width, HEIGHT), &[]));
    let (side, end) = (Vec2::new(depth, HEIGHT), Vec2::new(width, HEIGHT));
    let left = upright(LEFT, FRONT, Vec3::NEG_Z);
    let others = upright(RIGHT, BACK, Vec3::Z).wall(side, &[]).with(upright(RIGHT, FRONT, Vec3::NEG_X).wall(end, &[]));
    document.add("walls", plaster, others.with(left.wall(side, &[WINDOW])).with(left.reveal(&WINDOW, WALL, true)));
    // Against the walls, not into them: what lies beyond a wall stands in the sun.
    let skirting = [
        block([LEFT, RIGHT], [0.0, 0.09], [BACK, BACK + 0.016]),
        block([LEFT, LEFT + 0.016], [0.0, 0.09], [BACK, FRONT]),
        block([RIGHT - 0.016, RIGHT], [0.0, 0.09], [BACK, FRONT]),
    ];
    document.add("skirting", paint, Shape::union(skirting));
}

/// In the left wall; its frame runs from the front of the room to the back.
const WINDOW: Opening = Opening { low: Vec2::new(1.5, 0.875), high: Vec2::new(3.75, 2.375), arch_segments: 0 };

fn window(document: &mut Document) {
    let paint = document.material("window paint", Material::glossy(0.82, 0.82, 0.8, 0.4));
    let x = [LEFT - 0.16, LEFT - 0.11];
    let [near, far] = [FRONT - WINDOW.low.x, FRONT - WINDOW.high.x];
    let (low, high) = (WINDOW.low.y, WINDOW.high.y);
    let third = (near - far) / 3.0;
    let mut bars = Vec::new();
    for k in 0..4 {
        let z = far + third * k as f32;
        let half = if k == 0 || k == 3 { 0.045 } else { 0.025 };
        bars.push(slab(x, [low, high], [z - half, z + half], 0.006));
    }
    for (y, half) in [(low, 0.045), (high, 0.045), (low + 1.0, 0.02)] {
        bars.push(slab([x[0] + 0.004, x[1] - 0.004], [y - half, y + half], [far, near], 0.006));
    }
    bars.push(slab([LEFT - 0.24, LEFT + 0.06], [low - 0.015, low + 0.02], [far - 0.06, near + 0.06], 0.008));
    document.add("window frame", paint, Shape::union(bars));

    // A painted view far enough from the window that the sun passes above it.
    let view = document.texture("view", 128, outdoors);
    let sky = Material { emission_texture: Some(view), ..Material::light(11.0, 11.0, 11.0) };
    let sky = document.material("view", sky);
    let corners = [[-5.75, 0.4, 2.75], [-5.75, 0.4, -3.7], [-5.75, 3.25, -3.7], [-5.75, 3.25, 2.75]];
    let mut backdrop = Shape::quad(corners.map(Vec3::from));
    backdrop.uv = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from).to_vec();
    document.add("view", sky, backdrop);

    let ribs = (0..8).map(|k| {
        let z = far + 0.35 + 0.2 * k as f32;
        slab([LEFT + 0.03, LEFT + 0.11], [0.14, 0.72], [z, z + 0.16], 0.03)
    });
    let radiator = document.material("radiator", Material::glossy(0.78, 0.78, 0.75, 0.35));
    document.add("radiator", radiator, Shape::union(ribs));
}

/// Sky above hazy hills and a meadow, sRGB.
fn outdoors(x: f32, y: f32) -> [f32; 3] {
    let ridge = |height: f32, scale: i32, phase: f32| {
        let rough = kit::noise(x * scale as f32 + phase, 3.5, scale)
            + 0.5 * kit::noise(x * 2.0 * scale as f32, phase, 2 * scale);
        height - 0.09 * rough
    };
    if y > ridge(0.86, 5, 0.3) {
        let tone = 0.85 + 0.3 * kit::noise(x * 24.0, y * 40.0, 24);
        [0.34 * tone, 0.46 * tone, 0.22 * tone]
    } else if y > ridge(0.72, 4, 2.7) {
        [0.36, 0.49, 0.42]
    } else if y > ridge(0.62, 3, 5.1) {
        [0.52, 0.63, 0.68]
    } else {
        let cloud = (kit::noise(x * 6.0, y * 14.0, 6) * 1.6 - 0.75).clamp(0.0, 0.6);
        let blue = [0.5 + 0.34 * y, 0.69 + 0.2 * y, 0.9 + 0.04 * y];
        blue.map(|c| c + (0.97 - c) * cloud)
    }
}

fn desk(document: &mut Document) {
    let grain = document.texture("walnut", 128, kit::planks(2, [0.3, 0.18, 0.11], [0.46, 0.3, 0.19]));
    let walnut = document.material("walnut", Material::glossy(1.0, 1.0, 1.0, 0.4).textured(grain, 0.8));
    let steel = document.material("dark steel", Material::metal(0.35, 0.35, 0.37, 0.45));
    let black = document.material("black plastic", Material::glossy(0.04, 0.04, 0.045, 0.4));
    let screen = Material { roughness: 0.25, ..Material::light(0.6, 0.8, 1.0) };
    let screen = document.material("screen", Material { color: [0.03; 3], ..screen });
    let paper = document.material("paper", Material::matte(0.82, 0.81, 0.77));
    let red = document.material("red lacquer", Material::glossy(0.62, 0.09, 0.05, 0.3));
    let blue = document.material("blue glaze", Material::glossy(0.12, 0.3, 0.48, 0.3));

    let desk = [(walnut, furniture::desk_wood()), (steel, furniture::desk_steel())];
    let mesh = document.mesh("desk", &desk);
    document.place("desk", mesh, Placement::at(-0.95, 0.0, -1.5));
    let (stand, panel) = furniture::monitor();
    let mesh = document.mesh("monitor", &[(black, stand), (screen, panel)]);
    document.place("monitor", mesh, Placement::at(-0.9, 0.75, -1.68).turned(6.0));
    let keys = slab([-0.21, 0.21], [0.0, 0.018], [-0.065, 0.065], 0.006);
    let mouse = Shape::sphere(12).scaled(Vec3::new(0.03, 0.028, 0.052)).moved(Vec3::new(0.3, 0.0, 0.0));
    let mesh = document.mesh("keyboard", &[(black, keys.with(mouse))]);
    document.place("keyboard", mesh, Placement::at(-0.92, 0.75, -1.33).turned(3.0));
    let mesh = document.mesh("mug", &[(blue, furniture::mug())]);
    document.place("mug", mesh, Placement::at(-0.38, 0.75, -1.38).turned(-40.0));
    let mesh = document.mesh("desk lamp", &[(red, furniture::desk_lamp())]);
    document.place("desk lamp", mesh, Placement::at(-1.5, 0.75, -1.72).turned(-35.0));
    document.spot_light("desk lamp bulb", [-1.31, 1.1, -1.58], [-1.2, 0.75, -1.46], [3.0, 2.3, 1.4], [35.0, 62.0]);
    let sheets = [(-0.05, 0.0, 12.0), (0.02, 0.004, -7.0), (0.0, 0.008, 25.0)];
    let stack = sheets.map(|(x, y, turn)| {
        block([-0.105, 0.105], [y, y + 0.004], [-0.148, 0.148]).turned_y(turn).moved(Vec3::new(x, 0.0, 0.0))
    });
    let mesh = document.mesh("papers", &[(paper, Shape::union(stack))]);
    document.place("papers", mesh, Placement::at(-1.42, 0.75, -1.28));
}

fn shelves(document: &mut Document) {
    let wood = document.material("birch", Material::matte(0.66, 0.53, 0.38));
    let mesh = document.mesh("shelf", &[(wood, furniture::shelf())]);
    document.place("shelf", mesh, Placement::at(1.35, 0.0, BACK + 0.02));
    let covers = [
        ("dark red cloth", [0.4, 0.07, 0.06]),
        ("navy cloth", [0.07, 0.12, 0.28]),
        ("green cloth", [0.12, 0.28, 0.17]),
        ("ochre cloth", [0.66, 0.46, 0.14]),
        ("cream cloth", [0.75, 0.69, 0.55]),
        ("grey cloth", [0.3, 0.32, 0.34]),
    ];
    let mut piles: Vec<Shape> = covers.iter().map(|_| Shape::default()).collect();
    furniture::books(&mut Dice::new(7), &mut piles);
    for ((name, [r, g, b]), pile) in covers.into_iter().zip(piles) {
        let cloth = document.material(name, Material::matte(r, g, b));
        let mesh = document.mesh(name, &[(cloth, pile)]);
        document.place(&format!("books in {name}"), mesh, Placement::at(1.35, 0.0, BACK + 0.02));
    }
    let clay = document.material("clay", Material::matte(0.58, 0.32, 0.2));
    let vase = document.mesh("vase", &[(clay, furniture::vase())]);
    document.place("vase", vase, Placement::at(1.95, 1.74, BACK + 0.18));
}

fn seats(document: &mut Document) {
    let fabric = document.material("petrol fabric", Material::matte(0.07, 0.24, 0.28));
    let frame = document.material("chair frame", Material::metal(0.5, 0.5, 0.52, 0.35));
    let (soft, hard) = furniture::office_chair();
    let mesh = document.mesh("office chair", &[(fabric, soft), (frame, hard)]);
    document.place("office chair", mesh, Placement::at(-0.75, 0.0, -0.62).turned(155.0));
    let mustard = document.material("mustard fabric", Material::matte(0.68, 0.42, 0.09));
    let legs = document.material("beech", Material::glossy(0.6, 0.43, 0.26, 0.5));
    let (soft, hard) = furniture::easy_chair();
    let mesh = document.mesh("easy chair", &[(mustard, soft), (legs, hard)]);
    document.place("easy chair", mesh, Placement::at(-1.55, 0.0, 0.95).turned(62.0));
    let rug = document.material("rug", Material::matte(0.5, 0.17, 0.12));
    let border = document.material("rug border", Material::matte(0.7, 0.6, 0.44));
    let base = slab([-1.15, 1.15], [0.0, 0.01], [-0.8, 0.8], 0.003);
    let top = slab([-1.0, 1.0], [0.005, 0.013], [-0.65, 0.65], 0.003);
    let mesh = document.mesh("rug", &[(border, base), (rug, top)]);
    document.place("rug", mesh, Placement::at(0.0, 0.0, 0.75).turned(-4.0));
}

fn small_things(document: &mut Document) {
    let leaf = Material { double_sided: true, ..Material::glossy(0.1, 0.3, 0.08, 0.5) };
    let leaf = document.material("leaf", leaf);
    let pot = document.material("white pot", Material::glossy(0.78, 0.77, 0.74, 0.4));
    let soil = document.material("soil", Material::matte(0.09, 0.06, 0.04));
    let (leaves, vessel, earth) = furniture::plant(&mut Dice::new(3));
    let mesh = document.mesh("plant", &[(leaf, leaves), (pot, vessel), (soil, earth)]);
    document.place("plant", mesh, Placement::at(0.35, 0.0, -1.66));

    let frame = document.material("picture frame", Material::glossy(0.05, 0.045, 0.04, 0.4));
    let art = document.texture("picture", 64, |x, y| {
        let sun = (Vec2::new(x, y) - Vec2::new(0.62, 0.36)).length() < 0.17;
        let land = y > 0.62 + 0.1 * (kit::noise(x * 3.0, 1.0, 3) - 0.5);
        if land {
            [0.16, 0.3, 0.38]
        } else if sun {
            [0.87, 0.38, 0.2]
        } else {
            [0.92, 0.86, 0.74]
        }
    });
    let art = document.material("picture", Material::matte(1.0, 1.0, 1.0).textured(art, 1.0));
    let edge = slab([-1.42, -0.68], [1.42, 2.16], [BACK - 0.01, BACK + 0.025], 0.006);
    document.add("picture frame", frame, edge);
    let z = BACK + 0.026;
    let mut canvas =
        Shape::quad([[-1.39, 1.45, z], [-0.71, 1.45, z], [-0.71, 2.13, z], [-1.39, 2.13, z]].map(Vec3::from));
    canvas.uv = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from).to_vec();
    document.add("picture", art, canvas);

    let wire =
        document.material("wire basket", Material { double_sided: true, ..Material::metal(0.4, 0.4, 0.42, 0.5) });
    let basket = Shape::lathe(&[&[[0.11, 0.01], [0.15, 0.3]], &[[0.0, 0.01], [0.11, 0.01]]], 20);
    let mesh = document.mesh("basket", &[(wire, basket)]);
    document.place("basket", mesh, Placement::at(-0.1, 0.0, -1.05));

    // A ceiling lamp, dimmed.
    let shade = document.material("lamp shade", Material { double_sided: true, ..Material::matte(0.75, 0.72, 0.66) });
    let glow = document.material("lamp glass", Material::light(6.0, 5.0, 3.6));
    let cord = document.material("cord", Material::matte(0.05, 0.05, 0.05));
    document.add("lamp cord", cord, rod([[0.4, 2.3, 0.3], [0.4, HEIGHT, 0.3]], [0.006, 0.006], 6));
    let cone: &[[f32; 2]] = &[[0.26, 0.0], [0.24, 0.1], [0.16, 0.18], [0.03, 0.23]];
    let lamp = [(shade, Shape::lathe(&[cone], 24)), (glow, Shape::sphere(12).scaled(Vec3::splat(0.07)))];
    let lamp = lamp.map(|(material, shape)| (material, shape.moved(Vec3::new(0.4, 2.1, 0.3))));
    let mesh = document.mesh("lamp", &lamp);
    document.place("lamp", mesh, Placement::at(0.0, 0.0, 0.0));
}
