//! The path of the tool during a motion. Only poses that differ visibly from the previous one are stored.

use dq_messages::messages::{Point, Pose, Quaternion};

/// Poses of a trace that are nearer to each other than this \[m, rad\] are merged. In a long path, the distance is multiplied by
/// `coarseness`.
const STEP: f64 = 0.002;
const TURN: f64 = 0.02;

/// The largest number of poses.
const MOST: usize = 400;

/// If the tool moves farther than this between two poses \[m\], the tool has jumped, for example because a simulated arm was reset.
/// In a long path, the distance is multiplied by `coarseness`.
const JUMP: f64 = 0.2;

/// The path of the tool.
#[derive(Debug)]
pub(super) struct Trace {
    poses: Vec<Pose>,
    /// The least distance of successive poses, as a multiple of [`STEP`] and [`TURN`].
    coarseness: f64,
    motion: u64,
}

impl Default for Trace {
    fn default() -> Self {
        Self { poses: Vec::new(), coarseness: 1.0, motion: 0 }
    }
}

impl Trace {
    /// Adds the tool pose `tool` during motion number `motion`. Returns whether the trace has changed.
    pub fn take(&mut self, tool: &Pose, motion: u64) -> bool {
        let jumped = self.poses.last().is_some_and(|last| distance(last, tool) > self.coarseness * JUMP);
        if motion != self.motion || jumped {
            *self = Self { motion, ..Self::default() };
        }
        let (step, turn) = (self.coarseness * STEP, self.coarseness * TURN);
        let near = |last: &Pose| distance(last, tool) < step && angle(last, tool) < turn;
        if self.poses.last().is_some_and(near) {
            return false;
        }
        if self.poses.len() == MOST {
            let mut number = 0;
            self.poses.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.coarseness *= 2.0;
        }
        self.poses.push(tool.clone());
        true
    }

    /// Returns the poses in order.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Returns poses at which frames are drawn. These poses are at least `step` \[m\] or `turn` \[rad\] apart.
    pub fn spaced(&self, step: f64, turn: f64) -> Vec<&Pose> {
        let mut spaced: Vec<&Pose> = Vec::new();
        for pose in &self.poses {
            if spaced.last().is_none_or(|last| distance(last, pose) >= step || angle(last, pose) >= turn) {
                spaced.push(pose);
            }
        }
        spaced
    }
}

/// Returns the distance between the positions of two poses \[m\].
pub(super) fn distance(one: &Pose, other: &Pose) -> f64 {
    let (Point { x, y, z }, to) = (&one.position, &other.position);
    (to.x - x).hypot(to.y - y).hypot(to.z - z)
}

/// Returns the angle between the orientations of two poses \[rad\]: 2 arccos |⟨q₁, q₂⟩|.
pub(super) fn angle(one: &Pose, other: &Pose) -> f64 {
    let (Quaternion { x, y, z, w }, to) = (&one.orientation, &other.orientation);
    2.0 * (x * to.x + y * to.y + z * to.z + w * to.w).abs().min(1.0).acos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Pose {
        [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into()
    }

    #[test]
    fn a_trace_has_no_more_poses_than_are_visible_and_keeps_its_whole_path() {
        let mut trace = Trace::default();
        let length = 50_000;
        for i in 0..=length {
            trace.take(&at(0.001 * f64::from(i)), 1);
        }
        let poses = trace.poses();
        assert!(poses.len() > MOST / 2 && poses.len() <= MOST, "{}", poses.len());
        assert_eq!(poses[0], at(0.0));
        assert!(distance(poses.last().unwrap(), &at(50.0)) < 0.5);
        let gaps: Vec<_> = poses.windows(2).map(|pair| distance(&pair[0], &pair[1])).collect();
        assert!(gaps.iter().all(|gap| *gap < 0.6), "{gaps:?}");
    }

    #[test]
    fn another_goal_and_a_reset_arm_start_another_trace() {
        let mut trace = Trace::default();
        assert!(trace.take(&at(0.0), 1) && trace.take(&at(0.1), 1));
        assert!(!trace.take(&at(0.1001), 1), "too near");
        assert_eq!(trace.poses(), [at(0.0), at(0.1)]);
        assert!(trace.take(&at(0.1), 2));
        assert_eq!(trace.poses(), [at(0.1)]);
        assert!(trace.take(&at(0.9), 2));
        assert_eq!(trace.poses(), [at(0.9)]);
    }

    #[test]
    fn turning_on_the_spot_is_a_way_too_and_frames_are_spaced() {
        let turned = |angle: f64| -> Pose {
            let (sin, cos) = (angle / 2.0).sin_cos();
            [0.0, 0.0, 0.0, 0.0, 0.0, sin, cos].into()
        };
        assert!((angle(&turned(0.3), &turned(1.0)) - 0.7).abs() < 1e-12);
        let mut trace = Trace::default();
        for i in 0..100 {
            trace.take(&turned(0.01 * f64::from(i)), 1);
        }
        assert!((45..=51).contains(&trace.poses().len()), "{}", trace.poses().len());
        assert_eq!(trace.spaced(1.0, 0.25).len(), 4);
    }
}
