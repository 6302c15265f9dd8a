//! The method on a fixture, and its tables on the host.

use crate::common::TestContext;
use crate::fixture::Fixture;
use glam::Vec3;
use linklight::methods::antiradiance::{Antiradiance, BinCount, Settings, TableWindow, Tables};
use linklight::stages::work::Unwatched;

/// f32 tables, so that twins need not round; as the paper otherwise where a test does not say.
pub fn settings(bins: u32) -> Settings {
    Settings {
        bins: BinCount::new(bins).unwrap(),
        half_tables: false,
        refinement: 1.0,
        smoothing: false,
        ..Settings::default()
    }
}

pub fn prepare(context: &TestContext, fixture: &Fixture, settings: Settings) -> Antiradiance {
    Antiradiance::prepare(context, &fixture.stage(), settings).unwrap()
}

/// W/m2 per element.
pub struct Solution {
    pub direct: Vec<Vec3>,
    pub indirect: Vec<Vec3>,
}

pub fn solve(context: &TestContext, method: &mut Antiradiance, fixture: &Fixture, bounces: u32) -> Solution {
    method.solve(context, &fixture.world, bounces, &Unwatched).unwrap();
    Solution {
        direct: context.download(method.direct_irradiance()).unwrap(),
        indirect: context.download(method.indirect_irradiance()).unwrap(),
    }
}

/// A table of f32 entries, node by node.
pub fn entries(
    context: &TestContext,
    tables: &Tables,
    table: impl Fn(&TableWindow) -> &linklight::gpu::Buffer<u64>,
) -> Vec<Vec3> {
    let words = tables.download(context, table).unwrap();
    let halves = |word: u64| [word as u32, (word >> 32) as u32].map(f32::from_bits);
    let by_bin: Vec<Vec3> = words
        .chunks(2)
        .map(|pair| (halves(pair[0]), halves(pair[1])[0]))
        .map(|([r, g], b)| Vec3::new(r, g, b))
        .collect();
    by_node(&by_bin, tables.bin_count)
}

/// A table that stands bin by bin, node by node (or leaf by leaf).
pub fn by_node<T: Copy>(table: &[T], bin_count: u32) -> Vec<T> {
    let (bins, nodes) = (bin_count as usize, table.len() / bin_count as usize);
    (0..table.len()).map(|k| table[k % bins * nodes + k / bins]).collect()
}

/// sqrt(sum of squared differences over sum of squares).
pub fn relative_rmse(found: &[Vec3], expected: &[Vec3]) -> f64 {
    let sum = |values: &mut dyn Iterator<Item = Vec3>| values.map(|v| f64::from(v.length_squared())).sum::<f64>();
    let error = sum(&mut found.iter().zip(expected).map(|(f, e)| *f - *e));
    (error / sum(&mut expected.iter().copied())).sqrt()
}
