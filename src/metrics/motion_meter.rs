//! Measures the figures of a motion: numbers such as its settling time. The project defines each figure only here.
//!
//! Sample k is taken at the time t_k. It has the error e_k, the tool's position p_k and the joint velocities θ̇_k. The first sample
//! is number 0, and the last is number n. The goal's position is g. The point s is the tool's position when the goal last moved, or
//! p_0 if the goal never moved.
//!
//! | figure | formula |
//! |---|---|
//! | settling time | the last t_k with e_k above `max(2 % of e_0, tolerance)`, if e_n is not above it |
//! | path length | `Σ \|p_k − p_{k−1}\|` |
//! | straight line | `\|p_n − p_0\|` |
//! | path ratio | path length / straight line |
//! | overshoot | `max_k (p_k − g)·(g − s)/\|g − s\|` with g and s at the time t_k, not below 0 |
//! | effort | `Σ \|θ̇_{k−1}\|² (t_k − t_{k−1})` for velocities that are constant between samples; the trapezoidal rule for continuous velocities |
//! | peak joint speed | `max_k max_i \|θ̇_{k,i}\|` |

use crate::{Figures, GoalError, Tolerance};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The error (position or rotation) has settled when it stays below this fraction of its initial value (paper §3, §8: 2 %).
const SETTLING_BAND: f64 = 0.02;

/// Measures the settling time of one quantity, such as the position error or the rotation error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settling {
    band: f64,
    last_outside: Duration,
    inside: bool,
}

impl Settling {
    /// Creates the measurement. The error counts as settled while it is at most 2 % of `reference`, or at most `tolerance` if that
    /// is larger. `reference` is the initial error or, for a quantity that approaches a final value, the final value.
    pub fn new(reference: f64, tolerance: f64) -> Self {
        Self {
            band: (SETTLING_BAND * reference.abs()).max(tolerance),
            last_outside: Duration::ZERO,
            inside: false,
        }
    }

    /// Adds the size of the error at the time `elapsed`.
    pub fn update(&mut self, elapsed: Duration, error: f64) {
        self.inside = error <= self.band;
        if !self.inside {
            self.last_outside = elapsed;
        }
    }

    /// Returns the time from which the error has stayed within the band; `None` while the error is outside the band.
    pub fn time(&self) -> Option<Duration> {
        self.inside.then_some(self.last_outside)
    }
}

/// Measures a motion to one goal as it proceeds, in constant memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionMeter {
    started: Duration,
    rotation: Settling,
    position: Settling,
    start_point: Vector3<f64>,
    /// The tool's position when the goal last moved or, if the goal never moved, at the start of the motion. Overshoot is measured
    /// along the line from this position to the goal.
    line_start: Vector3<f64>,
    goal_point: Vector3<f64>,
    last: Option<LastSample>,
    /// Whether velocities change continuously between samples. Otherwise each velocity is constant until the next sample.
    continuous: bool,
    figures: Figures,
}

/// The previous sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct LastSample {
    time: Duration,
    point: Vector3<f64>,
    /// `|θ̇|²` [rad²/s²].
    speed_squared: f64,
}

/// The path ratio is computed only while the tool is at least this far from its start \[m\].
const APART: f64 = 1e-3;

impl MotionMeter {
    /// Begins to measure a motion at time `now`, with the tool at `point` \[m\], the goal at `goal_point` \[m\], and the tool's
    /// `error` with respect to the goal.
    pub fn begin(
        now: Duration,
        point: Vector3<f64>,
        goal_point: Vector3<f64>,
        error: &GoalError,
        tolerance: &Tolerance,
    ) -> Self {
        Self {
            started: now,
            rotation: Settling::new(error.rotation, tolerance.angular),
            position: Settling::new(error.position, tolerance.linear),
            start_point: point,
            line_start: point,
            goal_point,
            last: None,
            continuous: false,
            figures: Figures::default(),
        }
    }

    /// Makes this meter compute the effort for velocities that change continuously, as in a simulation in continuous time.
    #[must_use]
    pub fn of_continuous_velocities(mut self) -> Self {
        self.continuous = true;
        self
    }

    /// Notes that the goal has moved to `goal_point` \[m\].
    pub fn aim_at(&mut self, goal_point: Vector3<f64>) {
        if goal_point != self.goal_point {
            self.line_start = self.last.map_or(self.start_point, |last| last.point);
            self.goal_point = goal_point;
        }
    }

    /// Adds a sample at time `now`: the tool at `point` \[m\], its error, and the commanded joint velocities `theta_dot` [rad/s,
    /// prismatic: m/s].
    pub fn update(&mut self, now: Duration, point: Vector3<f64>, error: &GoalError, theta_dot: &[f64]) {
        let elapsed = now.saturating_sub(self.started);
        self.rotation.update(elapsed, error.rotation);
        self.position.update(elapsed, error.position);
        let speed_squared = theta_dot.iter().map(|speed| speed * speed).sum();
        let fastest = theta_dot.iter().fold(0.0_f64, |max, speed| max.max(speed.abs()));
        let figures = &mut self.figures;
        if let Some(last) = self.last {
            figures.path_length += (point - last.point).norm();
            let step = now.saturating_sub(last.time).as_secs_f64();
            let before = last.speed_squared;
            figures.effort += step * if self.continuous { 0.5 * (before + speed_squared) } else { before };
        }
        if let Some(ahead) = (self.goal_point - self.line_start).try_normalize(f64::EPSILON) {
            figures.overshoot = figures.overshoot.max((point - self.goal_point).dot(&ahead));
        }
        figures.elapsed = elapsed.as_secs_f64();
        figures.straight_line = (point - self.start_point).norm();
        figures.path_ratio =
            (figures.straight_line >= APART).then(|| figures.path_length / figures.straight_line);
        figures.position_error = error.position;
        figures.rotation_error = error.rotation;
        figures.peak_joint_speed = figures.peak_joint_speed.max(fastest);
        figures.settling_time_rotation = self.rotation.time().map(|time| time.as_secs_f64());
        figures.settling_time_position = self.position.time().map(|time| time.as_secs_f64());
        self.last = Some(LastSample { time: now, point, speed_squared });
    }

