//! The memory that something takes.

use peak_alloc::PeakAlloc;
use std::sync::{Mutex, PoisonError};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What `work` returns, and how much more memory was held at the peak than before, by tests that run beside too \[bytes\].
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, usize) {
    // One at a time, as the memory is everybody's.
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let result = work();
    (result, MEMORY.peak_usage().saturating_sub(before))
}
