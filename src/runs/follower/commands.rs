//! What a follower makes of commands.

use super::Follower;
use crate::config::{CycleParameters, NodeParameters};
use crate::wire::messages::Float64MultiArray;
use crate::wire::{CycleLabel, Wiring};

impl<T: Wiring> Follower<T>
where
    CycleParameters<T>: NodeParameters,
{
    pub(super) fn take_command(&mut self, time: f64, arm: usize, command: &Float64MultiArray) {
        let label = CycleLabel::of(command).map(|label| self.numbers.in_label(label));
        let now = label.as_ref().map(|label| label.now);
        let Some(whole) = self.halves.add(arm, &command.data, now) else { return };
        self.take_label(time, label.as_ref());
        self.run.commands.push((time, whole.clone()));
        self.command = whole;
        self.measure(time);
        let seconds = self.clock.since_last(time, label.as_ref());
        if self.store.is_some() {
            self.note_jitter(time, seconds);
            self.judge(time, label);
        }
    }

    /// Where the arm is sent, which is its command of velocities, integrated.
    pub(super) fn take_positions(
        &mut self,
        time: f64,
        arm: usize,
        positions: &[f64],
        label: Option<CycleLabel>,
    ) {
        let now = label.as_ref().map(|label| label.now);
        let Some(whole) = self.halves.add(arm, positions, now) else { return };
        self.take_label(time, label.as_ref());
        let seconds = self.clock.since_last(time, label.as_ref());
        let begins = label.as_ref().is_some_and(|label| label.anew);
        let speeds = self.speeds_to(&whole, seconds.unwrap_or_default()).filter(|_| !begins);
        if speeds.is_none() {
            self.run.sent.push((time, vec![f64::NAN; whole.len()]));
        }
        self.command = speeds.unwrap_or_else(|| vec![0.0; whole.len()]);
        self.run.commands.push((time, self.command.clone()));
        self.run.sent.push((time, whole));
        self.measure(time);
        self.note_jitter(time, seconds.filter(|_| label.is_some()));
    }

    /// Notes how much longer than its period the cycle has taken.
    fn note_jitter(&mut self, time: f64, seconds: Option<f64>) {
        let period = self.parameters.period.as_secs_f64();
        seconds.iter().for_each(|seconds| self.run.jitter.push((time, 1e3 * (seconds - period))));
    }

    /// The speeds at which the arm is sent on to `positions` [rad/s], `seconds` after those before: a cycle moves them on by its period,
    /// in whose time and that of the cycles missed before it the arm goes there. None for a step that no limit of speed has allowed:
    /// the positions begin anew where the arm is.
    fn speeds_to(&self, positions: &[f64], seconds: f64) -> Option<Vec<f64>> {
        let period = self.parameters.period.as_secs_f64();
        let (_, before) = self.run.sent.last()?;
        let ways: Vec<_> = before.iter().zip(positions).map(|(from, to)| to - from).collect();
        let is_allowed = |(way, limit): (&f64, &f64)| way.abs() <= 1.001 * limit * period;
        let time = (seconds / period).round().max(1.0) * period;
        ways.iter().zip(&self.fastest).all(is_allowed).then(|| ways.iter().map(|way| way / time).collect())
    }

    /// Drops the goal where the servo was stopped since its command before, and begins anew with one that was started again.
    fn take_label(&mut self, time: f64, label: Option<&CycleLabel>) {
        let Some(label) = label else { return };
        if self.label.replace(label.clone()).is_some_and(|before| label.is_of_another_life(&before)) {
            (self.asked, self.clock) = Default::default();
            self.judge.begin_anew();
        }
        if self.asked.take(label) {
            self.motions.drop_goal(time);
        }
    }

    fn judge(&mut self, time: f64, label: Option<CycleLabel>) {
        // The task is where the last sample was.
        let tool = self.run.samples.last().map(|_| self.parameters.task.tool_speed(&self.command));
        let checked = label.map(|label| self.judge.check(&self.command, label, tool.as_ref()));
        if let Some(Err(violation)) = checked {
            self.run.violations.push((time, violation));
            if let Some(row) = self.motions.row() {
                row.violations += 1;
            }
        }
    }
}
