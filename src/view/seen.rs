//! What changes all the time: what the servo and its arm publish, and the frame that shows it.

use super::robot::Robot;
use super::words::words;
use crate::dq::UnitDualQuaternion;
use crate::ros::{Node, RosError, Subscription};
use crate::servo::{Goal, GoalReading};
use crate::wire::StatusReport;
use crate::wire::messages::{DiagnosticStatus, JointState, Message, PoseStamped, TwistStamped};
use crate::wire::{Contract, Direction, PoseNumbers, pose_numbers};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// What is heard of a servo and its arm.
pub(super) struct Seen {
    servo: String,
    started: Instant,
    statuses: Subscription<DiagnosticStatus>,
    poses: Subscription<PoseStamped>,
    errors: Subscription<TwistStamped>,
    joint_states: Subscription<JointState>,
    status: Option<(StatusReport, f64, Instant)>,
    pose: Option<PoseStamped>,
    error: Option<TwistStamped>,
    arm: Option<(Vec<f64>, Vec<f64>)>,
    two_arms: bool,
}

impl Seen {
    /// Listens to the servo `servo`; its full name is `full_name`.
    pub fn new(node: &mut Node, servo: &str, full_name: String) -> Result<Self, RosError> {
        let (out, incoming) = (Direction::Out, Direction::In);
        Ok(Self {
            statuses: listen(node, "~/status", out, &format!("{servo}/status"))?,
            poses: listen(node, "~/current_pose", out, &format!("{servo}/current_pose"))?,
            errors: listen(node, "~/pose_error", out, &format!("{servo}/pose_error"))?,
            joint_states: listen(node, "joint_states", incoming, "joint_states")?,
            servo: full_name,
            started: Instant::now(),
            status: None,
            pose: None,
            error: None,
            arm: None,
            two_arms: false,
        })
    }

    /// Takes what came; whether anything did.
    pub fn take(&mut self, robot: Option<&Robot>) -> bool {
        let mut news = self.take_status();
        news |= replace(&mut self.pose, self.poses.newest().message);
        news |= replace(&mut self.error, self.errors.newest().message);
        let arm = &mut self.arm;
        self.joint_states.each(|state| {
            // There may be those of a gripper on the same topic.
            if let Some(ours) = robot.and_then(|robot| of_arm(robot, &state)) {
                (*arm, news) = (Some(ours), true);
            }
        });
        news
    }

    fn take_status(&mut self) -> bool {
        let Some(message) = self.statuses.newest().message else { return false };
        let Some(report) = StatusReport::from_message(&message) else { return false };
        let sigma = message.values.iter().find(|pair| pair.key == "smallest_singular_value");
        let sigma = sigma.and_then(|pair| pair.value.parse().ok()).unwrap_or(f64::NAN);
        self.status = Some((report, sigma, Instant::now()));
        true
    }

    /// Whether the servo was ever heard.
    pub fn heard(&self) -> bool {
        self.status.is_some()
    }

    /// What the servo reported last.
    pub fn report(&self) -> Option<&StatusReport> {
        self.status.as_ref().map(|(report, ..)| report)
    }

    /// Where the arm's joints are \[rad\].
    pub fn positions(&self) -> Option<&[f64]> {
        self.arm.as_ref().map(|(positions, _)| positions.as_slice())
    }

    /// Takes whether there is a servo for two arms instead.
    pub fn set_two_arms(&mut self, two_arms: bool) {
        self.two_arms = two_arms;
    }

    /// Whether the servo was heard lately.
    pub fn alive(&self) -> bool {
        self.silence().is_some_and(|silence| silence <= StatusReport::SILENCE)
    }

    fn silence(&self) -> Option<Duration> {
        self.status.as_ref().map(|(.., heard)| heard.elapsed())
    }

    /// What the servo is doing, in words.
    pub fn words(&self) -> String {
        let heard = self.status.as_ref().map(|(report, _, heard)| (report, heard.elapsed()));
        words(&self.servo, heard, self.two_arms)
    }

