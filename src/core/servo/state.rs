//! The states of the servo.

use dq_common::named;

named! {
    /// The servo's state. The servo is in one state at a time, and reports the name of that state in `~/status`.
    "state" State {
        /// No joint state has arrived yet.
        WaitingForState = "waiting_for_state",
        /// There is no goal, or its request is revoked, or two publishers send one input: decelerating, then standing.
        Holding = "holding",
        /// Moving to the goal.
        Tracking = "tracking",
        /// Moving to another configuration of the joints, from where the law reaches the goal.
        Reconfiguring = "reconfiguring",
        /// Moving by a twist.
        Jogging = "jogging",
        /// Settled at the goal, within the tolerances. The settling time to 2 % has another definition: see
        /// [`Figures`](super::Figures).
        Settled = "settled",
        /// No progress for `progress_timeout`: decelerating, then standing, until there is a reason to try again.
        Stalled = "stalled",
        /// On the way to the goal, but a joint is at its position limit.
        JointLimit = "joint_limit",
        /// On the way to the goal, but an obstacle or the arm itself is in the path.
        Constrained = "constrained",
        /// The arm does not move as commanded, or nobody subscribes to the commands. The servo sends zeros, and once a second tries
        /// to move the arm gently.
        NotFollowing = "not_following",
        /// The joint state is older than `state_timeout`: decelerating, then standing.
        StaleState = "stale_state",
        /// No goal has arrived for longer than `goal_timeout`, or TF lacks the frame with which the goal moves: decelerating, then
        /// standing.
        StaleGoal = "stale_goal",
        /// The goal is to yield to the wrench at the tool, but no usable wrench arrives: decelerating, then standing.
        StaleWrench = "stale_wrench",
        /// Paused by the service `~/pause`: decelerating, then standing.
        Paused = "paused",
        /// Stopped by the service `~/stop` or by the end of the program: decelerating to rest.
        Stopping = "stopping",
    }
}

impl State {
    /// Returns whether the servo moves the arm in this state. Braking the arm to a standstill does not count.
    pub fn is_driven(self) -> bool {
        matches!(
            self,
            Self::Tracking
                | Self::Reconfiguring
                | Self::Settled
                | Self::JointLimit
                | Self::Constrained
                | Self::NotFollowing
                | Self::Jogging
        )
    }

    /// Returns whether the arm should get nearer to its goal in this state. If it does not, the motion stalls.
    pub(super) fn gets_nearer(self) -> bool {
        matches!(self, Self::Tracking | Self::JointLimit | Self::Constrained | Self::Reconfiguring)
    }

    /// Returns whether an operator should look at the robot.
    pub fn is_warning(self) -> bool {
        matches!(
            self,
            Self::WaitingForState
                | Self::Stalled
                | Self::JointLimit
                | Self::Constrained
                | Self::NotFollowing
                | Self::StaleState
                | Self::StaleGoal
                | Self::StaleWrench
        )
    }
}
