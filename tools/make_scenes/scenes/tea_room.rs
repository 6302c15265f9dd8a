//! A tea room: pots of silver, copper and glazed clay on a round table, tall windows, a lamp above. About 12,000
//! vertices once every instance is placed.

use super::document::{Document, Material, Placement};
use super::kit::{self, block, plan_uv, profile, rod, slab};
use super::tea_things as things;
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Frame, Opening, Shape, sin_cos};

const HALF_WIDTH: f32 = 3.0;
const BACK: f32 = -2.5;
const FRONT: f32 = 3.0;
const HEIGHT: f32 = 3.0;
const WALL: f32 = 0.25;
const DADO: f32 = 1.0;

pub fn tea_room() -> Document {
    let mut document = Document::new("tea-room");
    document.camera("main", [1.4, 1.5, 1.7], [-0.1, 0.8, -0.2], 44.0);
    document.camera("table", [0.62, 1.12, 0.82], [-0.06, 0.83, -0.04], 42.0);
    document.camera("room", [-2.6, 1.8, 2.7], [0.5, 0.95, -0.8], 58.0);
    shell(&mut document);
    windows(&mut document);
    table(&mut document);
    sideboard(&mut document);
    lamp(&mut document);
    document
}

fn shell(document: &mut Document) {
    let tiles = document.texture("tiles", 256, kit::checker([0.84, 0.79, 0.7], [0.45, 0.25, 0.19], [0.5, 0.46, 0.41]));
    let floor = document.material("tile floor", Material::glossy(1.0, 1.0, 1.0, 0.35).textured(tiles, 0.8));
    let cream = document.material("cream wall", Material::matte(0.78, 0.7, 0.56));
    let panel = document.material("teal panelling", Material::glossy(0.09, 0.24, 0.26, 0.5));
    let white = document.material("ceiling white", Material::matte(0.82, 0.8, 0.76));
    let [width, depth] = [2.0 * HALF_WIDTH, FRONT - BACK];
    let x = HALF_WIDTH;
    let ground = Frame::new(Vec3::new(-x, 0.0, FRONT), Vec3::X, Vec3::NEG_Z);
    document.add("floor", floor, ground.wall(Vec2::new(width, depth), &[]));
    let above = Frame::new(Vec3::new(-x, HEIGHT, BACK), Vec3::X, Vec3::Z);
    document.add("ceiling", white, above.wall(Vec2::new(width, depth), &[]));

    let upright = |x: f32, y: f32, z: f32, u: Vec3| Frame::new(Vec3::new(x, y, z), u, Vec3::Y);
    let (mut upper, mut lower) = (Shape::default(), Shape::default());
    for (corner, u, length) in
        [([-x, FRONT], Vec3::NEG_Z, depth), ([x, BACK], Vec3::Z, depth), ([x, FRONT], Vec3::NEG_X, width)]
    {
        upper.append(upright(corner[0], DADO, corner[1], u).wall(Vec2::new(length, HEIGHT - DADO), &[]));
        lower.append(upright(corner[0], 0.0, corner[1], u).wall(Vec2::new(length, DADO), &[]));
    }
    let back = upright(-x, 0.0, BACK, Vec3::X);
    lower.append(back.wall(Vec2::new(width, DADO), &[]));
    // The back wall above the panelling: three bays, each with a window.
    for k in 0..3 {
        let bay = upright(-x + width / 3.0 * k as f32, DADO, BACK, Vec3::X);
        upper.append(bay.arched_wall(Vec2::new(width / 3.0, HEIGHT - DADO), &WINDOW));
        upper.append(bay.reveal(&WINDOW, WALL, true));
    }
    document.add("walls", cream, upper);
    document.add("panelling", panel, lower);

    let rail = |x: [f32; 2], z: [f32; 2]| slab(x, [DADO - 0.03, DADO + 0.025], z, 0.01).with(block(x, [0.0, 0.11], z));
    let t = 0.025;
    let mut trim = Shape::union([
        rail([-x, x], [BACK - 0.02, BACK + t]),
        rail([-x - 0.02, -x + t], [BACK, FRONT]),
        rail([x - t, x + 0.02], [BACK, FRONT]),
    ]);
    for k in 0..=12 {
        let at = -x + 0.5 * k as f32;
        trim.append(slab([at - 0.04, at + 0.04], [0.1, DADO], [BACK - 0.02, BACK + 0.015], 0.005));
    }
    document.add("trim", panel, trim);
}

/// Within a bay of two metres, above the panelling.
const WINDOW: Opening = Opening { low: Vec2::new(0.45, 0.12), high: Vec2::new(1.55, 1.2), arch_segments: 12 };

