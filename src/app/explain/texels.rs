//! Pixels of methods whose light is on the texels of an atlas, shown by the lightmap.

use std::collections::BTreeMap;

use glam::{DVec3, IVec2, UVec2, Vec2, Vec3};

use super::probe::{Probe, Seen};
use super::{Frame, Parts, add};
use crate::app::AppError;
use crate::app::on_texels::{LightmapShown, TexelsShown};
use crate::display::direct::{Canvas, Lighting};
use crate::display::lightmap::{Gloss, TexelLight};
use crate::report::explanation::Light;
use crate::scene::atlas::{Atlas, NO_TEXEL};
use crate::stages::film::Film;

pub fn explain(
    frame: Frame<'_>,
    shown: &TexelsShown,
    pixel: UVec2,
    parts: &mut Parts,
) -> Result<Vec<String>, AppError> {
    let Frame { context, request, stage, watch, .. } = frame;
    let Some(LightmapShown { display, shadow_maps, g_buffer, method, gloss }) = shown.lightmap() else {
        return Ok(Vec::new());
    };
    let scratch = Film::new(context, request.width, request.height)?;
    let (world, tracer, view, samples) = (&stage.world, stage.tracer(), &stage.view, request.spp);
    let canvas = Canvas { lighting: Lighting { world, shadow_maps, tracer, g_buffer }, view, samples, film: &scratch };
    let probe = Probe::new(context, stage, canvas, pixel)?;
    let ones = context.upload("explain/ones", &vec![Vec3::ONE; method.texels.count as usize])?;
    let zeros = context.upload("explain/zeros", &vec![Vec3::ZERO; method.atlas.texel_at.len()])?;
    let unlit = gloss.map(|_| Gloss { direct: &zeros, indirect: &zeros });
    let light = TexelLight { direct_irradiance: &ones, indirect_irradiance: &ones, gloss: unlit };
    let mut weights: BTreeMap<u32, DVec3> = BTreeMap::new();
    let mut names = Vec::new();
    for index in 0..samples {
        let seen = probe.sample(index, parts)?;
        let Some(triangle) = seen.triangle else { continue };
        let line = probe.name(triangle);
        if !names.contains(&line) {
            names.push(line);
        }
        if seen.reflects {
            let reflectance = probe
                .reflectance(&seen, |recorder, view, weight| display.add(recorder, light, canvas, view, weight))?;
            for (texel, share) in shares(&method.atlas, triangle, &seen) {
                *weights.entry(texel).or_default() += f64::from(share) * reflectance;
            }
            for (kind, shine) in
                gloss.iter().flat_map(|gloss| [(Light::Direct, gloss.direct), (Light::Indirect, gloss.indirect)])
            {
                let dark = TexelLight { direct_irradiance: &zeros, indirect_irradiance: &zeros, ..light };
                let light = TexelLight { gloss: Some(Gloss { direct: &zeros, indirect: shine }), ..dark };
                let shown = probe
                    .reflectance(&seen, |recorder, view, weight| display.add(recorder, light, canvas, view, weight))?;
                let key = (kind, None, "the glossy bounce of texels".to_owned(), "all that the lobes meet".to_owned());
                add(parts, key, shown);
            }
        }
    }
    let name = |texel: u32| format!("texel {texel} at {}", method.atlas.texels[texel as usize].at);
    let direct = context.download(method.direct_irradiance())?;
    for (&texel, &weight) in &weights {
        names.push(format!("{}: {:.4} 1/sr", name(texel), weight.element_sum() / 3.0));
        let key = (Light::Direct, Some(0), "emitters and environment".to_owned(), name(texel));
        add(parts, key, weight * direct[texel as usize].as_dvec3());
    }
    for bounce in 1..=request.bounces {
        watch.step("explain", u64::from(bounce) - 1, request.bounces.into())?;
        shown.solve(context, stage, bounce)?;
        let arrived = context.download(method.last_irradiance())?;
        let cuts = context.download(method.cut_sizes())?;
        for (&texel, &weight) in &weights {
            let source = format!("a cut of {} nodes", cuts[texel as usize]);
            let key = (Light::Indirect, Some(bounce), source, name(texel));
            add(parts, key, weight * arrived[texel as usize].as_dvec3());
        }
    }
    Ok(names)
}

/// As `display/lightmap` filters: texels and their shares.
fn shares(atlas: &Atlas, triangle: u32, seen: &Seen) -> Vec<(u32, f32)> {
    let [a, b, c] = atlas.corner_places[usize::from(seen.is_back)][triangle as usize];
    let [wa, wb, wc] = seen.weights;
    let place: Vec2 = wa * a + wb * b + wc * c;
    let last = atlas.resolution as i32 - 1;
    let texel_at = |at: IVec2| {
        let is_inside = at.min_element() >= 0 && at.max_element() <= last;
        is_inside.then(|| atlas.texel_at[(at.y * (last + 1) + at.x) as usize]).filter(|&texel| texel != NO_TEXEL)
    };
    let beside = (0..9).map(|k: i32| match k {
        0 => IVec2::ZERO,
        k => IVec2::new((k - i32::from(k < 5)) % 3 - 1, (k - i32::from(k < 5)) / 3 - 1),
    });
    let chart_of = |texel: u32| atlas.texels[texel as usize].chart;
    let under = place.floor().as_ivec2();
    let mut near = beside.map(|beside| (under + beside).clamp(IVec2::ZERO, IVec2::splat(last)));
    let Some(chart) = near.find_map(texel_at).map(chart_of) else { return Vec::new() };

    let first = (place - 0.5).floor().as_ivec2() - 1;
    let [wx, wy] = [(place.x - 0.5).fract(), (place.y - 0.5).fract()].map(|t| cubic_weights(t - t.floor()));
    let mut shares = Vec::new();
    for y in 0..4 {
        for x in 0..4 {
            if let Some(texel) = texel_at(first + IVec2::new(x, y)).filter(|&texel| chart_of(texel) == chart) {
                shares.push((texel, wx[x as usize] * wy[y as usize]));
            }
        }
    }
    let sum: f32 = shares.iter().map(|(_, share)| share).sum();
    shares.iter_mut().for_each(|(_, share)| *share /= sum.max(f32::MIN_POSITIVE));
    shares
}

/// The uniform cubic B-spline at a place between the middle two of four.
fn cubic_weights(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    let middle = |t: f32| 4.0 - 6.0 * t * t + 3.0 * t * t * t;
    [s * s * s, middle(t), middle(s), t * t * t].map(|weight| weight / 6.0)
}
