//! What the frame asks of a method that solves on elements, whichever it is.

use super::AppError;
use crate::gpu::{Buffer, Context};
use crate::methods::antiradiance::{Antiradiance, Scheme};
use crate::methods::carried::Carried;
use crate::methods::explicit_visibility::{ExplicitVisibility, Stage};
use crate::methods::implicit_visibility::ImplicitVisibility;
use crate::methods::pick::{Pick, picked_element};
use crate::scene::camera::View;
use crate::stages::elements::Elements;
use crate::stages::splats::Splats;
use crate::stages::world::World;
use glam::{UVec2, Vec3};
use serde_json::Value;

/// A method whose solution is irradiance per element.
pub trait OnElements {
    /// The light of direct illumination and `bounces` more, with all that has to be made anew for a frame.
    fn solve(&mut self, context: &Context, stage: &Stage<'_>, bounces: u32) -> Result<(), AppError>;
    /// Takes over albedo and intensities that changed, without new links.
    fn relight(&self, context: &Context, world: &World) -> Result<(), AppError>;
    fn elements(&self) -> &Elements;
    /// What was made for it, in numbers: the method's report.
    fn facts(&self) -> serde_json::Result<Value>;
    /// From punctual lights, W/m2 per element.
    fn punctual_irradiance(&self) -> &Buffer<Vec3>;
    /// From emitters and the environment.
    fn direct_irradiance(&self) -> &Buffer<Vec3>;
    /// Reflected at least once.
    fn indirect_irradiance(&self) -> &Buffer<Vec3>;

    /// Direct (without punctual lights) and indirect light as the eye of `view` sees it, where surfaces reflect unevenly;
    /// by default as it is.
    fn look(&self, _: &Context, _: &World, _: &View) -> Result<(&Buffer<Vec3>, &Buffer<Vec3>), AppError> {
        Ok((self.direct_irradiance(), self.indirect_irradiance()))
    }

    /// As [`Self::solve`], with the links there are.
    fn solve_again(&mut self, context: &Context, stage: &Stage<'_>, bounces: u32) -> Result<(), AppError> {
        self.solve(context, stage, bounces)
    }

    /// Takes over surfaces and lights that moved (`has_moved`, else old links go on being made).
    fn follow(&mut self, context: &Context, stage: &Stage<'_>, has_moved: bool) -> Result<(), AppError>;

    /// Frames since the oldest links were made, where they are older than the surfaces' places.
    fn link_age(&self) -> Option<u32> {
        None
    }

    /// Angle between normals, radians, below which neighbours' indirect light is averaged; `None` without smoothing.
    fn smoothing(&self) -> Option<f32>;

    /// Whether a solve of fewer bounces is the first part of one of more.
    fn bounces_are_apart(&self) -> bool {
        true
    }

    /// Lets solves keep what [`Self::carried_to`] needs, or no longer.
    fn keep_sent(&mut self, _: &Context, _: bool) -> Result<(), AppError> {
        Ok(())
    }

    /// What each of `elements` received in the last bounce of the last solve, link by link; in all of them if
    /// [`Self::bounces_add_up`].
    fn carried_to(&self, context: &Context, elements: &[u32]) -> Result<Vec<Vec<Carried>>, AppError>;

    /// Whether each bounce sends the light of those before again.
    fn bounces_add_up(&self) -> bool {
        false
    }

    /// Whose light an element shows: its own, unless it is hidden.
    fn shown_by(&self, element: u32) -> u32 {
        element
    }

    /// Flat patches for the splatting display, if the method has them.
    fn splats(&self) -> Option<&Splats> {
        None
    }

    /// The colours of the debug view that the settings ask for, if they do, for a picture of `size` pixels.
    fn false_colors(&self, _: &Context, _: &World, _: &View, _: UVec2) -> Result<Option<Buffer<Vec3>>, AppError> {
        Ok(None)
    }
}

/// The element that a view is about.
fn picked(
    context: &Context,
    world: &World,
    elements: &Elements,
    pick: Pick,
    view: &View,
    size: UVec2,
) -> Result<Option<u32>, AppError> {
    let Pick::Pixel { .. } = pick else { return Ok(picked_element(pick, &[], &[], &[], view, size)) };
    let positions = context.download(&world.positions)?;
    let triangles = context.download(&world.triangles)?;
    Ok(picked_element(pick, &positions, &triangles, &elements.topology.back_elements, view, size))
}

/// What every method offers under the same names.
macro_rules! as_it_is {
    () => {
        fn relight(&self, context: &Context, world: &World) -> Result<(), AppError> {
            let mut recorder = context.recorder("relight")?;
            self.update_materials(&mut recorder, world);
            Ok(recorder.submit()?)
        }

        fn elements(&self) -> &Elements {
            Self::elements(self)
        }

        fn smoothing(&self) -> Option<f32> {
            let settings = self.settings();
            settings.smoothing.then(|| settings.feature_angle.to_radians())
        }

        fn facts(&self) -> serde_json::Result<Value> {
            serde_json::to_value(self.report())
        }

        fn punctual_irradiance(&self) -> &Buffer<Vec3> {
            Self::punctual_irradiance(self)
        }

        fn direct_irradiance(&self) -> &Buffer<Vec3> {
            Self::direct_irradiance(self)
        }

        fn indirect_irradiance(&self) -> &Buffer<Vec3> {
            Self::indirect_irradiance(self)
        }
    };
}

impl OnElements for ExplicitVisibility {
    fn solve(&mut self, context: &Context, stage: &Stage<'_>, bounces: u32) -> Result<(), AppError> {
        let mut recorder = context.recorder("frame")?;
        recorder.scope("explicit-visibility", |recorder| Self::solve(self, recorder, stage.world, bounces));
        Ok(recorder.submit()?)
    }

    fn follow(&mut self, context: &Context, stage: &Stage<'_>, has_moved: bool) -> Result<(), AppError> {
        let rays = self.settings().link_budget;
        let followed = match (rays, has_moved) {
            (0, false) => Ok(()),
            (0, true) => Self::follow(self, context, stage),
            (rays, has_moved) => self.follow_within(context, stage, rays, has_moved),
        };
        followed.map_err(AppError::failed)
    }

    fn link_age(&self) -> Option<u32> {
        self.is_stale().then(|| self.oldest_link())
    }

    fn false_colors(
        &self,
        context: &Context,
        world: &World,
        view: &View,
        size: UVec2,
    ) -> Result<Option<Buffer<Vec3>>, AppError> {
        if !self.shows_view() {
            return Ok(None);
        }
        let picked = picked(context, world, self.elements(), self.settings().pick, view, size)?;
        let colors = self.view_colors(context, picked)?;
        Ok(colors.map(|colors| context.upload("explicit/view colors", &colors)).transpose()?)
    }

    fn carried_to(&self, context: &Context, elements: &[u32]) -> Result<Vec<Vec<Carried>>, AppError> {
        elements.iter().map(|&element| Ok(Self::carried_to(self, context, element)?)).collect()
    }

    as_it_is!();
}

impl OnElements for ImplicitVisibility {
    fn solve(&mut self, context: &Context, stage: &Stage<'_>, bounces: u32) -> Result<(), AppError> {
        self.link(context, stage).map_err(AppError::failed)?;
        tracing::info!("{}", self.report());
        self.solve_again(context, stage, bounces)
    }

    /// Every solve makes all links anew.
    fn follow(&mut self, _: &Context, _: &Stage<'_>, _: bool) -> Result<(), AppError> {
        Ok(())
    }

    fn solve_again(&mut self, context: &Context, stage: &Stage<'_>, bounces: u32) -> Result<(), AppError> {
        let mut recorder = context.recorder("frame")?;
        recorder.scope("implicit-visibility", |recorder| Self::solve(self, recorder, stage.world, bounces));
        Ok(recorder.submit()?)
    }

    fn carried_to(&self, context: &Context, elements: &[u32]) -> Result<Vec<Vec<Carried>>, AppError> {
        elements.iter().map(|&element| Ok(Self::carried_to(self, context, element)?)).collect()
    }

    as_it_is!();

    fn look(&self, context: &Context, world: &World, view: &View) -> Result<(&Buffer<Vec3>, &Buffer<Vec3>), AppError> {
        let mut recorder = context.recorder("frame")?;
        recorder.scope("look", |recorder| Self::look(self, recorder, world, view));
        recorder.submit()?;
        Ok(self.shown_irradiance())
    }

    fn false_colors(
        &self,
        context: &Context,
        world: &World,
        view: &View,
        size: UVec2,
    ) -> Result<Option<Buffer<Vec3>>, AppError> {
        if !self.shows_view() {
            return Ok(None);
        }
        let picked = picked(context, world, self.elements(), self.settings().pick, view, size)?;
        let colors = self.view_colors(context, picked).map_err(AppError::failed)?;
        Ok(Some(context.upload("implicit/view colors", &colors)?))
    }
}

impl OnElements for Antiradiance {
    fn solve(&mut self, context: &Context, stage: &Stage<'_>, bounces: u32) -> Result<(), AppError> {
        Self::solve(self, context, stage.world, bounces, stage.watch).map_err(AppError::failed)?;
        if let (Some(last), true) = (self.residuals().last(), bounces > 0) {
            tracing::info!("{} steps, the last changed {:.2} % of the light", last.step, 100.0 * last.relative());
        }
        Ok(())
    }

    as_it_is!();

    fn look(&self, context: &Context, world: &World, view: &View) -> Result<(&Buffer<Vec3>, &Buffer<Vec3>), AppError> {
        let mut recorder = context.recorder("frame")?;
        recorder.scope("look", |recorder| Self::look(self, recorder, world, view));
        recorder.submit()?;
        Ok(self.shown_irradiance())
    }

    fn splats(&self) -> Option<&Splats> {
        Some(Self::splats(self))
    }

    fn follow(&mut self, context: &Context, stage: &Stage<'_>, has_moved: bool) -> Result<(), AppError> {
        if has_moved {
            Self::follow(self, context, stage, false).map_err(AppError::failed)?;
        }
        Ok(())
    }

    fn bounces_are_apart(&self) -> bool {
        self.settings().scheme == Scheme::Asymmetric
    }

    fn keep_sent(&mut self, context: &Context, keeps: bool) -> Result<(), AppError> {
        Ok(Self::keep_sent(self, context, keeps)?)
    }

    fn carried_to(&self, context: &Context, elements: &[u32]) -> Result<Vec<Vec<Carried>>, AppError> {
        Ok(Self::carried_to(self, context, elements)?)
    }

    fn shown_by(&self, element: u32) -> u32 {
        Self::shown_by(self, element)
    }

    fn bounces_add_up(&self) -> bool {
        true
    }

    fn false_colors(
        &self,
        context: &Context,
        world: &World,
        view: &View,
        size: UVec2,
    ) -> Result<Option<Buffer<Vec3>>, AppError> {
        let picked = picked(context, world, self.elements(), self.settings().pick, view, size)?;
        let colors = self.view_colors(context, picked).map_err(AppError::failed)?;
        Ok(colors.map(|colors| context.upload("antiradiance/view colors", &colors)).transpose()?)
    }
}
