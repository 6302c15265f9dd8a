//! Emissive surfaces as light sources of their own: points on them, and which points each element sees.
//!
//! A part that emits is either *sampled* here, point by point with shadow rays, or *linked*: a method carries its
//! light along its own transport. Each part is one or the other, so that no light counts twice. Visibility is kept as
//! bits: other emission needs no rays.
//!
//! [Roberts2018]: crate::methods::PAPERS

use super::elements::{Elements, NO_ELEMENT};
use super::trace::{self, Tracer};
use super::world::World;
use crate::gpu::shaders::elements as passes;
use crate::gpu::shaders::types::{EmitterSample, Ray};
use crate::gpu::{Buffer, Context, GpuError, Recorder};
use crate::scene::geometry::Geometry;
use glam::{Vec2, Vec3};

crate::choice! {
    /// How light of emissive surfaces reaches the elements directly.
    pub enum EmitterChoice {
        /// Sampled where a part is at most a twentieth of all area, else linked
        Auto = "auto",
        /// Along links, like reflected light
        Linked = "linked",
        /// By shadow rays to points on them
        Sampled = "sampled",
    }
}

/// Largest share of the scene's area of a part that [`EmitterChoice::Auto`] samples.
const SMALL_PART: f64 = 0.05;

/// Which parts are sampled, and where.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EmitterPlan {
    pub samples: Vec<EmitterSample>,
    /// Per part.
    pub is_sampled: Vec<bool>,
    pub sampled_parts: u32,
    pub linked_parts: u32,
}

impl EmitterPlan {
    /// Spreads `sample_count` points over the sampled parts: half of them evenly, so that a small lamp in its shade has
    /// some, the rest in proportion to power; inside a part evenly along the sum of its triangles' powers, and inside a
    /// triangle by a sequence that fills it evenly [Roberts2018].
    ///
    /// `positions` in world space at rest and `emission` (W m^-2 sr^-1) per vertex; `is_double_sided` per vertex.
    ///
    /// [Roberts2018]: crate::methods::PAPERS
    pub fn new(
        geometry: &Geometry,
        positions: &[Vec3],
        emission: &[Vec3],
        is_double_sided: impl Fn(u32) -> bool,
        choice: EmitterChoice,
        sample_count: u32,
    ) -> Self {
        let area = |t: usize| {
            let [a, b, c] = geometry.triangles[t].map(|v| positions[v as usize]);
            f64::from(0.5 * (b - a).cross(c - a).length())
        };
        let brightness = |t: usize| {
            f64::from(geometry.triangles[t].iter().map(|&v| emission[v as usize].element_sum()).sum::<f32>())
        };
        let total_area: f64 = (0..geometry.triangles.len()).map(area).sum();

        let mut plan = Self { is_sampled: vec![false; geometry.parts.len()], ..Self::default() };
        let mut sampled = Vec::new();
        for (index, part) in geometry.parts.iter().enumerate() {
            let triangles = part.triangle_offset as usize..(part.triangle_offset + part.triangle_count) as usize;
            let powers = PowerSums::new(triangles.clone().map(|t| (t, area(t) * brightness(t))));
            if powers.total <= 0.0 {
                continue;
            }
            let is_small = triangles.map(area).sum::<f64>() <= SMALL_PART * total_area;
            if choice == EmitterChoice::Sampled || (choice == EmitterChoice::Auto && is_small) {
                plan.is_sampled[index] = true;
                sampled.push(powers);
            } else {
                plan.linked_parts += 1;
            }
        }
        plan.sampled_parts = sampled.len() as u32;

        for (k, (triangle, power)) in spread(&sampled, sample_count).into_iter().enumerate() {
            // The point stands for the area that would emit its share of the power at this brightness.
            let stands_for = power / brightness(triangle);
            plan.samples.push(EmitterSample {
                triangle: triangle as u32,
                barycentrics: point_in_triangle(k as u32),
                share: (stands_for / area(triangle)) as f32,
                is_double_sided: u32::from(is_double_sided(geometry.triangles[triangle][0])),
            });
        }
        plan
    }
}

