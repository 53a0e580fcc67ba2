//! The outputs of a servo node.

use super::commands::Commands;
use super::events::EventsTopic;
use super::guards::Guards;
use super::in_force::NotObeyed;
use super::node_setup::NodeSetup;
use super::pictures::{Moment, MomentSlot};
use super::ros_inputs::RejectedGoal;
use super::snapshot::{MotionUpdate, Snapshot};
use dq_check::GuardState;
use dq_core::servo::{Status, joint_name};
use dq_messages::messages::*;
use dq_ros::ros::{Clock, EndpointId, Publisher, RosError};
use dq_wire::{KeyValues, Reported, ServoReport, microseconds, milliseconds, pose_message};
use dq_wire::{MotionContext, MotionReport, ServoKind, SpreadFigures};
use std::sync::Arc;
use std::time::Duration;

/// The warning that is logged when a guard is gone.
pub(super) const GUARD_GONE: &str = "the guard is gone: nobody would stop the arm if this servo were killed";

/// The outputs of the node.
pub(super) struct Outputs {
    node: String,
    goal_frame: String,
    pub kind: ServoKind,
    /// The names of all joints, arm after arm.
    pub joints: Vec<String>,
    pub commands: Arc<Commands>,
    events: Arc<EventsTopic>,
    /// The guards of each arm.
    guards: Vec<Guards>,
    guard: GuardState,
    slot: MomentSlot,
    clock: Clock,
    current_pose: Publisher<PoseStamped>,
    pose_error: Publisher<TwistStamped>,
    status: Publisher<DiagnosticStatus>,
    motions: Publisher<DiagnosticStatus>,
    diagnostics: Publisher<DiagnosticArray>,
}

impl Outputs {
    /// Creates all publishers of the node except those in `commands`. `joints` are the names of all joints. The data for the next
    /// picture are stored in `slot`.
    pub fn new(
        NodeSetup { node, kind, contract }: &mut NodeSetup,
        commands: Arc<Commands>,
        events: Arc<EventsTopic>,
        slot: MomentSlot,
        clock: Clock,
        joints: Vec<String>,
        goal_frame: String,
    ) -> Result<Self, RosError> {
        Ok(Self {
            node: node.name().name().to_owned(),
            goal_frame,
            kind: *kind,
            joints,
            guards: commands.guards().map(Guards::new).collect(),
            commands,
            events,
            guard: GuardState::None,
            slot,
            clock,
            current_pose: node.publisher(contract, "~/current_pose")?,
            pose_error: node.publisher(contract, "~/pose_error")?,
            status: node.publisher(contract, "~/status")?,
            motions: node.publisher(contract, "~/motions")?,
            diagnostics: node.publisher(contract, "/diagnostics")?,
        })
    }

    /// Counts the subscribers to the commands and to the record.
    pub fn update_readers(&self) {
        self.commands.update_readers();
        self.events.update_readers();
    }

    /// Returns the name of joint `number`. The number counts from 1, through the joints of the first arm and then of the second.
    pub fn joint(&self, number: usize) -> String {
        joint_name(number, &self.joints)
    }

    /// Returns the name of the joint that is stopped by its position limit; `None` if no limit stops a joint.
    pub fn joint_at_limit(&self, status: &Status) -> Option<&str> {
        self.joints.get(status.joint_at_limit?.checked_sub(1)?).map(String::as_str)
    }

    /// Checks at `now` whether each arm has a guard. Returns the worst state among the arms if this state has changed.
    pub fn update_guards(&mut self, now: Duration) -> Option<GuardState> {
        let states: Vec<_> = self.guards.iter_mut().map(|guards| guards.look(now)).collect();
        let all = [GuardState::Gone, GuardState::None].into_iter().find(|state| states.contains(state));
        let before = std::mem::replace(&mut self.guard, all.unwrap_or(GuardState::Watching));
        (self.guard != before).then_some(self.guard)
    }

    /// Publishes the pose and the pose error, and stores the data for the next picture. The stamp is the time of the joint states
    /// from which the pose was computed.
    pub fn publish_pose(&self, cycle: &Snapshot) {
        let Some(controlled) = &cycle.pose else { return };
        let header = Header { stamp: cycle.stamp.clone(), frame_id: self.goal_frame.clone() };
        let goal = cycle.status.goal.as_ref();
        self.slot.leave(Moment {
            header: header.clone(),
            tool: Some(pose_message(controlled)),
            goal: goal.map(|goal| pose_message(goal.base_from_goal())),
            motion: cycle.status.goal_count,
            law: self.kind.law(&cycle.controller).law,
            scene: cycle.scene.clone(),
            closest: cycle.status.closest,
        });
        self.current_pose
            .publish_if_heard(|| PoseStamped { header: header.clone(), pose: pose_message(controlled) });
        if goal.is_some() {
            let error = cycle.status.pose_error;
            let vector = |i: usize| Vector3 { x: error[i], y: error[i + 1], z: error[i + 2] };
            let twist = Twist { angular: vector(0), linear: vector(3) };
            self.pose_error.publish_if_heard(|| TwistStamped { header, twist });
        }
    }

