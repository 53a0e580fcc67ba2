//! What the servo is doing.

use std::fmt;

/// The servo's state: one at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// No joint state has come yet.
    WaitingForState,
    /// No goal: standing still.
    Holding,
    /// Moving to the goal.
    Tracking,
    /// Arrived: at the goal, within the tolerances. The settling time to 2 % is another thing: see [`Figures`](super::Figures).
    Settled,
    /// No progress for `progress_timeout`: decelerating, then standing, until there is reason to try again.
    Stalled,
    /// On the way to the goal, but a joint is held back by its position limit.
    JointLimit,
    /// The arm does not move as commanded, or nobody subscribes to the commands: zeros, but for a gentle try once a second.
    NotFollowing,
    /// The joint state is older than `state_timeout`: decelerating, then standing.
    StaleState,
    /// The stream of goals is silent for longer than `goal_timeout`: decelerating, then standing.
    StaleGoal,
    /// Paused by the service `~/pause`: decelerating, then standing.
    Paused,
    /// Stopped by the service `~/stop` or by the end of the program: decelerating to rest.
    Stopping,
}

impl State {
    const NAMES: [(Self, &'static str); 11] = [
        (Self::WaitingForState, "waiting_for_state"),
        (Self::Holding, "holding"),
        (Self::Tracking, "tracking"),
        (Self::Settled, "settled"),
        (Self::Stalled, "stalled"),
        (Self::JointLimit, "joint_limit"),
        (Self::NotFollowing, "not_following"),
        (Self::StaleState, "stale_state"),
        (Self::StaleGoal, "stale_goal"),
        (Self::Paused, "paused"),
        (Self::Stopping, "stopping"),
    ];

    /// The name that `~/status` carries.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(state, _)| *state == self).map_or("unknown", |(_, name)| name)
    }

    /// The state of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, n)| *n == name).map(|(state, _)| *state)
    }

    /// Whether an operator should look.
    pub fn is_warning(self) -> bool {
        matches!(
            self,
            Self::WaitingForState
                | Self::Stalled
                | Self::JointLimit
                | Self::NotFollowing
                | Self::StaleState
                | Self::StaleGoal
        )
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
