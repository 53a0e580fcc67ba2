//! Collects the messages of a servo and its arms, and creates the JSON message from which the page shows them.

use super::explain::explain;
use super::robot::{Robot, link_frames, link_points};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{GoalReading, JointOrder};
use dq_kinematics::arm::{ArmError, Chain};
use dq_messages::messages::{DiagnosticStatus, JointState, Message, PoseStamped, TwistStamped};
use dq_messages::{Direction, PoseNumbers};
use dq_metrics::GoalError;
use dq_ros::ros::{Node, RosError, Subscription};
use dq_wire::{Contract, ServoKind, error_distance, goal_reading, pose_numbers};
use dq_wire::{MotionReport, Outcome, StatusReport};
use serde::Serialize;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// The latest messages of a servo and its arm.
pub(super) struct ServoMonitor {
    servo: String,
    started: Instant,
    statuses: Subscription<DiagnosticStatus>,
    motions: Subscription<DiagnosticStatus>,
    poses: Subscription<PoseStamped>,
    errors: Subscription<TwistStamped>,
    /// The subscription to the joint states of each arm.
    joint_states: Vec<Subscription<JointState>>,
    status: Option<HeardStatus>,
    /// The last motion.
    motion: Option<MotionReport>,
    rejected: Option<RejectedGoal>,
    pose: Option<PoseStamped>,
    error: Option<TwistStamped>,
    /// The state of each arm; `None` for an arm from which no joint state was received.
    arms: Vec<Option<ArmState>>,
    /// Whether the namespace has a servo for two arms, although this monitor is for one arm.
    pub two_arms: bool,
}

/// The servo's latest status report, with the time at which it arrived.
struct HeardStatus {
    report: StatusReport,
    smallest_singular_value: f64,
    at: Instant,
}

/// The last rejected goal.
#[derive(Serialize)]
struct RejectedGoal {
    stamp: String,
    why: String,
}

/// The joints of an arm, in the arm's order.
#[derive(Clone)]
struct ArmState {
    /// The positions \[rad, prismatic: m\].
    positions: Vec<f64>,
    /// The velocities [rad/s, prismatic: m/s]; empty if the robot does not report them.
    velocities: Vec<f64>,
}

impl ServoMonitor {
    /// Subscribes to the topics of a servo of this kind. `servo` is the servo's name in the node's namespace; `full_name` is its
    /// fully qualified name.
    pub fn new(node: &mut Node, kind: ServoKind, servo: &str, full_name: String) -> Result<Self, RosError> {
        let (out, incoming) = (Direction::Out, Direction::In);
        let mut joint_states = Vec::new();
        for arm in kind.arms() {
            let topic = format!("{arm}joint_states");
            joint_states.push(listen(kind, node, &topic, incoming, &topic)?);
        }
        Ok(Self {
            statuses: listen(kind, node, "~/status", out, &format!("{servo}/status"))?,
            motions: listen(kind, node, "~/motions", out, &format!("{servo}/motions"))?,
            poses: listen(kind, node, "~/current_pose", out, &format!("{servo}/current_pose"))?,
            errors: listen(kind, node, "~/pose_error", out, &format!("{servo}/pose_error"))?,
            joint_states,
            servo: full_name,
            started: Instant::now(),
            status: None,
            motion: None,
            rejected: None,
            pose: None,
            error: None,
            arms: vec![None; kind.arms().len()],
            two_arms: false,
        })
    }

    /// Processes the received messages. Returns whether there were any messages.
    pub fn take(&mut self, robot: Option<&Robot>) -> bool {
        let mut has_new = self.take_status();
        has_new |= self.take_motions();
        has_new |= replace(&mut self.pose, self.poses.newest().message);
        has_new |= replace(&mut self.error, self.errors.newest().message);
        for (number, (states, arm)) in self.joint_states.iter().zip(&mut self.arms).enumerate() {
            states.each(|state, _| {
                // The topic may also carry joint states of a gripper.
                let joints = robot.and_then(|robot| robot.joints().get(number));
                if let Some(ours) = joints.and_then(|joints| of_arm(joints, &state)) {
                    (*arm, has_new) = (Some(ours), true);
                }
            });
        }
        has_new
    }

