//! What a servo node publishes.

use super::Wiring;
use super::goal_fates::GoalFates;
use super::shutdown::SHORTEST_FAREWELL;
use super::status_message::{self, Told, Values};
use super::words;
use crate::dq::UnitDualQuaternion;
use crate::ros::messages::*;
use crate::ros::{Node, NodeContract, Publisher, RosError};
use crate::servo::{CycleTiming, Servo, Status};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What the node publishes.
pub(super) struct Outputs {
    node: String,
    goal_frame: String,
    joints: Vec<String>,
    pub commands: Arc<Commands>,
    current_pose: Publisher<PoseStamped>,
    pose_error: Publisher<TwistStamped>,
    status: Publisher<DiagnosticStatus>,
    diagnostics: Publisher<DiagnosticArray>,
}

/// The commands to all arms. Whatever ends the cycle, a panic or a hang too, the last ones are zeros: so they outlive it.
pub(super) struct Commands {
    /// To each arm, and how many joints it has.
    arms: Vec<(Publisher<Float64MultiArray>, usize)>,
    /// Whether any command was sent: before, even zeros might be a step for a robot that another servo moves.
    begun: AtomicBool,
    ended: AtomicBool,
}

/// At the end so many zeros are sent, over [`SHORTEST_FAREWELL`].
const ZEROS_AT_THE_END: u32 = 10;

impl Commands {
    /// To each arm its part of the command; zeros where it has ended.
    pub fn publish(&self, command: &[f64], label: &str) {
        self.begun.store(true, Ordering::Relaxed);
        let ended = self.has_ended();
        let mut rest = command;
        for (commands, joint_count) in &self.arms {
            let (part, others) = rest.split_at(*joint_count);
            let size = u32::try_from(*joint_count).unwrap_or(u32::MAX);
            let dim = vec![MultiArrayDimension { label: label.to_owned(), size, stride: size }];
            let data = if ended { vec![0.0; *joint_count] } else { part.to_vec() };
            commands.publish(Float64MultiArray { layout: MultiArrayLayout { dim, data_offset: 0 }, data });
            rest = others;
        }
    }

    /// Whether nothing but zeros is sent any more.
    pub fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }

    /// Sends zeros, now and for a moment, whatever the cycle does meanwhile; nothing else is sent any more.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
        if !self.begun.load(Ordering::Relaxed) {
            return;
        }
        let zeros = vec![0.0; self.arms.iter().map(|(_, count)| count).sum()];
        for _ in 0..ZEROS_AT_THE_END {
            self.publish(&zeros, "");
            std::thread::sleep(SHORTEST_FAREWELL / ZEROS_AT_THE_END);
        }
    }

    /// Of each arm, whether anyone subscribes to its commands.
    pub fn listeners(&self) -> impl Iterator<Item = bool> {
        self.arms.iter().map(|(commands, _)| commands.readers() > 0)
    }

    /// The full name of the commands' topic for the arm number `arm`.
    pub fn topic(&self, arm: usize) -> &str {
        self.arms.get(arm).map_or("", |(commands, _)| commands.topic())
    }

    /// Commands that found no room in a writer.
    fn dropped(&self) -> u64 {
        self.arms.iter().map(|(commands, _)| commands.dropped()).sum()
    }

    /// What to say where others publish commands too.
    fn rivals(&self) -> Option<String> {
        let (commands, _) = self.arms.iter().find(|(commands, _)| commands.other_publishers() > 0)?;
        Some(status_message::rivalry(commands.topic(), commands.other_publishers() + 1))
    }
}

impl Outputs {
    /// The publishers of the node, for arms of so many joints, which are called `joints` in all.
    pub fn new<T: Wiring>(
        node: &mut Node,
        contract: &NodeContract,
        joint_counts: &[usize],
        joints: Vec<String>,
        goal_frame: String,
    ) -> Result<Self, RosError> {
        let mut commands = Vec::new();
        for (arm, joint_count) in T::ARMS.iter().zip(joint_counts) {
            let topic = format!("{arm}forward_velocity_controller/commands");
            commands.push((node.publisher(contract, &topic)?, *joint_count));
        }
        Ok(Self {
            node: node.name().name().to_owned(),
            goal_frame,
            joints,
            commands: Arc::new(Commands {
                arms: commands,
                begun: AtomicBool::new(false),
                ended: AtomicBool::new(false),
            }),
            current_pose: node.publisher(contract, "~/current_pose")?,
            pose_error: node.publisher(contract, "~/pose_error")?,
            status: node.publisher(contract, "~/status")?,
            diagnostics: node.publisher(contract, "/diagnostics")?,
        })
    }

