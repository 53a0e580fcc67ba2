//! What a follower makes of joint states.

use super::Follower;
use crate::config::{CycleParameters, NodeParameters};
use crate::runs::{RunError, Sample};
use crate::servo::{longest_way, way};
use crate::wire::Wiring;
use crate::wire::messages::JointState;

impl<T: Wiring> Follower<T>
where
    CycleParameters<T>: NodeParameters,
{
    pub(super) fn take_joint_state(
        &mut self,
        time: f64,
        arm: usize,
        state: &JointState,
    ) -> Result<(), RunError> {
        let (range, joints) = (self.range(arm), &self.parameters.joints[arm]);
        if joints.positions(&state.name, &state.position, &mut self.positions[range.clone()]).is_err() {
            self.strangers += 1;
            return Ok(());
        }
        let velocities = &mut self.velocities[range];
        if joints.positions(&state.name, &state.velocity, velocities).is_err() {
            velocities.fill(f64::NAN);
        }
        // The arms' states of one moment make one sample; an arm that is silent does not hold up the others.
        (self.fresh[arm], self.heard[arm]) = (true, true);
        let timeout = self.parameters.settings.state_timeout.as_secs_f64();
        let silent = self.run.samples.last().is_some_and(|last| time - last.time > timeout);
        let due = silent || self.fresh.iter().all(|fresh| *fresh);
        if due && self.heard.iter().all(|heard| *heard) {
            self.fresh.fill(false);
            self.sample(time)?;
        }
        Ok(())
    }

    fn sample(&mut self, time: f64) -> Result<(), RunError> {
        let jumped = self.has_jumped(time);
        if jumped {
            self.motions.jump();
        }
        self.parameters.task.evaluate(&self.positions)?;
        self.run.samples.push(Sample {
            time,
            positions: self.positions.clone(),
            velocities: self.velocities.clone(),
            pose: self.parameters.task.pose(),
            jumped: std::mem::take(&mut self.tool_changed) || jumped,
            error: self.signed_goal().map(|goal| self.goal_error(&goal)),
            smallest_singular_value: self
                .parameters
                .task
                .smallest_singular_value(&self.parameters.settings.controller),
        });
        // As the servo does, once a cycle; in a bag without commands, at each state.
        if self.run.commands.is_empty() {
            self.measure(time);
        }
        Ok(())
    }

    /// Whether a joint is farther from where it was at the last sample than any limit of speed has allowed so far: it may still brake
    /// after that is lowered.
    fn has_jumped(&self, time: f64) -> bool {
        let kinds = self.parameters.task.joint_kinds();
        self.run.samples.last().is_some_and(|last| {
            let ends = last.positions.iter().zip(&self.positions);
            let mut ways =
                ends.zip(kinds).map(|((from, to), kind)| way(kind, *from, *to).abs()).zip(&self.fastest);
            ways.any(|(way, speed)| way > longest_way(*speed, time - last.time))
        })
    }
}
