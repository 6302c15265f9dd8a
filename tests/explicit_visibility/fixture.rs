//! The method on a scene made ready for it.

use crate::common::TestContext;
pub use crate::common::posed::{Fixture, Solution, builtin_scene};
use linklight::methods::explicit_visibility::{ExplicitVisibility, Settings};
use linklight::stages::world::World;

impl Fixture {
    pub fn prepare(&self, context: &TestContext, settings: Settings) -> ExplicitVisibility {
        ExplicitVisibility::prepare(context, &self.stage(), settings).unwrap()
    }
}

pub fn solve(context: &TestContext, method: &ExplicitVisibility, world: &World, bounces: u32) -> Solution {
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
