//! The guards of the arms, as the servo sees them.

use crate::ros::{Node, RosError, Subscription};
use crate::servo::GuardState;
use crate::wire::messages::DiagnosticStatus;
use crate::wire::{NodeContract, Wiring};
use std::time::Duration;

/// A guard that says nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(1);

/// The guards of one arm. There may be several: each counts as one publisher of commands that is no rival.
pub(super) struct Guards {
    statuses: Subscription<DiagnosticStatus>,
    heard: Option<Duration>,
}

impl Guards {
    /// Those of the arm whose topics begin with `prefix`.
    pub fn new(node: &mut Node, contract: &NodeContract, prefix: &str) -> Result<Self, RosError> {
        Ok(Self { statuses: node.subscription(contract, &format!("{prefix}command_guard"))?, heard: None })
    }

    /// Those of each arm of the task.
    pub fn of_arms<T: Wiring>(node: &mut Node, contract: &NodeContract) -> Result<Vec<Self>, RosError> {
        T::ARMS.iter().map(|prefix| Self::new(node, contract, prefix)).collect()
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
