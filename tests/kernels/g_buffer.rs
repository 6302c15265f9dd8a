//! `display/visible_triangles` and `display/g_buffer` against rays cast through every pixel at every triangle.

use crate::common::scenes::{lambert, parallelogram, scene};
use crate::common::{Random, TestContext};
use crate::compare::{Tolerance, hold, tells_apart};
use glam::{DVec3, UVec2, Vec2, Vec3, Vec4};
use linklight::display::PixelView;
use linklight::display::g_buffer::GBuffer;
use linklight::display::pixel_samples::sample_offset;
use linklight::gpu::Context;
use linklight::scene::camera::{Lens, Ray, View};
use linklight::scene::deform::{WorldVertices, world_vertices};
use linklight::scene::environment::Environment;
use linklight::scene::geometry::Geometry;
use linklight::scene::pose::Pose;
use linklight::scene::{Image, Material, Primitive, Scene, Texture, TextureRef, Wrap};
use linklight::stages::world::World;

/// What the images hold at one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Texel {
    /// Index + 1; 0 is the background.
    triangle: u32,
    position: Vec4,
    normal: Vec4,
    albedo: Vec4,
    specular: Vec4,
    emission: Vec4,
}

/// Positions are barycentric sums of coordinates below 40 m, whose weights divide by a pixel's share of the triangle.
const POSITION: Tolerance = Tolerance { absolute: 2e-3, relative: 1e-4 };
/// Interpolated by the same weights; textures are filtered with 8 bits of weight on software drivers.
const SURFACE: Tolerance = Tolerance { absolute: 8e-3, relative: 0.0 };

fn look(eye: Vec3, target: Vec3, lens: Lens) -> View {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    View { position: eye, right, up: right.cross(forward), forward, lens, near: 0.05, far: None }
}

const RAMP: u32 = 32;
const MASK: u32 = 8;

/// A texture whose red follows u and green v, and one whose alpha is a checker of 8 x 8.
fn textures(scene: &mut Scene) {
    let ramp = (0..RAMP * RAMP).flat_map(|i| [(i % RAMP * 8) as u8, (i / RAMP * 8) as u8, 128, 255]);
    let mask =
        (0..MASK * MASK).flat_map(|i| [255, 255, 255, if (i % MASK + i / MASK).is_multiple_of(2) { 255 } else { 0 }]);
    let image = |name: &str, side, rgba| Image { name: name.into(), width: side, height: side, rgba, srgb: false };
    scene.images = vec![image("ramp", RAMP, ramp.collect()), image("mask", MASK, mask.collect())];
    let texture = |image, linear| Texture {
        image,
        wrap: [Wrap::ClampToEdge; 2],
        mag_linear: linear,
        min_linear: linear,
        mipmapped: false,
        mip_linear: false,
    };
    scene.textures = vec![texture(0, true), texture(1, false)];
}

fn texture(texture: u32) -> Option<TextureRef> {
    Some(TextureRef { texture, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] })
}

/// A floor that runs under and behind the camera, a soup of triangles, a textured wall, a sheet with holes.
fn room() -> Scene {
    let random = &mut Random(41);
    let one_sided = Material { double_sided: false, ..lambert(Vec3::new(0.9, 0.5, 0.2)) };
    let shiny = Material {
        metallic: 0.5,
        roughness: 0.6,
        specular: 0.8,
        emission: Vec3::new(0.5, 0.25, 0.125),
        ..lambert(Vec3::new(0.2, 0.6, 0.9))
    };
    let ramp = Material { base_color_texture: texture(0), ..lambert(Vec3::ONE) };
    let holes = Material { base_color_texture: texture(1), alpha_cutoff: Some(0.5), ..lambert(Vec3::splat(0.7)) };
    let unlit = Material { unlit: true, ..lambert(Vec3::new(0.1, 0.4, 0.7)) };
    let mut soup = Primitive { material: 0, ..Primitive::default() };
    let mut vector = || Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
    for triangle in 0..40u32 {
        let centre = Vec3::new(0.0, 1.0, 0.0) + vector();
        for _ in 0..3 {
            soup.positions.push(centre + 0.5 * vector());
            soup.normals.push((Vec3::Y + 0.9 * vector()).normalize());
            soup.colors.push((0.5 + 0.5 * vector()).extend(1.0));
        }
        soup.triangles.push([0, 1, 2].map(|k| 3 * triangle + k));
    }
    let shiny_soup = Primitive {
        positions: soup.positions.iter().map(|p| *p + Vec3::new(0.3, 0.1, -0.4)).collect(),
        material: 1,
        ..soup.clone()
    };
    let floor = parallelogram(Vec3::new(-9.0, -0.5, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 18.0, 1, 4);
    let wall = parallelogram(Vec3::new(-2.0, -0.5, -2.5), Vec3::X * 4.0, Vec3::Y * 3.0, 2, 2);
    let sheet = parallelogram(Vec3::new(-1.5, 0.0, 1.5), Vec3::X * 1.4, Vec3::Y * 1.4, 1, 3);
    let mut scene = scene(vec![one_sided, shiny, ramp, holes, unlit], vec![soup, shiny_soup, floor, wall, sheet], &[]);
    textures(&mut scene);
    scene
}

/// The caster: everything in double precision, no structure, one triangle after the other.
struct Caster<'a> {
    scene: &'a Scene,
    geometry: &'a Geometry,
    vertices: &'a WorldVertices,
}