fn windows(document: &mut Document) {
    let daylight = document.material("frosted daylight", Material::light(6.6, 7.5, 8.7));
    let paint = document.material("window paint", Material::glossy(0.8, 0.79, 0.75, 0.4));
    let cloth = Material { double_sided: true, ..Material::matte(0.66, 0.3, 0.2) };
    let cloth = document.material("curtain", cloth);
    let brass = document.material("brass", Material::metal(0.83, 0.65, 0.3, 0.3));
    let bay = Frame::new(Vec3::new(0.0, DADO, BACK - WALL), Vec3::X, Vec3::Y);
    let z = [BACK - 0.2, BACK - 0.165];
    let (low, high) = (DADO + WINDOW.low.y, DADO + WINDOW.high.y);
    let middle = (WINDOW.low.x + WINDOW.high.x) * 0.5;
    let bars = Shape::union([
        slab([middle - 0.02, middle + 0.02], [low, high + 0.55], z, 0.006),
        slab([WINDOW.low.x, WINDOW.high.x], [high - 0.02, high + 0.02], [z[0] + 0.002, z[1] - 0.002], 0.006),
        slab([WINDOW.low.x, WINDOW.high.x], [low + 0.53, low + 0.56], [z[0] + 0.002, z[1] - 0.002], 0.006),
        slab([WINDOW.low.x - 0.05, WINDOW.high.x + 0.05], [low - 0.03, low + 0.01], [BACK - 0.24, BACK + 0.07], 0.01),
    ]);
    let window = document.mesh("window", &[(daylight, bay.pane(&WINDOW)), (paint, bars)]);
    let curtains = curtain(0.18, 0.46).with(curtain(1.54, 1.82));
    let pole = rod([[0.12, 2.86, BACK + 0.09], [1.88, 2.86, BACK + 0.09]], [0.014, 0.014], 8);
    let drapery = document.mesh("drapery", &[(cloth, curtains), (brass, pole)]);
    for k in 0..3 {
        let at = Placement::at(-HALF_WIDTH + 2.0 * k as f32, 0.0, 0.0);
        document.place(&format!("window {}", k + 1), window, at);
        document.place(&format!("drapery {}", k + 1), drapery, at);
    }
}

/// A gathered curtain between two x, from the pole to the panelling.
fn curtain(left: f32, right: f32) -> Shape {
    const FOLDS: usize = 20;
    let mut cloth = Shape::default();
    for (row, y) in [2.86, 2.2, 1.6, DADO - 0.12].into_iter().enumerate() {
        for i in 0..=FOLDS {
            let t = i as f32 / FOLDS as f32;
            let (wave, _) = sin_cos(t * 4.0 + 0.06 * row as f32);
            let depth = (0.03 + 0.008 * row as f32) * wave;
            cloth.vertex(Vec3::new(left + (right - left) * t, y, BACK + 0.09 + depth), Vec3::Z, Vec2::ZERO);
        }
    }
    let width = FOLDS as u32 + 1;
    for (row, i) in (0..3).flat_map(|row| (0..FOLDS as u32).map(move |i| (row, i))) {
        let a = row * width + i;
        cloth.quad_of([a + width, a + width + 1, a + 1, a]);
    }
    cloth.smoothed()
}

fn table(document: &mut Document) {
    let grain = document.texture("cherry", 128, kit::planks(4, [0.46, 0.24, 0.13], [0.62, 0.37, 0.21]));
    let cherry = document.material("cherry", Material::glossy(1.0, 1.0, 1.0, 0.3).textured(grain, 0.7));
    let dark = document.material("dark wood", Material::glossy(0.14, 0.065, 0.035, 0.35));
    let cane = document.material("cane seat", Material::matte(0.62, 0.47, 0.28));
    let silver = document.material("silver", Material::metal(0.84, 0.83, 0.8, 0.16));
    let glaze = document.material("celadon glaze", Material::glossy(0.12, 0.42, 0.4, 0.15));
    let china = document.material("china", Material::glossy(0.83, 0.82, 0.78, 0.2));
    let tea = document.material("tea", Material::glossy(0.28, 0.09, 0.02, 0.05));
    let sponge = document.material("cake", Material::matte(0.72, 0.5, 0.25));
    let berry = document.material("berries", Material::glossy(0.55, 0.03, 0.05, 0.25));
    let stem = document.material("stems", Material::matte(0.16, 0.36, 0.1));
    let petal = document.material("petals", Material::matte(0.8, 0.22, 0.3));
    let indigo = document.material("indigo glass", Material::glossy(0.06, 0.1, 0.32, 0.12));

    let (top, leg) = things::table();
    let mesh = document.mesh("table", &[(cherry, plan_uv(top)), (dark, leg)]);
    document.place("table", mesh, Placement::at(0.0, 0.0, 0.0));
    let (frame, seat) = things::chair();
    let mesh = document.mesh("chair", &[(dark, frame), (cane, seat)]);
    for (k, (x, z, turn)) in [(-0.62, -0.62, 45.0), (0.72, -0.6, -52.0), (-0.78, 0.52, 118.0)].into_iter().enumerate() {
        document.place(&format!("chair {}", k + 1), mesh, Placement::at(x, 0.0, z).turned(turn));
    }

    const Y: f32 = 0.76;
    let mesh = document.mesh("silver teapot", &[(silver, things::teapot())]);
    document.place("silver teapot", mesh, Placement::at(0.1, Y, 0.13).turned(205.0));
    let glazed = document.repainted("glazed teapot", mesh, glaze);
    document.place("glazed teapot", glazed, Placement::at(-0.2, Y, -0.24).turned(-30.0).scaled(1.15));
    let (cup, drink) = things::cup();
    let cup = document.mesh("cup", &[(china, cup), (tea, drink)]);
    let spoon = document.mesh("spoon", &[(silver, things::spoon())]);
    for (k, (x, z, turn)) in
        [(-0.31, 0.28, 30.0), (0.4, -0.18, 140.0), (0.2, -0.4, -80.0), (0.33, 0.36, -35.0)].into_iter().enumerate()
    {
        document.place(&format!("cup {}", k + 1), cup, Placement::at(x, Y, z).turned(turn));
        document.place(&format!("spoon {}", k + 1), spoon, Placement::at(x - 0.03, Y, z + 0.105).turned(turn * 0.3));
    }
    let (plate, cake, berries) = things::cake();
    let mesh = document.mesh("cake", &[(china, plate), (sponge, cake), (berry, berries)]);
    document.place("cake", mesh, Placement::at(-0.36, Y, 0.02).turned(15.0).scaled(0.85));
    let (stems, blossoms) = things::tulips();
    let mesh = document.mesh("tulips", &[(indigo, things::vase()), (stem, stems), (petal, blossoms)]);
    document.place("tulips", mesh, Placement::at(0.08, Y, -0.13).turned(20.0));
}

