//! `linklight render --capture`: a frame capture that RenderDoc can open, of the same picture, with everything named.
//! And GFXReconstruct, from outside: it changes no picture, and what it captured replays without validation messages.
//!
//! Needs the two tools; without RenderDoc only its absence is tested.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

fn linklight(folder: &Path, options: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_linklight"));
    command.current_dir(folder).args(options.split_whitespace());
    command.env_remove("ENABLE_VULKAN_RENDERDOC_CAPTURE");
    command
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Runs to the end without a word.
fn succeed(mut command: Command) {
    let output = command.output().unwrap();
    assert!(output.status.success() && output.stdout.is_empty(), "{command:?}: {}\n{}", output.status, text(&output));
}

/// The capture as RenderDoc's own tool writes it: one element per line.
fn as_xml(folder: &Path, capture: &str) -> String {
    let converted = Command::new("renderdoccmd")
        .args(["convert", "-f", capture, "-o", "capture.xml", "-c", "xml"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(converted.status.success(), "{}", text(&converted));
    std::fs::read_to_string(folder.join("capture.xml")).unwrap()
}

fn is_installed(tool: &str, package: &str) -> bool {
    let found = Command::new(tool).arg("--version").output().is_ok();
    if !found {
        println!("skipped: {tool} is not installed (package {package}; tools/setup --test installs it)");
    }
    found
}

/// A recorded call: its name and the lines of its arguments.
struct Call<'x> {
    name: &'x str,
    lines: Vec<&'x str>,
}

fn attribute<'x>(line: &'x str, name: &str) -> Option<&'x str> {
    let (_, rest) = line.split_once(&format!(" {name}=\""))?;
    rest.split('"').next()
}

fn content(line: &str) -> &str {
    line.split_once('>').and_then(|(_, rest)| rest.split('<').next()).unwrap_or("")
}

fn calls(xml: &str) -> Vec<Call<'_>> {
    let mut calls: Vec<Call<'_>> = Vec::new();
    for line in xml.lines() {
        match (line.trim_start().starts_with("<chunk "), attribute(line, "name")) {
            (true, Some(name)) => calls.push(Call { name, lines: Vec::new() }),
            _ => calls.iter_mut().last().into_iter().for_each(|call| call.lines.push(line)),
        }
    }
    calls
}

/// Kinds of object that a reader of a capture meets, and the calls that make them.
const MADE: [(&str, &str); 10] = [
    ("vkCreateBuffer", "VkBuffer"),
    ("vkCreateImage", "VkImage"),
    ("vkCreateImageView", "VkImageView"),
    ("vkCreateSampler", "VkSampler"),
    ("vkCreateShaderModule", "VkShaderModule"),
    ("vkCreatePipelineLayout", "VkPipelineLayout"),
    ("vkCreateComputePipelines", "VkPipeline"),
    ("vkCreateGraphicsPipelines", "VkPipeline"),
    ("vkAllocateDescriptorSets", "VkDescriptorSet"),
    ("vkAllocateCommandBuffers", "VkCommandBuffer"),
];