struct Hit {
    triangle: usize,
    t: f64,
    weights: DVec3,
}

impl Caster<'_> {
    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.geometry.triangles[triangle].map(|vertex| self.vertices.positions[vertex as usize].as_dvec3())
    }

    /// Where the ray meets the plane of a triangle inside of it.                        [Möller, Trumbore 1997]
    fn meet(&self, ray: &Ray, triangle: usize) -> Option<Hit> {
        let [a, b, c] = self.corners(triangle);
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        if determinant == 0.0 {
            return None;
        }
        let from = origin - a;
        let v = from.dot(across) / determinant;
        let w = direction.dot(from.cross(ab)) / determinant;
        let t = ac.dot(from.cross(ab)) / determinant;
        let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
        let seen = t >= f64::from(ray.t_min) && t <= f64::from(ray.t_max);
        (inside && seen).then_some(Hit { triangle, t, weights: DVec3::new(1.0 - v - w, v, w) })
    }

    fn material(&self, triangle: usize) -> &Material {
        let part = self.geometry.triangle_part[triangle] as usize;
        &self.scene.materials[self.geometry.parts[part].material as usize]
    }

    fn blend<T, S>(&self, hit: &Hit, values: &[T]) -> S
    where
        T: Copy + std::ops::Mul<f32, Output = S>,
        S: std::iter::Sum,
    {
        let corners = self.geometry.triangles[hit.triangle];
        corners.iter().zip(hit.weights.to_array()).map(|(&v, w)| values[v as usize] * w as f32).sum()
    }

    /// Base colour with its texture: bilinear for the ramp, nearest for the mask.
    fn base_color(&self, hit: &Hit) -> Vec4 {
        let material = self.material(hit.triangle);
        let color: Vec4 = material.base_color * self.blend::<Vec4, Vec4>(hit, &self.geometry.colors);
        let uv: Vec2 = self.blend(hit, &self.geometry.uv[0]);
        match material.base_color_texture {
            None => color,
            Some(TextureRef { texture: 0, .. }) => {
                let at = (uv * RAMP as f32 - 0.5).clamp(Vec2::ZERO, Vec2::splat(RAMP as f32 - 1.0));
                color * Vec4::new(at.x * 8.0, at.y * 8.0, 128.0, 255.0) / 255.0
            }
            Some(_) => {
                let at = (uv * MASK as f32).as_uvec2().min(UVec2::splat(MASK - 1));
                color * Vec4::new(1.0, 1.0, 1.0, if (at.x + at.y).is_multiple_of(2) { 1.0 } else { 0.0 })
            }
        }
    }

    fn nearest(&self, ray: &Ray) -> Option<Hit> {
        let is_hole = |hit: &Hit| self.material(hit.triangle).alpha_cutoff.is_some_and(|c| self.base_color(hit).w < c);
        let hits = (0..self.geometry.triangles.len()).filter_map(|triangle| self.meet(ray, triangle));
        hits.filter(|hit| !is_hole(hit)).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    /// The twin of both passes at one pixel.
    fn texel(&self, ray: &Ray) -> Texel {
        let Some(hit) = self.nearest(ray) else { return Texel::default() };
        let [a, b, c] = self.corners(hit.triangle);
        let is_back = (b - a).cross(c - a).dot(ray.direction.as_dvec3()) > 0.0;
        let m = self.material(hit.triangle);
        let reflects = !m.unlit && (m.double_sided || !is_back);
        let normal = self.blend::<Vec3, Vec3>(&hit, &self.vertices.normals).normalize();
        let base = self.base_color(&hit).truncate();
        let f0 = ((m.ior - 1.0) / (m.ior + 1.0)).powi(2) * m.specular * m.specular_color;
        let emission = match m.unlit {
            true => base,
            false if is_back && !m.double_sided => Vec3::ZERO,
            false => m.emission,
        };
        let shown = if reflects { 1.0 } else { 0.0 };
        Texel {
            triangle: hit.triangle as u32 + 1,
            position: (ray.origin.as_dvec3() + hit.t * ray.direction.as_dvec3()).as_vec3().extend(hit.weights.y as f32),
            normal: (if is_back { -normal } else { normal }).extend(m.roughness * m.roughness),
            albedo: (base * (1.0 - m.metallic) * shown).extend((m.specular + (1.0 - m.specular) * m.metallic) * shown),
            specular: (f0.lerp(base, m.metallic) * shown).extend(hit.weights.z as f32),
            emission: emission.extend(shown),
        }
    }
}

