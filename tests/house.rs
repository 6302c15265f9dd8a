//! Mechanical checks of the house rules: where `unsafe` may stand, file sizes, headers, banned phrases.
//!
//! Reads the sources as text and nothing else; each rule is also shown to find a planted breach.

use std::fs;
use std::path::{Path, PathBuf};

/// One file of the checkout: its path from the root with forward slashes, and its text.
struct Source {
    path: String,
    text: String,
}

impl Source {
    fn planted(path: &str, text: &str) -> Self {
        Self { path: path.into(), text: text.into() }
    }

    fn has_extension(&self, wanted: &[&str]) -> bool {
        Path::new(&self.path).extension().is_some_and(|e| wanted.iter().any(|w| e == *w))
    }

    fn is_rust(&self) -> bool {
        self.has_extension(&["rs"])
    }

    /// A shader with an entry point, as opposed to one that others include.
    fn is_pass(&self) -> bool {
        self.has_extension(&["comp", "vert", "frag"])
    }

    fn is_shader(&self) -> bool {
        self.is_pass() || self.has_extension(&["glsl"])
    }

    /// Lines with their number from 1, without what follows `//`.
    fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        self.text.lines().enumerate().map(|(i, line)| (i + 1, line.split("//").next().unwrap_or_default()))
    }
}

