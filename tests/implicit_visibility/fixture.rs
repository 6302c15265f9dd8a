//! The method on a scene made ready for it.

use crate::common::TestContext;
pub use crate::common::posed::{Fixture, Solution, builtin_scene};
use linklight::methods::implicit_visibility::{ImplicitVisibility, Settings};
use linklight::stages::world::World;

impl Fixture {
    /// Prepared and linked.
    pub fn linked(&self, context: &TestContext, settings: Settings) -> ImplicitVisibility {
        let mut method = ImplicitVisibility::prepare(context, &self.stage(), settings).unwrap();
        method.link(context, &self.stage()).unwrap();
        method
    }
}

pub fn solve(context: &TestContext, method: &ImplicitVisibility, world: &World, bounces: u32) -> Solution {
    let mut recorder = context.recorder("test").unwrap();
    method.solve(&mut recorder, world, bounces);
    recorder.submit().unwrap();
    Solution {
        punctual: context.download(method.punctual_irradiance()).unwrap(),
        direct: context.download(method.direct_irradiance()).unwrap(),
        indirect: context.download(method.indirect_irradiance()).unwrap(),
        last: context.download(method.last_irradiance()).unwrap(),
    }
}

/// The winners of each leaf's bins.
pub fn winners(context: &TestContext, method: &ImplicitVisibility) -> Vec<Vec<u32>> {
    let mut rows = Vec::new();
    for window in &method.linking().windows {
        let all = context.download(&window.winners).unwrap();
        let count = window.plan.leaves().len();
        rows.extend((0..count).map(|leaf| all.iter().skip(leaf).step_by(count).copied().collect()));
    }
    rows
}
