//! A basilica: six bays of round arches on columns, two aisles with stained glass, a barrel vault, an apse. Sun through
//! the open clerestory on the south side (+X), painted glass and candles elsewhere. The nave runs along -Z.

use super::church_parts as parts;
use super::document::{Document, Material, Placement};
use super::kit::{self, slab};
use glam::{Vec2, Vec3};
use linklight::scene::shapes::{Frame, Opening, Shape, circle};

const BAYS: usize = 6;
const BAY: f32 = 4.0;
const LENGTH: f32 = BAY * BAYS as f32;
const NAVE: f32 = 3.5;
const WALL: f32 = 0.75;
const AISLE: f32 = 7.25;
const AISLE_HEIGHT: f32 = 5.75;
const SPRING: f32 = 3.5;
const CLERESTORY: f32 = 6.0;
const VAULT: f32 = 9.5;
const VAULT_STEPS: usize = 20;

const ARCADE: Opening = Opening { low: Vec2::new(0.55, 0.0), high: Vec2::new(3.45, 0.0), arch_segments: 16 };
const HIGH_WINDOW: Opening = Opening { low: Vec2::new(1.1, 0.4), high: Vec2::new(2.9, 2.0), arch_segments: 12 };
const AISLE_WINDOW: Opening = Opening { low: Vec2::new(1.3, 1.5), high: Vec2::new(2.7, 3.6), arch_segments: 12 };
const APSE_WINDOW: Opening = Opening { low: Vec2::new(0.55, 2.4), high: Vec2::new(1.3, 4.6), arch_segments: 12 };

const APSE: f32 = 3.0;
const APSE_SPRING: f32 = 6.375;
const APSE_SIDES: usize = 5;

struct Palette {
    stone: usize,
    warm: usize,
    vault: usize,
    glass: usize,
    sky: usize,
}

pub fn church() -> Document {
    let mut document = Document::new("church");
    document.camera("main", [1.1, 2.0, -1.6], [-0.45, 3.6, -14.0], 64.0);
    document.camera("aisle", [-6.1, 1.8, -1.2], [-3.4, 2.3, -12.0], 58.0);
    document.camera("apse", [1.6, 2.2, -15.5], [-0.3, 3.4, -25.0], 60.0);
    document.camera("west", [0.0, 3.2, -22.5], [0.4, 4.4, -8.0], 66.0);
    document.sun("sun", [-0.85, -1.0, -0.3], [150.0, 128.0, 96.0]);
    let painted = document.texture("stained glass", 128, parts::stained_glass);
    let glass = Material { emission_texture: Some(painted), ..Material::light(14.0, 14.0, 14.0) };
    let palette = Palette {
        stone: document.material("limestone", Material::matte(0.68, 0.63, 0.54)),
        warm: document.material("sandstone", Material::matte(0.6, 0.46, 0.33)),
        vault: document.material("vault plaster", Material::matte(0.74, 0.71, 0.65)),
        glass: document.material("stained glass", glass),
        sky: document.material("clear glass", Material::light(3.4, 4.3, 5.6)),
    };
    floor(&mut document);
    bays(&mut document, &palette);
    vault(&mut document, &palette);
    ends(&mut document, &palette);
    apse(&mut document, &palette);
    furnish(&mut document);
    sky(&mut document);
    document
}

/// What is seen through the open windows: a far panel below the sun's rays and one above them, tilted as the rays are.
fn sky(document: &mut Document) {
    let blue = document.material("sky", Material { unlit: true, ..Material::matte(0.62, 0.78, 1.0) });
    let [near, far] = [3.0, -LENGTH - 4.0];
    let panel = |a: [f32; 2], b: [f32; 2]| {
        Shape::quad([[a[0], a[1], near], [a[0], a[1], far], [b[0], b[1], far], [b[0], b[1], near]].map(Vec3::from))
    };
    let high = panel([NAVE + WALL + 5.2, 15.3], [NAVE + WALL + 0.1, 9.3]);
    document.add("sky", blue, panel([9.0, 4.0], [9.0, 11.6]).flipped().with(high));
}

