//! Files read and written: all of the program's go through here, so that a test can make any one access fail.
//!
//! The functions are those of [`std::fs`] by the same names. While a [`FileFaults`] lives, each access that can fail is
//! counted and one of them fails; nothing of it runs otherwise.

use std::fs;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// One at a time: the counts are the process's.
static TURN: Mutex<()> = Mutex::new(());
static IS_ON: AtomicBool = AtomicBool::new(false);
static COUNT: AtomicU64 = AtomicU64::new(0);
/// The access that fails, from 1; 0 for none.
static FAIL_AT: AtomicU64 = AtomicU64::new(0);
static FAILED: Mutex<Option<String>> = Mutex::new(None);

/// What an access fails with that a test makes fail.
pub const PLANTED: &str = "a planted failure";

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Failing accesses, switched on until this is dropped. Others wait for their turn.
pub struct FileFaults {
    _turn: MutexGuard<'static, ()>,
}

impl FileFaults {
    /// Starts counting; no access fails yet.
    pub fn start() -> Self {
        let faults = Self { _turn: lock(&TURN) };
        IS_ON.store(true, Ordering::Release);
        faults.fail(0);
        faults
    }

    /// Counts anew from 0, and makes access number `at` (from 1; 0 for none) fail, once.
    pub fn fail(&self, at: u64) {
        FAIL_AT.store(at, Ordering::Release);
        COUNT.store(0, Ordering::Release);
        *lock(&FAILED) = None;
    }

    /// Accesses since the last [`Self::fail`].
    pub fn count(&self) -> u64 {
        COUNT.load(Ordering::Acquire)
    }

    /// What failed, if it was reached: the action and the path.
    pub fn failed(&self) -> Option<String> {
        lock(&FAILED).clone()
    }
}

impl Drop for FileFaults {
    fn drop(&mut self) {
        self.fail(0);
        IS_ON.store(false, Ordering::Release);
    }
}

/// Counts an access; the error where it is its turn to fail.
fn access(action: &str, path: &Path) -> io::Result<()> {
    if !IS_ON.load(Ordering::Acquire) || COUNT.fetch_add(1, Ordering::AcqRel) + 1 != FAIL_AT.load(Ordering::Acquire) {
        return Ok(());
    }
    *lock(&FAILED) = Some(format!("{action} {}", path.display()));
    Err(io::Error::other(PLANTED))
}

/// Runs a decoder of another crate. One that panics on damaged data (on this thread) is one that refuses it.
pub fn decode<T>(decoder: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let broken = |_| Err("its decoder broke off; the file is damaged, write it again".to_owned());
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(decoder)).unwrap_or_else(broken)
}

pub fn metadata(path: &Path) -> io::Result<fs::Metadata> {
    access("look at", path)?;
    fs::metadata(path)
}

pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    access("read", path)?;
    fs::read(path)
}

pub fn read_to_string(path: &Path) -> io::Result<String> {
    access("read", path)?;
    fs::read_to_string(path)
}

pub fn create_dir_all(path: &Path) -> io::Result<()> {
    access("make the folder", path)?;
    fs::create_dir_all(path)
}

/// A file open for reading.
#[derive(Debug)]
pub struct File {
    file: fs::File,
    path: PathBuf,
}

impl File {
    pub fn open(path: &Path) -> io::Result<Self> {
        access("open", path)?;
        Ok(Self { file: fs::File::open(path)?, path: path.to_owned() })
    }

    pub fn metadata(&self) -> io::Result<fs::Metadata> {
        access("look at", &self.path)?;
        self.file.metadata()
    }
}

impl Read for File {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        access("read", &self.path)?;
        self.file.read(bytes)
    }
}

impl Seek for File {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// A file being written beside its target, which it replaces when it is whole; dropped before, nothing is left of it.
#[derive(Debug)]
pub struct Part {
    file: tempfile::NamedTempFile,
    target: PathBuf,
}

impl Part {
    /// Beside `target`, as `builder` says.
    pub fn create(builder: &tempfile::Builder<'_, '_>, target: &Path) -> io::Result<Self> {
        access("make a part of", target)?;
        let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Ok(Self { file: builder.tempfile_in(folder)?, target: target.to_owned() })
    }

    /// Takes the place of the target, once all is on the disk.
    pub fn finish(self) -> io::Result<()> {
        access("finish", &self.target)?;
        self.file.as_file().sync_all()?;
        access("put in place", &self.target)?;
        self.file.persist(&self.target).map(drop).map_err(|error| error.error)
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        access("write", &self.target)?;
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Part {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}
