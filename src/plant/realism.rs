//! The differences between real robots and an ideal arm: latency, noise, encoder resolution, and joints that follow with a time
//! constant.

use dq_params::Parameters;
use std::collections::VecDeque;
use std::time::Duration;

/// How the simulated robot differs from an ideal arm. By default all values are zero: the arm then follows each command at once and
/// reports its state at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Parameters)]
pub struct Realism {
    /// time from the arrival of a command until it takes effect \[s\]
    #[parameter(range = 0.0..=1.0)]
    pub command_latency: Duration,
    /// time from the measurement of a joint state until it is published \[s\]
    #[parameter(range = 0.0..=1.0)]
    pub state_latency: Duration,
    /// time constant with which a joint follows a velocity command, as a first-order system \[s\]
    #[parameter(range = 0.0..=10.0)]
    pub velocity_time_constant: Duration,
    /// largest deviation of a measured position from the true one, in either direction \[rad, m\]
    #[parameter(range = 0.0..=1.0)]
    pub position_noise: f64,
    /// position difference of one encoder count; 0: positions are not rounded to counts \[rad, m\]
    #[parameter(range = 0.0..=1.0)]
    pub encoder_resolution: f64,
    /// The time from one joint state to the next. Zero means one joint state per step.
    pub state_interval: Duration,
}

impl Realism {
    /// Returns the measured value of a position \[rad, prismatic: m\]. `noise` is from −1 to 1.
    fn measured(&self, position: f64, noise: f64) -> f64 {
        let noisy = position + self.position_noise * noise;
        match self.encoder_resolution > 0.0 {
            true => self.encoder_resolution * (noisy / self.encoder_resolution).round(),
            false => noisy,
        }
    }
}

/// A joint state as the robot publishes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The time of the measurement.
    pub at: Duration,
    /// Joint positions \[rad, prismatic: m\].
    pub positions: Vec<f64>,
    /// Joint velocities [rad/s, prismatic: m/s].
    pub velocities: Vec<f64>,
}

/// The time of the next measurement, and the joint states that have been measured but not yet published.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sensor {
    next: Duration,
    under_way: VecDeque<Measured>,
}

impl Sensor {
    /// Measures at `now` if a measurement is due. Returns the newest joint state whose latency has passed, if there is one.
    pub fn measure(
        &mut self,
        now: Duration,
        realism: &Realism,
        (positions, velocities): (&[f64], &[f64]),
        mut noise: impl FnMut() -> f64,
    ) -> Option<Measured> {
        // If the interval was shortened, the next measurement may still be planned for later than one new interval from now. Then
        // measure at once.
        if now >= self.next || self.next.saturating_sub(now) > realism.state_interval {
            // Keep the measurements at whole multiples of the interval, so that slightly late steps do not lower the rate. Missed
            // measurements are left out.
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

    /// Discards the joint states that have not been published yet.
    pub fn clear(&mut self) {
        self.under_way.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn states_are_delayed_at_their_own_rate_and_carry_their_time_of_measurement() {
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
    fn a_raised_rate_applies_at_once() {
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
    fn positions_are_rounded_to_encoder_counts_and_noise_is_bounded() {
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
