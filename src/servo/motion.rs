//! What a motion was like: the project's one definition of settling time, path length and peak speed.

use super::Tolerance;
use nalgebra::Vector3;
use std::time::Duration;

/// A component has settled when its error stays within this part of its initial value (paper §3, §8: 2 %).
const SETTLING_BAND: f64 = 0.02;

/// One component's error over time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Settling {
    band: f64,
    last_outside: Duration,
    inside: bool,
}

impl Settling {
    /// The band is 2 % of the initial error, and never narrower than the tolerance within which the goal counts as met.
    fn new(initial_error: f64, tolerance: f64) -> Self {
        Self {
            band: (SETTLING_BAND * initial_error).max(tolerance),
            last_outside: Duration::ZERO,
            inside: false,
        }
    }

    fn update(&mut self, elapsed: Duration, error: f64) {
        self.inside = error <= self.band;
        if !self.inside {
            self.last_outside = elapsed;
        }
    }

    fn time(&self) -> Option<Duration> {
        self.inside.then_some(self.last_outside)
    }
}

/// A motion to one goal, measured as it goes on; memory does not grow.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    started: Duration,
    rotation: Settling,
    position: Settling,
    start_point: Vector3<f64>,
    last_point: Vector3<f64>,
    figures: Figures,
}

/// The figures of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Time since the goal was taken \[s\].
    pub elapsed: f64,
    /// When the angle to the goal entered 2 % of its initial value for good \[s\].
    pub settling_time_rotation: Option<f64>,
    /// When the distance to the goal entered 2 % of its initial value for good \[s\].
    pub settling_time_position: Option<f64>,
    /// When the goal tolerances were first met \[s\].
    pub arrival_time: Option<f64>,
    /// Length of the tool's path so far \[m\].
    pub path_length: f64,
    /// Distance from the start to where the tool is now \[m\].
    pub straight_line: f64,
    /// Distance to the goal \[m\].
    pub position_error: f64,
    /// Angle to the goal \[rad\].
    pub rotation_error: f64,
    /// Largest joint speed commanded [rad/s].
    pub peak_joint_speed: f64,
}

impl Figures {
    /// When rotation and position had both settled to 2 % \[s\].
    pub fn settling_time(&self) -> Option<f64> {
        Some(self.settling_time_rotation?.max(self.settling_time_position?))
    }
}

impl Motion {
    /// Begins at time `now` with the tool at `point` \[m\], `position_error` \[m\] and `rotation_error` \[rad\] from the goal.
    pub fn begin(
        now: Duration,
        point: Vector3<f64>,
        position_error: f64,
        rotation_error: f64,
        tolerance: &Tolerance,
    ) -> Self {
        Self {
            started: now,
            rotation: Settling::new(rotation_error, tolerance.angular),
            position: Settling::new(position_error, tolerance.linear),
            start_point: point,
            last_point: point,
            figures: Figures::default(),
        }
    }

    /// Adds a sample: the tool at `point` \[m\], its errors, and the largest joint speed commanded [rad/s].
    pub fn update(
        &mut self,
        now: Duration,
        point: Vector3<f64>,
        position_error: f64,
        rotation_error: f64,
        joint_speed: f64,
    ) {
        let elapsed = now.saturating_sub(self.started);
        self.rotation.update(elapsed, rotation_error);
        self.position.update(elapsed, position_error);
        let figures = &mut self.figures;
        figures.elapsed = elapsed.as_secs_f64();
        figures.path_length += (point - self.last_point).norm();
        figures.straight_line = (point - self.start_point).norm();
        figures.position_error = position_error;
        figures.rotation_error = rotation_error;
        figures.peak_joint_speed = figures.peak_joint_speed.max(joint_speed);
        figures.settling_time_rotation = self.rotation.time().map(|time| time.as_secs_f64());
        figures.settling_time_position = self.position.time().map(|time| time.as_secs_f64());
        self.last_point = point;
    }

    /// Notes that the goal tolerances are met; only the first time counts.
    pub fn arrived(&mut self) {
        self.figures.arrival_time.get_or_insert(self.figures.elapsed);
    }

    /// The figures so far.
    pub fn figures(&self) -> Figures {
        self.figures
    }
}