fn on_device(context: &Context, scene: &Scene, geometry: &Geometry, view: &View, size: UVec2) -> Vec<Texel> {
    sampled(context, scene, geometry, &PixelView::new(view, size, 0, 1), size)
}

fn sampled(context: &Context, scene: &Scene, geometry: &Geometry, view: &PixelView, size: UVec2) -> Vec<Texel> {
    let pose = Pose::rest(scene);
    let world = World::new(context, scene, geometry, &pose, &Environment::default(), false).unwrap();
    let g_buffer = GBuffer::new(context, size.x, size.y).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    g_buffer.draw(&mut recorder, &world, view);
    recorder.submit().unwrap();
    let image = |image| context.download_image::<[f32; 4]>(image, 0).unwrap().into_iter().map(Vec4::from);
    let triangles: Vec<u32> = context.download_image(&g_buffer.visible_triangles, 0).unwrap();
    let surfaces = image(&g_buffer.albedo).zip(image(&g_buffer.specular)).zip(image(&g_buffer.emission));
    let places = image(&g_buffer.position).zip(image(&g_buffer.normal));
    let texels = triangles.into_iter().zip(places.zip(surfaces));
    texels
        .map(|(triangle, ((position, normal), ((albedo, specular), emission)))| {
            // Behind the background the other images hold nothing.
            let seen = Texel { triangle, position, normal, albedo, specular, emission };
            if triangle == 0 { Texel::default() } else { seen }
        })
        .collect()
}

fn cast(scene: &Scene, geometry: &Geometry, view: &View, size: UVec2) -> Vec<Texel> {
    let vertices = world_vertices(geometry, &Pose::rest(scene));
    let caster = Caster { scene, geometry, vertices: &vertices };
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
    pixels.map(|pixel| caster.texel(&view.ray(pixel, size))).collect()
}

/// Pixels whose triangles agree, as pairs.
fn agreeing<'a>(got: &'a [Texel], expected: &'a [Texel]) -> Vec<(&'a Texel, &'a Texel)> {
    got.iter().zip(expected).filter(|(g, e)| g.triangle == e.triangle && e.triangle != 0).collect()
}

fn hold_texels(what: &str, got: &[Texel], expected: &[Texel]) {
    let pairs = agreeing(got, expected);
    let column =
        |of: fn(&Texel) -> Vec4| -> (Vec<Vec4>, Vec<Vec4>) { pairs.iter().map(|(g, e)| (of(g), of(e))).unzip() };
    let (positions, normals) = (column(|t| t.position), column(|t| t.normal));
    hold(&format!("{what}, position and weight 1"), &positions.0, &positions.1, POSITION);
    hold(&format!("{what}, normal and alpha"), &normals.0, &normals.1, SURFACE);
    for (name, (got, expected)) in [
        ("albedo and grazing", column(|t| t.albedo)),
        ("specular and weight 2", column(|t| t.specular)),
        ("emission and side", column(|t| t.emission)),
    ] {
        hold(&format!("{what}, {name}"), &got, &expected, SURFACE);
    }
}

