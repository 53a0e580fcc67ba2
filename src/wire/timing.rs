//! Measures how late the cycle's thread wakes, and how long a cycle works.

use std::time::Duration;

/// Collects the lateness of the cycle's wake-ups, the working times of the cycles, and the number of skipped cycles.
#[derive(Clone, Debug, Default)]
pub struct CycleTiming {
    lateness: Spread,
    work: Spread,
    overruns: u64,
}

/// The quantiles and the maximum of a duration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpreadFigures {
    /// The median. Like the two quantiles below, it may be up to 1 % too long.
    pub median: Duration,
    /// The 99 % quantile.
    pub p99: Duration,
    /// The 99.9 % quantile.
    pub p999: Duration,
    /// The longest time.
    pub max: Duration,
}

/// The quantiles and the count of a [`CycleTiming`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimingFigures {
    /// The lateness of the wake-ups.
    pub lateness: SpreadFigures,
    /// The working times of the cycles, from wake-up to end.
    pub work: SpreadFigures,
    /// The number of deadlines that were skipped since the start.
    pub overruns: u64,
}

impl CycleTiming {
    /// Adds a wake-up that came `lateness` after its deadline. `missed` deadlines were skipped since the previous wake-up.
    pub fn add(&mut self, lateness: Duration, missed: u64) {
        self.lateness.add(lateness);
        self.overruns += missed;
    }

    /// Adds the working time of a cycle.
    pub fn add_work(&mut self, time: Duration) {
        self.work.add(time);
    }

    /// Clears the distributions, for example when a motion begins. Overruns continue to count.
    pub fn restart(&mut self) {
        self.lateness.clear();
        self.work.clear();
    }

    /// Returns the quantiles of the lateness and of the working times, and the number of skipped cycles.
    pub fn figures(&self) -> TimingFigures {
        TimingFigures {
            lateness: self.lateness.figures(),
            work: self.work.figures(),
            overruns: self.overruns,
        }
    }
}

/// A histogram of times. Each bin ends 1 % later than the previous one.
#[derive(Clone, Debug)]
struct Spread {
    bins: Vec<u32>,
    count: u32,
    max: Duration,
}

/// The ratio of the ends of successive bins. The first bin ends at [`FIRST`].
const RATIO: f64 = 1.01;

/// The end of the first bin \[s\].
const FIRST: f64 = 1e-7;

/// The number of bins. The last bin ends at one hour.
const BINS: usize = 2444;

impl Default for Spread {
    fn default() -> Self {
        Self { bins: vec![0; BINS], count: 0, max: Duration::ZERO }
    }
}

impl Spread {
    fn add(&mut self, time: Duration) {
        let bin = (time.as_secs_f64() / FIRST).max(1.0).log(RATIO).ceil();
        let bin = (bin as usize).min(BINS - 1);
        self.bins[bin] = self.bins[bin].saturating_add(1);
        self.count = self.count.saturating_add(1);
        self.max = self.max.max(time);
    }

    fn clear(&mut self) {
        self.bins.fill(0);
        (self.count, self.max) = (0, Duration::ZERO);
    }

    fn figures(&self) -> SpreadFigures {
        let [median, p99, p999] = self.quantiles([0.5, 0.99, 0.999]);
        SpreadFigures { median, p99, p999, max: self.max }
    }

    /// Returns the quantile for each of the fractions `parts` (from 0 to 1), which must be in ascending order. 0.5 gives the
    /// median.
    fn quantiles<const N: usize>(&self, parts: [f64; N]) -> [Duration; N] {
        let (mut seen, mut bins) = (0, self.bins.iter().enumerate());
        let mut end = Duration::ZERO;
        parts.map(|part| {
            let wanted = (f64::from(self.count) * part).ceil();
            while f64::from(seen) < wanted {
                let Some((bin, count)) = bins.next() else { break };
                seen += count;
                end = Duration::from_secs_f64(RATIO.powf(bin as f64) * FIRST).min(self.max);
            }
            end
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rule_11_lateness_work_and_missed_cycles_are_counted() {
        let mut timing = CycleTiming::default();
        (0..989).for_each(|_| timing.add(Duration::from_micros(50), 0));
        (0..10).for_each(|_| timing.add(Duration::from_micros(700), 0));
        timing.add(Duration::from_millis(3), 2);
        (0..1000).for_each(|i| timing.add_work(Duration::from_micros(i + 1)));
        let TimingFigures { lateness, work, overruns } = timing.figures();
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        assert!((50.0..50.51).contains(&us(lateness.median)), "{lateness:?}");
        assert!((700.0..707.1).contains(&us(lateness.p99)), "990 of 1000 were no later: {lateness:?}");
        assert!((700.0..707.1).contains(&us(lateness.p999)), "{lateness:?}");
        assert_eq!((lateness.max, overruns), (Duration::from_millis(3), 2));
        assert!(
            (500.0..505.1).contains(&us(work.median)) && (990.0..=1000.0).contains(&us(work.p99)),
            "{work:?}"
        );
        timing.restart();
        assert_eq!(timing.figures(), TimingFigures { overruns: 2, ..TimingFigures::default() });
    }

    #[test]
    fn rule_11_a_machine_that_is_always_late_has_a_p99_of_its_own() {
        for (usual, worst) in [(6, 20), (40, 900), (1_000, 3_000_000)] {
            let mut timing = CycleTiming::default();
            (0..990).for_each(|_| timing.add(Duration::from_millis(usual), 0));
            (0..10).for_each(|_| timing.add(Duration::from_millis(worst), 0));
            let p99 = timing.figures().lateness.p99.as_secs_f64() * 1e3;
            assert!((usual as f64..1.01 * usual as f64).contains(&p99), "{p99} ms of {usual}");
            timing.add(Duration::from_secs(10_000), 0);
            let lateness = timing.figures().lateness;
            assert!(lateness.p999 <= lateness.max);
        }
    }
}
