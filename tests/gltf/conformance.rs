//! Valid scenes load, and hold what their makers say they hold.
//!
//! Runs over the shared scene collection, where there is one beside the checkout (or at `LINKLIGHT_SHARED`).

use crate::sound::assert_sound;
use crate::support::{gltf_files, shared};
use linklight::scene::{self, LoadOptions, Scene};
use std::path::Path;

fn load(path: &Path) -> Scene {
    scene::load(path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Triangles stored, triangles drawn (each mesh as often as nodes show it), and those dropped, from the notes.
fn triangle_counts(scene: &Scene) -> (usize, usize, usize) {
    let of_mesh = |mesh: &scene::Mesh| mesh.primitives.iter().map(|p| p.triangles.len()).sum::<usize>();
    let stored = scene.meshes.iter().map(of_mesh).sum();
    let drawn = scene.nodes.iter().filter_map(|node| node.mesh).map(|mesh| of_mesh(&scene.meshes[mesh as usize])).sum();
    let dropped = scene.notes.iter().find_map(|note| note.strip_suffix(" degenerate triangles were dropped."));
    (stored, drawn, dropped.map_or(0, |count| count.parse().unwrap()))
}

#[test]
fn every_shared_scene_loads_soundly() {
    let Some(folder) = shared("scenes") else { return };
    let files = gltf_files(&folder);
    assert!(files.len() > 90, "{} files", files.len());
    for file in files {
        let name = file.strip_prefix(&folder).unwrap().to_string_lossy().into_owned();
        match scene::load(&file, &LoadOptions::default()) {
            Ok(scene) => assert_sound(&scene, &name),
            // These two are made to be refused: a required minor version and a required unknown extension.
            Err(error) if name.ends_with("Compatibility_04.gltf") => assert!(error.to_string().contains("\"2.1\"")),
            Err(error) if name.ends_with("Compatibility_05.gltf") => {
                assert!(error.to_string().contains("FAKE_materials_quantumRendering"), "{error}");
            }
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn triangle_counts_match_the_manifest() {
    let Some(folder) = shared("scenes") else { return };
    let manifest = std::fs::read_to_string(folder.join("MANIFEST.md")).unwrap();
    let mut checked = 0;
    for row in manifest.lines().filter(|row| row.starts_with("| `")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let (name, triangles) = (cells[1].trim_matches('`'), cells[3]);
        let Some(stated) = triangles.split(' ').next().and_then(|count| count.parse::<usize>().ok()) else { continue };
        let drawn_stated = triangles.split(['(', ')']).nth(1).map(|count| count.parse::<usize>().unwrap());
        // The manifest counts all scenes of the file, of which one is loaded.
        if name.contains("MultipleScenes") {
            continue;
        }
        let scene = load(&folder.join(name));
        let (stored, drawn, dropped) = triangle_counts(&scene);
        assert!(stored + dropped == stated || drawn + dropped == stated, "{name}: {stored} + {dropped}, not {stated}");
        if let Some(drawn_stated) = drawn_stated {
            assert_eq!(drawn, drawn_stated, "{name}");
        }
        checked += 1;
    }
    assert!(checked > 35, "{checked} rows");
}