fn floor(document: &mut Document) {
    let slabs =
        document.texture("stone slabs", 256, kit::checker([0.72, 0.68, 0.61], [0.47, 0.43, 0.39], [0.33, 0.3, 0.27]));
    let stone = document.material("stone floor", Material::glossy(1.0, 1.0, 1.0, 0.45).textured(slabs, 2.0));
    let carpet = document.material("carpet", Material::matte(0.42, 0.06, 0.05));
    let ground = Frame::new(Vec3::new(-AISLE, 0.0, 0.0), Vec3::X, Vec3::NEG_Z);
    document.add("floor", stone, ground.wall(Vec2::new(2.0 * AISLE, LENGTH + APSE), &[]));
    document.add("carpet", carpet, slab([-0.6, 0.6], [0.0, 0.012], [-20.4, -2.0], 0.004));
}

/// Everything that repeats: both arcades, aisles, columns.
fn bays(document: &mut Document, palette: &Palette) {
    let up = |x: f32, y: f32, z: f32, u: Vec3| Frame::new(Vec3::new(x, y, z), u, Vec3::Y);
    let stained = |frame: &Frame, depth: f32, window: &Opening| {
        let behind = Frame { origin: frame.origin - frame.normal() * depth, ..*frame };
        let mut pane = behind.pane(window);
        let (low, width) = (window.low, window.high.x - window.low.x);
        let height = window.high.y - low.y + width * 0.5;
        pane.uv.iter_mut().for_each(|t| *t = Vec2::new((t.x - low.x) / width, 1.0 - (-t.y - low.y) / height));
        pane
    };
    // One bay of the north side, whose walls look towards +X and +Z is to the left; the south side is its mirror.
    let (mut stone, mut warm, mut plaster) = (Shape::default(), Shape::default(), Shape::default());
    let arcade = up(-NAVE, SPRING, 0.0, Vec3::NEG_Z);
    let size = Vec2::new(BAY, CLERESTORY - SPRING);
    stone.append(arcade.arched_wall(size, &ARCADE));
    warm.append(arcade.reveal(&ARCADE, WALL, false));
    let high = up(-NAVE, CLERESTORY, 0.0, Vec3::NEG_Z);
    stone.append(high.arched_wall(Vec2::new(BAY, VAULT - CLERESTORY), &HIGH_WINDOW));
    warm.append(high.reveal(&HIGH_WINDOW, WALL, true));
    let behind = up(-NAVE - WALL, SPRING, -BAY, Vec3::Z);
    plaster.append(behind.arched_wall(Vec2::new(BAY, AISLE_HEIGHT - SPRING), &ARCADE));
    let outer = up(-AISLE, 0.0, 0.0, Vec3::NEG_Z);
    plaster.append(outer.arched_wall(Vec2::new(BAY, AISLE_HEIGHT), &AISLE_WINDOW));
    warm.append(outer.reveal(&AISLE_WINDOW, 0.5, true));
    let overhead = Frame::new(Vec3::new(-AISLE, AISLE_HEIGHT, -BAY), Vec3::X, Vec3::Z);
    plaster.append(overhead.wall(Vec2::new(AISLE - NAVE - WALL, BAY), &[]));
    warm.append(slab([-NAVE - 0.04, -NAVE + 0.09], [CLERESTORY - 0.12, CLERESTORY + 0.08], [-BAY, 0.0], 0.03));
    warm.append(slab([-NAVE - 0.04, -NAVE + 0.12], [VAULT - 0.16, VAULT + 0.04], [-BAY, 0.0], 0.03));
    let clear = Frame { origin: high.origin - high.normal() * (WALL - 0.1), ..high }.pane(&HIGH_WINDOW);
    let glass = stained(&outer, 0.4, &AISLE_WINDOW);

    let mirrored = |shape: &Shape| shape.clone().scaled(Vec3::new(-1.0, 1.0, 1.0));
    let south = [
        (palette.stone, mirrored(&stone)),
        (palette.warm, mirrored(&warm)),
        (palette.vault, mirrored(&plaster)),
        (palette.glass, mirrored(&glass)),
    ];
    let south = document.mesh("south bay", &south);
    let north = [
        (palette.stone, stone),
        (palette.warm, warm),
        (palette.vault, plaster),
        (palette.glass, glass),
        (palette.sky, clear),
    ];
    let north = document.mesh("north bay", &north);
    for k in 0..BAYS {
        let at = Placement::at(0.0, 0.0, -BAY * k as f32);
        document.place(&format!("north bay {}", k + 1), north, at);
        document.place(&format!("south bay {}", k + 1), south, at);
    }
    let column = document.mesh("column", &[(palette.stone, parts::column(SPRING + 0.02, WALL))]);
    let shaft = document.mesh("shaft", &[(palette.warm, parts::shaft(SPRING + 0.05, VAULT - 0.1))]);
    for k in 0..=BAYS {
        let z = -BAY * k as f32;
        for (side, x) in [("north", -NAVE - WALL * 0.5), ("south", NAVE + WALL * 0.5)] {
            document.place(&format!("{side} column {}", k + 1), column, Placement::at(x, 0.0, z));
        }
        if k > 0 && k < BAYS {
            document.place(&format!("north shaft {k}"), shaft, Placement::at(-NAVE, 0.0, z));
            document.place(&format!("south shaft {k}"), shaft, Placement::at(NAVE, 0.0, z));
        }
    }
}