    fn take_status(&mut self) -> bool {
        let Some(message) = self.statuses.newest().message else { return false };
        let Some(report) = StatusReport::from_message(&message) else { return false };
        let sigma = message.values.iter().find(|pair| pair.key == "smallest_singular_value");
        let smallest_singular_value = sigma.and_then(|pair| pair.value.parse().ok()).unwrap_or(f64::NAN);
        self.status = Some(HeardStatus { report, smallest_singular_value, at: Instant::now() });
        true
    }

    fn take_motions(&mut self) -> bool {
        let mut has_new = false;
        self.motions.each(|message, _| {
            let Some(motion) = MotionReport::from_message(&message) else { return };
            has_new = true;
            match motion.outcome {
                Outcome::Rejected => {
                    let why = motion.why.unwrap_or_default();
                    self.rejected = Some(RejectedGoal { stamp: motion.goal_stamp, why });
                }
                _ => self.motion = Some(motion),
            }
        });
        has_new
    }

    /// Returns the last report of a motion.
    pub fn motion(&self) -> Option<&MotionReport> {
        self.motion.as_ref()
    }

    /// Returns whether a status of the servo has ever arrived.
    pub fn heard(&self) -> bool {
        self.status.is_some()
    }

    /// Returns the servo's last status report.
    pub fn report(&self) -> Option<&StatusReport> {
        self.status.as_ref().map(|status| &status.report)
    }

    /// Returns the joint positions of all arms \[rad, prismatic: m\]; `None` until every arm has sent a joint state.
    pub fn positions(&self) -> Option<Vec<f64>> {
        self.heard_arms().map(|arms| arms.iter().flat_map(|arm| &arm.positions).copied().collect())
    }

    /// Returns the joint velocities of the arms that report them [rad/s, prismatic: m/s]; `None` until every arm has sent a joint
    /// state.
    fn velocities(&self) -> Option<Vec<f64>> {
        self.heard_arms().map(|arms| arms.iter().flat_map(|arm| &arm.velocities).copied().collect())
    }

    fn heard_arms(&self) -> Option<Vec<&ArmState>> {
        self.arms.iter().map(Option::as_ref).collect()
    }

    /// Returns whether the servo's last status is younger than [`StatusReport::SILENCE`].
    pub fn alive(&self) -> bool {
        self.silence().is_some_and(|silence| silence <= StatusReport::SILENCE)
    }

    fn silence(&self) -> Option<Duration> {
        self.status.as_ref().map(|status| status.at.elapsed())
    }

    /// Describes the state of the servo in words.
    pub fn words(&self) -> String {
        let heard = self.report().zip(self.silence());
        explain(&self.servo, heard, self.two_arms)
    }

    /// Returns the present state of the arm, in the format in which the page stores samples of a motion. `time` is the time since the
    /// motion began \[s\].
    pub fn sample(&self, robot: &Robot, time: f64) -> Value {
        let goal = self.report().and_then(|report| report.goal);
        let tool = self.pose.as_ref().map(pose);
        let share = |(speed, limit): (&f64, &f64)| 100.0 * speed.abs() / limit;
        let speeds = self.velocities().unwrap_or_default();
        json!({
            "time": time,
            "links": self.links(Some(robot)),
            "frames": self.frames(Some(robot)),
            "tool": tool,
            "goal": goal,
            "error": self.error.as_ref().map(distance),
            "sigma": self.status.as_ref().map(|status| status.smallest_singular_value),
            "speeds": speeds.iter().zip(robot.joint_velocity_limits()).map(share).collect::<Vec<_>>(),
        })
    }

