//! Poses of tools and goals, and their spread.

use dq_algebra::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3, Vector4};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The pose of the tool or the goal at a time \[s\].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Place {
    pub time: f64,
    pub point: Vector3<f64>,
    pub turn: UnitQuaternion<f64>,
}

impl Place {
    pub fn of(time: Duration, pose: &UnitDualQuaternion) -> Self {
        Self { time: time.as_secs_f64(), point: pose.translation(), turn: pose.rotation() }
    }

    /// Returns the distances of position and rotation from `other` \[m, rad\].
    pub fn distances(&self, other: &Self) -> [f64; 2] {
        [(self.point - other.point).norm(), self.turn.angle_to(&other.turn)]
    }
}

/// Accumulates the spread of poses around their mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    count: f64,
    points: Vector3<f64>,
    squares: f64,
    turns: Vector4<f64>,
    first: Option<UnitQuaternion<f64>>,
}

impl Spread {
    pub fn add(&mut self, point: Vector3<f64>, turn: UnitQuaternion<f64>) {
        let first = self.first.get_or_insert(turn);
        self.turns += alike(&turn, first).coords;
        self.points += point;
        self.squares += point.norm_squared();
        self.count += 1.0;
    }

    /// Returns the root mean square distances of position and rotation from the mean \[m, rad\].
    pub fn sizes(&self) -> [f64; 2] {
        let (point, turn) = (self.points / self.count, self.turns / self.count);
        // Between two unit quaternions, the angle is half the angle of rotation.
        let variances = [self.squares / self.count - point.norm_squared(), 4.0 * (1.0 - turn.norm_squared())];
        variances.map(|variance| variance.max(0.0).sqrt())
    }
}

/// Returns the noise of the goals' positions and rotations \[m, rad\], as a root mean square. It is estimated from the distance of
/// each goal from the line between its neighbors.
pub fn noise<'a>(goals: impl Iterator<Item = &'a Place> + Clone) -> [f64; 2] {
    let (mut squares, mut count) = ([0.0; 2], 0.0_f64);
    let (second, third) = (goals.clone().skip(1), goals.clone().skip(2));
    for ((one, two), three) in goals.zip(second).zip(third) {
        let share = (two.time - one.time) / (three.time - one.time);
        let turns = [one, two, three].map(|place| alike(&place.turn, &two.turn).coords);
        let off = [
            (two.point - one.point.lerp(&three.point, share)).norm_squared(),
            4.0 * (turns[1] - turns[0].lerp(&turns[2], share)).norm_squared(),
        ];
        count += 1.0;
        for (sum, off) in squares.iter_mut().zip(off) {
            *sum += off / (1.0 + share.powi(2) + (1.0 - share).powi(2));
        }
    }
    squares.map(|sum: f64| (sum / count.max(1.0)).sqrt())
}

/// Returns `turn` or `−turn`, whichever quaternion is nearer to `other`.
pub fn alike(turn: &UnitQuaternion<f64>, other: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if turn.coords.dot(&other.coords) < 0.0 {
        UnitQuaternion::new_unchecked(-turn.into_inner())
    } else {
        *turn
    }
}
