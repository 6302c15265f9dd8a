//! Frame captures by RenderDoc's in-application interface, of programs without a window too.
//!
//! RenderDoc is a Vulkan layer: it must be in the process before the instance is made. [`prepare_capture`] sees to
//! that, [`Capture`] takes one frame: everything submitted between start and finish. It does not touch what is rendered,
//! but under RenderDoc a device offers fewer optional features, and calls itself Vulkan 1.2.

use super::context::Context;
use super::instance;
use renderdoc::{RenderDoc, V112};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The layer's switch: its manifest asks for this variable.
const SWITCH: &str = "ENABLE_VULKAN_RENDERDOC_CAPTURE";
const LAYER: &std::ffi::CStr = c"VK_LAYER_RENDERDOC_Capture";

/// Why there is no capture.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    #[error(
        "--capture needs RenderDoc, which is not installed: no Vulkan layer {}; install the package `renderdoc` \
         (tools/setup --test does) or get it from renderdoc.org, or leave --capture out", .0.to_string_lossy()
    )]
    NotInstalled(&'static std::ffi::CStr),
    #[error("RenderDoc's Vulkan layer is installed but was not loaded ({0}); unset DISABLE_VULKAN_RENDERDOC_CAPTURE*")]
    NotLoaded(renderdoc::Error),
    #[error("cannot start this program again under RenderDoc: {0}")]
    Restart(std::io::Error),
    #[error("the capture {path:?} cannot be written: {reason}")]
    Write { path: PathBuf, reason: String },
}

/// Makes sure that RenderDoc sees the instance about to be made. Where it is not in the process yet, this program is
/// started again with its layer switched on, with the same arguments: then this call does not return. Call it before
/// any other work.
pub fn prepare_capture() -> Result<(), CaptureError> {
    let is_loaded = RenderDoc::<V112>::new().is_ok();
    if is_loaded {
        return Ok(());
    }
    if !instance::has_layer(LAYER) {
        return Err(CaptureError::NotInstalled(LAYER));
    }
    if std::env::var_os(SWITCH).is_some_and(|value| value == "1") {
        return Ok(());
    }
    tracing::info!("starting again under RenderDoc");
    let program = std::env::current_exe().map_err(CaptureError::Restart)?;
    restart(Command::new(program).args(std::env::args_os().skip(1)).env(SWITCH, "1"))
}

/// Becomes `command`.
#[cfg(unix)]
fn restart(command: &mut Command) -> Result<(), CaptureError> {
    use std::os::unix::process::CommandExt as _;
    Err(CaptureError::Restart(command.exec()))
}

/// Runs `command` in place of this process and ends as it ended.
#[cfg(not(unix))]
fn restart(command: &mut Command) -> Result<(), CaptureError> {
    let status = command.status().map_err(CaptureError::Restart)?;
    std::process::exit(status.code().unwrap_or(1));
}

/// Takes captures on one context.
pub struct Capture<'c> {
    renderdoc: RenderDoc<V112>,
    target: PathBuf,
    /// Where RenderDoc writes: beside the target, so that the finished file is moved there at once.
    folder: tempfile::TempDir,
    is_running: bool,
    /// RenderDoc finds the device by itself, as long as there is one.
    device: PhantomData<&'c Context>,
}

impl<'c> Capture<'c> {
    /// Ready to capture into `target`. Fails where RenderDoc is not in the process; see [`prepare_capture`].
    pub fn new(_context: &'c Context, target: &Path) -> Result<Self, CaptureError> {
        let mut renderdoc = RenderDoc::<V112>::new().map_err(CaptureError::NotLoaded)?;
        let refuse = |reason: String| CaptureError::Write { path: target.to_owned(), reason };
        let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = tempfile::Builder::new()
            .prefix(".linklight-")
            .suffix(".part")
            .tempdir_in(parent)
            .map_err(|error| refuse(error.to_string()))?;
        let template = folder.path().join("capture");
        // The interface takes C strings in UTF-8.
        match template.to_str() {
            Some(text) if !text.contains('\0') => renderdoc.set_capture_file_path_template(text),
            _ => return Err(refuse("RenderDoc needs a path in UTF-8".into())),
        }
        Ok(Self { renderdoc, target: target.to_owned(), folder, is_running: false, device: PhantomData })
    }

    /// The frame begins: what is submitted from now on belongs to it.
    pub fn start(&mut self) {
        self.renderdoc.start_frame_capture(std::ptr::null(), std::ptr::null());
        self.is_running = true;
    }

    /// The frame came to nothing: what was captured of it is left out.
    pub fn abandon(&mut self) {
        self.end();
    }

    /// The frame ends: the capture appears at the target, whole.
    pub fn finish(mut self) -> Result<(), CaptureError> {
        let before = self.renderdoc.get_num_captures();
        self.end();
        let count = self.renderdoc.get_num_captures();
        // RenderDoc puts a number after the name.
        let written = (count > before).then(|| self.renderdoc.get_capture(count - 1)).flatten();
        let refuse = |reason: String| CaptureError::Write { path: self.target.clone(), reason };
        let Some((written, _)) = written else {
            return Err(refuse(
                "RenderDoc took no capture; its log in the folder RenderDoc of the temporary folder says why".into(),
            ));
        };
        std::fs::rename(&written, &self.target).map_err(|error| refuse(error.to_string()))?;
        tracing::info!("captured {}", self.target.display());
        Ok(())
    }

    fn end(&mut self) {
        if std::mem::take(&mut self.is_running) {
            self.renderdoc.end_frame_capture(std::ptr::null(), std::ptr::null());
        }
    }
}

impl Drop for Capture<'_> {
    /// A frame that was broken off leaves no file: RenderDoc's goes with its folder.
    fn drop(&mut self) {
        self.end();
        tracing::trace!("removing {}", self.folder.path().display());
    }
}
