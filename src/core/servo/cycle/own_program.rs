//! The methods for a program that runs a servo itself, without the node of this project: the program sets a goal, and passes the
//! measured joint positions in each cycle.

use super::Servo;
use crate::servo::{GoalReading, JointReading, Rejection, Sent};
use dq_algebra::UnitDualQuaternion;
use std::time::Duration;

/// The measured positions and velocities. They are in the order of the servo's joints, arm after arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured<'a> {
    /// Positions \[rad, prismatic: m\].
    pub positions: &'a [f64],
    /// Velocities [rad/s, prismatic: m/s]; empty if they are not measured.
    pub velocities: &'a [f64],
}

impl Servo {
    /// Sets a goal pose in the base frame. The next [`cycle`](Self::cycle) or [`cycle_with`](Self::cycle_with) takes this goal.
    ///
    /// If the program sets another goal within [`STREAM`](crate::servo::STREAM), the motion in progress continues to the new goal. For
    /// a moving goal, call this method before every cycle, with the pose of the goal at the time of the cycle.
    pub fn set_goal(&mut self, base_from_goal: impl Into<UnitDualQuaternion>) {
        self.set = Some(base_from_goal.into());
    }

    /// Runs a whole cycle at time `now` with the `measured` joint positions and velocities. Returns the output for the robot, as
    /// [`output`](Self::output) does. `now` may come from any monotonic clock.
    ///
    /// # Errors
    /// The [`Rejection`] of the joint state, or of the goal set by [`set_goal`](Self::set_goal). The servo counts the rejection,
    /// and the last valid input remains. The cycle runs in any case; [`output`](Self::output) returns its output.
    pub fn cycle(&mut self, now: Duration, measured: &Measured) -> Result<Option<&[f64]>, Rejection> {
        self.begin(now);
        let fits = self.one_per_joint(measured);
        let state = self.counted(fits).and_then(|()| self.take_states(measured, Some(Duration::ZERO), now));
        let goal = self.take_set_goal(now);
        self.step(now);
        state.and(goal)?;
        Ok(self.output())
    }

    /// Takes the `measured` joint positions and velocities, received at `now`. `stamp_age` is the time since the measurement; `None` if
    /// this time is unknown.
    ///
    /// # Errors
    /// [`Rejection::OnePerJoint`], which is not counted. The errors of [`take_joint_state`](Self::take_joint_state), which are counted.
    /// The last valid joint state remains.
    pub fn take_measured(
        &mut self,
        measured: &Measured,
        stamp_age: Option<Duration>,
        now: Duration,
    ) -> Result<(), Rejection> {
        self.one_per_joint(measured)?;
        self.take_states(measured, stamp_age, now)
    }

    /// Checks that `measured` has one position for each joint, and one velocity for each joint or no velocities.
    fn one_per_joint(&self, Measured { positions, velocities }: &Measured) -> Result<(), Rejection> {
        let expected = self.robot.arms.joint_count();
        let lengths = [Some(positions.len()), (!velocities.is_empty()).then_some(velocities.len())];
        match lengths.into_iter().flatten().find(|got| *got != expected) {
            Some(got) => Err(Rejection::OnePerJoint { expected, got }),
            None => Ok(()),
        }
    }

    /// Takes the joint states of all arms. `measured` has one position, and one velocity or none, for each joint, arm after arm.
    fn take_states(
        &mut self,
        Measured { positions, velocities }: &Measured,
        stamp_age: Option<Duration>,
        now: Duration,
    ) -> Result<(), Rejection> {
        for arm in 0..self.robot.link.figures().count() {
            let (order, joints) = self.robot.link.order(arm);
            let reading = JointReading {
                names: order.names(),
                positions: &positions[joints.clone()],
                velocities: velocities.get(joints).unwrap_or_default(),
                source: 0,
                stamp_age,
            };
            self.take_joint_state(arm, &reading, now)?;
        }
        Ok(())
    }

    /// Takes the goal set by [`set_goal`](Self::set_goal), if any. Call it after [`begin`](Self::begin). [`cycle`](Self::cycle) and
    /// [`cycle_with`](Self::cycle_with) already take this goal.
    ///
    /// # Errors
    /// The errors of [`take_stamped_goal`](Self::take_stamped_goal).
    pub fn take_set_goal(&mut self, now: Duration) -> Result<(), Rejection> {
        let Some(base_from_goal) = self.set.take() else { return Ok(()) };
        let rotation = base_from_goal.real();
        let goal = GoalReading {
            position: base_from_goal.translation().into(),
            orientation_xyzw: [rotation.i, rotation.j, rotation.k, rotation.w],
            frame_id: "",
            stamp: 0,
            waited: Duration::ZERO,
            sent: Sent::default(),
        };
        self.take_stamped_goal(&goal, now)
    }
}
