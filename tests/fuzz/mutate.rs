//! Ways to bend an input: bytes anywhere, words of a text, values of a JSON document, and what has to be put right again
//! so that the bent part is looked at (lengths of a container, checksums).

use serde_json::{Value, json};

/// A small deterministic generator (SplitMix64).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed);
        random.next();
        random
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In `0..bound`; 0 for a bound of 0.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    pub fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }

    /// True once in `of` times.
    pub fn one_in(&mut self, of: usize) -> bool {
        self.below(of) == 0
    }
}

/// Numbers at the edges of their types.
const EDGES: [u64; 22] = [
    0,
    1,
    2,
    3,
    4,
    7,
    16,
    127,
    128,
    255,
    256,
    32767,
    65535,
    65536,
    1 << 24,
    i32::MAX as u64,
    1 << 31,
    u32::MAX as u64,
    1 << 32,
    i64::MAX as u64,
    0x7ff0_0000_0000_0000,
    u64::MAX,
];

/// One to eight changes of single bytes, words, stretches or the length.
pub fn bytes(random: &mut Random, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..1 << random.below(4) {
        let at = random.below(bytes.len());
        match random.below(9) {
            _ if bytes.is_empty() => bytes.push(random.next() as u8),
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes.truncate(at),
            3 | 4 => {
                let width = 1 << random.below(4);
                let value = random.pick(&EDGES).wrapping_sub(random.below(2) as u64).to_le_bytes();
                let mut value = value[..width].to_vec();
                if random.one_in(2) {
                    value.reverse();
                }
                bytes.iter_mut().skip(at).zip(value).for_each(|(byte, new)| *byte = new);
            }
            5 => {
                let end = (at + random.below(32)).min(bytes.len());
                drop(bytes.drain(at..end));
            }
            6 => {
                let end = (at + random.below(64)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                drop(bytes.splice(to..to, copy));
            }
            7 => {
                let end = (at + random.below(16)).min(bytes.len());
                let fill = *random.pick(&[0, 0xff, 0x7f, 0x80]);
                bytes[at..end].fill(fill);
            }
            _ => {
                let number = f32::from_bits(*random.pick(&[0x7f80_0000, 0x7fc0_0000, 0xff7f_ffff, 1, 0x8000_0000]));
                bytes.iter_mut().skip(at & !3).zip(number.to_le_bytes()).for_each(|(byte, new)| *byte = new);
            }
        }
    }
    bytes
}

/// Every pointer into a document.
fn pointers(value: &Value, at: String, found: &mut Vec<String>) {
    match value {
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(index, value)| pointers(value, format!("{at}/{index}"), found));
        }
        Value::Object(map) => map.iter().for_each(|(key, value)| pointers(value, format!("{at}/{key}"), found)),
        _ => {}
    }
    found.push(at);
}

fn hostile(random: &mut Random, words: &[&str]) -> Value {
    match random.below(8) {
        0..=2 => json!(*random.pick(&EDGES)),
        3 => json!(*random.pick(&[
            -1.0,
            0.5,
            1e-30,
            1e9,
            1e30,
            -1e30,
            1e38,
            3.5e38,
            1e300,
            -0.0,
            1e-45,
            2.0f64.powi(53)
        ])),
        4 => json!(*random.pick(words)),
        5 => random.pick(&[json!(null), json!(true), json!(false), json!([]), json!({}), json!("")]).clone(),
        6 => json!(random.next() as i32),
        _ => json!(random.below(12)),
    }
}

/// One to four changes of a document: values replaced, moved, doubled, removed, or keys added from `words`.
pub fn document(random: &mut Random, document: &mut Value, words: &[&str]) {
    for _ in 0..1 + random.below(4) {
        let mut found = Vec::new();
        pointers(document, String::new(), &mut found);
        let (at, other) = (random.pick(&found).clone(), random.pick(&found).clone());
        let elsewhere = document.pointer(&other).cloned().unwrap_or_default();
        let new = hostile(random, words);
        let Some(value) = document.pointer_mut(&at) else { continue };
        match (random.below(8), value) {
            // Whole subtrees grow the document: seldom.
            (0, value) if elsewhere.to_string().len() < 2000 => *value = elsewhere,
            (1, Value::Array(values)) if !values.is_empty() => {
                let copy = values[random.below(values.len())].clone();
                values.push(copy);
            }
            (2, Value::Array(values)) if !values.is_empty() => drop(values.remove(random.below(values.len()))),
            (2, Value::Object(map)) if !map.is_empty() => {
                let key = map.keys().nth(random.below(map.len())).cloned().unwrap_or_default();
                map.remove(&key);
            }
            (3, Value::Object(map)) => drop(map.insert((*random.pick(words)).to_owned(), new)),
            (4, Value::Number(number)) => {
                let number = number.as_f64().unwrap_or(0.0);
                *value_of(document, &at) = json!(number + *random.pick(&[-1.0, 1.0, 0.5, 1e6]));
            }
            (_, value) => *value = new,
        }
    }
}

fn value_of<'v>(document: &'v mut Value, at: &str) -> &'v mut Value {
    document.pointer_mut(at).expect("a pointer just found")
}

/// One to four changes of a text: lines or words doubled, removed, replaced by `words`, cut in two, or single bytes.
pub fn text(random: &mut Random, text: &str, words: &[&str]) -> Vec<u8> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..1 + random.below(4) {
        let at = random.below(lines.len());
        match random.below(7) {
            _ if lines.is_empty() => lines.push((*random.pick(words)).to_owned()),
            0 => drop(lines.remove(at)),
            1 => lines.insert(at, lines[at].clone()),
            2 => lines.insert(at, (*random.pick(words)).to_owned()),
            3 => {
                let end = lines[at].find('=').map_or(0, |at| at + 1);
                lines[at].truncate(end);
                let value = match random.below(3) {
                    0 => random.pick(&EDGES).to_string(),
                    1 => (*random.pick(&["nan", "inf", "-0", "1e39", "0.5,", ",,", "1,2,3", "-1", "é", ""])).to_owned(),
                    _ => (*random.pick(words)).to_owned(),
                };
                lines[at].push_str(&value);
            }
            4 => {
                let cut = (0..=lines[at].len()).filter(|cut| lines[at].is_char_boundary(*cut)).collect::<Vec<_>>();
                let rest = lines[at].split_off(*random.pick(&cut));
                lines.insert(at + 1, rest);
            }
            5 => {
                let other = random.below(lines.len());
                lines.swap(at, other);
            }
            _ => lines[at] = String::from_utf8_lossy(&bytes(random, lines[at].clone().into_bytes())).into_owned(),
        }
    }
    lines.join("\n").into_bytes()
}

/// Puts every chunk's checksum right, so that a decoder looks into the bent chunks of a PNG.
pub fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while at + 12 <= bytes.len() {
        let length = u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
        let Some(end) = (at + 8).checked_add(length).filter(|end| end + 4 <= bytes.len()) else { return };
        let crc = crc32(&bytes[at + 4..end]).to_be_bytes();
        bytes[end..end + 4].copy_from_slice(&crc);
        at = end + 4;
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}