fn vault(document: &mut Document, palette: &Palette) {
    let mut shell = Shape::default();
    for row in 0..=BAYS {
        for i in 0..=VAULT_STEPS {
            let around = circle(0.5 * i as f32 / VAULT_STEPS as f32);
            let at = Vec3::new(around.x * NAVE, VAULT + around.y * NAVE, -BAY * row as f32);
            shell.vertex(at, Vec3::new(-around.x, -around.y, 0.0), Vec2::ZERO);
        }
    }
    let width = VAULT_STEPS as u32 + 1;
    for (row, i) in (0..BAYS as u32).flat_map(|row| (0..VAULT_STEPS as u32).map(move |i| (row, i))) {
        let a = row * width + i;
        shell.quad_of([a, a + 1, a + width + 1, a + width]);
    }
    document.add("barrel vault", palette.vault, shell);
    let rib = document.mesh("rib", &[(palette.warm, parts::rib(NAVE, 0.2, 0.4, VAULT_STEPS))]);
    for k in 0..=BAYS {
        document.place(&format!("rib {}", k + 1), rib, Placement::at(0.0, VAULT, -BAY * k as f32));
    }
}

/// The half disc that closes the vault, with its centre at the springing line, facing +Z.
fn lunette() -> Shape {
    let rim: Vec<Vec3> =
        (0..=VAULT_STEPS).map(|i| (circle(0.5 * i as f32 / VAULT_STEPS as f32) * NAVE).extend(0.0)).collect();
    Shape::polygon(&rim).moved(Vec3::Y * VAULT)
}

fn ends(document: &mut Document, palette: &Palette) {
    let up = |x: f32, z: f32, u: Vec3| Frame::new(Vec3::new(x, 0.0, z), u, Vec3::Y);
    let west = up(AISLE, 0.0, Vec3::NEG_X).wall(Vec2::new(2.0 * AISLE, VAULT), &[]);
    document.add("west wall", palette.stone, west.with(lunette().turned_y(180.0)));
    let rose = document.texture("rose", 128, parts::rose);
    let rose = Material { emission_texture: Some(rose), ..Material::light(16.0, 16.0, 16.0) };
    let rose = document.material("rose window", rose);
    let (pane, frame) = parts::rose_window(1.7);
    let mesh = document.mesh("rose window", &[(rose, pane), (palette.warm, frame)]);
    document.place("rose window", mesh, Placement::at(0.0, 8.6, 0.0).turned(180.0));
    let door = document.material("oak door", Material::matte(0.2, 0.11, 0.06));
    document.add("west door", door, slab([-1.1, 1.1], [0.0, 3.0], [-0.08, 0.02], 0.02));

    let mut east = up(-NAVE, -LENGTH, Vec3::X).arched_wall(Vec2::new(2.0 * NAVE, VAULT), &chancel());
    east.append(lunette().moved(Vec3::NEG_Z * LENGTH));
    for x in [-AISLE, NAVE] {
        east.append(up(x, -LENGTH, Vec3::X).wall(Vec2::new(AISLE - NAVE, AISLE_HEIGHT), &[]));
    }
    document.add("east wall", palette.stone, east);
}

