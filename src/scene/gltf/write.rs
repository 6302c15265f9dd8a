//! The binary side of writing a .glb: bytes collected as buffer views and accessors, joined with the JSON at the end.

use glam::Vec3;
use serde_json::{Value, json};

/// Component types of accessors.
pub const FLOAT: u32 = 5126;
pub const UNSIGNED_BYTE: u32 = 5121;
pub const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;

/// What the bytes of an accessor are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    Vertices,
    Indices,
    /// Neither: animations, skins.
    Other,
}

/// The one buffer of a .glb under construction.
#[derive(Debug, Clone, Default)]
pub struct Binary {
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: Vec<u8>,
}

impl Binary {
    /// Appends a buffer view over `bytes`, its index.
    pub fn view(&mut self, bytes: &[u8], target: Target) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        match target {
            Target::Vertices => view["target"] = json!(34962),
            Target::Indices => view["target"] = json!(34963),
            Target::Other => {}
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Appends an accessor of `count` entries over `bytes`, its index; `fields` are merged in (`min`, `max`, `normalized`).
    pub fn accessor(
        &mut self,
        kind: &str,
        component: u32,
        count: usize,
        bytes: &[u8],
        target: Target,
        fields: &Value,
    ) -> usize {
        let view = self.view(bytes, target);
        let mut accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        for key in ["min", "max", "normalized"] {
            if !fields[key].is_null() {
                accessor[key] = fields[key].clone();
            }
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// A vertex attribute of floats.
    pub fn floats<T: bytemuck::NoUninit>(&mut self, kind: &str, values: &[T]) -> usize {
        self.accessor(kind, FLOAT, values.len(), bytemuck::cast_slice(values), Target::Vertices, &Value::Null)
    }

    /// Positions, with the bounds that glTF asks for.
    pub fn positions(&mut self, values: &[Vec3]) -> usize {
        let first = values.first().copied().unwrap_or_default();
        let (low, high) = values.iter().fold((first, first), |(low, high), p| (low.min(*p), high.max(*p)));
        let fields = json!({ "min": numbers(&low.to_array()), "max": numbers(&high.to_array()) });
        self.accessor("VEC3", FLOAT, values.len(), bytemuck::cast_slice(values), Target::Vertices, &fields)
    }

    /// Indices of triangles over `vertex_count` vertices, as short as they can be: 65535 is no index.
    pub fn indices(&mut self, indices: &[u32], vertex_count: usize) -> usize {
        if vertex_count < 65_535 {
            let short: Vec<u16> = indices.iter().map(|&index| index as u16).collect();
            let bytes = bytemuck::cast_slice(&short);
            self.accessor("SCALAR", UNSIGNED_SHORT, short.len(), bytes, Target::Indices, &Value::Null)
        } else {
            let bytes = bytemuck::cast_slice(indices);
            self.accessor("SCALAR", UNSIGNED_INT, indices.len(), bytes, Target::Indices, &Value::Null)
        }
    }

    /// The file: `root` with the buffer, its views and accessors, and the bytes. `None` beyond the 4 GiB of the format.
    pub fn glb(mut self, mut root: Value) -> Option<Vec<u8>> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        root["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        root["bufferViews"] = Value::Array(self.views);
        root["accessors"] = Value::Array(self.accessors);
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');

        let total = u32::try_from(12 + 8 + text.len() + 8 + self.bytes.len()).ok()?;
        let mut glb = Vec::with_capacity(total as usize);
        for word in [0x4654_6C67, 2, total] {
            glb.extend_from_slice(&word.to_le_bytes());
        }
        for (kind, chunk) in [(0x4E4F_534A_u32, &text), (0x004E_4942, &self.bytes)] {
            glb.extend_from_slice(&(chunk.len() as u32).to_le_bytes());
            glb.extend_from_slice(&kind.to_le_bytes());
            glb.extend_from_slice(chunk);
        }
        Some(glb)
    }
}

/// The shortest decimal that reads back as `x`.
pub fn number(x: f32) -> Value {
    let shortest: f64 = (x + 0.0).to_string().parse().unwrap_or(0.0);
    if shortest == shortest.trunc() && shortest.abs() < 1e9 { json!(shortest as i64) } else { json!(shortest) }
}

pub fn numbers(values: &[f32]) -> Value {
    values.iter().map(|&x| number(x)).collect()
}
