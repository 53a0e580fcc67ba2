//! What a motion was like: the project's one definition of settling time, path length and peak speed.

use super::{GoalError, Tolerance};
use nalgebra::Vector3;
use serde::Serialize;
use std::time::Duration;

/// The settling time of a component is when its error begins to stay within this part of its initial value (paper §3, §8: 2 %).
const SETTLING_BAND: f64 = 0.02;

/// One component's error over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settling {
    band: f64,
    last_outside: Duration,
    inside: bool,
}

impl Settling {
    /// The band is 2 % of `reference` (the initial error, or a final value), and never narrower than the tolerance within
    /// which the goal counts as met.
    pub fn new(reference: f64, tolerance: f64) -> Self {
        Self {
            band: (SETTLING_BAND * reference.abs()).max(tolerance),
            last_outside: Duration::ZERO,
            inside: false,
        }
    }

    /// Adds the error's size at the time `elapsed`.
    pub fn update(&mut self, elapsed: Duration, error: f64) {
        self.inside = error <= self.band;
        if !self.inside {
            self.last_outside = elapsed;
        }
    }

    /// Whether only one of the two errors is in the band.
    fn separates(&self, one: f64, other: f64) -> bool {
        (one <= self.band) != (other <= self.band)
    }

    /// When the error entered the band for good, if it is inside.
    pub fn time(&self) -> Option<Duration> {
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
    /// Where the tool was when the goal last moved, or at the start.
    line_start: Vector3<f64>,
    goal_point: Vector3<f64>,
    last: Option<Sample>,
    figures: Figures,
}

/// What the next sample is measured against.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    time: Duration,
    point: Vector3<f64>,
    /// `|θ̇|²` [rad²/s²].
    speed_squared: f64,
}

/// Declares [`Figures`], each with the one name that it has in statuses and files, which ends with its unit.
macro_rules! figures {
    ($($(#[$doc:meta])* $field:ident: $kind:ty = $name:literal,)*) => {
        /// The figures of a motion.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
        pub struct Figures { $($(#[$doc])* #[serde(rename = $name)] pub $field: $kind,)* }

        impl Figures {
            /// The figures with their names; none for those that there are not yet.
            pub fn named(&self) -> impl Iterator<Item = (&'static str, Option<f64>)> {
                [$(($name, Option::from(self.$field)),)*].into_iter()
            }

            /// The figures out of what `value` has under their names; 0 for those that there always are.
            pub fn from_named(value: impl Fn(&str) -> Option<f64>) -> Self {
                Self { $($field: Named(value($name)).into(),)* }
            }
        }
    };
}

/// What there is under a figure's name.
struct Named(Option<f64>);

impl From<Named> for Option<f64> {
    fn from(Named(value): Named) -> Self {
        value
    }
}

impl From<Named> for f64 {
    fn from(Named(value): Named) -> Self {
        value.unwrap_or_default()
    }
}

figures! {
    /// Time since the goal was taken \[s\].
    elapsed: f64 = "elapsed_s",
    /// When the angle to the goal entered 2 % of its initial value for good \[s\].
    settling_time_rotation: Option<f64> = "settling_time_2_percent_rotation_s",
    /// When the distance to the goal entered 2 % of its initial value for good \[s\].
    settling_time_position: Option<f64> = "settling_time_2_percent_position_s",
    /// When the goal tolerances were first met \[s\].
    arrival_time: Option<f64> = "arrival_time_s",
    /// Length of the tool's path so far \[m\].
    path_length: f64 = "path_length_m",
    /// Distance from the start to where the tool is now \[m\].
    straight_line: f64 = "straight_line_m",
    /// Distance to the goal \[m\].
    position_error: f64 = "position_error_m",
    /// Angle to the goal \[rad\].
    rotation_error: f64 = "rotation_error_rad",
    /// Largest joint speed commanded [rad/s].
    peak_joint_speed: f64 = "peak_joint_speed_rad_s",
    /// How far past the goal the tool went, along the line to the goal from the start, or from where it was when the goal last moved
    /// \[m\].
    overshoot: f64 = "overshoot_m",
    /// Control effort `∫|θ̇|² dt` [rad²/s].
    effort: f64 = "effort_rad2_s",
}

impl Figures {
    /// The longer of both settling times to 2 % \[s\].
    pub fn settling_time(&self) -> Option<f64> {
        Some(self.settling_time_rotation?.max(self.settling_time_position?))
    }

    /// The path's length by the distance from its start to its end; not a number where these are less than a millimetre apart.
    pub fn path_ratio(&self) -> f64 {
        const APART: f64 = 1e-3;
        if self.straight_line < APART { f64::NAN } else { self.path_length / self.straight_line }
    }
}

impl Motion {
    /// Begins at time `now` with the tool at `point` \[m\], `error` from a goal at `goal_point` \[m\].
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
            figures: Figures::default(),
        }
    }

    /// The goal has moved to `goal_point` \[m\].
    pub fn aim_at(&mut self, goal_point: Vector3<f64>) {
        if goal_point != self.goal_point {
            self.line_start = self.last.map_or(self.start_point, |last| last.point);
            self.goal_point = goal_point;
        }
    }

    /// Adds a sample: the tool at `point` \[m\], its errors, and the joint velocities commanded [rad/s].
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
            figures.effort += 0.5 * step * (last.speed_squared + speed_squared);
        }
        if let Some(ahead) = (self.goal_point - self.line_start).try_normalize(f64::EPSILON) {
            figures.overshoot = figures.overshoot.max((point - self.goal_point).dot(&ahead));
        }
        figures.elapsed = elapsed.as_secs_f64();
        figures.straight_line = (point - self.start_point).norm();
        figures.position_error = error.position;
        figures.rotation_error = error.rotation;
        figures.peak_joint_speed = figures.peak_joint_speed.max(fastest);
        figures.settling_time_rotation = self.rotation.time().map(|time| time.as_secs_f64());
        figures.settling_time_position = self.position.time().map(|time| time.as_secs_f64());
        self.last = Some(Sample { time: now, point, speed_squared });
    }

    /// Whether a part of the error enters or leaves its band between the two.
    pub fn crosses(&self, one: &GoalError, other: &GoalError) -> bool {
        self.position.separates(one.position, other.position)
            || self.rotation.separates(one.rotation, other.rotation)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overshoot_is_past_the_goal_on_the_way_there_from_where_it_last_moved() {
        let tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };
        let (x, error) = (|x| Vector3::new(x, 0.0, 0.0), GoalError { position: 1.0, rotation: 0.0 });
        let mut motion = Motion::begin(Duration::ZERO, x(0.0), x(1.0), &error, &tolerance);
        let overshoot = |motion: &mut Motion, at: f64| {
            motion.update(Duration::ZERO, x(at), &error, &[]);
            motion.figures().overshoot
        };
        assert_eq!(overshoot(&mut motion, 0.0), 0.0);
        assert_eq!(overshoot(&mut motion, 0.5), 0.0);
        motion.aim_at(x(0.25));
        assert_eq!(overshoot(&mut motion, 0.375), 0.0, "it comes back to the goal that leapt behind it");
        assert_eq!(overshoot(&mut motion, 0.125), 0.125);
        motion.aim_at(x(0.25));
        assert_eq!(overshoot(&mut motion, 0.0), 0.25, "the goal has not moved since");
        assert!(motion.figures().path_ratio().is_nan(), "it is back at its start");
    }
}