    pub fn publish_status(
        &self,
        cycle: &Snapshot,
        reason: Option<&str>,
        asker: Option<String>,
        not_obeyed: &NotObeyed,
    ) {
        let NotObeyed { idle, refused } = not_obeyed;
        let not_obeyed: Vec<_> = idle.iter().chain(refused).map(String::as_str).collect();
        let keep_outs = cycle.scene.as_ref().map(|scene| scene.keep_outs().len() + scene.keep_ins().len());
        let servo = ServoReport {
            law: self.kind.law(&cycle.controller),
            joint_at_limit: self.joint_at_limit(&cycle.status),
            reason: reason.map(str::to_owned),
            keep_outs,
            smallest_singular_value: cycle.smallest_singular_value,
            now: cycle.now,
            asker,
            status: &cycle.status,
            heard: cycle.pose.is_some(),
            rejections: &cycle.rejections,
        };
        let reported = Reported {
            node: &self.node,
            guard: self.guard,
            not_obeyed: (!not_obeyed.is_empty()).then(|| not_obeyed.join("; ")),
            servo,
            timing: cycle.timing,
        };
        self.status.publish(reported.message());
    }

    /// Publishes the updates of motions and goals. `describe` returns the name of an endpoint's node.
    pub fn publish_updates(&self, cycle: &Snapshot, describe: impl Fn(EndpointId) -> String) {
        for MotionUpdate { motion, asker, goal_frame } in &cycle.updates.motions {
            let asked_by = asker.map(&describe);
            let began = Time::now().before(cycle.now.saturating_sub(motion.began));
            let why = motion.why(|joint| self.joint(joint));
            let (law, gains) = self.kind.law_of(motion);
            let context = MotionContext {
                law,
                gains,
                why,
                goal_frame,
                asked_by: asked_by.as_deref(),
                began: Some(&began),
                cycle_jitter: (&cycle.timing.lateness).into(),
            };
            self.motions.publish(MotionReport::new(motion, context).message(&self.node));
        }
        for RejectedGoal { stamp, by, why } in &cycle.updates.rejected {
            let report = MotionReport::rejected(stamp, by.map(&describe), why.text());
            self.motions.publish(report.message(&self.node));
        }
    }

    pub fn publish_diagnostics(&self, cycle: &Snapshot, period: Duration, reason: Option<&str>) {
        let state = cycle.status.state;
        let mut values = KeyValues::default();
        values.add("state", state);
        values.add_some("reason", reason);
        values.add("guard", self.guard);
        for (topic, readers) in self.commands.readers() {
            values.add(&format!("subscribers of {topic}"), readers);
        }
        values.add("latency_ms", milliseconds(cycle.status.latency));
        values.add("cycle_period_ms", milliseconds(period.as_secs_f64()));
        for (what, times) in [("jitter", cycle.timing.lateness), ("time", cycle.timing.work)] {
            let SpreadFigures { median, p99, p999, max } = times;
            for (part, time) in [("median", median), ("p99", p99), ("p999", p999), ("max", max)] {
                values.add(&format!("cycle_{what}_{part}_us"), microseconds(time));
            }
        }
        values.add("overruns", cycle.timing.overruns);
        values.add("commands_dropped", self.commands.dropped());
        values.add("commands_replaced", cycle.replaced.count);
        for (reason, count) in cycle.rejections.by_reason() {
            values.add(&format!("rejected.{reason}"), count);
        }
        let unheard = self.commands.readers().find(|(_, readers)| *readers == 0);
        let unheard = unheard.map(|(topic, _)| format!("nobody subscribes to {topic}"));
        let unguarded = (self.guard == GuardState::Gone).then(|| GUARD_GONE.to_owned());
        let rivals = self.commands.rivals().or(reason.map(str::to_owned)).or(unheard).or(unguarded);
        let (warns, name) = (state.is_warning() || rivals.is_some(), format!("{}: cycle", self.node));
        let status = values.status(warns, &name, rivals.unwrap_or_else(|| state.to_string()));
        self.diagnostics.publish(DiagnosticArray { header: self.clock.header(""), status: vec![status] });
    }
}
