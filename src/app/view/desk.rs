//! Between the window and the thread that renders: the newest request goes one way, films and progress the other.
//! The window never waits.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::comparison::{Compared, OtherJob};
use super::engine::{Depth, Engine, Picked, change};
use crate::app::AppError;
use crate::app::frame::SAMPLING_TASKS;
use crate::app::render::RenderRequest;
use crate::gpu::{Capture, Context};
use crate::report::explanation::Explanation;
use crate::report::profile::SceneFacts;
use crate::report::trace::TimeLine;
use crate::scene::camera::View;
use crate::stages::film::Film;
use crate::stages::work::{Interrupted, Unwatched, Watch};
use glam::UVec2;

/// How often progress is told.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);

/// A picture that is wanted.
#[derive(Clone)]
pub struct Job {
    pub request: RenderRequest,
    /// One sample a pixel, and not to be left half-way: the picture while something moves.
    pub is_preview: bool,
    /// Prepared anew even where nothing changed: a shader did.
    pub is_anew: bool,
}

/// A picture that is there.
pub struct Shown {
    pub film: Arc<Film>,
    pub job: Job,
    pub view: View,
    /// World-space corners of the scene.
    pub bounds: [glam::Vec3; 2],
    pub facts: SceneFacts,
    /// Of the scene's longest clip; 0 where nothing moves.
    pub duration: f32,
    /// Of the scene's cameras.
    pub cameras: Vec<String>,
    /// Names and intensities of the scene's lights, as edited.
    pub lights: Vec<(String, glam::Vec3)>,
    /// From request to film.
    pub milliseconds: f64,
    /// Frames since the oldest links were made, where newer ones are under way.
    pub link_age: Option<u32>,
}

/// What the work says while it lasts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Progress {
    pub task: String,
    pub done: u64,
    pub total: u64,
}

/// What has become of the work since it was last asked.
#[derive(Default)]
pub struct News {
    pub shown: Option<Shown>,
    /// Why there is no picture.
    pub failure: Option<String>,
    pub progress: Option<Progress>,
    pub is_working: bool,
    /// The other picture of a comparison.
    pub compared: Option<Compared>,
    /// Another picture is being made, or made finer.
    pub is_comparing: bool,
    /// A pixel, explained.
    pub explanation: Option<Explanation>,
    /// What was clicked at; the inner `None` is the background.
    pub picked: Option<Option<Picked>>,
    /// What a copy moves, bytes a millisecond, once it was asked for.
    pub bandwidth: Option<f64>,
    /// The GPU is gone: nothing more will come.
    pub end: Option<AppError>,
}

#[derive(Default)]
struct Papers {
    job: Option<Job>,
    /// A pixel that was clicked at.
    pick: Option<UVec2>,
    explain: Option<UVec2>,
    other: Option<OtherJob>,
    wants_bandwidth: bool,
    news: News,
    is_cancelled: bool,
    is_closing: bool,
}

/// A capture of one picture, and which.
pub struct Capturing<'c> {
    /// Until it is taken.
    pub capture: Option<Capture<'c>>,
    /// Counted from 1; the first in full quality where none is named.
    pub picture: Option<u32>,
}

impl<'c> Capturing<'c> {
    /// Renders picture `number`, and captures it where it is the one.
    fn render(
        &mut self,
        engine: &mut Engine<'c>,
        job: &Job,
        number: u32,
        watch: &dyn Watch,
    ) -> Result<Arc<Film>, AppError> {
        let mut film = None;
        if self.picture.is_none() {
            film = Some(engine.render(&job.request, watch)?);
        }
        let is_the_one = self.picture.map_or(!job.is_preview, |picture| picture == number);
        let Some(mut capture) = self.capture.take_if(|_| is_the_one) else {
            return film.map_or_else(|| engine.render(&job.request, watch), Ok);
        };
        capture.start();
        // Where it is made for a second time everything is prepared: the capture holds a frame and nothing else.
        let unwatched = film.is_some();
        match engine.render(&job.request, if unwatched { &Unwatched } else { watch }) {
            Ok(film) => Ok(capture.finish().map(|()| film)?),
            Err(error) => {
                // A newer picture was asked for meanwhile: that one, then.
                capture.abandon();
                self.capture = Some(capture);
                Err(error)
            }
        }
    }
}

/// One thing for the renderer to do.
enum Order {
    Picture(Box<Job>),
    Pick(UVec2),
    Explain(UVec2),
    Bandwidth,
    Other(Box<OtherJob>),
}

/// Shared by the two threads.
pub struct Desk {
    papers: Mutex<Papers>,
    wake: Condvar,
    /// Called when there is news.
    tell: Box<dyn Fn() + Send + Sync>,
}

impl Desk {
    pub fn new(tell: impl Fn() + Send + Sync + 'static) -> Self {
        Self { papers: Mutex::default(), wake: Condvar::new(), tell: Box::new(tell) }
    }

    /// Asks for a picture in place of any that was asked for and not begun.
    pub fn ask(&self, job: Job) {
        let mut papers = self.lock();
        papers.job = Some(job);
        papers.is_cancelled = false;
        papers.news.is_working = true;
        papers.news.failure = None;
        drop(papers);
        self.wake.notify_all();
    }

