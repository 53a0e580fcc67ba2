//! The motion of a goal that is sent repeatedly. Its twist is estimated from the recent poses.

use dq_algebra::{UnitDualQuaternion, split};
use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::Duration;

/// The twist is estimated from the poses that are at most this much older than the newest pose \[s\].
const WINDOW: f64 = 0.12;

/// The least number of poses for an estimate, whatever time they span.
const FEWEST: usize = 3;
/// The largest number of poses for an estimate, whatever time they span.
const MOST: usize = 64;

/// The least number of poses, and the least time that they span \[s\], for a goal to count as moving.
const PROOF: usize = 3;
const SPAN: f64 = 0.03;

/// The longest time between two successive poses of a stream \[s\].
const LONGEST_INTERVAL: f64 = 0.25;

/// A stream's time stamps are used if the transport times of its poses differ little. They may differ by `SPREAD` \[s\] plus the
/// fraction `SPREAD_SHARE` of the time between the first and the last pose. If they differ by more, the sender's clock is wrong.
const SPREAD: f64 = 0.01;
const SPREAD_SHARE: f64 = 0.25;

/// A goal has jumped if its pose differs from the expected pose by more than `STEP` \[rad, m\] plus this fraction of the goal's
/// expected motion since the last pose. The poses before a jump no longer count.
const JUMP: f64 = 0.5;
const STEP: [f64; 2] = [5e-3, 1e-3];

/// A velocity counts as noise up to this many times its standard error.
const NOISE: f64 = 2.0;

/// The weight of one pose in the estimate of the noise.
const MEMORY: f64 = 0.1;

/// A goal that moves by less than this counts as standing \[rad, m\].
const ROUNDING: f64 = 1e-6;

/// A pose as received.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct StampedPose {
    pose: UnitDualQuaternion,
    stamp: i64,
    received: i64,
    /// The time at which the goal is at the pose, by the cycle's clock \[ns\].
    time: i64,
}

/// A goal's motion relative to its newest pose.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Fit {
    pose: UnitDualQuaternion,
    /// The time of the newest pose, by the cycle's clock \[ns\].
    time: i64,
    /// The fitted pose relative to `pose`, as a screw log \[rad, m\], then the twist [rad/s, m/s], then the twist's rate of change
    /// [rad/s², m/s²].
    coefficients: [Vector6<f64>; 3],
    /// The inverse of the normal matrix of the least-squares fit. Its rows and columns belong to the powers 0, 1 and 2 of the time
    /// divided by `span` \[s\].
    covariance: Matrix3<f64>,
    span: f64,
}

/// A moving goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MovingGoal {
    /// The expected pose of the goal.
    pub pose: UnitDualQuaternion,
    /// The body twist of the goal, `(ω, v)` [rad/s, m/s].
    pub twist: Vector6<f64>,
}

impl MovingGoal {
    /// Returns the goal `seconds` later.
    pub fn after(&self, seconds: f64) -> Self {
        Self { pose: self.pose * UnitDualQuaternion::screw_exp(&(seconds * self.twist)), ..*self }
    }
}

/// The recent poses of a goal.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct GoalStream {
    samples: VecDeque<StampedPose>,
    fit: Option<Fit>,
    /// The variance of the noise of the poses' rotation \[rad²\] and position \[m²\].
    noise: [f64; 2],
    /// Number of poses from which the noise is estimated.
    heard: u32,
}

impl Default for GoalStream {
    fn default() -> Self {
        Self { samples: VecDeque::with_capacity(MOST), fit: None, noise: [0.0; 2], heard: 0 }
    }
}

fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 * 1e-9
}

