//! Links spread over frames: while surfaces move, each frame casts a budget of rays for new links and is lit along the
//! old ones, which are as old as they are. Once all elements have been asked, the new links take the old ones' place.
//!
//! Shadow rays are cast anew in every frame: direct light is never old. Elements are where they are now; only who sees
//! whom is late. Where surfaces stand still again, frames go on until the links are those of their places, bit for bit
//! what [`ExplicitVisibility::follow`] makes of them.
//!
//! [Schmitz2008] makes links beside the rendering on another device; a budget needs no second one.
//!
//! [Schmitz2008]: crate::methods::PAPERS

use super::linking::Linked;
use super::{ExplicitError, ExplicitVisibility, Report, Stage};
use crate::gpu::Context;
use crate::stages::links::Outcomes;

/// What is known of the age of links, in frames.
#[derive(Default)]
pub(super) struct Ages {
    /// Frames so far.
    frame: u32,
    /// The frame in which surfaces moved last.
    moved: u32,
    /// Per element: the frame in which its links were made; all now where empty.
    made: Vec<u32>,
    /// The frame in which the first of them was.
    begun: u32,
    pending: Option<Pending>,
    /// Of the links under way, or of those before the present ones.
    outcomes: Option<Outcomes>,
}

/// Links under way, which [`super::linking::Linking`] holds.
struct Pending {
    made: Vec<u32>,
    begun: u32,
}

impl Ages {
    /// All links are those of now.
    pub fn renew(&mut self) {
        let outcomes = self.outcomes.take();
        *self = Self { frame: self.frame, moved: self.frame, begun: self.frame, outcomes, ..Self::default() };
    }
}

impl ExplicitVisibility {
    /// Follows surfaces as [`Self::follow`] does, with at most so many rays for links (one element's at least); they
    /// moved since the last frame if `has_moved`.
    pub fn follow_within(
        &mut self,
        context: &Context,
        stage: &Stage<'_>,
        rays: u32,
        has_moved: bool,
    ) -> Result<(), ExplicitError> {
        let mut recorder = context.recorder("explicit-visibility")?;
        self.elements.place(&mut recorder, stage.world);
        self.elements.update_materials(&mut recorder, stage.world);
        recorder.submit()?;
        self.ages.frame += 1;
        if has_moved {
            self.ages.moved = self.ages.frame;
        }
        if self.is_stale() {
            self.relink(context, stage, rays)?;
        }
        let mut recorder = context.recorder("explicit-visibility")?;
        self.trace_emitters(&mut recorder, stage);
        self.trace_lights(&mut recorder, stage);
        Ok(recorder.submit()?)
    }

    /// The next of the links to come. After an error they start anew.
    fn relink(&mut self, context: &Context, stage: &Stage<'_>, rays: u32) -> Result<(), ExplicitError> {
        let Self { settings, elements, sizes, linking, ages, .. } = self;
        let frame = ages.frame;
        let outcomes = match &mut ages.outcomes {
            Some(outcomes) => outcomes,
            none => none.insert(Outcomes::new(context, elements.count, settings.rays_per_element.get())?),
        };
        let linked = Linked { settings, elements, outcomes, sizes };
        let mut pending = ages.pending.take().unwrap_or_else(|| {
            linking.start_at(0);
            Pending { made: Vec::new(), begun: frame }
        });
        let mut left = sizes.elements_of(rays);
        while left > 0 && !linking.is_done(elements) {
            let done = linking.step(context, stage, linked, left)?;
            pending.made.extend(done.clone().map(|_| frame));
            left -= (done.len() as u32).min(left);
        }
        if !linking.is_done(elements) {
            ages.pending = Some(pending);
            return Ok(());
        }
        linking.swap(&mut self.links);
        std::mem::swap(&mut self.outcomes, outcomes);
        (ages.made, ages.begun) = (pending.made, pending.begun);
        self.report =
            Report::new(context, &self.settings, &self.elements, &self.emitters, &self.links, &self.outcomes)?;
        Ok(())
    }

    /// Whether surfaces have moved since the links were made.
    pub fn is_stale(&self) -> bool {
        self.ages.begun < self.ages.moved
    }

    /// Frames since the links of each element were made; none where all are of this one.
    pub fn link_ages(&self) -> Vec<u32> {
        let ages = &self.ages;
        match (self.is_stale(), ages.made.is_empty()) {
            (false, _) => Vec::new(),
            (true, true) => vec![ages.frame - ages.begun; self.elements.count as usize],
            (true, false) => ages.made.iter().map(|made| ages.frame - made).collect(),
        }
    }

    /// Of the oldest links.
    pub fn oldest_link(&self) -> u32 {
        self.link_ages().into_iter().max().unwrap_or(0)
    }
}