    /// Asks what a pixel of the last picture shows.
    pub fn pick(&self, pixel: UVec2) {
        self.lock().pick = Some(pixel);
        self.wake.notify_all();
    }

    /// Asks what makes up a pixel of the last picture.
    pub fn explain(&self, pixel: UVec2) {
        self.lock().explain = Some(pixel);
        self.wake.notify_all();
    }

    /// Asks for another picture to compare the picture with, or for none.
    pub fn compare(&self, other: Option<OtherJob>) {
        let mut papers = self.lock();
        papers.news.is_comparing = other.is_some();
        papers.news.compared = None;
        papers.other = other;
        drop(papers);
        self.wake.notify_all();
    }

    /// Asks what a copy moves on this device.
    pub fn measure_bandwidth(&self) {
        self.lock().wants_bandwidth = true;
        self.wake.notify_all();
    }

    /// Ends the work that is being done, without a picture.
    pub fn cancel(&self) {
        let mut papers = self.lock();
        papers.is_cancelled = true;
        papers.job = None;
    }

    /// Ends the other thread.
    pub fn close(&self) {
        self.lock().is_closing = true;
        self.wake.notify_all();
    }

    /// What has happened since the last call; progress and failure stay until something newer comes.
    pub fn news(&self) -> News {
        let mut papers = self.lock();
        let news = &mut papers.news;
        News {
            shown: news.shown.take(),
            failure: news.failure.clone(),
            progress: news.progress.clone(),
            is_working: news.is_working,
            compared: news.compared.take(),
            is_comparing: news.is_comparing,
            explanation: news.explanation.take(),
            picked: news.picked.take(),
            bandwidth: news.bandwidth.take(),
            end: news.end.take(),
        }
    }

    /// Whether a picture or a failure has come that was not taken yet.
    pub fn news_are_waiting(&self) -> bool {
        let papers = self.lock();
        papers.news.shown.is_some() || papers.news.end.is_some() || papers.news.is_working
    }

