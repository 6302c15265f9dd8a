//! The window: events in, frames out. It draws the last film there is, tone-mapped on the GPU, and the interface over
//! it; it never renders.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::UVec2;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

use super::desk::Desk;
use super::viewer::Viewer;
use crate::app::AppError;
use crate::display::interface::Interface;
use crate::display::tone_map::ToneMapping;
use crate::gpu::{Context, Format, Image, ImageDescription, Presenter, ShaderWatcher, Shape, WindowSource};

/// How often changed shaders are looked for.
const SHADER_INTERVAL: Duration = Duration::from_millis(200);
/// Behind the picture and where there is none yet; encoded values.
const BACKGROUND: [f32; 4] = [0.1, 0.1, 0.1, 1.0];

/// Handles the window's events; errors end the event loop and come out of [`Self::finish`].
pub struct ViewWindow<'c> {
    context: &'c Context,
    desk: &'c Desk,
    viewer: Viewer,
    shaders: Option<ShaderWatcher>,
    egui: egui::Context,
    open: Option<Open>,
    error: Option<AppError>,
    /// When the interface wants to be drawn again by itself.
    next_draw: Option<Instant>,
}

/// What there is while the window is open.
struct Open {
    // Before the window: it uses its surface.
    presenter: Presenter,
    input: egui_winit::State,
    interface: Interface,
    tone_mapping: ToneMapping,
    frame: Image,
    window: Arc<Window>,
    title: String,
}

impl<'c> ViewWindow<'c> {
    pub fn new(context: &'c Context, desk: &'c Desk, viewer: Viewer, shaders: Option<ShaderWatcher>) -> Self {
        let egui = egui::Context::default();
        Self { context, desk, viewer, shaders, egui, open: None, error: None, next_draw: None }
    }

    /// How it ended.
    pub fn finish(self) -> Result<Viewer, AppError> {
        self.error.map_or(Ok(self.viewer), Err)
    }

    fn open(&self, event_loop: &ActiveEventLoop) -> Result<Open, AppError> {
        let [width, height] = self.viewer.window_size();
        let attributes =
            Window::default_attributes().with_title("linklight").with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(event_loop.create_window(attributes).map_err(AppError::failed)?);
        let source: Arc<dyn WindowSource> = window.clone();
        let presenter = Presenter::new(self.context, source)?;
        let most = self.context.limits().image_extent as usize;
        let (scale, theme) = (window.scale_factor() as f32, window.theme());
        let input =
            egui_winit::State::new(self.egui.clone(), egui::ViewportId::ROOT, &window, Some(scale), theme, Some(most));
        Ok(Open {
            presenter,
            input,
            interface: Interface::new(self.context)?,
            tone_mapping: ToneMapping::new(self.context, 1)?,
            frame: frame_image(self.context, width, height)?,
            window,
            title: String::new(),
        })
    }

    fn draw(&mut self) -> Result<(), AppError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let PhysicalSize { width, height } = open.window.inner_size();
        if width == 0 || height == 0 {
            return Ok(());
        }
        if (open.frame.width, open.frame.height) != (width, height) {
            open.frame = frame_image(self.context, width, height)?;
        }
        // What a picture cost is there before the picture is.
        self.viewer.take_records(self.context.take_records());
        self.viewer.take_news(self.desk)?;
        if let Some(shaders) = &self.shaders {
            self.viewer.take_reloads(&shaders.poll(self.context));
        }
        self.viewer.memory = self.context.memory_by_owner();
        let input = open.input.take_egui_input(&open.window);
        let viewer = &mut self.viewer;
        let mut output = self.egui.run_ui(input, |ui| viewer.interface(ui, self.desk));
        open.interface.take_textures(std::mem::take(&mut output.textures_delta));
        open.input.handle_platform_output(&open.window, output.platform_output);
        self.viewer.do_actions(self.context, self.desk)?;
        let primitives = self.egui.tessellate(output.shapes, output.pixels_per_point);

        let mut recorder = self.context.recorder("window")?;
        recorder.clear_image(&open.frame, BACKGROUND);
        for picture in self.viewer.pictures() {
            if open.tone_mapping.pixels() < picture.film.pixel_count() {
                open.tone_mapping = ToneMapping::new(self.context, picture.film.pixel_count())?;
            }
            let corner = UVec2::from(picture.corner);
            let (film, parts, tone) = (picture.film, picture.parts, picture.tone);
            recorder.scope("tone map", |recorder| {
                open.tone_mapping.draw(recorder, film, parts, tone, &open.frame, corner);
            });
        }
        open.interface.update(self.context, &mut recorder, &primitives, output.pixels_per_point)?;
        open.interface.draw(&mut recorder, &open.frame);
        if std::mem::take(&mut self.viewer.wants_new_surface) {
            open.presenter.lose_surface(self.context);
        }
        open.window.pre_present_notify();
        open.presenter.present(self.context, recorder, &open.frame)?;
        self.viewer.frame_count += 1;

        let title = self.viewer.title();
        if title != open.title {
            open.window.set_title(&title);
            open.title = title;
        }
        let wait = output.viewport_output.get(&egui::ViewportId::ROOT).map_or(Duration::MAX, |root| root.repaint_delay);
        let wait = if self.viewer.is_moving() { Duration::ZERO } else { wait };
        let wait = if self.shaders.is_some() { wait.min(SHADER_INTERVAL) } else { wait };
        self.next_draw = Instant::now().checked_add(wait).filter(|_| wait < Duration::from_secs(60));
        Ok(())
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: AppError) {
        self.error.get_or_insert(error);
        event_loop.exit();
    }
}

impl ApplicationHandler for ViewWindow<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_none() {
            match self.open(event_loop) {
                Ok(open) => {
                    open.window.request_redraw();
                    self.open = Some(open);
                }
                Err(error) => self.fail(event_loop, error),
            }
        }
    }

    fn suspended(&mut self, _: &ActiveEventLoop) {
        if let Some(open) = &mut self.open {
            open.presenter.lose_surface(self.context);
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        if let Some(open) = &self.open {
            open.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.draw() {
                    self.fail(event_loop, error);
                } else if self.viewer.wants_to_quit {
                    event_loop.exit();
                }
            }
            event => {
                let response = open.input.on_window_event(&open.window, &event);
                if response.repaint || matches!(event, WindowEvent::Resized(_) | WindowEvent::Occluded(false)) {
                    open.window.request_redraw();
                }
            }
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(open) = &self.open else { return };
        if self.next_draw.is_some_and(|at| at <= Instant::now()) {
            self.next_draw = None;
            open.window.request_redraw();
        }
        event_loop.set_control_flow(self.next_draw.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}

fn frame_image(context: &Context, width: u32, height: u32) -> Result<Image, AppError> {
    Ok(context.image(&ImageDescription {
        name: "window/frame",
        width,
        height,
        layers: 1,
        mip_levels: 1,
        format: Format::Rgba8,
        shape: Shape::Flat,
    })?)
}
