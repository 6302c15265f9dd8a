//! `display/lightmap` against its twin: a cubic B-spline over the texels of the chart that is seen.

use crate::common::{Random, TestContext};
use crate::compare::{hold, tells_apart};
use crate::display::{Case, RADIANCE, SIZE, Surfaces, case, even_albedo};
use glam::{IVec2, UVec2, Vec2, Vec3};
use linklight::display::PixelView;
use linklight::display::direct::{Canvas, Lighting};
use linklight::display::g_buffer::GBuffer;
use linklight::display::lightmap::{Lightmap, TexelLight};
use linklight::display::shadow_maps::ShadowMaps;
use linklight::scene::atlas::{Atlas, NO_TEXEL, Size};
use linklight::scene::camera::Lens;
use linklight::scene::deform::world_vertices;
use linklight::stages::bvh::Bvh;
use linklight::stages::film::Film;
use linklight::stages::trace::Tracer;
use linklight::stages::world::World;
use std::f32::consts::PI;

/// Of the four texels around: the uniform cubic B-spline.
fn weights(t: f32) -> [f32; 4] {
    let piece = |x: f32| match x.abs() {
        x if x < 1.0 => 2.0 / 3.0 - x * x + 0.5 * x * x * x,
        x if x < 2.0 => (2.0 - x).powi(3) / 6.0,
        _ => 0.0,
    };
    [1.0 + t, t, 1.0 - t, 2.0 - t].map(piece)
}

fn texel_at(atlas: &Atlas, at: IVec2) -> Option<usize> {
    let side = atlas.resolution as i32;
    let inside = at.min_element() >= 0 && at.max_element() < side;
    inside.then(|| atlas.texel_at[(at.y * side + at.x) as usize]).filter(|&texel| texel != NO_TEXEL).map(|t| t as usize)
}

/// What reaches the eye of irradiance on the texels, pixel by pixel; of all charts alike, or of that which is seen.
fn twin(case: &Case, atlas: &Atlas, surfaces: &Surfaces, texels: &[Vec3], of_all_charts: bool) -> Vec<Vec3> {
    let positions = world_vertices(&case.geometry, &case.pose).positions;
    let pixel = |index: usize| {
        let seen = surfaces.triangle[index];
        if seen == 0 || surfaces.emission[index].w <= 0.5 {
            return Vec3::ZERO;
        }
        let (position, n) = (surfaces.position[index], surfaces.normal[index]);
        let (albedo, specular) = (surfaces.albedo[index], surfaces.specular[index]);
        let to_eye = (case.view.position - position.truncate()).normalize();
        let [a, b, c] = case.geometry.triangles[seen as usize - 1].map(|v| positions[v as usize]);
        let is_back = (b - a).cross(c - a).dot(to_eye) < 0.0;
        let corners = atlas.corner_places[usize::from(is_back)][seen as usize - 1];
        let place = (1.0 - position.w - specular.w) * corners[0] + position.w * corners[1] + specular.w * corners[2];
        let last = IVec2::splat(atlas.resolution as i32 - 1);
        let around = [(0, 0), (-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
        let under = around.iter().find_map(|&(x, y)| {
            texel_at(atlas, (place.floor().as_ivec2() + IVec2::new(x, y)).clamp(IVec2::ZERO, last))
        });
        let chart = under.map(|texel| atlas.texels[texel].chart);
        let from = place - 0.5;
        let (wx, wy) = (weights(from.x - from.x.floor()), weights(from.y - from.y.floor()));
        let (mut sum, mut weight_sum) = (Vec3::ZERO, 0.0);
        for (k, w) in (0..16).map(|k| (k, wx[k % 4] * wy[k / 4])) {
            let at = from.floor().as_ivec2() + IVec2::new(k as i32 % 4 - 1, k as i32 / 4 - 1);
            let Some(texel) = texel_at(atlas, at) else { continue };
            if of_all_charts || Some(atlas.texels[texel].chart) == chart {
                sum += w * texels[texel];
                weight_sum += w;
            }
        }
        let reflectance = even_albedo(albedo, specular, n.w, n.truncate().dot(to_eye));
        if weight_sum > 0.0 { reflectance / PI * sum / weight_sum } else { Vec3::ZERO }
    };
    (0..surfaces.triangle.len()).map(pixel).collect()
}

#[test]
fn lightmap_agrees_with_its_twin() {
    let context = TestContext::new();
    let mut case = case(Lens::Perspective { tan_half: Vec2::new(0.75, 0.53) });
    case.pose.lights.clear();
    let random = &mut Random(31);
    let positions = world_vertices(&case.geometry, &case.pose).positions;
    let atlas = Atlas::new(&case.scene, &case.geometry, &positions, Size::tight(48)).unwrap();
    let mut values = || -> Vec<Vec3> {
        atlas.texels.iter().map(|_| Vec3::new(random.unit(), random.unit(), 3.0 * random.unit())).collect()
    };
    let (direct, indirect) = (values(), values());
    let Case { scene, geometry, pose, environment, view, .. } = &case;
    let world = World::new(&context, scene, geometry, pose, environment, false).unwrap();
    let shadow_maps = ShadowMaps::new(&context, pose, SIZE.to_array()).unwrap();
    let g_buffer = GBuffer::new(&context, SIZE.x, SIZE.y).unwrap();
    let film = Film::new(&context, SIZE.x, SIZE.y).unwrap();
    let light = TexelLight {
        direct_irradiance: &context.upload("test/direct", &direct).unwrap(),
        indirect_irradiance: &context.upload("test/indirect", &indirect).unwrap(),
        gloss: None,
    };
    let lightmap = Lightmap::new(&context, &atlas).unwrap();
    let bvh = Bvh::build(&context, &positions, &geometry.triangles).unwrap();
    let (world, shadow_maps, g_buffer, film) = (&world, &shadow_maps, &g_buffer, &film);
    let tracer = Tracer::compute(&bvh, world);
    let mut recorder = context.recorder("test").unwrap();
    let lighting = Lighting { world, shadow_maps, tracer, g_buffer };
    let canvas = Canvas { lighting, view, samples: 1, film };
    lightmap.draw(&mut recorder, light, canvas);
    let size = UVec2::new(SIZE.x, SIZE.y);
    g_buffer.draw(&mut recorder, world, &PixelView::new(view, size, 0, 1));
    recorder.submit().unwrap();

    let surfaces = Surfaces::of(&context, g_buffer);
    let mut got = context.download(&film.direct).unwrap();
    for (index, pixel) in got.iter_mut().enumerate() {
        let is_background = surfaces.triangle[index] == 0;
        *pixel = if is_background { Vec3::ZERO } else { *pixel - surfaces.emission[index].truncate() };
    }
    let expected = twin(&case, &atlas, &surfaces, &direct, false);
    assert!(expected.iter().filter(|light| light.z > 0.0).count() > 500, "most pixels are lit");
    hold("direct", &got, &expected, RADIANCE);
    let expected = twin(&case, &atlas, &surfaces, &indirect, false);
    hold("indirect", &context.download(&film.indirect).unwrap(), &expected, RADIANCE);
    tells_apart("other charts", &twin(&case, &atlas, &surfaces, &indirect, true), &expected, RADIANCE);
    tells_apart("direct for indirect light", &twin(&case, &atlas, &surfaces, &direct, false), &expected, RADIANCE);
}
