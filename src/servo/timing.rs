//! How late the cycle woke.

use std::time::Duration;

/// Lateness of the cycle's wake-ups against their deadlines, in 1 µs bins, and the cycles that were missed.
#[derive(Clone, Debug)]
pub struct CycleTiming {
    bins: Vec<u32>,
    count: u32,
    max: Duration,
    overruns: u64,
}

/// Lateness beyond this [µs] falls into the last bin.
const BINS: usize = 5000;

impl Default for CycleTiming {
    fn default() -> Self {
        Self { bins: vec![0; BINS], count: 0, max: Duration::ZERO, overruns: 0 }
    }
}

impl CycleTiming {
    /// Adds a wake-up that came `lateness` after its deadline, with `missed` deadlines skipped since the one before.
    pub fn add(&mut self, lateness: Duration, missed: u64) {
        let bin = usize::try_from(lateness.as_micros()).unwrap_or(BINS).min(BINS - 1);
        self.bins[bin] = self.bins[bin].saturating_add(1);
        self.count = self.count.saturating_add(1);
        self.max = self.max.max(lateness);
        self.overruns += missed;
    }

    /// Forgets the lateness so far, as at the start of a motion; overruns are counted on.
    pub fn restart(&mut self) {
        self.bins.fill(0);
        self.count = 0;
        self.max = Duration::ZERO;
    }

    /// The lateness that 99 % of the wake-ups kept under, to 1 µs; [`max`](Self::max) where it is beyond 5 ms.
    pub fn p99(&self) -> Duration {
        let wanted = (f64::from(self.count) * 0.99).ceil();
        let mut seen = 0.0;
        let bin = self.bins.iter().position(|count| {
            seen += f64::from(*count);
            seen >= wanted
        });
        match bin {
            Some(bin) if bin < BINS - 1 => Duration::from_micros(bin as u64 + 1).min(self.max),
            _ => self.max,
        }
    }

    /// The worst lateness.
    pub fn max(&self) -> Duration {
        self.max
    }

    /// Deadlines skipped since the start.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }
}
