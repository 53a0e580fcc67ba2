//! Judges recorded commands: whether they hold what every command must.

use super::asked::Asked;
use crate::servo::{Invariants, Limits, ToolSpeed, Violation};
use crate::wire::CycleLabel;
use std::collections::VecDeque;
use std::time::Duration;

/// Follows the commands of one servo.
pub(super) struct Judge {
    invariants: Invariants,
    /// Limits that were set, but that no command was yet made under.
    coming: VecDeque<Limits>,
    /// Changes that commands were made under, but that have not come yet.
    owed: u64,
    /// Of the last command.
    label: Option<CycleLabel>,
    asked: Asked,
}

impl Judge {
    /// For the commands of a cycle of `period` under `limits`.
    pub fn new(limits: Limits, period: Duration) -> Self {
        let invariants = Invariants::new(limits, period);
        Self { invariants, coming: VecDeque::new(), owed: 0, label: None, asked: Asked::default() }
    }

    /// The servo was started again.
    pub fn begin_anew(&mut self) {
        (self.label, self.asked) = (None, Asked::default());
        self.invariants.robot_came();
    }

    /// Other limits were set. They count from the command on whose label says that it was made under them.
    pub fn set_limits(&mut self, limits: Limits) {
        if self.label.is_some() && self.owed == 0 {
            self.coming.push_back(limits);
        } else {
            self.owed = self.owed.saturating_sub(1);
            self.invariants.set_limits(limits);
        }
    }

    fn follow_settings(&mut self, label: &CycleLabel) {
        let before = self.label.as_ref().map_or(label.settings, |last| last.settings);
        let changes = label.settings.saturating_sub(before);
        let known = self.coming.len().min(usize::try_from(changes).unwrap_or(usize::MAX));
        self.coming.drain(..known).for_each(|limits| self.invariants.set_limits(limits));
        self.owed = self.owed.saturating_add(changes - known as u64);
    }

    /// Checks a command [rad/s], which moves the fastest tool at `tool` where that is known. The servo has reason to stand while it is paused, and until a goal has come since its start or
    /// since it was stopped.
    ///
    /// # Errors
    /// What it breaks.
    pub fn check(
        &mut self,
        command: &[f64],
        label: CycleLabel,
        tool: Option<&ToolSpeed>,
    ) -> Result<(), Violation> {
        self.follow_settings(&label);
        self.asked.take(&label);
        let standing = label.paused || !(self.asked.has_goal() || self.asked.has_twist());
        if label.arms.iter().any(|arm| arm.figures.came) {
            self.invariants.robot_came();
        }
        let now = label.now;
        self.label = Some(label);
        self.invariants.check(now, command, standing)?;
        tool.map_or(Ok(()), |tool| self.invariants.check_tool(tool))
    }
}
