//! What one element received in the last bounce, link by link: what explanations of a pixel are made of.

use glam::Vec3;

/// Where light came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sender {
    Element(u32),
    /// A node over several elements, `leaf_count` of them, the first being `first`.
    Node {
        node: u32,
        first: u32,
        leaf_count: u32,
    },
    /// The element stands inside something: it took over the mean of its neighbours.
    Neighbours,
    /// Tables of directions of glossy senders, all together.
    Glossy,
    /// What was taken away below the least that may arrive, and is given back.
    Floor,
}

/// One link and what came along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried {
    pub from: Sender,
    /// W/m2: form factor times what the sender sent.
    pub irradiance: Vec3,
}
