//! Links in compressed sparse rows: built on the device from the hits of each receiver's rays, batch after batch.
//!
//! Row `r` holds the links of receiver `r`, sorted by sender, each sender once; weights are form factors from receiver
//! to sender. The list is cut into windows of whole rows, none larger than a pass can bind. What it does not do: cast
//! rays ([`super::trace`]) or send light ([`super::gather`]).

mod building;

pub use building::LinkBuilder;

use crate::gpu::{Buffer, Context, GpuError};

/// Elements that a packed link can name.
pub const PACKED_ELEMENTS: u32 = 1 << 20;
/// Units of the weight of one packed link.
const PACKED_UNITS: u32 = 4096;
/// Units of one ray; the same constant stands in `lib/link.glsl`.
const RAY_UNITS: u32 = 1 << 16;
/// Rays per element that fit the workgroup memory of the merge.
pub const MAX_RAYS: u32 = 1024;

/// How a link is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkFormat {
    /// Sender and f32 weight, 8 bytes.
    Full,
    /// 20 bits of sender and 12 of weight, 4 bytes. A weight is off by 1/4096 at most; sums of rows are kept. What is
    /// sent along them is rounded too, by 1/512 of the brightest channel at most.
    Packed,
}

/// Why links cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(
        "links need about {needed} bytes ({per_element:.0} links an element, as counted on the first {counted} of \
         {element_count}), {available} are available; lower --elements or rays_per_element, or set packed_links=true"
    )]
    OutOfMemory { needed: u64, available: u64, per_element: f64, counted: u32, element_count: u32 },
    #[error("packed links name at most {PACKED_ELEMENTS} elements, this scene has {0}; set packed_links=false")]
    TooManyForPacked(u32),
    #[error("{0} links are more than 32 bits can count; lower --elements or rays_per_element")]
    TooMany(u64),
}

/// A link from a receiver to one sender, and its weight: the form factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    pub sender: u32,
    pub weight: f32,
}

impl Link {
    /// As stored in [`LinkFormat::Full`].
    pub fn from_word(word: u64) -> Self {
        Self { sender: word as u32, weight: f32::from_bits((word >> 32) as u32) }
    }

    /// As stored in [`LinkFormat::Packed`].
    pub fn from_packed(word: u32) -> Self {
        Self { sender: word / PACKED_UNITS, weight: (word % PACKED_UNITS) as f32 / PACKED_UNITS as f32 }
    }
}

/// The links of some consecutive receivers, a word each; some room may be left at the end.
pub struct LinkWindow<W> {
    pub first_element: u32,
    pub element_count: u32,
    /// Links of the windows before.
    pub first_link: u32,
    pub link_count: u32,
    pub words: Buffer<W>,
}

/// Windows in order of receivers, without gaps, and room for what is sent along their links ([`super::gather`]).
pub struct LinkSet<W> {
    pub windows: Vec<LinkWindow<W>>,
    /// Radiosity of each sender, a word as long as a link.
    pub sent: Buffer<W>,
    /// Of links that were here before.
    spare: Vec<Buffer<W>>,
}

impl<W> LinkSet<W> {
    fn new(context: &Context, sender_count: u32) -> Result<Self, GpuError> {
        let sent = context.buffer("links/sent", sender_count as usize)?;
        Ok(Self { windows: Vec::new(), sent, spare: Vec::new() })
    }

    fn size_bytes(&self) -> u64 {
        let windows = self.windows.iter().map(|window| &window.words).chain(&self.spare);
        self.sent.size_bytes() + windows.map(Buffer::size_bytes).sum::<u64>()
    }

    fn clear(&mut self) {
        self.windows.clear();
        self.spare.clear();
    }

    /// All links go, their memory stays for others.
    fn empty(&mut self) {
        self.spare.extend(self.windows.drain(..).map(|window| window.words));
    }

