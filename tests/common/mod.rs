//! What the GPU tests share: a context with validation on, whose silence is checked when it goes.
#![allow(dead_code, reason = "each test file uses its own part")]

pub mod hemisphere_bins;
pub mod lobe;
pub mod posed;
pub mod scenes;

use linklight::gpu::{Context, Options};
use std::ops::Deref;

/// What best practices say of us that we do on purpose, and why that is right.
const ON_PURPOSE: [(&str, &str); 1] = [(
    "using the SPIR-V Workgroup built-in",
    "LocalSizeId is an optional feature (maintenance4) that we do not ask for",
)];

/// With this in the environment, all tests run as on a device of the least limits and without optional features.
const SMALL_DEVICE: &str = "LINKLIGHT_TEST_SMALL_DEVICE";

/// Bytes a pass can bind there.
const SMALL_STORAGE_BUFFER: u64 = 16 << 20;

/// A context with core, synchronization and best-practices validation; dropping it fails the test if any said anything
/// that is not [`ON_PURPOSE`].
pub struct TestContext(Context);

impl TestContext {
    pub fn new() -> Self {
        Self::with(Options::default())
    }

    pub fn with(options: Options) -> Self {
        let mut options = Options { validation: true, best_practices: true, ..options };
        if std::env::var_os(SMALL_DEVICE).is_some() {
            options.no_optional_features = true;
            options.max_storage_buffer_bytes.get_or_insert(SMALL_STORAGE_BUFFER);
        }
        Self(
            Context::new(options)
                .unwrap_or_else(|e| panic!("GPU tests need a Vulkan device and the validation layer: {e}")),
        )
    }
}

impl Deref for TestContext {
    type Target = Context;
    fn deref(&self) -> &Context {
        &self.0
    }
}

impl Drop for TestContext {
    fn drop(&mut self) {
        let is_on_purpose = |message: &String| ON_PURPOSE.iter().any(|(part, _)| message.contains(part));
        let mut messages = self.0.validation_messages();
        messages.retain(|message| !is_on_purpose(message));
        if !std::thread::panicking() {
            assert!(messages.is_empty(), "validation messages:\n{}", messages.join("\n"));
        }
    }
}

/// A small deterministic generator for test data (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, bound: u32) -> u32 {
        (self.next_u64() % u64::from(bound.max(1))) as u32
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 / (1u64 << 24) as f32
    }
}
