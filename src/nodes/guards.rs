//! Tracks whether each arm has a guard, from the statuses that the guards publish.

use dq_check::GuardState;
use dq_messages::NodeContract;
use dq_messages::messages::DiagnosticStatus;
use dq_ros::ros::{Node, RosError, Subscription};
use std::sync::Arc;
use std::time::Duration;

/// A guard that is silent for longer than this counts as gone.
const SILENCE: Duration = Duration::from_secs(1);

/// The subscription to the statuses of an arm's guards. Each guard publishes and subscribes to the arm's commands, but a guard is
/// neither a rival nor a robot. So the number of guards is subtracted from the numbers of publishers and subscribers of the
/// commands.
pub(super) type GuardStatuses = Arc<Subscription<DiagnosticStatus>>;

/// Subscribes to the statuses of one arm's guards. The names of the arm's topics begin with `prefix`.
pub(super) fn subscribe(
    node: &mut Node,
    contract: &NodeContract,
    prefix: &str,
) -> Result<GuardStatuses, RosError> {
    Ok(Arc::new(node.subscription(contract, &format!("{prefix}command_guard"))?))
}

/// The state of one arm's guards.
pub(super) struct Guards {
    statuses: GuardStatuses,
    heard: Option<Duration>,
}

impl Guards {
    /// Creates the state in which no guard has sent a status yet.
    pub fn new(statuses: GuardStatuses) -> Self {
        Self { statuses, heard: None }
    }

    /// Returns the state of the guards at `now`.
    pub fn look(&mut self, now: Duration) -> GuardState {
        if self.statuses.newest().count > 0 {
            self.heard = Some(now);
        }
        match self.heard {
            None => GuardState::None,
            Some(heard) if now.saturating_sub(heard) > SILENCE => GuardState::Gone,
            Some(_) => GuardState::Watching,
        }
    }

    /// Returns the number of guards that discovery knows.
    pub fn count(&self) -> usize {
        self.statuses.publishers()
    }
}