fn sideboard(document: &mut Document) {
    let oak = document.material("oak", Material::glossy(0.42, 0.25, 0.12, 0.4));
    let copper = document.material("copper", Material::metal(0.88, 0.5, 0.34, 0.22));
    let china = document.material("blue china", Material::glossy(0.3, 0.42, 0.62, 0.2));
    let x = HALF_WIDTH;
    let mut chest = slab([x - 0.5, x - 0.03], [0.12, 0.82], [-1.9, -0.3], 0.012);
    chest.append(slab([x - 0.54, x - 0.025], [0.82, 0.86], [-1.96, -0.24], 0.012));
    for z in [-1.84, -0.42] {
        chest.append(block([x - 0.46, x - 0.4], [0.0, 0.12], [z, z + 0.06]));
    }
    for k in 0..3 {
        let z = -1.85 + 0.51 * k as f32;
        chest.append(slab([x - 0.515, x - 0.49], [0.17, 0.78], [z, z + 0.48], 0.01));
    }
    document.add("sideboard", oak, chest);
    let mesh = document.mesh("copper pot", &[(copper, things::tall_pot())]);
    document.place("copper pot", mesh, Placement::at(x - 0.28, 0.86, -0.7).turned(120.0).scaled(1.2));
    let plate = profile([[0.0, 0.0], [0.07, 0.0], [0.115, 0.018]], 1);
    let over = profile([[0.115, 0.021], [0.07, 0.008], [0.0, 0.006]], 1);
    let plate = Shape::lathe(&[&plate, &[[0.115, 0.018], [0.115, 0.021]], &over], 20);
    let mesh = document.mesh("plate", &[(china, plate)]);
    for k in 0..4 {
        document.place(&format!("plate {}", k + 1), mesh, Placement::at(x - 0.3, 0.862 + 0.009 * k as f32, -1.45));
    }
}

fn lamp(document: &mut Document) {
    let enamel = document.material("green enamel", Material::glossy(0.05, 0.19, 0.13, 0.25));
    let lining = document.material("white enamel", Material::matte(0.82, 0.8, 0.75));
    let bulb = document.material("bulb", Material::light(160.0, 120.0, 74.0));
    let cord = document.material("cord", Material::matte(0.04, 0.04, 0.04));
    let [outside, inside] = [0.0, 0.006]
        .map(|t| profile([[0.21 - t, 0.0], [0.19 - t, 0.06], [0.12 - t, 0.12], [0.045 - t * 0.5, 0.16 - t]], 2));
    let inside: Vec<[f32; 2]> = inside.into_iter().rev().collect();
    let neck = [[0.045, 0.16], [0.03, 0.2], [0.0, 0.205]];
    let shade = Shape::lathe(&[&outside, &neck], 24);
    let lining_shape = Shape::lathe(&[&[[0.0, 0.15], [0.042, 0.154]], &inside, &[[0.204, 0.0], [0.21, 0.0]]], 24);
    let glass = Shape::sphere(12).scaled(Vec3::splat(0.04)).moved(Vec3::new(0.0, 0.075, 0.0));
    let mesh = document.mesh("lamp", &[(enamel, shade), (lining, lining_shape), (bulb, glass)]);
    document.place("lamp", mesh, Placement::at(0.0, 1.72, 0.0));
    document.add("lamp cord", cord, rod([[0.0, 1.92, 0.0], [0.0, HEIGHT, 0.0]], [0.005, 0.005], 6));
    document.spot_light("fill", [2.6, 2.7, 2.7], [0.0, 0.8, 0.0], [20.0, 17.0, 13.0], [25.0, 42.0]);
}