fn chancel() -> Opening {
    Opening::arched(Vec2::new(NAVE - APSE, 0.0), Vec2::new(NAVE + APSE, APSE_SPRING), 16)
}

fn apse(document: &mut Document, palette: &Palette) {
    let corner = |k: usize| {
        let around = circle(0.5 - 0.5 * k as f32 / APSE_SIDES as f32) * APSE;
        Vec3::new(around.x, 0.0, -LENGTH - around.y)
    };
    let (mut stone, mut warm, mut glass) = (Shape::default(), Shape::default(), Shape::default());
    for k in 0..APSE_SIDES {
        let (from, to) = (corner(k), corner(k + 1));
        let width = from.distance(to);
        let frame = Frame::new(from, (to - from) / width, Vec3::Y);
        if (1..APSE_SIDES - 1).contains(&k) {
            stone.append(frame.arched_wall(Vec2::new(width, APSE_SPRING), &APSE_WINDOW));
            warm.append(frame.reveal(&APSE_WINDOW, 0.4, true));
            let back = Frame { origin: frame.origin - frame.normal() * 0.35, ..frame };
            let mut pane = back.pane(&APSE_WINDOW);
            let scale = Vec2::new(APSE_WINDOW.high.x - APSE_WINDOW.low.x, 2.575);
            pane.uv.iter_mut().for_each(|t| {
                *t = Vec2::new((t.x - APSE_WINDOW.low.x) / scale.x, 1.0 + (t.y + APSE_WINDOW.low.y) / scale.y)
            });
            glass.append(pane);
        } else {
            stone.append(frame.wall(Vec2::new(width, APSE_SPRING), &[]));
        }
    }
    document.add("apse", palette.stone, stone);
    document.add("apse openings", palette.warm, warm);
    document.add("apse glass", palette.glass, glass);
    // The gores of the half dome stand on the straight sides below; its front edge is the chancel arch.
    let dome = parts::half_dome(APSE_SIDES, 8, APSE).moved(Vec3::new(0.0, APSE_SPRING, -LENGTH));
    let gold = document.material("gilded dome", Material::glossy(0.62, 0.42, 0.13, 0.5));
    document.add("half dome", gold, dome);
}

fn furnish(document: &mut Document) {
    let oak = document.material("oak", Material::glossy(0.3, 0.17, 0.08, 0.5));
    let marble = document.material("marble", Material::glossy(0.76, 0.74, 0.7, 0.3));
    let linen = document.material("linen", Material::matte(0.8, 0.79, 0.74));
    let gold = document.material("gold", Material::metal(0.86, 0.63, 0.24, 0.25));
    let wax = document.material("wax", Material::matte(0.8, 0.74, 0.6));
    let flame = document.material("flame", Material::light(90.0, 55.0, 20.0));
    let pew = document.mesh("pew", &[(oak, parts::pew())]);
    for row in 0..9 {
        for (side, x) in [("left", -1.95), ("right", 1.95)] {
            document.place(&format!("{side} pew {}", row + 1), pew, Placement::at(x, 0.0, -5.2 - 1.45 * row as f32));
        }
    }
    let steps = (0..3).map(|k| {
        let inset = 0.45 * k as f32;
        slab([-2.9 + inset, 2.9 - inset], [0.16 * k as f32, 0.16 * (k + 1) as f32], [-26.2, -20.6 - inset], 0.02)
    });
    document.add("steps", marble, Shape::union(steps));
    let altar = slab([-1.05, 1.05], [0.48, 1.4], [-24.0, -23.2], 0.02);
    document.add("altar", marble, altar);
    document.add("altar cloth", linen, slab([-1.2, 1.2], [1.4, 1.46], [-24.1, -23.1], 0.02));
    let (stick, candle, fire) = parts::candlestick();
    let mesh = document.mesh("candle", &[(gold, stick), (wax, candle), (flame, fire)]);
    for (k, x) in [-0.95, 0.95].into_iter().enumerate() {
        document.place(&format!("altar candle {}", k + 1), mesh, Placement::at(x, 1.46, -23.6));
        document.point_light(&format!("altar candle light {}", k + 1), [x, 2.36, -23.6], [4.5, 3.0, 1.3]);
    }
}