#[test]
fn pixels_see_what_rays_hit() {
    let context = TestContext::new();
    let scene = room();
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    let perspective = |x, y| Lens::Perspective { tan_half: Vec2::new(x, y) };
    let orthographic = Lens::Orthographic { half_extent: Vec2::new(2.4, 1.6) };
    let (eye, target) = (Vec3::new(0.4, 1.2, 4.0), Vec3::new(0.0, 0.6, 0.0));
    let views = [
        ("perspective", look(eye, target, perspective(0.75, 0.5)), UVec2::new(96, 64)),
        ("wide", look(Vec3::new(0.1, 0.3, 0.9), target, perspective(2.0, 1.2)), UVec2::new(67, 41)),
        ("orthographic", look(eye, target, orthographic), UVec2::new(96, 64)),
        ("far plane", View { far: Some(4.3), ..look(eye, target, perspective(0.75, 0.5)) }, UVec2::new(63, 65)),
        ("from behind", look(Vec3::new(1.5, 3.2, -4.5), target, perspective(0.6, 0.6)), UVec2::new(40, 40)),
    ];
    for (name, view, size) in views {
        let got = on_device(&context, &scene, &geometry, &view, size);
        let expected = cast(&scene, &geometry, &view, size);
        // Pixels whose centre is on an edge, at a mask's border or at a crossing of two triangles may go either way.
        let pixels = got.len();
        let same = got.iter().zip(&expected).filter(|(g, e)| g.triangle == e.triangle).count();
        assert!(same * 1000 >= pixels * 995, "{name}: {same} of {pixels} pixels see the same triangle");
        let kinds: std::collections::BTreeSet<u32> = expected.iter().map(|t| t.triangle).collect();
        assert!(kinds.len() > 15, "{name}: the picture must show something: {kinds:?}");
        hold_texels(name, &got, &expected);

        // One pixel to the side, or another lens, is another picture.
        let shifted: Vec<Texel> = expected[1..].iter().chain(&expected[..1]).copied().collect();
        let still_same = got.iter().zip(&shifted).filter(|(g, e)| g.triangle == e.triangle).count();
        assert!(still_same * 1000 < pixels * 995, "{name}: a picture one pixel off would go unnoticed");
        let pairs = agreeing(&got, &shifted);
        let (g, e): (Vec<Vec4>, Vec<Vec4>) = pairs.iter().map(|(g, e)| (g.position, e.position)).unzip();
        tells_apart(&format!("{name}: positions one pixel off"), &g, &e, POSITION);
    }
}

#[test]
fn holes_show_what_is_behind_them() {
    let context = TestContext::new();
    let scene = room();
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    let lens = Lens::Orthographic { half_extent: Vec2::splat(0.7) };
    let view = View { near: 0.0, ..look(Vec3::new(-0.8, 0.7, 1.6), Vec3::new(-0.8, 0.7, 0.0), lens) };
    // Eight cells across, four pixels each.
    let size = UVec2::splat(32);
    let got = on_device(&context, &scene, &geometry, &view, size);
    let sheet = geometry.parts.iter().find(|part| part.material == 3).unwrap();
    let is_sheet =
        |t: &Texel| t.triangle > sheet.triangle_offset && t.triangle <= sheet.triangle_offset + sheet.triangle_count;
    for (index, texel) in got.iter().enumerate() {
        let (x, y) = (index as u32 % 32, index as u32 / 32);
        // The sheet's v grows upwards, the picture's y downwards.
        let cell = x / 4 + (31 - y) / 4;
        assert_eq!(is_sheet(texel), cell % 2 == 0, "pixel {x}, {y}");
    }
}

#[test]
fn the_smallest_picture_is_one_pixel() {
    let context = TestContext::new();
    let scene = room();
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    let lens = Lens::Perspective { tan_half: Vec2::splat(0.01) };
    let view = look(Vec3::new(1.5, 2.2, 3.0), Vec3::new(1.5, 2.2, -2.5), lens);
    let size = UVec2::ONE;
    let (got, expected) = (on_device(&context, &scene, &geometry, &view, size), cast(&scene, &geometry, &view, size));
    assert_eq!((got[0].triangle, expected[0].triangle != 0), (expected[0].triangle, true));
    hold_texels("one pixel", &got, &expected);
}