/// The triangles of a part with their running sum of powers.
struct PowerSums {
    /// (triangle, power up to and with it), those without power left out.
    sums: Vec<(usize, f64)>,
    total: f64,
}

impl PowerSums {
    fn new(powers: impl Iterator<Item = (usize, f64)>) -> Self {
        let mut total = 0.0;
        let sums = powers.filter(|&(_, power)| power > 0.0).map(|(triangle, power)| {
            total += power;
            (triangle, total)
        });
        Self { sums: sums.collect(), total }
    }

    /// The triangle in which the sum reaches `power`.
    fn triangle_at(&self, power: f64) -> usize {
        self.sums[self.sums.partition_point(|&(_, sum)| sum <= power).min(self.sums.len() - 1)].0
    }
}

/// `count` triangles of all parts and the power that each stands for; together all power there is.
fn spread(parts: &[PowerSums], count: u32) -> Vec<(usize, f64)> {
    let total: f64 = parts.iter().map(|part| part.total).sum();
    let each = (count as usize / 2).checked_div(parts.len()).unwrap_or(0);
    let by_power = count as usize - each * parts.len();
    let mut points = Vec::with_capacity(count as usize);
    let mut before = 0.0;
    for part in parts {
        // Even steps along the power of all parts; those that fall into this one.
        let step = |power: f64| (power / total * by_power as f64 + 0.5).floor();
        let own = (step(before + part.total) - step(before)) as usize;
        let count = each + own;
        // Without a point of its own for every part, each point stands for an equal share of all power.
        let power = if each > 0 { part.total / count as f64 } else { total / by_power as f64 };
        points.extend((0..count).map(|k| {
            let at = (k as f64 + 0.5) / count as f64 * part.total;
            (part.triangle_at(at), power)
        }));
        before += part.total;
    }
    points
}

/// The k-th point of an even sequence over a triangle.
fn point_in_triangle(k: u32) -> Vec2 {
    // Powers of 1 / 1.3247..., the root of x^3 = x + 1.
    let point = Vec2::new(0.5 + 0.754_877_7 * k as f32, 0.5 + 0.569_840_3 * k as f32).fract();
    if point.x + point.y > 1.0 { 1.0 - point } else { point }
}

/// The plan on the device, and who sees whom.
pub struct Emitters {
    pub plan: EmitterPlan,
    pub samples: Buffer<EmitterSample>,
    /// Per element: its emission is carried by samples and must not be by links.
    pub is_sampled: Buffer<u32>,
    /// A bit per element and sample; each element starts a word.
    pub visible: Buffer<u32>,
}

impl Emitters {
    pub fn new(
        context: &Context,
        geometry: &Geometry,
        positions: &[Vec3],
        elements: &Elements,
        choice: EmitterChoice,
        sample_count: u32,
    ) -> Result<Self, GpuError> {
        let emission = context.download(&elements.emission)?;
        let back_elements = &elements.topology.back_elements;
        let is_double_sided = |v: u32| back_elements[v as usize] != NO_ELEMENT;
        let plan = EmitterPlan::new(geometry, positions, &emission, is_double_sided, choice, sample_count);
        let is_sampled: Vec<u32> = (elements.topology.vertices.iter())
            .map(|&entry| {
                let vertex = entry & !super::elements::BACK_SIDE;
                u32::from(plan.is_sampled[geometry.vertex_part[vertex as usize] as usize])
            })
            .collect();
        let words = elements.count as usize * plan.samples.len().div_ceil(32);
        Ok(Self {
            samples: context.upload("emitters/samples", &plan.samples)?,
            is_sampled: context.upload("emitters/is sampled", &is_sampled)?,
            visible: context.buffer("emitters/visible", words)?,
            plan,
        })
    }