    /// The arm at `time` \[s\] of its motion, as the page has the samples of a run.
    pub fn sample(&self, robot: &Robot, time: f64) -> Value {
        let goal = self.report().and_then(|report| report.goal);
        let tool = self.pose.as_ref().map(pose);
        let checked =
            |[x, y, z, orientation @ ..]: PoseNumbers| Goal::new([x, y, z], orientation, "", "").ok();
        let distance =
            tool.and_then(checked).zip(goal.and_then(checked)).map(|(tool, goal)| tool.distance(&goal));
        let share = |(speed, limit): (&f64, &f64)| 100.0 * speed.abs() / limit;
        let limits = robot.joint_velocity_limits();
        json!({
            "time": time,
            "links": self.links(Some(robot)).map(|links| [links]),
            "tool": tool,
            "goal": goal,
            "error": distance.map(|distance| [distance.position, distance.rotation]),
            "sigma": self.status.as_ref().map(|(_, sigma, _)| sigma),
            "speeds": self.arm.iter().flat_map(|(_, speeds)| speeds.iter().zip(limits).map(share)).collect::<Vec<_>>(),
        })
    }

    /// The frame that shows it.
    pub fn frame(&self, robot: Option<&Robot>) -> String {
        json!({ "now": {
            "time": self.started.elapsed().as_secs_f64(),
            "alive": self.alive(),
            "words": self.words(),
            "servo": self.status(),
            "tool": self.pose.as_ref().map(pose),
            "links": self.links(robot),
            "frames": self.frames(robot),
            "error": self.error.as_ref().map(error),
            "positions": self.arm.as_ref().map(|(positions, _)| positions),
            "velocities": self.arm.as_ref().map(|(_, velocities)| velocities),
        }})
        .to_string()
    }

    fn status(&self) -> Option<Value> {
        let (report, sigma, _) = self.status.as_ref()?;
        Some(json!({
            "state": report.state.name(),
            "warning": report.state.is_warning() || report.goal_beyond_reach,
            "law": report.law,
            "goal": report.goal,
            "goal_count": report.goal_count,
            "rejected_goal": report.rejected_goal.as_ref().map(|(stamp, why)| json!({ "stamp": stamp, "why": why })),
            "smallest_singular_value": sigma,
            "jitter_p99_us": report.cycle_jitter_us.0,
            "jitter_max_us": report.cycle_jitter_us.1,
        }))
    }

    /// The origins of base, links and tool \[m\], base first.
    fn links(&self, robot: Option<&Robot>) -> Option<Vec<[f64; 3]>> {
        let (robot, (positions, _)) = (robot?, self.arm.as_ref()?);
        let links = robot.chain.link_poses(positions).ok()?;
        let tool = robot.chain.forward_kinematics(positions).ok()?;
        let base = UnitDualQuaternion::identity();
        Some([base].iter().chain(&links).chain(&[tool]).map(|pose| pose.translation().into()).collect())
    }

    /// The poses of the links, where there are limits of their joints to be shown.
    fn frames(&self, robot: Option<&Robot>) -> Option<Vec<PoseNumbers>> {
        let (robot, (positions, _)) =
            (robot.filter(|robot| robot.has_position_limits())?, self.arm.as_ref()?);
        let links = robot.chain.link_poses(positions).ok()?;
        Some(links.iter().map(pose_numbers).collect())
    }
}

/// Subscribes best effort to the servo's topic `entry` as `topic`: no publisher keeps samples for a viewer that does not read, and any
/// publisher matches.
fn listen<M: Message>(
    node: &mut Node,
    entry: &str,
    direction: Direction,
    topic: &str,
) -> Result<Subscription<M>, RosError> {
    let contract = Contract::builtin()?.servo.with_best_effort(entry);
    node.subscription_as(contract.topic::<M>(entry, direction)?, topic)
}

/// Positions \[rad\] and velocities \[rad/s\] of the arm's joints in its order; none where the message is not of this arm.
fn of_arm(robot: &Robot, state: &JointState) -> Option<(Vec<f64>, Vec<f64>)> {
    let sorted = |values: &[f64]| {
        let mut into = vec![0.0; robot.joints.names().len()];
        robot.joints.positions(&state.name, values, &mut into).ok().map(|()| into)
    };
    let positions = sorted(&state.position)?;
    Some((positions, sorted(&state.velocity).unwrap_or_default()))
}

fn replace<T>(known: &mut Option<T>, newer: Option<T>) -> bool {
    let is_news = newer.is_some();
    if is_news {
        *known = newer;
    }
    is_news
}

fn pose(message: &PoseStamped) -> PoseNumbers {
    let GoalReading { position: [x, y, z], orientation_xyzw: [i, j, k, w], .. } = message.reading();
    [x, y, z, i, j, k, w]
}

/// The amounts of the screw log's two parts: \[m\] and \[rad\].
fn error(message: &TwistStamped) -> [f64; 2] {
    let norm = |v: &crate::wire::messages::Vector3| nalgebra::Vector3::new(v.x, v.y, v.z).norm();
    [norm(&message.twist.linear), norm(&message.twist.angular)]
}
