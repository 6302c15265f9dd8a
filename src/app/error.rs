//! How a command ends when it does not end well: the message and the exit code.

use std::error::Error;
use std::io;

use crate::gpu::{CaptureError, GpuError};
use crate::methods::settings::SettingError;
use crate::report::errors::CompareError;
use crate::report::image::PictureError;
use crate::report::profile::ProfileError;
use crate::report::write::FileError;
use crate::stages::work::Interrupted;

/// Why a command failed. Messages say what failed, the value seen, what was allowed and what to do next.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// Wrong usage that clap cannot see; exit code 2.
    #[error("{0}\n\nFor more information, try '--help'.")]
    Usage(String),
    /// The work failed; exit code 1.
    #[error(transparent)]
    Failed(Box<dyn Error + Send + Sync>),
    /// A limit of `diff` was exceeded; exit code 1.
    #[error("{0}")]
    AboveLimit(String),
    /// The user stopped the work; exit code 1.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// The user stopped the work when some of it could already be shown; exit code 1.
    #[error("interrupted after {0}; the picture shows the light until then")]
    Partial(String),
    /// No usable GPU; exit code 3.
    #[error(transparent)]
    NoGpu(GpuError),
    /// Standard output could not be written; exit code 1, or 0 where its reader merely went away.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] io::Error),
}

impl AppError {
    /// Any error of the work itself.
    pub fn failed(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Failed(error.into())
    }

    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Failed(_) | Self::AboveLimit(_) | Self::Interrupted(_) | Self::Partial(_) | Self::Output(_) => 1,
            Self::Usage(_) => 2,
            Self::NoGpu(_) => 3,
        }
    }

    /// Whether the reader of standard output closed it (`linklight methods | head`).
    pub fn is_closed_pipe(&self) -> bool {
        matches!(self, Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}

impl From<SettingError> for AppError {
    fn from(error: SettingError) -> Self {
        Self::Usage(error.to_string())
    }
}

impl From<GpuError> for AppError {
    fn from(error: GpuError) -> Self {
        if error.is_no_device() { Self::NoGpu(error) } else { Self::failed(error) }
    }
}

macro_rules! failed_from {
    ($($error:ty),*) => {
        $(impl From<$error> for AppError {
            fn from(error: $error) -> Self {
                Self::failed(error)
            }
        })*
    };
}
failed_from!(CaptureError, CompareError, FileError, PictureError, ProfileError, serde_json::Error);