    /// Sees again which samples each element sees, in batches that fit `rays`. Returns the number of shadow rays.
    pub fn trace(
        &self,
        recorder: &mut Recorder<'_>,
        tracer: &Tracer<'_>,
        world: &World,
        elements: &Elements,
        rays: &Buffer<Ray>,
        is_free: &Buffer<u32>,
    ) -> u64 {
        let sample_count = self.plan.samples.len() as u32;
        let batch = (rays.len().min(is_free.len()) as u32).checked_div(sample_count).unwrap_or(0);
        if batch == 0 {
            return 0;
        }
        for first_element in (0..elements.count).step_by(batch as usize) {
            let batch_count = batch.min(elements.count - first_element);
            let ray_count = batch_count * sample_count;
            recorder.dispatch(
                &passes::EmitterRays {
                    element_normals: &elements.normals,
                    ray_origins: &elements.ray_origins,
                    samples: &self.samples,
                    triangles: &world.triangles,
                    positions: &world.positions,
                    rays,
                    params: passes::EmitterRaysParams {
                        first_element,
                        batch_count,
                        sample_count,
                        ray_offset: elements.ray_offset,
                    },
                },
                ray_count,
            );
            trace::any_hit(recorder, tracer, rays, is_free, ray_count as usize);
            let words = sample_count.div_ceil(32);
            let params = passes::PackVisibilityParams {
                first_word: first_element * words,
                row_count: batch_count,
                row_length: sample_count,
            };
            recorder.dispatch(
                &passes::PackVisibility { rays, is_free, visible: &self.visible, params },
                batch_count * words,
            );
        }
        u64::from(elements.count) * u64::from(sample_count)
    }

    /// Irradiance from all samples, W/m2; black without any.
    pub fn irradiance(
        &self,
        recorder: &mut Recorder<'_>,
        world: &World,
        elements: &Elements,
        irradiance: &Buffer<Vec3>,
    ) {
        let pass = passes::EmitterIrradiance {
            element_positions: &elements.positions,
            element_normals: &elements.normals,
            samples: &self.samples,
            triangles: &world.triangles,
            positions: &world.positions,
            emission: &elements.emission,
            visible: &self.visible,
            irradiance,
            params: passes::EmitterIrradianceParams {
                element_count: elements.count,
                sample_count: self.plan.samples.len() as u32,
            },
        };
        recorder.dispatch(&pass, elements.count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(first: usize, powers: &[f64]) -> PowerSums {
        PowerSums::new(powers.iter().enumerate().map(|(k, &power)| (first + k, power)))
    }

    #[test]
    fn points_stand_for_all_power_and_leave_no_part_out() {
        let parts = [part(0, &[100.0, 0.0, 300.0]), part(3, &[1.0]), part(4, &[7.0, 2.0])];
        for count in [6, 7, 32, 1000] {
            let points = spread(&parts, count);
            assert_eq!(points.len(), count as usize);
            for (part, range) in parts.iter().zip([0..3, 3..4, 4..6]) {
                let power: f64 = points.iter().filter(|(t, _)| range.contains(t)).map(|(_, power)| power).sum();
                assert!((power - part.total).abs() < 1e-9, "{count} points: {power} of {}", part.total);
            }
            assert!(points.iter().all(|&(t, _)| t != 1), "a dark triangle has no point");
        }
        // Fewer points than parts: all power still, by the brightest.
        let few = spread(&parts, 2);
        assert_eq!(few.iter().map(|(_, power)| power).sum::<f64>(), 410.0);
        assert!(spread(&[], 32).is_empty());
    }

    #[test]
    fn points_lie_inside_and_spread() {
        let points: Vec<Vec2> = (0..64).map(point_in_triangle).collect();
        assert!(points.iter().all(|p| p.min_element() >= 0.0 && p.x + p.y <= 1.0));
        let mean = points.iter().sum::<Vec2>() / 64.0;
        assert!((mean - Vec2::splat(1.0 / 3.0)).abs().max_element() < 0.03, "{mean}");
    }
}
