//! The guards of the arms, as the servo sees them.

use dq_limits::check::GuardState;
use dq_messages::NodeContract;
use dq_messages::messages::DiagnosticStatus;
use dq_ros::ros::{Node, RosError, Subscription};
use std::sync::Arc;
use std::time::Duration;

/// A guard that says nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(1);

/// What the guards of an arm say: each counts as one publisher of the arm's commands that is no rival, and as one subscriber to them
/// that is no robot.
pub(super) type GuardStatuses = Arc<Subscription<DiagnosticStatus>>;

/// Subscribes to what the guards of the arm say whose topics begin with `prefix`.
pub(super) fn subscribe(
    node: &mut Node,
    contract: &NodeContract,
    prefix: &str,
) -> Result<GuardStatuses, RosError> {
    Ok(Arc::new(node.subscription(contract, &format!("{prefix}command_guard"))?))
}

/// Whether one arm has guards.
pub(super) struct Guards {
    statuses: GuardStatuses,
    heard: Option<Duration>,
}

impl Guards {
    /// Nothing heard yet.
    pub fn new(statuses: GuardStatuses) -> Self {
        Self { statuses, heard: None }
    }

    /// Looks at `now` whether there is one.
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

    /// How many there are, as far as discovery knows.
    pub fn count(&self) -> usize {
        self.statuses.publishers()
    }
}