    /// Why the arm does not arrive, and what to try.
    pub fn reason(&self, status: &Status) -> Option<String> {
        words::reason(status, &self.joints)
    }

    /// The joint that its position limit holds back.
    pub fn joint_at_limit(&self, status: &Status) -> Option<&str> {
        self.joints.get(status.joint_at_limit?.checked_sub(1)?).map(String::as_str)
    }

    /// What to say where others publish commands too.
    pub fn rivals(&self) -> Option<String> {
        self.commands.rivals()
    }

    /// The pose and its error, stamped with the time of the joint states that they were made from.
    pub fn publish_pose<T: Wiring>(&self, servo: &Servo<T>, stamp: Time) {
        let Some(controlled) = servo.pose() else { return };
        let header = Header { stamp, frame_id: self.goal_frame.clone() };
        self.current_pose.publish(PoseStamped { header: header.clone(), pose: pose(&controlled) });
        if servo.status().goal.is_some() {
            let error = servo.status().pose_error;
            let vector = |i: usize| Vector3 { x: error[i], y: error[i + 1], z: error[i + 2] };
            self.pose_error
                .publish(TwistStamped { header, twist: Twist { angular: vector(0), linear: vector(3) } });
        }
    }

    pub fn publish_status<T: Wiring>(
        &self,
        servo: &Servo<T>,
        goals: &GoalFates,
        timing: &CycleTiming,
        reason: Option<&str>,
    ) {
        self.status.publish(status_message::message(&Told {
            node: &self.node,
            law: &T::law(&servo.settings().controller),
            joint_at_limit: self.joint_at_limit(servo.status()),
            reason: reason.map(str::to_owned),
            smallest_singular_value: servo.smallest_singular_value(),
            status: servo.status(),
            heard: servo.pose().is_some(),
            goals,
            rejections: servo.rejections(),
            timing,
        }));
    }

    pub fn publish_diagnostics<T: Wiring>(
        &self,
        servo: &Servo<T>,
        timing: &CycleTiming,
        period: Duration,
        reason: Option<&str>,
    ) {
        let state = servo.status().state;
        let mut values = Values::default();
        values.add("state", state);
        values.add_some("reason", reason);
        for (commands, _) in &self.commands.arms {
            values.add(&format!("subscribers of {}", commands.topic()), commands.readers());
        }
        values.add("latency_ms", servo.status().latency * 1e3);
        values.add("cycle_period_ms", period.as_secs_f64() * 1e3);
        values.add("cycle_jitter_p99_us", timing.p99().as_secs_f64() * 1e6);
        values.add("cycle_jitter_max_us", timing.max().as_secs_f64() * 1e6);
        values.add("overruns", timing.overruns());
        values.add("commands_dropped", self.commands.dropped());
        values.add("commands_replaced", servo.replaced().count);
        for (reason, count) in servo.rejections().by_reason() {
            values.add(&format!("rejected.{reason}"), count);
        }
        let unheard = self.commands.arms.iter().find(|(commands, _)| commands.readers() == 0);
        let unheard = unheard.map(|(commands, _)| format!("nobody subscribes to {}", commands.topic()));
        let rivals = self.rivals().or(reason.map(str::to_owned)).or(unheard);
        let status = DiagnosticStatus {
            level: u8::from(state.is_warning() || rivals.is_some()),
            name: format!("{}: cycle", self.node),
            message: rivals.unwrap_or_else(|| state.to_string()),
            hardware_id: String::new(),
            values: values.list,
        };
        self.diagnostics.publish(DiagnosticArray { header: Header::now(""), status: vec![status] });
    }
}

fn pose(controlled: &UnitDualQuaternion) -> Pose {
    let (t, r) = (controlled.translation(), controlled.rotation());
    Pose {
        position: Point { x: t.x, y: t.y, z: t.z },
        orientation: Quaternion { x: r.i, y: r.j, z: r.k, w: r.w },
    }
}
