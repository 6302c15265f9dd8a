//! Compressed maps on disk: under a hash of all that went into them, whole or not at all, checked when read.

use super::compress::{CompressedMaps, Run};
use crate::files;
use crate::report::write::{FileError, write_whole};
use crate::stages::kept;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Changes whenever the maps of the same input would come out differently, or are written differently.
const VERSION: u32 = 6;
const MAGIC: [u8; 8] = *b"LLSSMAPS";

/// What the maps depend on, as a hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key(blake3::Hash);

impl Key {
    /// Over parts of plain data, each told from the next by its length.
    pub fn over(parts: &[&[u8]]) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&MAGIC).update(&VERSION.to_le_bytes());
        for part in parts {
            hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
        }
        Self(hasher.finalize())
    }

    pub fn file_in(&self, folder: &Path) -> PathBuf {
        folder.join(format!("surface-maps-{}.bin", &self.0.to_hex()[..32]))
    }
}

/// What a look into the cache found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Found {
    Maps(CompressedMaps),
    Nothing,
    /// There is a file, but not what was written; the reason. It will be replaced.
    Damaged(&'static str),
}

/// Reads the maps of `key`, checked against their checksum and for sense.
pub fn read(folder: &Path, key: &Key) -> Found {
    let path = key.file_in(folder);
    let Ok(bytes) = files::read(&path) else { return Found::Nothing };
    match decode(&bytes, key) {
        Ok(maps) => {
            kept::used(&path);
            Found::Maps(maps)
        }
        Err(reason) => Found::Damaged(reason),
    }
}

/// Writes the maps of `key`; a reader finds all of them or none. Files not used for longest make room.
pub fn write(folder: &Path, key: &Key, maps: &CompressedMaps) -> Result<(), FileError> {
    files::create_dir_all(folder).map_err(|source| FileError::new("make the folder", folder, source))?;
    let path = key.file_in(folder);
    let body = encode(key, maps);
    write_whole(&path, |writer| writer.write_all(&body).map_err(|source| FileError::new("write", &path, source)))?;
    kept::make_room(folder, ["surface-maps-", ".bin"], &path, kept::MOST_BYTES);
    Ok(())
}

/// Magic, version, key, counts, offsets, runs; all after the checksum of it.
fn encode(key: &Key, maps: &CompressedMaps) -> Vec<u8> {
    let mut body = Vec::with_capacity(128 + maps.size_bytes() as usize);
    body.extend(MAGIC);
    body.extend(VERSION.to_le_bytes());
    body.extend(key.0.as_bytes());
    for count in [u64::from(maps.place_count), maps.offsets.len() as u64, maps.runs.len() as u64] {
        body.extend(count.to_le_bytes());
    }
    maps.offsets.iter().for_each(|offset| body.extend(offset.to_le_bytes()));
    for run in &maps.runs {
        body.extend(run.depth.to_le_bytes());
        body.extend(run.first.to_le_bytes());
    }
    let mut file = blake3::hash(&body).as_bytes().to_vec();
    file.extend(body);
    file
}

fn decode(file: &[u8], key: &Key) -> Result<CompressedMaps, &'static str> {
    let (checksum, body) = file.split_first_chunk::<{ blake3::OUT_LEN }>().ok_or("too short")?;
    if blake3::hash(body) != *checksum {
        return Err("its checksum is wrong");
    }
    let mut rest = body;
    let mut take = |count: usize| {
        let (taken, left) = rest.split_at_checked(count).ok_or("too short")?;
        rest = left;
        Ok::<_, &'static str>(taken)
    };
    if take(8)? != MAGIC || take(4)? != VERSION.to_le_bytes() {
        return Err("it is of another version");
    }
    if take(32)? != key.0.as_bytes() {
        return Err("it is of another scene");
    }
    let mut count = || take(8).map(|bytes| u64::from_le_bytes(bytes.try_into().unwrap_or_default()) as usize);
    let (place_count, offset_count, run_count) = (count()?, count()?, count()?);
    if offset_count.checked_add(run_count).and_then(|words| words.checked_mul(4)) != Some(rest.len()) {
        return Err("its counts are wrong");
    }
    let mut words = rest.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let offsets: Vec<u32> = words.by_ref().take(offset_count).collect();
    let runs: Vec<Run> = words.map(|word| Run { depth: word as u16, first: (word >> 16) as u16 }).collect();
    let place_count = u32::try_from(place_count).map_err(|_| "its counts are wrong")?;
    let maps = CompressedMaps { offsets, runs, place_count };
    if is_sound(&maps) { Ok(maps) } else { Err("its runs are out of order") }
}

/// What look-ups trust: every pixel has runs, the first of them from the first place on, the others later and later.
fn is_sound(maps: &CompressedMaps) -> bool {
    let whole = maps.offsets.first() == Some(&0) && maps.offsets.last() == Some(&(maps.runs.len() as u32));
    whole
        && maps.offsets.windows(2).all(|pair| {
            let Some(runs) = maps.runs.get(pair[0] as usize..pair[1] as usize) else { return false };
            let rises = runs.windows(2).all(|pair| pair[0].first < pair[1].first);
            let covers = match (runs.first(), runs.last()) {
                (Some(first), Some(last)) => first.first == 0 && u32::from(last.first) < maps.place_count,
                _ => maps.place_count == 0,
            };
            rises && covers
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn maps() -> CompressedMaps {
        let runs = (0..9).map(|i| Run { depth: 1000 * i, first: if i < 4 { i } else { i - 4 } }).collect();
        CompressedMaps { offsets: vec![0, 4, 9], runs, place_count: 12 }
    }

    #[test]
    fn what_was_written_is_read_and_damage_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let folder = &folder.path().join("not yet there");
        let key = Key::over(&[b"a scene", b"its settings"]);
        assert_eq!(read(folder, &key), Found::Nothing);
        write(folder, &key, &maps()).unwrap();
        assert_eq!(read(folder, &key), Found::Maps(maps()));
        // The same bytes split otherwise are another key.
        assert_ne!(key, Key::over(&[b"a scen", b"eits settings"]));
        assert_eq!(read(folder, &Key::over(&[b"another"])), Found::Nothing);

        let path = key.file_in(folder);
        let whole = std::fs::read(&path).unwrap();
        for at in [0, 40, 60, whole.len() - 1] {
            let mut spoilt = whole.clone();
            spoilt[at] ^= 1;
            std::fs::write(&path, spoilt).unwrap();
            assert!(matches!(read(folder, &key), Found::Damaged(_)), "a bit at {at}");
        }
        for length in [0, 20, 80, whole.len() - 4] {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(matches!(read(folder, &key), Found::Damaged(_)), "{length} bytes");
        }
        // Another scene's maps under this name.
        let other = Key::over(&[b"another"]);
        std::fs::write(&path, encode(&other, &maps())).unwrap();
        assert_eq!(read(folder, &key), Found::Damaged("it is of another scene"));
        write(folder, &key, &maps()).unwrap();
        assert_eq!(read(folder, &key), Found::Maps(maps()));
        assert_eq!(std::fs::read_dir(folder).unwrap().count(), 1, "no temporary files are left");
    }
}
