//! What a run leaves behind: pictures, error figures, timings, traces.
//!
//! | module | what |
//! |---|---|
//! | [`image`] | [`image::Picture`]: linear RGB with named channels; PNG, EXR and HDR files |
//! | [`tonemap`] | scene-linear radiance to display bytes, the CPU twin of the display's last pass |
//! | [`errors`] | how far a picture is from a reference: RMSE, relative MSE, energy, SSIM, FLIP |
//! | [`bench_file`] | the file of `linklight bench` |
//! | [`compare_page`] | the page of `linklight compare` and its data |
//! | [`papers_page`] | the page of `linklight papers` and its data |
//! | [`pass_hashes`] | the `--hashes` file, and where two of them part |
//! | [`plot`] | log-log plots as SVG |
//! | [`profile`] | the `--profile` JSON file |
//! | [`trace`] | the `--trace` file for Perfetto and `chrome://tracing` |
//! | [`statistics`] | medians, intervals, and whether one thing is slower than another |
//! | [`table`] | the table of passes printed at exit |
//! | [`mod@write`] | files written whole or not at all |
//!
//! Nothing here touches the GPU: timings arrive as plain [`profile::PassRecord`]s.

pub mod bench_file;
pub mod compare_page;
pub mod errors;
pub mod explanation;
mod exr_file;
pub mod heat_map;
pub mod image;
pub mod papers_page;
pub mod pass_hashes;
pub mod plot;
mod png_file;
pub mod profile;
mod ssim;
pub mod statistics;
pub mod table;
pub mod tonemap;
pub mod trace;
pub mod write;