/// Kinds and numbers of objects made without a name, and how many objects there are.
fn unnamed(calls: &[Call<'_>]) -> (Vec<String>, usize) {
    let (mut made, mut named) = (Vec::new(), BTreeSet::new());
    for call in calls {
        // Of the objects mentioned, the last one is the result.
        let objects = |kind: &str| {
            let of_kind = call.lines.iter().filter(|line| attribute(line, "typename") == Some(kind));
            of_kind.map(|line| content(line).to_owned()).next_back()
        };
        if call.name == "vkSetDebugUtilsObjectNameEXT" {
            let name = call.lines.iter().find(|line| attribute(line, "name") == Some("ObjectName"));
            if name.is_some_and(|line| !content(line).is_empty()) {
                named.extend(objects("ResourceId"));
            }
        }
        for (_, kind) in MADE.iter().filter(|(maker, _)| *maker == call.name) {
            made.extend(objects(kind).map(|object| (*kind, object)));
        }
    }
    let count = made.len();
    let without = made.into_iter().filter(|(_, object)| !named.contains(object));
    (without.map(|(kind, object)| format!("{kind} {object}")).collect(), count)
}

/// Work outside of a label of its own within that of its submission, and the labels around each piece of work.
fn unlabelled(calls: &[Call<'_>]) -> (Vec<String>, Vec<String>) {
    const WORK: [&str; 5] = ["vkCmdDispatch", "vkCmdDraw", "vkCmdCopy", "vkCmdFill", "vkCmdBlit"];
    let (mut outside, mut labels, mut open) = (Vec::new(), Vec::new(), Vec::<&str>::new());
    for call in calls {
        match call.name {
            "vkCmdBeginDebugUtilsLabelEXT" => {
                let name = call.lines.iter().find(|line| attribute(line, "name") == Some("pLabelName"));
                open.push(name.map_or("", |line| content(line)));
            }
            "vkCmdEndDebugUtilsLabelEXT" => drop(open.pop()),
            work if WORK.iter().any(|kind| work.starts_with(kind)) => match open.as_slice() {
                [_, .., pass] if pass.contains('/') => labels.push(open.join(" > ")),
                _ => outside.push(format!("{work} in {open:?}")),
            },
            _ => {}
        }
    }
    outside.extend(open.iter().map(|label| format!("label {label} was not closed")));
    (outside, labels)
}

fn check_capture(folder: &Path, options: &str, marks: &[&str]) {
    let scene = "render builtin:cornell-box --size 24x16 --elements 300 --bounces 1 --frames 2 --quiet --validate";
    succeed(linklight(folder, &format!("{scene} {options} -o plain.exr")));
    std::fs::write(folder.join("frame.rdc"), "an older file").unwrap();
    succeed(linklight(folder, &format!("{scene} {options} -o captured.exr --capture frame.rdc")));
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(read("plain.exr") == read("captured.exr"), "{options}: the same bits under RenderDoc");
    assert!(read("frame.rdc").starts_with(b"RDOC"), "{options}: the file asked for is the capture");

    let xml = as_xml(folder, "frame.rdc");
    let found = calls(&xml);
    let (without_name, objects) = unnamed(&found);
    assert!(
        without_name.is_empty() && objects > 40,
        "{options}: {} of {objects}: {without_name:?}",
        without_name.len()
    );
    let (without_label, labels) = unlabelled(&found);
    assert!(without_label.is_empty() && labels.len() > 8, "{options}: {without_label:?}");
    for mark in marks {
        assert!(labels.iter().any(|label| label.contains(mark)), "{options}: no {mark} in {labels:#?}");
    }

    // The checks themselves: names and labels taken away are missed.
    let nameless = xml.replacen("name=\"vkSetDebugUtilsObjectNameEXT\"", "name=\"nothing\"", usize::MAX);
    assert!(unnamed(&calls(&nameless)).0.len() > 40);
    let bare = xml.replacen("name=\"vkCmdBeginDebugUtilsLabelEXT\"", "name=\"nothing\"", 3);
    assert!(!unlabelled(&calls(&bare)).0.is_empty());

    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().flatten().map(|e| e.file_name()).collect();
    files.sort();
    assert_eq!(files, ["capture.xml", "captured.exr", "frame.rdc", "plain.exr"], "nothing else is left behind");
}

#[test]
fn a_capture_shows_the_last_frame_in_words() {
    if !is_installed("renderdoccmd", "renderdoc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let marks = ["frame > explicit-visibility", "display/vertex", "gather/", "display/visible_triangles"];
    check_capture(folder.path(), "--method explicit-visibility", &marks);
    let folder = tempfile::tempdir().unwrap();
    check_capture(folder.path(), "--method path-tracing --spp 2", &["frame > path-tracing"]);
}

/// Frames and the writing of the capture, in the order in which they happened.
#[test]
fn the_frame_that_is_named_is_captured() {
    if !is_installed("renderdoccmd", "renderdoc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = "render builtin:cornell-box --size 8x8 --method path-tracing --spp 1 --frames 3 --quiet -o a.exr";
    let capture = format!("{scene} --capture frame.rdc --trace a.json --capture-frame");
    succeed(linklight(folder.path(), &format!("{capture} 2")));
    assert!(std::fs::read(folder.path().join("frame.rdc")).unwrap().starts_with(b"RDOC"));
    let trace: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let mut spans: Vec<(f64, &str)> = trace["traceEvents"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|event| Some((event["ts"].as_f64()?, event["name"].as_str()?)))
        .filter(|(_, name)| *name == "write capture" || name.len() == 7 && name.starts_with("frame "))
        .collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    let names: Vec<&str> = spans.into_iter().map(|(_, name)| name).collect();
    assert_eq!(names, ["frame 1", "frame 2", "write capture", "frame 3"]);

    let refused = linklight(folder.path(), &format!("{capture} 4")).output().unwrap();
    assert!(refused.status.code() == Some(2) && text(&refused).contains("there are 3 frames"), "{}", text(&refused));
}

/// The loader is shown no layers of the system: as if RenderDoc were not there.
#[test]
fn without_renderdoc_nothing_is_rendered_and_the_message_says_what_to_install() {
    if Path::new("/etc/vulkan/implicit_layer.d").read_dir().is_ok_and(|mut entries| entries.next().is_some()) {
        println!("skipped: layers are installed in /etc, where they cannot be hidden from the loader");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut command = linklight(folder.path(), "render builtin:cornell-box --size 8x8 -o picture.exr --capture a.rdc");
    command.env("XDG_DATA_DIRS", folder.path()).env("XDG_DATA_HOME", folder.path()).env("HOME", folder.path());
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", text(&output));
    let message = text(&output);
    assert!(
        message.contains("RenderDoc, which is not installed") && message.contains("package `renderdoc`"),
        "{message}"
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is written");
}

#[test]
fn gfxreconstruct_changes_no_picture_and_replays_without_messages() {
    if !is_installed("gfxrecon-replay", "gfxreconstruct") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = "render builtin:cornell-box --size 24x16 --elements 300 --bounces 1 --quiet -o";
    succeed(linklight(folder.path(), &format!("{scene} plain.exr")));
    let mut captured = linklight(folder.path(), &format!("{scene} captured.exr"));
    captured.env("VK_INSTANCE_LAYERS", "VK_LAYER_LUNARG_gfxreconstruct").env("GFXRECON_LOG_LEVEL", "error");
    captured.env("GFXRECON_CAPTURE_FILE", "capture.gfxr").env("GFXRECON_CAPTURE_FILE_TIMESTAMP", "false");
    succeed(captured);
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("plain.exr") == read("captured.exr"), "the same bits while capturing");

    let replay = Command::new("gfxrecon-replay")
        .args(["--validate", "--log-level", "warning", "capture.gfxr"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    // A program without a window presents no frames.
    let said = text(&replay).replace("File did not contain any frames", "");
    assert!(replay.status.success() && said.trim().is_empty(), "{}: {said}", replay.status);
}
