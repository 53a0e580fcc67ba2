//! The checks of the rig in each cycle: only requests move the arm, the output keeps the limits, and an arm that must move does
//! move.

use super::{Arrived, Rig};
use crate::opinion::{REST, Truth};
use crate::sent::Step;
use dq_core::servo::Reason;
use dq_kinematics::control::{Aim, pose_error};
use dq_plant::Plant;
use std::time::Duration;

/// The time within which an arm with consent must move, even if it did not follow before.
const MOVES_WITHIN: Duration = Duration::from_millis(1500);

/// A speed slightly above 0.05 rad/s, the largest speed that the servo commands to a joint until the joint responds [rad/s]. If a
/// joint ceases to respond, the servo may command more than this for [`REFUSED_WITHIN`] plus the delays.
const REFUSED: f64 = 0.0501;
const REFUSED_WITHIN: Duration = Duration::from_millis(800);

/// A measured speed below this counts as noise [rad/s].
const STANDSTILL: f64 = 0.02;

/// The time that the servo may take to measure the robot's speed after joint states or commands have resumed.
const KNOWN_WITHIN: Duration = Duration::from_millis(50);

impl Rig {
    /// Passes the joint states that the servo has received to the model of consent.
    pub(super) fn observe(&mut self, arrived: &[Arrived]) {
        for state in arrived {
            for source in [Some(self.source), self.second_source].into_iter().flatten() {
                if self.opinion.state(state.arm, source, &state.positions, state.measured, self.now) {
                    self.came = self.now;
                }
            }
            let count = state.velocities.len();
            self.shown[state.arm * count..][..count].copy_from_slice(&state.velocities);
            self.seen[state.arm * count..][..count].copy_from_slice(&state.positions);
        }
    }

    /// Checks this cycle against the guide's safety page: only requests move the arm, the output keeps the limits, and the arm moves if
    /// it must. `before` is the output of the previous cycle.
    pub(super) fn check(&mut self, before: Option<&[f64]>) {
        let verdict = self.opinion.cycle(self.now);
        let (state, reason) = (self.state(), self.servo.status().reason);
        let may = verdict != Truth::No || !state.is_driven();
        assert!(may, "nobody asks for it at {:.3} s: {state}, {}", self.seconds(), self.opinion.explain());
        let is_lost = reason == Some(Reason::FrameLost);
        assert!(!(is_lost && self.opinion.knows_frame()), "the goal's frame was heard since");
        if self.check_commands {
            self.check_output(verdict, before)
                .unwrap_or_else(|why| panic!("{why} at {:.3} s", self.seconds()));
        }
        self.check_that_it_moves(verdict, before);
    }

    /// Returns whether the parameter `integral` was ever on. With `integral`, a part of each command balances an external force on
    /// the arm.
    pub fn was_held(&self) -> bool {
        self.held > Duration::ZERO
    }

    /// Returns whether a part of the command may balance an external force: `integral` is on, or was on within the last [`REST`].
    fn is_held(&self) -> bool {
        self.now.saturating_sub(self.held) < REST
    }

    /// Returns the time since the start \[s\].
    fn seconds(&self) -> f64 {
        self.now.as_secs_f64() - 1000.0
    }

    fn check_output(&mut self, verdict: Truth, before: Option<&[f64]>) -> Result<(), String> {
        let Some(sent) = self.output.clone() else { return Ok(()) };
        let settings = self.servo.settings();
        let (integral, takes_positions) = (settings.integral, settings.interface.takes_positions());
        // With `integral`, a part of the command balances an external force. Afterwards this part decreases slowly.
        if integral > 0.0 {
            self.held = self.now;
        }
        let is_held = self.is_held();
        let standing = (verdict == Truth::No || !self.state().is_driven()) && !is_held;
        let gap = self.outputs.is_after_gap(self.now, self.command_delay);
        if is_held && gap != Truth::No {
            self.came = self.now;
        }
        let has_come = self.now.saturating_sub(self.came) < KNOWN_WITHIN;
        let real: Vec<_> = self.plants.iter().flat_map(Plant::velocities).copied().collect();
        let zeros = vec![0.0; sent.len()];
        let still: Vec<_> =
            self.shown.iter().map(|speed| if speed.abs() < STANDSTILL { 0.0 } else { *speed }).collect();
        let mut steps: Vec<Step> = Vec::new();
        let [on, again] = match takes_positions {
            true => [&self.last_sent, &self.seen].map(|from| self.outputs.speeds(from, &sent, &self.command)),
            false => [sent.clone(), sent.clone()],
        };
        let is_silent = before.is_none();
        if gap != Truth::Yes {
            steps.push((None, &on));
        }
        if takes_positions {
            // An output of positions continues from the last output at its speed, or from the measured positions at rest.
            if is_silent || gap != Truth::No {
                steps.push((Some(&zeros), &on));
            }
            if is_silent || has_come {
                steps.extend([(Some(zeros.as_slice()), again.as_slice()), (None, &again)]);
            }
        } else if has_come || gap != Truth::No {
            let starts = [&real, &self.shown, &still];
            steps.extend(starts.map(|start| (Some(start.as_slice()), on.as_slice())));
        }
        let result = self.outputs.check(&steps, self.now, standing);
        self.last_sent.clone_from(&sent);
        // An output of positions may return to the measured positions of a robot that behaves oddly. The part of the command that
        // balances an external force continues after a robot stood because of its own timeout.
        let is_free = match takes_positions {
            true => self.opinion.doubts(self.now),
            false => is_held && has_come,
        };
        if is_free {
            return Ok(());
        }
        let speeds = result?;
        if self.check_tools && !is_held {
            self.truth.evaluate(&self.plants.iter().flat_map(Plant::positions).copied().collect::<Vec<_>>());
            let tool = self.truth.tool_speed(speeds);
            self.outputs.invariants().check_tool(&tool).map_err(|why| why.to_string())?;
        }
        Ok(())
    }

