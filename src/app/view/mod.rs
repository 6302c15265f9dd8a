//! `linklight view`: a scene in a window, rendered by the same code as `linklight render`.
//!
//! | module | what |
//! |---|---|
//! | [`engine`] | from a request to a film, doing again only what changed |
//! | [`desk`] | between the window's thread and the one that renders |
//! | [`window`] | the window: events in, frames out |
//! | [`viewer`] | what the user did: the state that decides the picture |
//! | [`comparison`] | another method or the reference beside the picture |
//! | [`input`] | keys and the mouse over the picture |
//! | [`panel`] | the panel beside the picture |
//! | [`settings`] | a widget for every setting, from its declaration |
//! | [`editor`] | materials, lights and places, changed |
//! | [`profiler`] | what the passes cost |
//! | [`camera`] | orbit and fly |
//!
//! The window's thread only ever draws the last film and the interface, so link generation never stops it.

mod camera;
mod comparison;
mod desk;
mod editor;
mod engine;
mod input;
mod panel;
mod profiler;
mod settings;
mod viewer;
mod window;

use std::sync::{Arc, Mutex};

use serde_json::Map;
use winit::event_loop::EventLoop;

use super::AppError;
use super::cli::{Global, ViewArgs};
use super::crash;
use super::render::{check_validation, device_options};
use crate::gpu::{Capture, Context, Options, ShaderWatcher, prepare_capture};
use crate::report::trace::TimeLine;
use crate::report::write::check_writable;
use desk::{Capturing, Desk};
use engine::Engine;
use viewer::Viewer;
use window::ViewWindow;

struct Closing<'d>(&'d Desk);

impl Drop for Closing<'_> {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Opens the window and stays until it is closed.
pub fn run(args: &ViewArgs, global: &Global) -> Result<(), AppError> {
    if !args.shots.is_dir() {
        return Err(AppError::Usage(format!("--shots {} is no folder; make it first", args.shots.display())));
    }
    for path in [&args.capture, &args.profile, &args.trace].into_iter().flatten() {
        check_writable(path)?;
    }
    if args.capture.is_some() {
        prepare_capture()?;
    }
    // The options of the last picture that was asked for.
    let asked = Arc::new(Mutex::new(String::new()));
    let viewer = Viewer::new(args, asked.clone())?;
    let shaders = args.shaders.as_deref().map(ShaderWatcher::new).transpose().map_err(AppError::Usage)?;
    let no_window = |error: winit::error::EventLoopError| {
        AppError::failed(format!("no window can be opened ({error}); `linklight render` needs none"))
    };
    let event_loop = EventLoop::<()>::with_user_event().build().map_err(no_window)?;
    let proxy = event_loop.create_proxy();
    let command = move || format!("linklight render {} -o again.png", desk::lock(&asked));
    let options = Options {
        presents: true,
        statistics: true,
        on_loss: Some(crash::hook(global, Map::new(), command)),
        ..device_options(global)
    };
    let context = Context::new(options)?;
    let info = context.info();
    tracing::info!("device {} {} ({})", info.index, info.name, info.driver);
    let capture = args.capture.as_ref().map(|path| Capture::new(&context, path)).transpose()?;
    let capturing = capture.map(|capture| Capturing { capture: Some(capture), picture: args.capture_frame });
    let time_line = args.trace.as_ref().map(|_| TimeLine::default());
    // A closed event loop needs no news.
    let desk = Arc::new(Desk::new(move || {
        let _ = proxy.send_event(());
    }));
    let result = std::thread::scope(|scope| {
        let renderer = std::thread::Builder::new().name("renderer".into());
        renderer.spawn_scoped(scope, || desk.work(Engine::new(&context), capturing, time_line.as_ref()))?;
        // However this ends, the renderer is not left waiting.
        let _closing = Closing(&desk);
        let mut window = ViewWindow::new(&context, &desk, viewer, shaders);
        let result = event_loop.run_app(&mut window).map_err(no_window);
        result?;
        window.finish()
    });
    let viewer = result?;
    viewer.write_measurements(&context, time_line.as_ref(), args)?;
    check_validation(&context)
}
