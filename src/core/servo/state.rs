//! What the servo is doing.

use dq_common::named;

named! {
    /// The servo's state: one at a time. `~/status` carries its name.
    "state" State {
        /// No joint state has come yet.
        WaitingForState = "waiting_for_state",
        /// No goal: standing still.
        Holding = "holding",
        /// Moving to the goal.
        Tracking = "tracking",
        /// Moving to another configuration of the joints, from where the law reaches the goal.
        Reconfiguring = "reconfiguring",
        /// Moving as a twist asks for.
        Jogging = "jogging",
        /// Arrived: at the goal, within the tolerances. The settling time to 2 % is another thing: see [`Figures`](super::Figures).
        Settled = "settled",
        /// No progress for `progress_timeout`: decelerating, then standing, until there is reason to try again.
        Stalled = "stalled",
        /// On the way to the goal, but a joint is held back by its position limit.
        JointLimit = "joint_limit",
        /// On the way to the goal, but held back by what the arm must keep out of, or by itself.
        Constrained = "constrained",
        /// The arm does not move as commanded, or nobody subscribes to the commands: zeros, but for a gentle try once a second.
        NotFollowing = "not_following",
        /// The joint state is older than `state_timeout`: decelerating, then standing.
        StaleState = "stale_state",
        /// The stream of goals is silent for longer than `goal_timeout`, or the frame with which the goal moves is lost: decelerating, then
        /// standing.
        StaleGoal = "stale_goal",
        /// Paused by the service `~/pause`: decelerating, then standing.
        Paused = "paused",
        /// Stopped by the service `~/stop` or by the end of the program: decelerating to rest.
        Stopping = "stopping",
    }
}

impl State {
    /// Whether the arm may move in it other than to come to rest.
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

    /// Whether the arm gets nearer to its goal in it, as long as nothing is wrong.
    pub(super) fn gets_nearer(self) -> bool {
        matches!(self, Self::Tracking | Self::JointLimit | Self::Constrained | Self::Reconfiguring)
    }

    /// Whether an operator should look.
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
        )
    }
}