fn nanoseconds(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

impl GoalStream {
    /// Clears the poses and the estimates.
    pub fn clear(&mut self) {
        self.samples.clear();
        (self.fit, self.noise, self.heard) = (None, [0.0; 2], 0);
    }

    /// Adds a pose with the time stamp `stamp` \[ns\], received at `now`. Of several poses in one cycle, the last counts. Returns
    /// true if the pose continues the earlier poses, false after a jump or a pause.
    pub fn add(&mut self, pose: &UnitDualQuaternion, stamp: i64, now: Duration) -> bool {
        let received = nanoseconds(now);
        if self.samples.back().is_some_and(|last| last.received >= received) {
            self.samples.pop_back();
        }
        let mut next = StampedPose { pose: *pose, stamp, received, time: received };
        if let Some(last) = self.samples.back() {
            if last.pose.real().dot(&pose.real()) < 0.0 {
                next.pose = -next.pose;
            }
            if seconds(received.saturating_sub(last.received)) > LONGEST_INTERVAL {
                self.samples.clear();
            }
        }
        if self.samples.len() >= MOST {
            self.samples.pop_front();
        }
        self.samples.push_back(next);
        self.set_times();
        let goes_on = self.samples.len() > 1 && !self.has_jumped();
        if !goes_on {
            self.samples.drain(..self.samples.len().saturating_sub(1));
            self.set_times();
        }
        self.forget_old();
        self.fit = self.find_fit();
        goes_on
    }

    /// Sets the time of each pose. If the stamps are usable, the time is the stamp plus the shortest transport time of all
    /// messages; otherwise it is the time of receipt.
    fn set_times(&mut self) {
        let mut stamps = self.samples.iter().zip(self.samples.iter().skip(1));
        let in_order = stamps.all(|(one, next)| one.stamp < next.stamp);
        let delays = self.samples.iter().map(|it| it.received.saturating_sub(it.stamp));
        let (fastest, slowest) = (delays.clone().min().unwrap_or(0), delays.max().unwrap_or(0));
        let ends = (self.samples.front(), self.samples.back());
        let received = |it: Option<&StampedPose>| it.map_or(0, |sample| sample.received);
        let most = SPREAD + SPREAD_SHARE * seconds(received(ends.1).saturating_sub(received(ends.0)));
        let stamped = in_order && seconds(slowest.saturating_sub(fastest)) <= most;
        for sample in &mut self.samples {
            sample.time = if stamped { sample.stamp.saturating_add(fastest) } else { sample.received };
        }
    }

    /// Returns whether the newest pose is too far from the motion of the earlier poses. If not, its deviation from that motion
    /// updates the estimate of the noise.
    fn has_jumped(&mut self) -> bool {
        let (Some(fit), Some(newest)) = (&self.fit, self.samples.back()) else { return false };
        let interval = seconds(newest.time.saturating_sub(fit.time));
        let expected = fit.after(interval).pose;
        let off = (expected.inverse() * newest.pose).screw_log();
        let [off, speeds] = [&off, &fit.coefficients[1]].map(|log| <[_; 2]>::from(split(log)));
        let passed = interval.max(SPAN);
        let mut all = off.iter().zip(&speeds).zip(STEP);
        if all.any(|((off, speed), step)| off.norm() > JUMP * passed * speed.norm() + step) {
            return true;
        }
        let variance = 1.0 + fit.variance_at(interval);
        self.heard = self.heard.saturating_add(1);
        let share = MEMORY.max(1.0 / f64::from(self.heard));
        for (noise, off) in self.noise.iter_mut().zip(&off) {
            *noise += share * (off.norm_squared() / variance - *noise);
        }
        false
    }

    fn forget_old(&mut self) {
        let Some(newest) = self.samples.back().map(|newest| newest.time) else { return };
        let is_old = |sample: &StampedPose| seconds(newest.saturating_sub(sample.time)) > WINDOW;
        while self.samples.len() > FEWEST && self.samples.front().is_some_and(is_old) {
            self.samples.pop_front();
        }
    }

    /// Fits a motion to the poses by least squares. With fewer than three poses, the fitted twist is constant; otherwise it changes
    /// at a constant rate. Returns `None` if the poses span no time.
    fn find_fit(&self) -> Option<Fit> {
        let (first, newest) = (self.samples.front()?, self.samples.back()?);
        let span = seconds(newest.time.saturating_sub(first.time));
        if span <= 0.0 {
            return None;
        }
        let order = if self.samples.len() < PROOF { 2 } else { 3 };
        let (mut normal, mut right) = (Matrix3::<f64>::zeros(), SMatrix::<f64, 3, 6>::zeros());
        for sample in &self.samples {
            let s = seconds(sample.time.saturating_sub(newest.time)) / span;
            let basis = if order < 3 { Vector3::new(1.0, s, 0.0) } else { Vector3::new(1.0, s, s * s) };
            let log = (newest.pose.inverse() * sample.pose).screw_log();
            normal += basis * basis.transpose();
            right += basis * log.transpose();
        }
        if order < 3 {
            normal[(2, 2)] = 1.0;
        }
        let mut covariance = normal.try_inverse()?;
        if order < 3 {
            covariance[(2, 2)] = 0.0;
        }
        let solution = covariance * right;
        let row = |i: usize| -> Vector6<f64> { solution.row(i).transpose() };
        let coefficients = [row(0), row(1) / span, 2.0 * row(2) / (span * span)];
        let finite = coefficients.iter().all(|row| row.iter().all(|number| number.is_finite()));
        finite.then_some(Fit { pose: newest.pose, time: newest.time, coefficients, covariance, span })
    }

    /// Returns the goal's pose and twist at `now`; `None` if the goal does not move, or moves no more than its noise. `by_itself` says,
    /// for position and for rotation, whether the goal moves independently of the tool. Ignores the motion of a part that does not.
    ///
    /// Let `T` be the largest age that a recent pose had when the next pose arrived. While the newest pose is not older than `T`,
    /// extrapolates from this pose. Then, up to the age `2 T`, the goal stands at the pose extrapolated to the age `T`. After that,
    /// returns `None`.
    pub fn at(&self, now: Duration, by_itself: [bool; 2]) -> Option<MovingGoal> {
        let fit = self.believed(by_itself)?;
        let (age, longest) = (seconds(nanoseconds(now).saturating_sub(fit.time)), self.longest_age());
        if age <= longest {
            return Some(fit.after(age.max(0.0)));
        }
        let stands = MovingGoal { twist: Vector6::zeros(), ..fit.after(longest) };
        (age <= 2.0 * longest).then_some(stands)
    }

    /// Returns the motion without the part that may be noise, separately for rotation and translation; `None` if no motion is left.
    fn believed(&self, [position, rotation]: [bool; 2]) -> Option<Fit> {
        let mut fit = self.fit.filter(|fit| self.samples.len() >= PROOF && fit.span >= SPAN)?;
        let error = fit.covariance[(1, 1)] / fit.span.powi(2);
        let [_, twist, change] = &mut fit.coefficients;
        let mut moves = false;
        for (half, (noise, by_itself)) in self.noise.iter().zip([rotation, position]).enumerate() {
            let mut speed = twist.fixed_rows_mut::<3>(3 * half);
            let square = speed.norm_squared();
            let share = (1.0 - NOISE.powi(2) * error * noise / square).max(0.0);
            let counts = by_itself && share > 0.0 && square.sqrt() * fit.span > ROUNDING;
            let share = if counts { share } else { 0.0 };
            speed *= share;
            change.fixed_rows_mut::<3>(3 * half).scale_mut(share);
            moves |= counts;
        }
        moves.then_some(fit)
    }

    /// Returns the largest age that a pose had when the next pose arrived, but at most [`LONGEST_INTERVAL`] \[s\].
    fn longest_age(&self) -> f64 {
        let ages = self.samples.iter().zip(self.samples.iter().skip(1));
        ages.map(|(one, next)| seconds(next.received.saturating_sub(one.time)))
            .fold(0.0, f64::max)
            .min(LONGEST_INTERVAL)
    }
}

impl Fit {
    /// Returns the variance of the fitted pose at the time `s` \[s\] after the newest pose, divided by the variance of a single
    /// received pose.
    fn variance_at(&self, s: f64) -> f64 {
        let s = s / self.span;
        let basis = Vector3::new(1.0, s, s * s);
        basis.dot(&(self.covariance * basis))
    }

    /// Returns the goal at the time `s` \[s\] after its newest pose.
    fn after(&self, s: f64) -> MovingGoal {
        let [place, twist, change] = &self.coefficients;
        let log = place + s * twist + 0.5 * s * s * change;
        MovingGoal { pose: self.pose * UnitDualQuaternion::screw_exp(&log), twist: twist + s * change }
    }
}