    /// Checks that the arm moves if `verdict` says that it must. Also checks that the servo soon ceases to drive a joint that does
    /// not move.
    fn check_that_it_moves(&mut self, verdict: Truth, before: Option<&[f64]>) {
        let settings = self.servo.settings();
        let is_patient = settings.progress_timeout.is_none_or(|timeout| timeout > MOVES_WITHIN);
        let is_simple = self.check_moves
            && settings.controller.aim == Aim::Pose
            && settings.scene.is_none()
            && is_patient;
        let (interface, following_error) = (settings.interface, settings.following_error);
        let must = verdict == Truth::Yes && is_simple && self.is_away() == Some(true);
        let moves = match interface.takes_positions() {
            true => self.output.as_deref() != before,
            false => self.output.iter().flatten().any(|speed| *speed != 0.0),
        };
        let positions = self.positions();
        let leads = self.output.iter().flatten().zip(&positions).map(|(sent, is)| (sent - is).abs());
        if interface.takes_positions() && leads.fold(0.0, f64::max) > 0.5 * following_error {
            self.opinion.doubt(self.now);
        }
        self.opinion.robot(self.altered, must, self.now);
        self.awaited = match self.awaited {
            _ if !must => None,
            None => Some(self.now),
            Some(_) if moves => Some(Duration::MAX),
            since => since,
        };
        let status = self.servo.status();
        assert!(
            self.awaited.is_none_or(|since| self.now.saturating_sub(since) <= MOVES_WITHIN),
            "stands with consent at {:.3} s: {} {:?}, {}",
            self.seconds(),
            status.state,
            status.reason,
            self.opinion.explain()
        );
        let longest = self.command_delay + self.state_delay + REFUSED_WITHIN;
        let mut since = self.refused.iter().flatten();
        assert!(
            since.all(|since| self.now.saturating_sub(*since) <= longest),
            "a joint does not move and is sent {:?} at {:.3} s: {:?}",
            self.output,
            self.seconds(),
            self.refused
        );
    }

    fn is_away(&mut self) -> Option<bool> {
        let tolerance = self.servo.settings().goal_tolerance;
        let positions = self.positions();
        self.truth.evaluate(&positions);
        let error = pose_error(self.truth.state(), self.opinion.goal_pose()?);
        let (linear, angular) = (error.translation().norm(), error.rotation().angle());
        Some(linear > 2.0 * tolerance.linear || angular > 2.0 * tolerance.angular)
    }

    /// Checks that the arms arrive at the goal in force within 20 s. The check fails if it remains uncertain which goal is in
    /// force.
    pub fn arrives(&mut self) {
        for _ in 0..40 {
            self.run(0.5);
            if self.is_away() == Some(false) {
                return;
            }
        }
        let status = self.servo.status();
        panic!("not arrived: {} {:?}, {}", status.state, status.reason, self.opinion.explain());
    }

    /// Notes which joints do not move. `asked` is the servo's command, `done` is the command that the robot carries out, and `stays` is a
    /// command under which the robot stands.
    pub(super) fn note_refusals(&mut self, asked: &[f64], done: &[f64], stays: &[f64]) {
        let refuses = done == stays && asked != stays;
        self.altered = (asked != done).then_some(refuses);
        // With `integral`, a joint that stands under a command may balance an external force.
        let is_held = self.is_held();
        let takes_positions = self.servo.settings().interface.takes_positions();
        let on = |joint: usize| match takes_positions {
            true => (asked[joint] - self.asked[joint]) / self.period.as_secs_f64(),
            false => asked[joint],
        };
        for (joint, since) in self.refused.iter_mut().enumerate() {
            let refuses = !is_held && done[joint] == stays[joint] && on(joint).abs() > REFUSED;
            *since = refuses.then(|| since.unwrap_or(self.now));
        }
        self.asked.copy_from_slice(asked);
    }
}