    /// Adds `sigma`, the smallest singular value of the Jacobian of the controlled pose at the present joint positions.
    pub fn see_singular_value(&mut self, sigma: f64) {
        let smallest = self.figures.smallest_singular_value.map_or(sigma, |smallest| smallest.min(sigma));
        self.figures.smallest_singular_value = Some(smallest);
    }

    /// Notes that the motion has stalled.
    pub fn stalled(&mut self) {
        self.figures.stalls += 1.0;
    }

    /// Notes that the goal tolerances are met. Only the first time counts.
    pub fn arrived(&mut self) {
        self.figures.arrival_time.get_or_insert(self.figures.elapsed);
    }

    /// Returns the figures of the motion so far.
    pub fn figures(&self) -> Figures {
        self.figures
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overshoot_is_along_the_line_to_the_goal_since_the_goal_last_moved() {
        let tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };
        let (x, error) = (|x| Vector3::new(x, 0.0, 0.0), GoalError { position: 1.0, rotation: 0.0 });
        let mut motion = MotionMeter::begin(Duration::ZERO, x(0.0), x(1.0), &error, &tolerance);
        let overshoot = |motion: &mut MotionMeter, at: f64| {
            motion.update(Duration::ZERO, x(at), &error, &[]);
            motion.figures().overshoot
        };
        assert_eq!(overshoot(&mut motion, 0.0), 0.0);
        assert_eq!(overshoot(&mut motion, 0.5), 0.0);
        motion.aim_at(x(0.25));
        assert_eq!(overshoot(&mut motion, 0.375), 0.0, "it comes back to the goal that jumped behind it");
        assert_eq!(overshoot(&mut motion, 0.125), 0.125);
        motion.aim_at(x(0.25));
        assert_eq!(overshoot(&mut motion, 0.0), 0.25, "the goal has not moved since");
        assert_eq!(motion.figures().path_ratio, None, "it is back at its start");
    }

    /// The tool moves along a quarter of a circle of radius 0.2 m within 1 s. Its joints move at 3 and then at 1 rad/s. The goal is
    /// at the end of the quarter, 0.2 √2 m from the start.
    #[test]
    fn figures_match_their_formulas() {
        const COUNT: u32 = 1000;
        let tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };
        let at = |part: f64| {
            let angle = part * std::f64::consts::FRAC_PI_2;
            0.2 * Vector3::new(angle.cos(), angle.sin(), 0.0)
        };
        let goal = at(1.0);
        let error = |part: f64| GoalError { position: (at(part) - goal).norm(), rotation: 1.0 - part };
        let speeds = |part: f64| if part < 0.25 { [3.0, 0.0] } else { [0.0, -1.0] };
        let efforts = [true, false].map(|continuous| {
            let mut motion = MotionMeter::begin(Duration::ZERO, at(0.0), goal, &error(0.0), &tolerance);
            motion = if continuous { motion.of_continuous_velocities() } else { motion };
            for k in 0..=COUNT {
                let part = f64::from(k) / f64::from(COUNT);
                motion.update(Duration::from_millis(k.into()), at(part), &error(part), &speeds(part));
                motion.see_singular_value(1.0 + (part - 0.5).abs());
            }
            motion.stalled();
            let Figures { path_length, path_ratio, straight_line, overshoot, effort, .. } = motion.figures();
            let arc = 0.2 * std::f64::consts::FRAC_PI_2;
            assert!((path_length - arc).abs() < 1e-6 && (straight_line - 0.2 * 2.0_f64.sqrt()).abs() < 1e-12);
            assert_eq!((path_ratio, overshoot), (Some(path_length / straight_line), 0.0));
            // The chord to the goal is 2 % of the initial chord, and the angle 2 % of 1 rad.
            let chord = 1.0 - 4.0 / std::f64::consts::PI * (0.02 * 0.5_f64.sqrt()).asin();
            let settled = motion.figures();
            assert!((settled.settling_time_position.unwrap() - chord).abs() <= 1e-3, "{settled:?}");
            assert!((settled.settling_time_rotation.unwrap() - 0.98).abs() <= 1e-3, "{settled:?}");
            assert_eq!((settled.peak_joint_speed, settled.stalls), (3.0, 1.0));
            assert_eq!((settled.smallest_singular_value, settled.elapsed), (Some(1.0), 1.0));
            effort
        });
        // For held commands, the effort is 9 rad²/s² for 0.25 s and 1 for the rest; by trapezoids, one step is half way between.
        assert!((efforts[1] - (9.0 * 0.25 + 0.75)).abs() < 1e-9, "{efforts:?}");
        assert!((efforts[0] - (efforts[1] - 0.5 * (9.0 - 1.0) * 1e-3)).abs() < 1e-9, "{efforts:?}");
    }
}