    /// Renders what is asked for until closed. Times go to `time_line`, where there is one.
    pub fn work<'c>(&self, mut engine: Engine<'c>, mut capturing: Option<Capturing<'c>>, time_line: Option<&TimeLine>) {
        let mut pictures = 0;
        let mut bench = Bench { context: engine.context(), other: None, request: None, film: None, compared: None };
        while let Some(order) = self.next() {
            let job = match order {
                Order::Picture(job) => *job,
                Order::Explain(pixel) => {
                    let watch = PlainWatch(self);
                    let Some(request) = &bench.request else { continue };
                    let result = engine.explain(request, pixel, &watch);
                    self.answer(result, engine.is_lost(), |news, found| news.explanation = Some(found));
                    continue;
                }
                Order::Other(job) => {
                    self.compare_once(*job, &mut engine, &mut bench);
                    continue;
                }
                Order::Pick(pixel) => {
                    let Some(request) = &bench.request else { continue };
                    self.answer(engine.pick(request, pixel), engine.is_lost(), |news, picked| {
                        news.picked = Some(picked)
                    });
                    continue;
                }
                Order::Bandwidth => {
                    let measured = engine.measure_bandwidth();
                    self.answer(measured, engine.is_lost(), |news, bandwidth| news.bandwidth = Some(bandwidth));
                    continue;
                }
            };
            let start = Instant::now();
            let watch = DeskWatch { desk: self, job: &job, told: Mutex::new(start) };
            if job.is_anew {
                engine.prepare_anew();
            }
            pictures += 1;
            let mut render = || match &mut capturing {
                Some(capturing) => capturing.render(&mut engine, &job, pictures, &watch),
                None => engine.render(&job.request, &watch),
            };
            let result = match time_line {
                Some(time_line) => time_line.span(&format!("picture {pictures}"), render),
                None => render(),
            };
            if result.is_err() {
                pictures -= 1;
            }
            let mut papers = self.lock();
            papers.news.progress = None;
            papers.news.is_working = papers.job.is_some();
            match (result, engine.stage()) {
                (Ok(film), Some(stage)) => {
                    bench.film = (!job.is_preview).then(|| Arc::clone(&film));
                    bench.request = Some(job.request.clone());
                    papers.news.shown = Some(Shown {
                        film,
                        view: stage.view,
                        bounds: stage.bounds,
                        facts: stage.facts(),
                        duration: stage.scene.clips.iter().map(|clip| clip.duration).fold(0.0, f32::max),
                        lights: stage.scene.lights.iter().map(|light| (light.name.clone(), light.intensity)).collect(),
                        cameras: stage.scene.cameras.iter().map(|camera| camera.name.clone()).collect(),
                        milliseconds: start.elapsed().as_secs_f64() * 1e3,
                        link_age: engine.link_age(),
                        job,
                    });
                }
                (Ok(_), None) => {}
                (Err(error), _) if engine.is_lost() => papers.news.end = Some(error),
                (Err(error), _) if is_interruption(&error) && papers.job.is_some() => {}
                (Err(error), _) if is_interruption(&error) => papers.news.failure = Some("cancelled".into()),
                (Err(error), _) => papers.news.failure = Some(error.to_string()),
            }
            drop(papers);
            (self.tell)();
        }
    }

    /// One step of another picture; what is left of it is asked for again, unless something newer was.
    fn compare_once(&self, job: OtherJob, engine: &mut Engine<'_>, bench: &mut Bench<'_>) {
        let Some(film) = bench.film.clone() else { return };
        let context = bench.context;
        let other = bench.other.get_or_insert_with(|| Engine::new(context));
        let watch = PlainWatch(self);
        let before = bench.compared.as_ref().filter(|compared| change(&compared.own, &job.own).is_none());
        let result = job.clone().work(context, (engine, other), &film, before, &watch);
        let mut papers = self.lock();
        match result {
            Ok((compared, rest)) => {
                bench.compared = compared.or(bench.compared.take());
                // Unless another comparison was asked for meanwhile.
                if papers.other.is_none() && papers.news.is_comparing {
                    papers.news.compared.clone_from(&bench.compared);
                    papers.news.is_comparing = rest.is_some();
                    papers.other = rest;
                }
            }
            Err(error) if context.is_lost() => papers.news.end = Some(error),
            Err(error) if is_interruption(&error) => {
                if papers.other.is_none() && papers.news.is_comparing && !papers.is_cancelled {
                    papers.other = Some(job);
                }
            }
            Err(error) => papers.news.failure = Some(error.to_string()),
        }
        drop(papers);
        (self.tell)();
    }

    /// Puts what a small order brought, or its error, into the news.
    fn answer<T>(&self, result: Result<T, AppError>, is_lost: bool, put: impl FnOnce(&mut News, T)) {
        let mut papers = self.lock();
        match result {
            Ok(value) => put(&mut papers.news, value),
            Err(error) if is_lost => papers.news.end = Some(error),
            Err(error) => papers.news.failure = Some(error.to_string()),
        }
        drop(papers);
        (self.tell)();
    }

    fn next(&self) -> Option<Order> {
        let mut papers = self.lock();
        loop {
            if papers.is_closing {
                return None;
            }
            if let Some(job) = papers.job.take() {
                return Some(Order::Picture(Box::new(job)));
            }
            if let Some(pixel) = papers.pick.take() {
                return Some(Order::Pick(pixel));
            }
            if let Some(pixel) = papers.explain.take() {
                return Some(Order::Explain(pixel));
            }
            if std::mem::take(&mut papers.wants_bandwidth) {
                return Some(Order::Bandwidth);
            }
            if let Some(job) = papers.other.take() {
                return Some(Order::Other(Box::new(job)));
            }
            papers = self.wake.wait(papers).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Papers> {
        lock(&self.papers)
    }
}

/// Locks, going on after a panic elsewhere: what is guarded is whole between statements.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Methods wrap the interruption in errors of their own.
fn is_interruption(error: &AppError) -> bool {
    if matches!(error, AppError::Partial(_)) {
        return true;
    }
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(error);
    while let Some(error) = cause {
        if error.is::<Interrupted>() || error.to_string() == Interrupted.to_string() {
            return true;
        }
        cause = error.source();
    }
    false
}

/// What the renderer keeps of a comparison.
struct Bench<'c> {
    context: &'c Context,
    other: Option<Engine<'c>>,
    /// Of the last picture.
    request: Option<RenderRequest>,
    /// The picture, in full quality.
    film: Option<Arc<Film>>,
    compared: Option<Compared>,
}

/// Ends work that anything else is more urgent than.
struct PlainWatch<'d>(&'d Desk);

impl Watch for PlainWatch<'_> {
    fn step(&self, task: &str, done: u64, total: u64) -> Result<(), Interrupted> {
        let mut papers = self.0.lock();
        if papers.is_closing || papers.is_cancelled || papers.job.is_some() {
            return Err(Interrupted);
        }
        papers.news.progress = Some(Progress { task: task.to_owned(), done, total });
        Ok(())
    }
}

struct DeskWatch<'d> {
    desk: &'d Desk,
    job: &'d Job,
    told: Mutex<Instant>,
}

impl Watch for DeskWatch<'_> {
    fn step(&self, task: &str, done: u64, total: u64) -> Result<(), Interrupted> {
        let mut papers = self.desk.lock();
        if papers.is_closing || papers.is_cancelled {
            return Err(Interrupted);
        }
        // A newer request makes this work vain where it needs other links, or where the work is one picture of many.
        if let Some(newer) = &papers.job {
            let depth = change(&self.job.request, &newer.request);
            let is_sampling = SAMPLING_TASKS.contains(&task) && !self.job.is_preview;
            if depth >= Some(Depth::Method) || (is_sampling && depth.is_some()) {
                return Err(Interrupted);
            }
        }
        papers.news.progress = Some(Progress { task: task.to_owned(), done, total });
        drop(papers);
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if told.elapsed() >= PROGRESS_INTERVAL {
            *told = Instant::now();
            (self.desk.tell)();
        }
        Ok(())
    }
}
