//! What each pass left in its buffers, as hashes: two runs of one frame, held side by side, show the first pass whose
//! output differs.
//!
//! With [`Options::hash_passes`](super::Options) every compute pass is followed by one that hashes, block by block, each
//! buffer it writes; new buffers are filled with zeros, so that what no pass wrote is alike too. Images are not hashed:
//! what is drawn shows in the buffers of the passes that read it.

use super::buffer::Buffer;
use super::error::GpuError;
use super::pass::{Bindings, Handle, Program};
use super::recorder::{Recorder, Threads};
use super::shaders::probe::{HashBlocks, HashBlocksParams};
use std::sync::Arc;

/// Hashes of one buffer, at most.
const BLOCKS: u32 = 256;
/// Hashes that one table holds; when it is full another follows.
const TABLE_LEN: usize = 1 << 16;
const WORD_BYTES: u64 = 4;

/// What a pass left in one of its buffers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PassHash {
    /// Enclosing scopes and pass.
    pub path: String,
    /// The binding's name in the shader.
    pub binding: &'static str,
    pub word_count: u32,
    pub words_per_block: u32,
    /// One for each block, the last of which may be shorter.
    pub blocks: Vec<u32>,
}

/// Hashes that a recording asked for, before they are known.
#[derive(Default)]
pub(super) struct PendingHashes {
    tables: Vec<Arc<Buffer<u32>>>,
    /// In the last table.
    used: usize,
    entries: Vec<Pending>,
}

struct Pending {
    hash: PassHash,
    table: usize,
    first: usize,
    count: usize,
}

impl Recorder<'_> {
    /// Hashes every buffer that the pass just recorded writes.
    pub(super) fn hash_outputs(&mut self, program: &'static Program, bindings: &Bindings<'_>) {
        if program.name == HashBlocks::PROGRAM.name || self.error.is_some() {
            return;
        }
        let path = format!("{}/{}", self.scopes.join("/"), program.name);
        for (info, resource) in program.bindings.iter().zip(&bindings.resources).filter(|(info, _)| info.writes) {
            let Handle::Buffer(buffer) = &resource.handle else { continue };
            let word_count = u32::try_from(resource.bytes / WORD_BYTES).unwrap_or(u32::MAX);
            if word_count == 0 {
                continue;
            }
            let words_per_block = word_count.div_ceil(BLOCKS);
            let count = word_count.div_ceil(words_per_block);
            let (table, index, first) = match self.hash_table(count as usize) {
                Ok(place) => place,
                Err(error) => return self.fail(error),
            };
            let params = HashBlocksParams { word_count, words_per_block, block_count: count, first_hash: first as u32 };
            let mut of_hash = Bindings::default();
            of_hash.raw_buffer(resource.id, resource.bytes, *buffer);
            of_hash.buffer(&table);
            of_hash.push_constants(bytemuck::bytes_of(&params));
            self.dispatch_bound(HashBlocks::PROGRAM, &of_hash, Threads::Linear(count), None);
            let hash =
                PassHash { path: path.clone(), binding: info.name, word_count, words_per_block, blocks: Vec::new() };
            self.hashes.entries.push(Pending { hash, table: index, first, count: count as usize });
        }
    }

    /// A table with room for `count` more, its index, and where they begin.
    fn hash_table(&mut self, count: usize) -> Result<(Arc<Buffer<u32>>, usize, usize), GpuError> {
        if self.hashes.tables.is_empty() || self.hashes.used + count > TABLE_LEN {
            let table = Buffer::new(&self.context.device, "pass hashes/table", TABLE_LEN)?;
            self.hashes.tables.push(Arc::new(table));
            self.hashes.used = 0;
        }
        let index = self.hashes.tables.len() - 1;
        let first = self.hashes.used;
        self.hashes.used += count;
        Ok((self.hashes.tables[index].clone(), index, first))
    }

    /// Reads the hashes of a finished submission.
    pub(super) fn collect_hashes(&mut self) -> Result<(), GpuError> {
        let PendingHashes { tables, entries, .. } = std::mem::take(&mut self.hashes);
        if entries.is_empty() {
            return Ok(());
        }
        let tables = tables.iter().map(|table| self.context.download(table)).collect::<Result<Vec<_>, _>>()?;
        let hashes = entries.into_iter().map(|Pending { hash, table, first, count }| PassHash {
            blocks: tables[table][first..first + count].to_vec(),
            ..hash
        });
        self.context.append_hashes(hashes);
        Ok(())
    }
}
