//! The file while it is being read: its JSON, its buffers (loaded when first used), the budget and the notes.

use super::budget::Budget;
use super::error::Fault;
use super::json::{List, Object};
use super::notes::Notes;
use super::uri;
use std::borrow::Cow;
use std::cell::{Cell, OnceCell};
use std::path::Path;

/// Shared by reference between the readers of all parts; budget, notes and buffer cache mutate inside.
pub struct Document<'a> {
    pub root: Object<'a>,
    pub budget: &'a Budget,
    pub notes: &'a Notes,
    folder: Option<&'a Path>,
    /// The .glb's binary chunk.
    binary: Option<&'a [u8]>,
    buffers: Vec<OnceCell<Cow<'a, [u8]>>>,
    /// Per accessor, whether its sparse indices were found sound: looked at once however often it is used.
    pub sparse_checked: Vec<Cell<bool>>,
}

/// The bytes of a buffer view.
#[derive(Debug, Clone, Copy)]
pub struct View<'d> {
    pub bytes: &'d [u8],
    /// Distance between the starts of elements, where the view sets one.
    pub stride: Option<usize>,
    /// Where the view starts in its buffer, for alignment rules.
    pub offset: u64,
}

impl<'a> Document<'a> {
    pub fn new(
        root: Object<'a>,
        binary: Option<&'a [u8]>,
        folder: Option<&'a Path>,
        budget: &'a Budget,
        notes: &'a Notes,
    ) -> Result<Self, Fault> {
        let buffers = (0..root.list("buffers")?.len()).map(|_| OnceCell::new()).collect();
        let sparse_checked = vec![Cell::new(false); root.list("accessors")?.len()];
        Ok(Self { root, budget, notes, folder, binary, buffers, sparse_checked })
    }

    /// One of the root's collections.
    pub fn list(&self, key: &str) -> Result<List<'a>, Fault> {
        self.root.list(key)
    }

    pub fn read_uri(&self, uri: &str, pointer: &str) -> Result<Vec<u8>, Fault> {
        uri::read(uri, pointer, self.folder, self.budget)
    }

    /// Takes the fault of a part that the scene can be shown without as a note. What breaks the budget or a rule of
    /// safety stays a fault.
    pub fn tolerate<T>(&self, part: &str, result: Result<T, Fault>) -> Result<Option<T>, Fault> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(fault @ (Fault::OverBudget { .. } | Fault::RefusedUri { .. })) => Err(fault),
            Err(fault) => {
                self.notes.say(format!("{part} was left out: {fault}."));
                Ok(None)
            }
        }
    }

    /// The buffer view that `owner` refers to by `key`.
    pub fn view(&self, owner: &Object, key: &str) -> Result<View<'_>, Fault> {
        let views = self.list("bufferViews")?;
        let index = owner.require(key, owner.index(key, "bufferViews", views.len())?)?;
        let view = views.object(index)?;
        let buffer_index = view.require("buffer", view.index("buffer", "buffers", self.buffers.len())?)?;
        let offset = view.integer("byteOffset")?.unwrap_or(0);
        let length = view.require("byteLength", view.integer("byteLength")?)?;
        let stride = view.integer("byteStride")?;
        if stride.is_some_and(|stride| !(4..=252).contains(&stride) || stride % 4 != 0) {
            return Err(view.invalid("byteStride", "must be a multiple of 4 from 4 to 252"));
        }
        if length == 0 {
            return Err(view.invalid("byteLength", "must be at least 1"));
        }
        let buffer = self.buffer(buffer_index)?;
        let range = offset.checked_add(length).filter(|end| *end <= buffer.len() as u64);
        let Some(end) = range else {
            let rule = format!("must end within the {} bytes of buffer {buffer_index}", buffer.len());
            return Err(Fault::invalid(view.pointer(), rule, format!("{length} bytes from byte {offset}")));
        };
        let stride = stride.map(|stride| stride as usize);
        Ok(View { bytes: &buffer[offset as usize..end as usize], stride, offset })
    }

    fn buffer(&self, index: usize) -> Result<&[u8], Fault> {
        if let Some(bytes) = self.buffers[index].get() {
            return Ok(bytes);
        }
        let buffer = self.list("buffers")?.object(index)?;
        let length = buffer.require("byteLength", buffer.integer("byteLength")?)?;
        let mut bytes = match (buffer.text("uri")?, self.binary) {
            (Some(uri), _) => Cow::Owned(self.read_uri(uri, &buffer.at("uri"))?),
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => {
                return Err(
                    buffer.invalid("uri", "is required, unless it is the first buffer of a .glb with binary data")
                );
            }
        };
        if length > bytes.len() as u64 {
            let rule = format!("must not be more than the {} bytes there are", bytes.len());
            return Err(buffer.invalid("byteLength", rule));
        }
        // Bytes after the stated end (padding, usually) are no part of the buffer.
        match &mut bytes {
            Cow::Owned(bytes) => bytes.truncate(length as usize),
            Cow::Borrowed(bytes) => *bytes = &bytes[..length as usize],
        }
        Ok(self.buffers[index].get_or_init(|| bytes))
    }
}