/// Every text file of the checkout, without build products and version control.
fn sources() -> Vec<Source> {
    fn visit(folder: &Path, root: &Path, found: &mut Vec<Source>) {
        for entry in fs::read_dir(folder).expect("the checkout is readable") {
            let path: PathBuf = entry.expect("the checkout is readable").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name == "target" || name == ".git" {
                continue;
            }
            if path.is_dir() {
                visit(&path, root, found);
            } else if name != "Cargo.lock"
                && let Ok(text) = fs::read_to_string(&path)
            {
                let path = path.strip_prefix(root).expect("below the root").to_string_lossy().replace('\\', "/");
                found.push(Source { path, text });
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    visit(root, root, &mut found);
    assert!(found.iter().any(|s| s.path == "src/lib.rs"), "found no src/lib.rs among {} files", found.len());
    found
}

/// Fails with one line per breach.
fn expect_none(rule: &str, breaches: Vec<String>) {
    assert!(breaches.is_empty(), "{rule}\n  {}", breaches.join("\n  "));
}

/// True when `word` stands in `line` with no identifier character on either side.
fn has_word(line: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(at, _)| {
        !line[..at].ends_with(is_part) && (word.ends_with(':') || !line[at + word.len()..].starts_with(is_part))
    })
}

fn unsafe_outside_gpu(sources: &[Source]) -> Vec<String> {
    // Written in two parts so that this file does not find itself.
    let words = [concat!("uns", "afe"), concat!("v", "k::")];
    let mut breaches = Vec::new();
    for source in sources.iter().filter(|s| s.is_rust() && !s.path.starts_with("src/gpu")) {
        for (number, line) in source.code() {
            breaches.extend(
                words
                    .iter()
                    .filter(|word| has_word(line, word))
                    .map(|word| format!("{}:{number}: {word}", source.path)),
            );
        }
    }
    breaches
}

fn long_files(sources: &[Source]) -> Vec<String> {
    let limit = |s: &Source| if s.is_rust() { 500 } else { 200 };
    let too_long = |s: &&Source| (s.is_rust() || s.is_shader()) && s.text.lines().count() > limit(s);
    sources
        .iter()
        .filter(too_long)
        .map(|s| format!("{}: {} lines, at most {}", s.path, s.text.lines().count(), limit(s)))
        .collect()
}

fn modules_without_purpose(sources: &[Source]) -> Vec<String> {
    sources.iter().filter(|s| s.is_rust() && !s.text.starts_with("//! ")).map(|s| s.path.clone()).collect()
}

fn shaders_without_header(sources: &[Source]) -> Vec<String> {
    let mut breaches = Vec::new();
    for source in sources.iter().filter(|s| s.is_shader()) {
        let header: Vec<&str> = source
            .text
            .lines()
            .skip_while(|l| l.starts_with('#') || l.is_empty())
            .take_while(|l| l.starts_with("//"))
            .collect();
        if header.is_empty() {
            breaches.push(format!("{}: does not open with what it does", source.path));
        } else if source.has_extension(&["comp"]) {
            let header = header.join("\n");
            let says = |words: &[&str]| words.iter().any(|word| has_word(&header, word));
            if !says(&["writes", "updates"]) {
                breaches.push(format!("{}: the header does not say what it writes or updates", source.path));
            }
            if !says(&["shared"]) {
                breaches.push(format!("{}: the header does not say what is shared, or none", source.path));
            }
        }
    }
    breaches
}

/// A path counts where it starts, not within a longer one.
fn contains_phrase(line: &str, phrase: &str) -> bool {
    line.match_indices(phrase)
        .any(|(at, _)| !phrase.starts_with('/') || !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

fn banned_phrases(sources: &[Source]) -> Vec<String> {
    let banned = [
        (concat!("/wo", "rk/"), "a path of one machine"),
        (concat!("/ro", "ot/"), "a path of one machine"),
        (concat!("/ho", "me/"), "a path of one machine"),
        (concat!("deb.deb", "ian"), "a package host"),
        (concat!("crates", ".io"), "a package host"),
        (concat!("pypi", ".org"), "a package host"),
        (concat!("npmjs", ".org"), "a package host"),
        (concat!("keep in ", "sync"), "layouts have one source"),
        (concat!("TO", "DO"), "file an issue instead"),
        (concat!("FIX", "ME"), "file an issue instead"),
        (concat!("to", "do!("), "unfinished"),
        (concat!("unimple", "mented!("), "unfinished"),
    ];
    let mut breaches = Vec::new();
    for source in sources {
        for (i, line) in source.text.lines().enumerate() {
            for (phrase, why) in banned.iter().filter(|(phrase, _)| contains_phrase(line, phrase)) {
                breaches.push(format!("{}:{}: \"{phrase}\": {why}", source.path, i + 1));
            }
        }
    }
    breaches
}

#[test]
fn only_the_gpu_layer_talks_to_vulkan() {
    expect_none("only src/gpu may be written with raw Vulkan:", unsafe_outside_gpu(&sources()));
}

#[test]
fn files_are_small() {
    expect_none("split these:", long_files(&sources()));
}

#[test]
fn modules_open_with_their_purpose() {
    expect_none("these do not open with `//! ` and their purpose:", modules_without_purpose(&sources()));
}

#[test]
fn shaders_open_with_their_header() {
    expect_none(
        "kernels open with what one thread does, then what it reads, writes or updates, and shares:",
        shaders_without_header(&sources()),
    );
}

#[test]
fn no_banned_phrase() {
    expect_none("phrases that do not belong here:", banned_phrases(&sources()));
}

#[test]
fn every_rule_finds_a_planted_breach() {
    let raw =
        Source::planted("src/app/mod.rs", concat!("//! App.\nfn f() { uns", "afe { v", "k::Buffer::null() } }\n"));
    assert_eq!(unsafe_outside_gpu(&[raw]).len(), 2);
    let allowed = Source::planted("src/gpu/mod.rs", concat!("//! Gpu.\nuns", "afe fn f() {}\n"));
    assert!(unsafe_outside_gpu(&[allowed]).is_empty());
    let lint = Source::planted("src/lib.rs", concat!("#![deny(uns", "afe_code)] // uns", "afe\n"));
    assert!(unsafe_outside_gpu(&[lint]).is_empty());

    let long = |path, count| Source::planted(path, &"\n".repeat(count));
    assert_eq!(long_files(&[long("a.rs", 501), long("b.comp", 201), long("c.glsl", 201), long("d.md", 900)]).len(), 3);
    assert!(long_files(&[long("a.rs", 500), long("b.comp", 200)]).is_empty());

    assert_eq!(modules_without_purpose(&[Source::planted("a.rs", "fn f() {}\n")]).len(), 1);

    assert_eq!(shaders_without_header(&[Source::planted("a.glsl", "#version 460\nvoid main() {}\n")]).len(), 1);
    assert_eq!(shaders_without_header(&[Source::planted("a.comp", "// One thread: reads a, writes b.\n")]).len(), 1);

    assert_eq!(banned_phrases(&[Source::planted("a.md", concat!("see /ro", "ot/x\n"))]).len(), 1);
    assert!(banned_phrases(&[Source::planted("a.md", "see data/root/x\n")]).is_empty());
}