    /// The last window, or another where that has no room for `count` more: a spare one, else a new one of `capacity` links.
    fn window_for(
        &mut self,
        context: &Context,
        first_element: u32,
        count: u32,
        capacity: impl FnOnce() -> Result<usize, LinkError>,
    ) -> Result<&mut LinkWindow<W>, LinkError> {
        let room = self.windows.last().map(|w| w.words.len() - w.link_count as usize);
        if room.is_none_or(|room| room < count as usize) {
            let first_link = self.windows.last().map_or(0, |w| w.first_link + w.link_count);
            let words = match self.spare.iter().position(|words| words.len() >= count as usize) {
                Some(place) => self.spare.remove(place),
                None => {
                    // What does not even hold a batch is of no use.
                    self.spare.clear();
                    context.buffer(&format!("links/window {}", self.windows.len()), capacity()?)?
                }
            };
            self.windows.push(LinkWindow { first_element, element_count: 0, first_link, link_count: 0, words });
        }
        let last = self.windows.len() - 1;
        Ok(&mut self.windows[last])
    }
}

/// The links in their format.
pub enum LinkWords {
    Full(LinkSet<u64>),
    Packed(LinkSet<u32>),
}

/// Words of rows that are written at once.
const ROW_PIECE: usize = 1 << 20;

/// All links of a scene.
pub struct Links {
    /// `element_count + 1` entries over all windows, the first 0.
    pub offsets: Buffer<u32>,
    pub words: LinkWords,
    pub element_count: u32,
    pub link_count: u32,
    /// Windows were made for more links than there were.
    has_room: bool,
}

impl Links {
    /// Bytes allocated.
    pub fn size_bytes(&self) -> u64 {
        let words = match &self.words {
            LinkWords::Full(set) => set.size_bytes(),
            LinkWords::Packed(set) => set.size_bytes(),
        };
        self.offsets.size_bytes() + words
    }

    pub fn window_count(&self) -> usize {
        match &self.words {
            LinkWords::Full(set) => set.windows.len(),
            LinkWords::Packed(set) => set.windows.len(),
        }
    }

    /// No links, and room for none.
    fn new(context: &Context, format: LinkFormat, counts: LinkCounts) -> Result<Self, GpuError> {
        Ok(Self {
            offsets: context.upload("links/offsets", &vec![0; counts.receivers as usize + 1])?,
            words: match format {
                LinkFormat::Full => LinkWords::Full(LinkSet::new(context, counts.senders)?),
                LinkFormat::Packed => LinkWords::Packed(LinkSet::new(context, counts.senders)?),
            },
            element_count: counts.receivers,
            link_count: 0,
            has_room: false,
        })
    }

    /// Gives the windows' memory back.
    pub fn clear(&mut self) {
        match &mut self.words {
            LinkWords::Full(set) => set.clear(),
            LinkWords::Packed(set) => set.clear(),
        }
        self.link_count = 0;
    }

    /// All links go; the windows' memory stays for those to come.
    fn empty(&mut self) {
        match &mut self.words {
            LinkWords::Full(set) => set.empty(),
            LinkWords::Packed(set) => set.empty(),
        }
        self.link_count = 0;
    }

    /// All links, for tests and views; offsets into them are [`Self::offsets`].
    pub fn download(&self, context: &Context) -> Result<Vec<Link>, GpuError> {
        let mut links = Vec::with_capacity(self.link_count as usize);
        match &self.words {
            LinkWords::Full(set) => {
                for window in &set.windows {
                    let words = context.download_range(&window.words, 0..window.link_count as usize)?;
                    links.extend(words.into_iter().map(Link::from_word));
                }
            }
            LinkWords::Packed(set) => {
                for window in &set.windows {
                    let words = context.download_range(&window.words, 0..window.link_count as usize)?;
                    links.extend(words.into_iter().map(Link::from_packed));
                }
            }
        }
        Ok(links)
    }
}

/// What the rays of each element met, beside links.
pub struct Outcomes {
    /// A bit per element and ray that met nothing; each element starts a word.
    pub escaped: Buffer<u32>,
    /// Per element: rays blocked by a back face, and in the upper half escaped ones.
    pub counts: Buffer<u32>,
}

impl Outcomes {
    pub fn new(context: &Context, element_count: u32, ray_count: u32) -> Result<Self, GpuError> {
        let words = element_count as usize * ray_count.div_ceil(32) as usize;
        Ok(Self {
            escaped: context.buffer("links/escaped rays", words)?,
            counts: context.buffer("links/ray outcomes", element_count as usize)?,
        })
    }
}

/// How many of what a [`LinkBuilder`] links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkCounts {
    pub receivers: u32,
    /// Senders have indices below this.
    pub senders: u32,
    /// Rays per receiver, at most [`MAX_RAYS`].
    pub rays: u32,
    /// Receivers of a batch.
    pub batch: u32,
}
