//! The memory a scene may take: everything decoded is counted here before it is allocated.

use super::error::Fault;
use std::cell::Cell;

/// A count of bytes with a limit. Shared by reference, so that readers of different parts draw on one budget.
#[derive(Debug)]
pub struct Budget {
    available: Cell<u64>,
}

impl Budget {
    pub fn new(bytes: u64) -> Self {
        Self { available: Cell::new(bytes) }
    }

    /// Takes `bytes`, or says what they were for and how many were left.
    pub fn reserve(&self, bytes: u64, what: impl FnOnce() -> String) -> Result<(), Fault> {
        let available = self.available.get();
        let left =
            available.checked_sub(bytes).ok_or_else(|| Fault::OverBudget { what: what(), needed: bytes, available })?;
        self.available.set(left);
        Ok(())
    }

    /// Takes the bytes of `count` values of type `T`.
    pub fn reserve_array<T>(&self, count: u64, what: impl FnOnce() -> String) -> Result<(), Fault> {
        self.reserve(count.saturating_mul(size_of::<T>() as u64), what)
    }

    /// Gives back bytes that are no longer held.
    pub fn release(&self, bytes: u64) {
        self.available.set(self.available.get().saturating_add(bytes));
    }
}