    /// Returns the JSON message that shows the state.
    ///
    /// Its members `pose` and `servo.goal` are in the goal frame. All other poses are in the base frame. With two arms, the goal frame is
    /// the frame of the left tool; the member `goal_frame` is the pose of the left tool, and `tool` that of the right tool.
    pub fn frame(&self, robot: Option<&Robot>) -> String {
        let pose = self.pose.as_ref().map(pose);
        let tools = self.tools(robot);
        let (goal_frame, tool) = match tools.as_deref() {
            Some([left, right]) => (Some(pose_numbers(left)), Some(pose_numbers(right))),
            _ => (None, pose),
        };
        json!({ "now": {
            "time": self.started.elapsed().as_secs_f64(),
            "alive": self.alive(),
            "words": self.words(),
            "servo": self.status(),
            "pose": pose,
            "tool": tool,
            "goal_frame": goal_frame,
            "links": self.links(robot),
            "frames": self.frames(robot),
            "error": self.error.as_ref().map(distance),
            "positions": self.positions(),
            "velocities": self.velocities(),
        }})
        .to_string()
    }

    fn status(&self) -> Option<Value> {
        let HeardStatus { report, smallest_singular_value, .. } = self.status.as_ref()?;
        Some(json!({
            "state": report.state.name(),
            "warning": report.state.is_warning() || report.goal_beyond_reach,
            "law": report.law,
            "goal": report.goal,
            "goal_count": report.goal_count,
            "rejected_goal": self.rejected,
            "smallest_singular_value": smallest_singular_value,
            "jitter_p99_us": report.cycle_jitter.p99,
            "jitter_max_us": report.cycle_jitter.max,
        }))
    }

    /// Calls `of` for each arm with its joint positions, and returns the results. Returns `None` without a `robot`, and until every
    /// arm has sent a joint state.
    fn of_each<R>(
        &self,
        robot: Option<&Robot>,
        of: impl Fn(&Chain, &[f64]) -> Result<R, ArmError>,
    ) -> Option<Vec<R>> {
        let (chains, arms) = (robot?.chains(), self.heard_arms()?);
        chains.into_iter().zip(arms).map(|(chain, arm)| of(chain, &arm.positions).ok()).collect()
    }

    /// Returns the tool poses of the arms.
    fn tools(&self, robot: Option<&Robot>) -> Option<Vec<UnitDualQuaternion>> {
        self.of_each(robot, Chain::forward_kinematics)
    }

    /// Returns for each arm the origins of base, links and tool \[m\], base first.
    fn links(&self, robot: Option<&Robot>) -> Option<Vec<Vec<[f64; 3]>>> {
        self.of_each(robot, link_points)
    }

    /// Returns the poses of all links, arm after arm.
    fn frames(&self, robot: Option<&Robot>) -> Option<Vec<PoseNumbers>> {
        self.of_each(robot, link_frames).map(|frames| frames.concat())
    }
}

/// Subscribes with best effort to `topic`. `entry` is the name of this topic in the servo's contract. With best effort, no
/// publisher stores samples for a viewer that does not read, and publishers of any reliability match.
fn listen<M: Message>(
    kind: ServoKind,
    node: &mut Node,
    entry: &str,
    direction: Direction,
    topic: &str,
) -> Result<Subscription<M>, RosError> {
    let contract = kind.contract(Contract::builtin()?).with_best_effort(entry);
    node.subscription_as(contract.topic::<M>(entry, direction)?, topic)
}

/// Returns the state of the arm with these joints; `None` if the message does not belong to this arm.
fn of_arm(joints: &JointOrder, state: &JointState) -> Option<ArmState> {
    let sorted = |values: &[f64]| {
        let mut into = vec![0.0; joints.names().len()];
        joints.positions(&state.name, values, &mut into).ok().map(|()| into)
    };
    let positions = sorted(&state.position)?;
    Some(ArmState { positions, velocities: sorted(&state.velocity).unwrap_or_default() })
}

fn replace<T>(known: &mut Option<T>, newer: Option<T>) -> bool {
    let is_new = newer.is_some();
    if is_new {
        *known = newer;
    }
    is_new
}

fn pose(message: &PoseStamped) -> PoseNumbers {
    let GoalReading { position: [x, y, z], orientation_xyzw: [i, j, k, w], .. } = goal_reading(message);
    [x, y, z, i, j, k, w]
}

/// Returns the distance of the tool from the goal \[m, rad\].
fn distance(error: &TwistStamped) -> [f64; 2] {
    let GoalError { position, rotation } = error_distance(error);
    [position, rotation]
}
