//! Room in folders that keep results between runs: what was not used for longest goes first.
//!
//! Files are told apart by how their names begin and end; nothing else in the folder is touched. What cannot be listed
//! or removed stays: a full folder never stops the work.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What all files of a kind may take in a folder, bytes.
pub const MOST_BYTES: u64 = 2 << 30;

/// Notes that `path` was of use now, so that it stays longest.
pub fn used(path: &Path) {
    let touched = fs::File::options().append(true).open(path).and_then(|file| file.set_modified(SystemTime::now()));
    if let Err(error) = touched {
        tracing::debug!("cannot note the use of {}: {error}", path.display());
    }
}

/// Removes files `{prefix}*{suffix}` of `folder`, the longest unused first, until at most `most_bytes` are left; never
/// `newest`.
pub fn make_room(folder: &Path, [prefix, suffix]: [&str; 2], newest: &Path, most_bytes: u64) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut files: Vec<(SystemTime, PathBuf, u64)> = entries
        .flatten()
        .filter(|entry| entry.file_name().to_str().is_some_and(|n| n.starts_with(prefix) && n.ends_with(suffix)))
        .filter_map(|entry| {
            let about = entry.metadata().ok().filter(fs::Metadata::is_file)?;
            Some((about.modified().unwrap_or(SystemTime::UNIX_EPOCH), entry.path(), about.len()))
        })
        .collect();
    files.sort();
    let mut total: u64 = files.iter().map(|file| file.2).sum();
    for (_, path, bytes) in files.iter().filter(|file| file.1 != newest) {
        if total <= most_bytes {
            break;
        }
        match fs::remove_file(path) {
            Ok(()) => total -= bytes,
            Err(error) => tracing::debug!("cannot remove {}: {error}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn the_longest_unused_files_go_and_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (age, name) in ["a.kept", "b.kept", "c.kept", "d.kept", "mine.txt"].iter().enumerate() {
            fs::write(path(name), [0; 100]).unwrap();
            let file = fs::File::options().append(true).open(path(name)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(1000 - 10 * age as u64)).unwrap();
        }
        let there = || {
            let mut names: Vec<_> =
                fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
            names.sort();
            names.join(" ")
        };
        make_room(folder.path(), ["", ".kept"], &path("d.kept"), 400);
        assert_eq!(there(), "a.kept b.kept c.kept d.kept mine.txt", "they fit");
        used(&path("a.kept"));
        make_room(folder.path(), ["", ".kept"], &path("d.kept"), 250);
        assert_eq!(there(), "a.kept d.kept mine.txt", "b and c were not used for longest");
        make_room(folder.path(), ["", ".kept"], &path("d.kept"), 0);
        assert_eq!(there(), "d.kept mine.txt", "the newest always stays");
        make_room(&path("no folder"), ["", ""], &path("d.kept"), 0);
    }
}
