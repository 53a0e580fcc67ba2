//! The cycle as a list: what came, whether the arm may move, where to, the velocity that is wanted, the filters, the command, the report.

use super::Servo;
use super::tracking::{GoalTracking, Tracked};
use crate::control::Map;
use crate::servo::filters::{Given, Towards};
use crate::servo::{GoalError, Input, Reason, State};
use std::time::Duration;

impl Servo {
    /// One cycle at time `now`: the next command, by what is known then. It returns the joint velocities [rad/s, prismatic: m/s]; what is to
    /// be sent to the arm is not these but [`output`](Self::output).
    pub fn step(&mut self, now: Duration) -> &[f64] {
        let elapsed = now.saturating_sub(std::mem::replace(&mut self.clock.stepped, now));
        self.clock.now = now;
        // What came.
        self.look_at_robot(now);
        self.watch_jog(now);
        self.robot.arms.evaluate(self.robot.link.measured());
        self.watch_setpoint(now);
        self.watch_reconfiguration(now);
        // Whether the arm may move.
        let (standing, reason) = self.reason_to_stand(now);
        if self.at_rest() {
            // What an arm that stands does next depends on its goal alone (`Held`): with that a recorded motion can be repeated.
            self.goals.stream.clear();
            self.goals.tracking.iter_mut().for_each(GoalTracking::forget_sign);
        }
        // Where to, the velocity that is wanted for that, and the command that filters make of it.
        let tracked = self.track(now);
        let driven = standing.is_none();
        if driven {
            self.want(now, tracked.as_ref());
        }
        self.set_command(driven, tracked.as_ref());
        let (measured, limits) = (self.robot.link.measured(), &self.settings.limits.position);
        self.output.move_setpoint(driven, elapsed, measured, self.clock.period, limits);
        self.robot.link.command(now, &self.output.command);
        self.report(now, (standing, reason), tracked.map(|tracked| tracked.error));
        if self.at_rest() {
            self.consent.stand();
        }
        self.status.consent = self.consent;
        &self.output.command
    }

    /// The velocity that is wanted, by the twist, by the law or on the way to another configuration, where the arm is when the command reaches it.
    fn want(&mut self, now: Duration, tracked: Option<&Tracked>) {
        self.robot.predicted.evaluate(self.robot.link.predicted());
        match (self.twists.jog, tracked) {
            (Some(jog), _) => self.obey(&jog.twist),
            (None, Some(_)) if self.is_reconfiguring() => self.go_elsewhere(),
            (None, Some(tracked)) => self.obey_law(now, tracked),
            (None, None) => self.output.velocity.fill(0.0),
        }
    }

    /// Makes the next command of what is wanted where the arm is `driven`; else the arm comes to rest.
    fn set_command(&mut self, driven: bool, tracked: Option<&Tracked>) {
        self.output.held_limits.update(&self.settings.limits, &self.output.command);
        let escapes =
            self.goals.tracking.as_ref().is_some_and(|tracking| tracking.watch.escape.is_escaping());
        let by_law = self.twists.jog.is_none() && !self.is_reconfiguring();
        let goal = tracked.filter(|_| by_law).map(|tracked| Towards {
            pose: tracked.goal,
            moving: tracked.moving.filter(|_| !escapes),
            gain_factor: self.status.gain_factor,
            escape: escapes.then_some(&self.escape.direction),
        });
        let given = Given {
            settings: &self.settings,
            arms: &self.robot.predicted,
            positions: self.robot.link.predicted(),
            goal,
            by_tool: !self.is_reconfiguring()
                && (!by_law || self.settings.controller.law.map() == Map::DampedInverse),
            link: &self.robot.link,
            before: &self.output.command,
            braking: self.robot.link.braking(self.output.held_limits.each(), self.clock.period),
            period: self.clock.period,
        };
        if driven {
            self.output.filters.drive(&given, &mut self.output.velocity);
            self.status.joint_at_limit = self.output.filters.held_back().map(|joint| joint + 1);
            self.status.held_by = self.output.filters.held_by();
            self.status.closest = self.output.filters.closest();
            let way = self.clock.period * self.escape.direction.along(&self.output.velocity);
            self.goals.tracking.iter_mut().for_each(|tracking| tracking.watch.escape.travel(way));
        } else {
            self.output.filters.stop(&given, &mut self.output.velocity);
        }
        std::mem::swap(&mut self.output.command, &mut self.output.velocity);
    }

    /// Says what the cycle did, and watches what became of the motion.
    fn report(
        &mut self,
        now: Duration,
        (standing, reason): (Option<State>, Option<Reason>),
        error: Option<GoalError>,
    ) {
        let arrived = self.measure(now, error);
        self.status.latency = self.robot.link.latency(self.settings.latency);
        self.status.state = standing.unwrap_or(self.driving_state(arrived));
        self.status.too_far = self.robot.link.too_far(now);
        self.status.reason = reason;
        self.watch_progress(now, error);
        self.record_motion(now);
        self.report_goal();
        self.status.input = match (&self.twists.jog, &self.goals.tracking) {
            (Some(_), _) => Input::Twist,
            (None, Some(_)) => Input::Goal,
            (None, None) => Input::None,
        };
        let watch = self.goals.tracking.as_ref().map(|tracking| &tracking.watch);
        self.status.stall = watch.and_then(|watch| watch.stall);
        self.status.reconfiguration = watch.map(|watch| watch.reconfiguration).unwrap_or_default();
        self.status.leaving_singularity =
            standing.is_none() && watch.is_some_and(|watch| watch.escape.is_escaping());
    }

    /// Has the goal in force in the status, and whether it is beyond reach: found out anew for another goal and under other settings only.
    fn report_goal(&mut self) {
        let goal = self.goals.tracking.as_ref().map(|tracking| tracking.goal);
        if (goal, self.configurations) != (self.status.goal, self.goals.reported) {
            let point = goal.map(|goal| goal.base_from_goal().translation());
            self.status.goal_beyond_reach = point.is_some_and(|point| self.beyond_reach(&point).is_some());
            (self.status.goal, self.goals.reported) = (goal, self.configurations);
        }
        self.status.goal_stamp = self.goals.tracking.as_ref().map_or(0, |tracking| tracking.stamp);
    }
}
