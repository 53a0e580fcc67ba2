//! Bags, without DDS: what is written is what is read, by us and by others; and no bytes bring the reader down.
#![cfg(feature = "ros")]

mod bags;
mod damage;
mod fuzz;
mod hostile;
mod interop;
mod reading;
mod runs;
mod writing;

use peak_alloc::PeakAlloc;
use std::sync::{Mutex, PoisonError};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What `work` returns, and how much more memory was held at the peak than before, by tests that run beside too \[bytes\].
fn measured<T>(work: impl FnOnce() -> T) -> (T, usize) {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let result = work();
    (result, MEMORY.peak_usage().saturating_sub(before))
}
