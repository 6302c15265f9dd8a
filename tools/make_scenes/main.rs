//! Writes the built-in scenes: `cargo run --example make-scenes -- assets`.
//!
//! The same source writes the same bytes; `tests/builtin_scenes.rs` holds the committed files to it.

mod scenes;

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: make-scenes FOLDER [NAME ...]");
        return ExitCode::from(2);
    };
    let chosen: Vec<String> = std::env::args().skip(2).collect();
    for (name, make) in scenes::ALL {
        if !chosen.is_empty() && !chosen.iter().any(|c| c == name) {
            continue;
        }
        let glb = make().glb();
        let path = folder.join(format!("{name}.glb"));
        if let Err(error) = std::fs::write(&path, &glb) {
            eprintln!("cannot write {}: {error}", path.display());
            return ExitCode::FAILURE;
        }
        println!("{:<24} {:>8} bytes", path.display(), glb.len());
    }
    ExitCode::SUCCESS
}
