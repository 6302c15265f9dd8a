//! Typed arrays in buffers: accessors, dense and sparse, read with every count, offset and value checked.

use super::document::Document;
use super::error::Fault;
use super::json::Object;

/// Component types, by the numbers glTF gives them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    I8 = 5120,
    U8 = 5121,
    I16 = 5122,
    U16 = 5123,
    U32 = 5125,
    F32 = 5126,
}

impl Component {
    const ALL: [Self; 6] = [Self::I8, Self::U8, Self::I16, Self::U16, Self::U32, Self::F32];

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::I8 => "BYTE",
            Self::U8 => "UNSIGNED_BYTE",
            Self::I16 => "SHORT",
            Self::U16 => "UNSIGNED_SHORT",
            Self::U32 => "UNSIGNED_INT",
            Self::F32 => "FLOAT",
        }
    }
}

/// The element types that the renderer reads.
const SHAPES: [(&str, usize); 5] = [("SCALAR", 1), ("VEC2", 2), ("VEC3", 3), ("VEC4", 4), ("MAT4", 16)];

/// An accessor whose place in its buffer is known to be sound. Values are checked as they are read.
#[derive(Debug)]
pub struct Accessor<'d> {
    pub count: usize,
    pub component: Component,
    pub normalized: bool,
    pub shape: &'static str,
    element_bytes: usize,
    /// JSON pointer of the accessor.
    pub pointer: String,
    /// Absent where all elements are zero but for the sparse ones.
    base: Option<Elements<'d>>,
    sparse: Option<Sparse<'d>>,
}

/// Elements at equal distances in bytes that hold all of them.
#[derive(Debug, Clone, Copy)]
struct Elements<'d> {
    bytes: &'d [u8],
    stride: usize,
}

/// Replaced elements: `indices` strictly increasing, one value for each.
#[derive(Debug)]
struct Sparse<'d> {
    count: usize,
    indices: Elements<'d>,
    index_component: Component,
    values: Elements<'d>,
}

/// Which elements to read.
#[derive(Debug, Clone, Copy)]
pub enum Selection<'s> {
    All,
    /// These, each below the accessor's count.
    These(&'s [u32]),
}

/// Elements that no byte of the file stands for (an accessor without a buffer view) can be had for free, so that
/// their number has a limit of its own.
const MAX_UNBACKED_ELEMENTS: usize = 1 << 24;

impl<'d> Accessor<'d> {
    /// Opens the accessor that `owner` refers to by `key`; `None` when it refers to none.
    pub fn open(document: &'d Document, owner: &Object, key: &str) -> Result<Option<Self>, Fault> {
        let accessors = document.list("accessors")?;
        let Some(index) = owner.index(key, "accessors", accessors.len())? else { return Ok(None) };
        let object = accessors.object(index)?;

        let count = object.require("count", object.integer("count")?)?;
        // Vertex and element indices are 32 bits wide throughout.
        let Some(count) = u32::try_from(count).ok().filter(|count| *count > 0) else {
            return Err(object.invalid("count", format!("must be from 1 to {}", u32::MAX)));
        };
        let count = count as usize;
        let component = component(&object, &Component::ALL)?;
        let kind = object.require("type", object.text("type")?)?;
        let Some((shape, components)) = SHAPES.into_iter().find(|(name, _)| *name == kind) else {
            let names = SHAPES.map(|(name, _)| name).join(", ");
            return Err(object.invalid("type", format!("must be one of {names} here")));
        };
        let normalized = object.boolean("normalized")?.unwrap_or(false) && component != Component::F32;

        let layout = Layout { component, element_bytes: component.bytes() * components, count };
        let base = match object.has("bufferView") {
            true => Some(layout.place(document, &object)?),
            false if object.has("byteOffset") => {
                return Err(object.invalid("byteOffset", "is only allowed together with bufferView"));
            }
            false => None,
        };
        let sparse = match object.object("sparse")? {
            Some(sparse) => {
                let sparse = Sparse::open(document, &sparse, layout)?;
                if !document.sparse_checked[index].get() {
                    sparse.check_indices(&object, count)?;
                    document.sparse_checked[index].set(true);
                }
                Some(sparse)
            }
            None => None,
        };
        let pointer = object.pointer().to_owned();
        Ok(Some(Self {
            count,
            component,
            normalized,
            shape,
            element_bytes: layout.element_bytes,
            pointer,
            base,
            sparse,
        }))
    }