/// Stripes along a floor that is seen at a grazing angle: a pixel is as narrow as a stripe, and many stripes long.
#[test]
fn textures_are_filtered_over_what_is_sampled_and_no_more() {
    const STRIPES: usize = 32;
    let context = TestContext::new();
    let random = &mut Random(5);
    let grey: Vec<f32> = (0..STRIPES).map(|_| (random.unit() * 255.0).round() / 255.0).collect();
    let texel = |i: usize| [(grey[i % STRIPES] * 255.0) as u8; 3].into_iter().chain([255]);
    let rgba = (0..STRIPES * STRIPES).flat_map(texel).collect();
    let mut floor = parallelogram(Vec3::new(-2.0, 0.0, 0.0), Vec3::X * 4.0, Vec3::NEG_Z * 40.0, 1, 0);
    floor.uv[0] = floor.positions.iter().map(|p| Vec2::new((p.x + 2.0) / 4.0, -p.z / 4.0)).collect();
    let material = Material { base_color_texture: texture(0), ..lambert(Vec3::ONE) };
    let mut scene = scene(vec![material], vec![floor], &[]);
    let side = STRIPES as u32;
    scene.images = vec![Image { name: "stripes".into(), width: side, height: side, rgba, srgb: false }];
    let wrap = [Wrap::Repeat; 2];
    scene.textures =
        vec![Texture { image: 0, wrap, mag_linear: true, min_linear: true, mipmapped: true, mip_linear: true }];
    let geometry = Geometry::flatten(&scene, 1 << 30).unwrap();
    let lens = Lens::Perspective { tan_half: Vec2::new(0.6, 0.4) };
    let (view, size) = (look(Vec3::new(0.0, 0.4, 1.0), Vec3::new(0.0, 0.2, -3.0), lens), UVec2::new(64, 48));

    // The stripe under a place of the picture; nothing beside the floor.
    let stripe = |at: Vec2| -> Option<f32> {
        let ray = view.ray(at, size);
        let p = ray.origin - ray.origin.y / ray.direction.y * ray.direction;
        let inside = ray.direction.y < 0.0 && p.x.abs() < 2.0 && (-40.0..0.0).contains(&p.z);
        let u = (p.x + 2.0) / 4.0 * STRIPES as f32 - 0.5;
        let of = |k: f32| grey[(k as i32).rem_euclid(STRIPES as i32) as usize];
        inside.then(|| of(u.floor()) + (of(u.floor() + 1.0) - of(u.floor())) * (u - u.floor()))
    };
    // Of a square of the picture.
    let mean = |middle: Vec2, width: f32| -> Option<f32> {
        let at = |k: i32| middle + width * (Vec2::new((k % 12) as f32 + 0.5, (k / 12) as f32 + 0.5) / 12.0 - 0.5);
        (0..144).map(|k| stripe(at(k))).sum::<Option<f32>>().map(|sum| sum / 144.0)
    };
    for samples in [1, 16] {
        let width = 1.0 / (samples as f32).sqrt();
        let offset = sample_offset(0, samples);
        let got = sampled(&context, &scene, &geometry, &PixelView::new(&view, size, 0, samples), size);
        let off = |width: f32| {
            let pixel = |index: u32| {
                let at = Vec2::new((index % size.x) as f32, (index / size.x) as f32) + 0.5 + offset;
                let expected = mean(at, width).filter(|_| mean(at, 4.0).is_some())?;
                Some((got[index as usize].albedo.x - expected).powi(2))
            };
            let squares: Vec<f32> = (0..size.x * size.y).filter_map(pixel).collect();
            assert!(squares.len() > 800, "{} pixels see the floor alone", squares.len());
            (squares.iter().sum::<f32>() / squares.len() as f32).sqrt()
        };
        let (own, wider) = (off(width), off(4.0 * width));
        println!("{samples} samples: off by {own:.4} from what is sampled, {wider:.4} from four times as much");
        assert!(own < 0.04 && wider > 2.0 * own, "{own} {wider}");
    }
}
