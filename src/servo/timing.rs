//! How late the cycle woke.

use std::time::Duration;

/// Lateness of the cycle's wake-ups against their deadlines, in bins that each end 1 % later than the one before, and the cycles
/// that were missed.
#[derive(Clone, Debug)]
pub struct CycleTiming {
    bins: Vec<u32>,
    count: u32,
    max: Duration,
    overruns: u64,
}

/// The figures of a [`CycleTiming`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimingFigures {
    /// The lateness that 99 % of the wake-ups kept under, at most 1 % too long.
    pub p99: Duration,
    /// The worst lateness.
    pub max: Duration,
    /// Deadlines skipped since the start.
    pub overruns: u64,
}

/// Each bin ends at this multiple of the one before; the first ends at 1 µs.
const RATIO: f64 = 1.01;

/// Enough for an hour.
const BINS: usize = 2212;

impl Default for CycleTiming {
    fn default() -> Self {
        Self { bins: vec![0; BINS], count: 0, max: Duration::ZERO, overruns: 0 }
    }
}

impl CycleTiming {
    /// Adds a wake-up that came `lateness` after its deadline, with `missed` deadlines skipped since the one before.
    pub fn add(&mut self, lateness: Duration, missed: u64) {
        let bin = (lateness.as_secs_f64() * 1e6).max(1.0).log(RATIO).ceil();
        let bin = (bin as usize).min(BINS - 1);
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

    /// The lateness that 99 % of the wake-ups kept under, at most 1 % too long.
    pub fn p99(&self) -> Duration {
        let wanted = (f64::from(self.count) * 0.99).ceil();
        let mut seen = 0.0;
        let bin = self.bins.iter().position(|count| {
            seen += f64::from(*count);
            seen >= wanted
        });
        match bin {
            Some(bin) => Duration::from_secs_f64(RATIO.powf(bin as f64) * 1e-6).min(self.max),
            None => self.max,
        }
    }

    /// All of it in figures.
    pub fn figures(&self) -> TimingFigures {
        TimingFigures { p99: self.p99(), max: self.max, overruns: self.overruns }
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