    /// Checks that the accessor is `shape` of one of `components` (each plain or, where `true`, normalized).
    pub fn expect(&self, what: &str, shapes: &[&str], components: &[(Component, bool)]) -> Result<(), Fault> {
        let known_component = components.contains(&(self.component, self.normalized));
        if shapes.contains(&self.shape) && known_component {
            return Ok(());
        }
        let normalized = |normalized| if normalized { " normalized" } else { "" };
        let name = |(component, norm): &(Component, bool)| format!("{}{}", component.name(), normalized(*norm));
        let names = components.iter().map(name).collect::<Vec<_>>().join(" or ");
        let seen = format!("{} of {}", self.shape, name(&(self.component, self.normalized)));
        Err(Fault::invalid(&self.pointer, format!("{what} must be {} of {names}", shapes.join(" or ")), seen))
    }

    /// Checks that the accessor has `count` elements.
    pub fn expect_count(&self, what: &str, count: usize) -> Result<(), Fault> {
        match self.count == count {
            true => Ok(()),
            false => Err(Fault::invalid(
                format!("{}/count", self.pointer),
                format!("{what} must have {count} elements"),
                self.count,
            )),
        }
    }

    /// Whether no bytes stand behind the accessor at all.
    pub fn is_all_zero(&self) -> bool {
        self.base.is_none() && self.sparse.is_none()
    }

    /// Checks that reading `count` elements is not had for free: see [`MAX_UNBACKED_ELEMENTS`].
    pub fn check_backed(&self, count: usize) -> Result<(), Fault> {
        if self.base.is_none() && count > MAX_UNBACKED_ELEMENTS {
            let rule = format!("at most {MAX_UNBACKED_ELEMENTS} elements without bufferView can be read");
            return Err(Fault::too_large(&self.pointer, rule, count));
        }
        Ok(())
    }

    /// Reads elements as floats, normalised integers mapped to their range. `N` is the shape's component count at
    /// most; further components are left out. Fails on NaN and infinity.
    pub fn read<const N: usize, T>(
        &self,
        document: &Document,
        selection: Selection,
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, Fault> {
        let mut values = Vec::new();
        self.visit(document, selection, &mut values, |accessor, bytes, index| {
            let mut element = [0.0; N];
            if let Some(bytes) = bytes {
                let components = bytes.chunks_exact(accessor.component.bytes());
                for (value, bytes) in element.iter_mut().zip(components) {
                    *value = accessor.float(bytes);
                }
            }
            match element.iter().find(|value| !value.is_finite()) {
                None => Ok(make(element)),
                Some(value) => Err(Fault::invalid(
                    &self.pointer,
                    "must hold finite numbers only",
                    format!("{value} in element {index}"),
                )),
            }
        })?;
        Ok(values)
    }

    /// Reads all elements as unsigned integers of up to 32 bits.
    pub fn read_indices(&self, document: &Document) -> Result<Vec<u32>, Fault> {
        let mut values = Vec::new();
        self.visit(document, Selection::All, &mut values, |accessor, bytes, _| {
            Ok(bytes.map_or(0, |bytes| unsigned(bytes, accessor.component)))
        })?;
        Ok(values)
    }

    /// Calls `make` with each selected element's bytes (`None` for zero) and index; collects into `values`.
    fn visit<T>(
        &self,
        document: &Document,
        selection: Selection,
        values: &mut Vec<T>,
        make: impl Fn(&Self, Option<&[u8]>, usize) -> Result<T, Fault>,
    ) -> Result<(), Fault> {
        let len = match selection {
            Selection::All => self.count,
            Selection::These(indices) => indices.len(),
        };
        document.budget.reserve_array::<T>(len as u64, || format!("the {len} elements of {}", self.pointer))?;
        self.check_backed(len)?;
        values.reserve_exact(len);
        for position in 0..len {
            let index = match selection {
                Selection::All => position,
                Selection::These(indices) => indices[position] as usize,
            };
            values.push(make(self, self.element(index), index)?);
        }
        Ok(())
    }

    fn element(&self, index: usize) -> Option<&'d [u8]> {
        let bytes = self.element_bytes;
        if let Some(sparse) = &self.sparse
            && let Some(position) = sparse.find(index)
        {
            return Some(sparse.values.get(position, bytes));
        }
        self.base.map(|base| base.get(index, bytes))
    }

