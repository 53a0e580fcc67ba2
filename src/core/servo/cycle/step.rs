//! The steps of one cycle, in this order: take the inputs, update the consent, determine the goal, compute the desired velocity,
//! filter it into the command, and report the status.

use super::Servo;
use super::output::Hindrance;
use super::tracking::Tracked;
use crate::servo::filters::{FilterInput, LawGoal};
use crate::servo::mode::{Mode, Pursuit};
use crate::servo::{FreeDirections, Input, Reason, State, Status};
use dq_kinematics::control::{AllowedRate, Map};
use dq_limits::Joints;
use dq_metrics::MotionMeter;
use std::time::Duration;

impl Servo {
    /// Computes the next command at time `now`. Returns its joint velocities [rad/s, prismatic: m/s]. To drive the arm, send
    /// [`output`](Self::output) instead.
    pub fn step(&mut self, now: Duration) -> &[f64] {
        let elapsed = now.saturating_sub(std::mem::replace(&mut self.clock.stepped, now));
        self.clock.now = now;
        // Inputs.
        self.process_robot_inputs(now);
        self.watch_jog(now);
        self.watch_frame(now);
        self.robot.arms.evaluate(self.robot.link.measured());
        self.robot.predicted.evaluate(self.robot.link.predicted());
        // Consent.
        let rivals = self.revoke_for_faults(now);
        self.watch_contact(now, elapsed);
        self.watch_reconfiguration(now);
        let (standing, reason) = self.reason_to_stand(now, rivals);
        let driven = standing.is_none();
        // Target, desired velocity, and command.
        self.yield_to_wrench(driven);
        let tracked = self.track(now);
        if driven {
            self.set_desired_velocity(now, tracked.as_ref());
        } else {
            self.law_memory.reset();
        }
        self.hold_joints(standing);
        self.set_command(driven, tracked.as_ref());
        let (measured, limits) = (self.robot.link.measured(), &self.settings.limits);
        self.output.move_setpoint(driven, elapsed, measured, self.clock.period, limits);
        self.robot.link.command(now, &self.output.command);
        // Result.
        let arrived = self.measure(now, tracked.as_ref());
        let state = standing.unwrap_or(self.driving_state(arrived));
        let reason = self.sagging(now, state, reason);
        if let Some(tracked) = tracked.as_ref().filter(|_| state.gets_nearer()) {
            self.watch_progress(now, elapsed, tracked);
        }
        self.record_motion(now);
        if self.at_rest() {
            self.requests.stand();
        }
        self.report(now, state, reason, tracked.as_ref());
        &self.output.command
    }

    /// Computes the desired velocity for the time at which the command takes effect: from the twist, from the law, or from the
    /// joint line.
    fn set_desired_velocity(&mut self, now: Duration, tracked: Option<&Tracked>) {
        match (&self.mode, tracked) {
            (Mode::Goal(pursuit), Some(_)) if pursuit.follows_joint_line() => self.follow_joint_line(),
            (Mode::Goal(_), Some(tracked)) => return self.obey_law(now, tracked),
            (Mode::Jog(jog), _) => {
                let twist = jog.twist;
                self.obey(&twist);
            }
            _ => self.output.velocity.fill(0.0),
        }
        self.law_memory.reset();
    }

    /// Filters the desired velocity into the next command if the arm is `driven`. Otherwise brakes the arm to rest.
    fn set_command(&mut self, driven: bool, tracked: Option<&Tracked>) {
        let pursuit = self.mode.law_pursuit();
        let escapes = pursuit.is_some_and(|pursuit| pursuit.watch.escape.is_escaping());
        let largest = self.stable_rate();
        let goal = tracked.zip(pursuit).map(|(tracked, pursuit)| LawGoal {
            pose: tracked.goal,
            memory: self.law_memory,
            moving: tracked.moving.filter(|_| !escapes),
            allowed: AllowedRate { part: pursuit.watch.gain_factor, largest },
            escape: escapes.then_some(&self.escape.direction),
            posture: match self.settings.posture.positions.as_slice() {
                [] => &pursuit.posture,
                given => given,
            },
        });
        let input = FilterInput {
            settings: &self.settings,
            joints: Joints {
                limits: &self.settings.limits,
                positions: self.robot.link.predicted(),
                before: &self.output.motion,
                hold: self.robot.link.hold(),
                braking: self.robot.link.braking(self.output.latched_limits.each(), self.clock.period),
            },
            arms: &self.robot.predicted,
            goal,
            by_tool: match pursuit {
                Some(_) => self.settings.controller.law.map() == Map::DampedInverse,
                None => self.mode.jog().is_some(),
            },
            link: &self.robot.link,
        };
        self.output.hindrance = Hindrance::default();
        if driven {
            self.output.filters.drive(&input, &mut self.output.velocity);
            self.output.hindrance = Hindrance::of(&self.output.filters);
            let travel = self.clock.period * self.escape.direction.along(&self.output.velocity);
            if let Some(pursuit) = self.mode.pursuit_mut() {
                pursuit.watch.escape.travel(travel);
            }
        } else {
            self.output.filters.stop(&input, &mut self.output.velocity);
        }
        self.output.send(self.robot.link.hold());
        self.output.be_silent(self.robot.link.is_blind(), self.robot.link.hold());
    }

