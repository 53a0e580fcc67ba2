//! What real robots add between a command and the joint state that shows it.

use dq_params::Parameters;
use std::collections::VecDeque;
use std::time::Duration;

/// What the robot is like; all zero, as by default, is an arm that follows each command at once, and reports at once where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Parameters)]
pub struct Realism {
    /// a command takes effect so much after it came \[s\]
    #[parameter(range = 0.0..=1.0)]
    pub command_latency: Duration,
    /// a joint state comes out so much after it was measured \[s\]
    #[parameter(range = 0.0..=1.0)]
    pub state_latency: Duration,
    /// a joint goes after a velocity command as a system of first order with it \[s\]
    #[parameter(range = 0.0..=10.0)]
    pub velocity_time_constant: Duration,
    /// each measured position is off by up to this either way \[rad, m\]
    #[parameter(range = 0.0..=1.0)]
    pub position_noise: f64,
    /// what one count of the encoders is; 0: they do not count \[rad, m\]
    #[parameter(range = 0.0..=1.0)]
    pub encoder_resolution: f64,
    /// From one joint state to the next; zero: one each step.
    pub state_interval: Duration,
}

impl Realism {
    /// The position \[rad\] as it is measured, with `noise` from −1 to 1.
    fn measured(&self, position: f64, noise: f64) -> f64 {
        let noisy = position + self.position_noise * noise;
        match self.encoder_resolution > 0.0 {
            true => self.encoder_resolution * (noisy / self.encoder_resolution).round(),
            false => noisy,
        }
    }
}

/// A joint state as it comes out.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// When it was measured.
    pub at: Duration,
    /// Joint positions \[rad\].
    pub positions: Vec<f64>,
    /// Joint velocities [rad/s].
    pub velocities: Vec<f64>,
}

/// Joint states on their way out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sensor {
    next: Duration,
    under_way: VecDeque<Measured>,
}

impl Sensor {
    /// Measures at `now`, where a measurement is due, and gives the newest joint state that has come out, if one has.
    pub fn measure(
        &mut self,
        now: Duration,
        realism: &Realism,
        (positions, velocities): (&[f64], &[f64]),
        mut noise: impl FnMut() -> f64,
    ) -> Option<Measured> {
        // One that is due later than the interval allows was planned when that was longer.
        if now >= self.next || self.next.saturating_sub(now) > realism.state_interval {
            // On a grid, so that steps that are a little late do not make it slower; never made up for.
            let next = self.next.min(now) + realism.state_interval;
            self.next = if next > now { next } else { now + realism.state_interval };
            let measured = |position: &f64| realism.measured(*position, noise());
            let positions = positions.iter().map(measured).collect();
            self.under_way.push_back(Measured { at: now, positions, velocities: velocities.to_vec() });
        }
        let mut out = None;
        while self.under_way.front().is_some_and(|it| it.at.saturating_add(realism.state_latency) <= now) {
            out = self.under_way.pop_front();
        }
        out
    }

    /// Forgets what is on its way.
    pub fn clear(&mut self) {
        self.under_way.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn states_come_late_at_their_own_rate_and_with_the_time_at_which_they_were_measured() {
        let realism = Realism { state_latency: 7 * MS, state_interval: 10 * MS, ..Realism::default() };
        let mut sensor = Sensor::default();
        let mut came = Vec::new();
        for time in (100..160).step_by(2) {
            let position = [f64::from(time)];
            if let Some(state) = sensor.measure(MS * time, &realism, (&position, &[1.0]), || 0.0) {
                assert_eq!(state.at, MS * state.positions[0] as u32);
                came.push((time, state.positions[0] as u32));
            }
        }
        assert_eq!(came, [(108, 100), (118, 110), (128, 120), (138, 130), (148, 140), (158, 150)]);
    }

    #[test]
    fn a_rate_that_is_raised_counts_from_now_on() {
        let slow = Realism { state_interval: 1_000_000 * MS, ..Realism::default() };
        let mut sensor = Sensor::default();
        let mut comes =
            |time, realism: &Realism| sensor.measure(MS * time, realism, (&[0.0], &[0.0]), || 0.0).is_some();
        assert!(comes(100, &slow) && !comes(102, &slow));
        let fast = Realism { state_interval: 10 * MS, ..Realism::default() };
        assert_eq!(
            [104, 106, 112, 114, 116].map(|time| comes(time, &fast)),
            [true, false, false, true, false]
        );
        assert!(comes(116, &Realism::default()) && comes(118, &Realism::default()));
    }

    #[test]
    fn encoders_count_and_noise_is_bounded() {
        let realism = Realism { position_noise: 0.009, encoder_resolution: 0.004, ..Realism::default() };
        for (noise, expected) in [(0.0, 1.0), (1.0, 1.008), (-1.0, 0.992)] {
            let measured = realism.measured(1.0, noise);
            let counts = measured / 0.004;
            assert!(
                (measured - expected).abs() < 1e-12 && (counts - counts.round()).abs() < 1e-9,
                "{measured}"
            );
        }
        assert_eq!(Realism::default().measured(0.123, 1.0), 0.123);
    }
}