    fn float(&self, bytes: &[u8]) -> f32 {
        let plain = match (self.component, bytes) {
            (Component::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
            (Component::I8, &[a, ..]) => f32::from(a as i8),
            (Component::I16, &[a, b, ..]) => f32::from(i16::from_le_bytes([a, b])),
            (component, bytes) => unsigned(bytes, component) as f32,
        };
        match (self.normalized, self.component) {
            (false, _) | (true, Component::F32 | Component::U32) => plain,
            (true, Component::I8) => (plain / 127.0).max(-1.0),
            (true, Component::U8) => plain / 255.0,
            (true, Component::I16) => (plain / 32767.0).max(-1.0),
            (true, Component::U16) => plain / 65535.0,
        }
    }
}

impl<'d> Elements<'d> {
    fn get(&self, index: usize, bytes: usize) -> &'d [u8] {
        let start = index * self.stride;
        &self.bytes[start..start + bytes]
    }
}

/// What an accessor's elements look like, wherever they are.
#[derive(Debug, Clone, Copy)]
struct Layout {
    component: Component,
    element_bytes: usize,
    count: usize,
}

impl Layout {
    /// Finds the elements in the buffer view that `object` (an accessor or a part of its sparse) names.
    fn place<'d>(self, document: &'d Document, object: &Object) -> Result<Elements<'d>, Fault> {
        let view = document.view(object, "bufferView")?;
        let offset = object.integer("byteOffset")?.unwrap_or(0);
        let stride = view.stride.unwrap_or(self.element_bytes);
        if stride < self.element_bytes {
            let rule =
                format!("the byteStride of its bufferView must cover its elements of {} bytes", self.element_bytes);
            return Err(Fault::invalid(object.pointer(), rule, stride));
        }
        let alignment = self.component.bytes() as u64;
        if view.offset.checked_add(offset).is_none_or(|total| total % alignment != 0) {
            let rule = format!("must, with its bufferView's {}, be a multiple of {alignment}", view.offset);
            return Err(Fault::invalid(object.at("byteOffset"), rule, offset));
        }
        // Below 2^32 elements of at most 252 bytes: no overflow in 64 bits.
        let span = (self.count as u64 - 1) * stride as u64 + self.element_bytes as u64;
        if offset.checked_add(span).is_none_or(|end| end > view.bytes.len() as u64) {
            let rule = format!("must end within the {} bytes of its bufferView", view.bytes.len());
            let seen = format!("{} elements, {span} bytes from byte {offset}", self.count);
            return Err(Fault::invalid(object.pointer(), rule, seen));
        }
        Ok(Elements { bytes: &view.bytes[offset as usize..(offset + span) as usize], stride })
    }
}

impl<'d> Sparse<'d> {
    fn open(document: &'d Document, object: &Object, layout: Layout) -> Result<Self, Fault> {
        let count = object.require("count", object.integer("count")?)?;
        if count == 0 || count > layout.count as u64 {
            return Err(object.invalid("count", format!("must be from 1 to the accessor's {} elements", layout.count)));
        }
        let count = count as usize;
        let indices = object.require("indices", object.object("indices")?)?;
        let index_component = component(&indices, &[Component::U8, Component::U16, Component::U32])?;
        let index_layout = Layout { component: index_component, element_bytes: index_component.bytes(), count };
        let values = object.require("values", object.object("values")?)?;
        Ok(Self {
            count,
            indices: index_layout.place(document, &indices)?,
            index_component,
            values: Layout { count, ..layout }.place(document, &values)?,
        })
    }

    fn index(&self, position: usize) -> usize {
        unsigned(self.indices.get(position, self.index_component.bytes()), self.index_component) as usize
    }

    fn check_indices(&self, accessor: &Object, element_count: usize) -> Result<(), Fault> {
        let mut smallest_allowed = 0;
        for position in 0..self.count {
            let index = self.index(position);
            if index < smallest_allowed || index >= element_count {
                let rule = format!("its sparse indices must increase strictly and stay below {element_count}");
                let pointer = format!("{}/sparse/indices", accessor.pointer());
                return Err(Fault::invalid(pointer, rule, format!("{index} at position {position}")));
            }
            smallest_allowed = index + 1;
        }
        Ok(())
    }

    /// The position whose index is `index`.
    fn find(&self, index: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match self.index(middle).cmp(&index) {
                std::cmp::Ordering::Equal => return Some(middle),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }
}

fn component(object: &Object, allowed: &[Component]) -> Result<Component, Fault> {
    let number = object.require("componentType", object.integer("componentType")?)?;
    let found = allowed.iter().find(|component| **component as u64 == number);
    found.copied().ok_or_else(|| {
        let names = allowed.iter().map(|component| format!("{} ({})", *component as u64, component.name()));
        object.invalid("componentType", format!("must be one of {}", names.collect::<Vec<_>>().join(", ")))
    })
}

/// Little-endian, of the component's width.
fn unsigned(bytes: &[u8], component: Component) -> u32 {
    bytes.iter().take(component.bytes()).rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}
