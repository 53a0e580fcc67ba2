//! Measures memory.

use peak_alloc::PeakAlloc;
use std::sync::{Mutex, PoisonError};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Returns the result of `work`, and the largest increase of memory during `work` \[bytes\], including that of parallel tests.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, usize) {
    // One measurement at a time, because all tests share the memory.
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let result = work();
    (result, MEMORY.peak_usage().saturating_sub(before))
}