    /// Returns the `reason` for `state`. If an idle arm sags, returns [`Reason::Sagging`] instead, because the sagging is more important
    /// than the reason why the arm is idle.
    fn sagging(&self, now: Duration, state: State, reason: Option<Reason>) -> Option<Reason> {
        let is_told = matches!(reason, None | Some(Reason::Revoked(_) | Reason::Release(_)));
        let stands = matches!(state, State::Holding | State::Paused | State::Stopping);
        let sinks = if is_told && stands { self.sinks(now) } else { None };
        sinks.map_or(reason, |(joint, speed)| {
            let kind = self.joint_line.kinds[joint];
            Some(Reason::Sagging { joint: joint + 1, speed, kind })
        })
    }

    /// Builds the status of this cycle. Nothing else in the cycle depends on it.
    fn report(&mut self, now: Duration, state: State, reason: Option<Reason>, tracked: Option<&Tracked>) {
        self.update_reach();
        let pursuit = self.mode.pursuit();
        let watch = pursuit.map(|pursuit| &pursuit.watch);
        let stall = watch.and_then(|watch| watch.stall);
        let by_law = self.mode.law_pursuit();
        let before = &self.status;
        self.status = Status {
            state,
            reason,
            consent: *self.requests.consent(),
            input: match &self.mode {
                Mode::Idle => Input::None,
                Mode::Goal(_) => Input::Goal,
                Mode::Jog(_) => Input::Twist,
            },
            goal_count: self.motions.count,
            goal: pursuit.map(|pursuit| pursuit.goal),
            goal_stamp: pursuit.map_or(0, |pursuit| pursuit.stamp),
            goal_beyond_reach: pursuit
                .and_then(|pursuit| pursuit.beyond_reach)
                .is_some_and(|(_, is_beyond)| is_beyond),
            sign: pursuit.map_or(before.sign, Pursuit::sign),
            joint_at_limit: self.output.hindrance.at_limit.or(stall.and_then(|stall| stall.joint())),
            held_by: self.output.hindrance.pair.or(stall.and_then(|stall| stall.pair())),
            closest: self.output.hindrance.closest,
            too_far: self.robot.link.too_far(now),
            speed_factor: self.robot.link.factor(),
            leaving_singularity: state.is_driven() && watch.is_some_and(|watch| watch.escape.is_escaping()),
            instead_of_twist: self.mode.jog().filter(|_| state == State::Jogging).and_then(|jog| {
                let robot = &self.robot.predicted;
                let aim = self.settings.controller.aim;
                FreeDirections::instead_of(&jog.twist, aim, robot.state(), &robot.tool_axes())
            }),
            stall,
            contact: self.contact_status(),
            reconfiguration: watch.map(|watch| watch.reconfiguration).unwrap_or_default(),
            figures: pursuit
                .and_then(|pursuit| pursuit.record.meter.as_ref())
                .map_or(before.figures, MotionMeter::figures),
            pose_error: tracked.map_or(before.pose_error, |tracked| tracked.log),
            latency: self.robot.link.latency(self.settings.latency),
            gain_factor: by_law.map_or(1.0, |pursuit| pursuit.watch.gain_factor),
        };
    }

    /// Determines whether the current goal is beyond reach, once for each goal and each change of settings.
    fn update_reach(&mut self) {
        let configurations = self.configurations;
        let Some(pursuit) = self.mode.pursuit() else { return };
        if pursuit.beyond_reach.is_some_and(|(under, _)| under == configurations) {
            return;
        }
        let point = pursuit.goal.base_from_goal().translation();
        let is_beyond = self.beyond_reach(&point).is_some();
        if let Some(pursuit) = self.mode.pursuit_mut() {
            pursuit.beyond_reach = Some((configurations, is_beyond));
        }
    }
}
