//! Files written whole or not at all: into a temporary neighbour first, then renamed over the target.
//!
//! A reader (or an interrupted run) therefore sees the old file or the new one, never a half of either.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::files::{self, Part};

/// A file that could not be read or written: the action, the path and the system's reason.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} {}: {source}", .path.display())]
pub struct FileError {
    pub action: &'static str,
    pub path: PathBuf,
    pub source: io::Error,
}

impl FileError {
    pub fn new(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self { action, path: path.to_owned(), source }
    }
}

/// Run `fill` on a temporary file beside `path`, then rename it to `path`. On any error nothing is left behind and
/// an older file at `path` is untouched. A symbolic link is followed; a target that exists and is no regular file
/// (a folder, a device) is refused.
pub fn write_whole<E: From<FileError>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut Part>) -> Result<(), E>,
) -> Result<(), E> {
    let fail = |source| FileError::new("write", path, source);
    let target = writable_target(path).map_err(fail)?;

    let mut builder = tempfile::Builder::new();
    builder.prefix(".linklight-").suffix(".part");
    #[cfg(unix)]
    {
        // The usual mode of a new file (less the umask), not the private one of temporary files.
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut part = Part::create(&builder, &target).map_err(fail)?;
    {
        let mut writer = BufWriter::new(&mut part);
        fill(&mut writer)?;
        writer.flush().map_err(fail)?;
    }
    Ok(part.finish().map_err(fail)?)
}

/// [`write_whole`] for text.
pub fn write_text(path: &Path, text: &str) -> Result<(), FileError> {
    write_bytes(path, text.as_bytes())
}

/// [`write_whole`] for bytes.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write_whole(path, |writer| writer.write_all(bytes).map_err(|source| FileError::new("write", path, source)))
}

/// Whether [`write_whole`] has a chance at `path`: checked before long work, so that a misspelt folder costs nothing.
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    let fail = |source| FileError::new("write", path, source);
    let target = writable_target(path).map_err(fail)?;
    let folder = folder_of(&target);
    match files::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => Ok(()),
        Ok(_) => Err(fail(io::Error::new(io::ErrorKind::NotADirectory, "its parent is not a folder"))),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(fail(error)),
        Err(_) => Err(fail(io::Error::new(
            io::ErrorKind::NotFound,
            format!("the folder {} does not exist; create it first", folder.display()),
        ))),
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn writable_target(path: &Path) -> io::Result<PathBuf> {
    match files::metadata(path) {
        Ok(metadata) if metadata.is_file() => std::fs::canonicalize(path),
        Ok(metadata) if metadata.is_dir() => {
            Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder; give a file name"))
        }
        Ok(_) => Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file; give a file name")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(path.to_owned()),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_keeps_the_old_file_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept.txt");
        write_text(&path, "old").unwrap();
        let result = write_whole::<FileError>(&path, |writer| {
            writer.write_all(b"half of the n").unwrap();
            Err(FileError::new("write", &path, io::Error::other("disk full")))
        });
        assert!(result.unwrap_err().to_string().ends_with("disk full"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn folders_and_missing_parents_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let message = write_text(folder.path(), "x").unwrap_err().to_string();
        assert!(message.contains("it is a folder"), "{message}");
        let missing = folder.path().join("no/such/file.json");
        assert!(check_writable(&missing).unwrap_err().to_string().contains("does not exist"));
        assert!(write_text(&missing, "x").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_keeps_pointing_at_the_new_content() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real.txt"), folder.path().join("link.txt"));
        write_text(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_text(&link, "new").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().file_type().is_symlink());
        assert_eq!(std::fs::read_to_string(&real).unwrap(), "new");
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_has_the_usual_mode() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("a"), folder.path().join("b"));
        write_text(&ours, "x").unwrap();
        std::fs::write(&plain, "x").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&ours), mode(&plain));
    }
}
