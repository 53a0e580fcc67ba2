//! The parameters of every node that runs the servo cycle, for one arm or for two.

use super::ArmParameters;
use super::common::{NO_POSE, pose};
use super::ranges::{JOINT_JERKS, JOINT_SPEEDS, POSITIVE};
use super::scene::scene;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    Arms, BeyondReach, GoalFrames, Interface, JointOrder, Limits, PositionLimits, Posture, RAMP_TIME,
    Reconfigure, STOP_TIME, Settings, SettingsError, Tolerance,
};
use dq_kinematics::arm::{JointKind, bounds};
use dq_kinematics::control::{Controller, Damping};
use dq_params::{Declarer, List, ParameterError};
use std::time::Duration;

/// With what reliability joint states are subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StatesReliability {
    /// Reliable, until a publisher offers best effort only: then best effort, which hears reliable ones too.
    Auto,
    /// Lost states are sent again; publishers that offer best effort only are not heard.
    Reliable,
    /// Lost states are lost.
    BestEffort,
}

/// A servo node's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoParameters {
    /// The arm, or the two arms.
    pub arms: Arms,
    /// The joint names of each arm.
    pub joints: Vec<JointOrder>,
    /// The frame in which goals come.
    pub goal_frame: String,
    /// The other one in which twists come.
    pub tool_frame: String,
    /// What may change while the servo runs.
    pub settings: Settings,
    /// How many keep-outs and keep-ins are set that the arm does not look at, as constraints are off.
    pub idle_keep_outs: usize,
    /// With what reliability joint states are subscribed to.
    pub joint_states: StatesReliability,
    /// The node's cycle.
    pub period: Duration,
    /// Of SCHED_FIFO for the cycle's thread; 0 for none.
    pub realtime_priority: u8,
    /// Whether stamps follow `/clock`.
    pub simulated_time: bool,
    /// Whether what comes to the servo is published, for replay.
    pub events: bool,
}

/// The numbers of joints and of arms; lists have a number for each joint of one arm, settings for each of all arms.
#[derive(Clone, Copy)]
struct PerJoint<'a> {
    joints: &'a [JointKind],
    count: usize,
}

impl PerJoint<'_> {
    fn each(self, list: &List<f64>) -> Result<Vec<f64>, ParameterError> {
        Ok(list.exactly(self.joints.len())?.repeat(self.count))
    }

    /// The same, or `none` for each joint where the list is empty.
    fn each_or(self, list: &List<f64>, none: f64) -> Result<Vec<f64>, ParameterError> {
        let given = list.exactly_or_none(self.joints.len())?;
        Ok(given.map_or_else(|| vec![none; self.joints.len() * self.count], |given| given.repeat(self.count)))
    }

    /// The same, where one number is for all joints.
    fn all_or_each(self, list: &List<f64>, none: f64) -> Result<Vec<f64>, ParameterError> {
        match list.items() {
            [all] => Ok(vec![*all; self.joints.len() * self.count]),
            _ => self.each_or(list, none),
        }
    }

    /// The unit of the position of a joint, counted from 0, arm after arm.
    fn unit(self, joint: usize) -> &'static str {
        self.joints[joint % self.joints.len()].unit()
    }
}

impl ServoParameters {
    /// The parameters of `controlled` under the law that `controller` declares, with `count` arms like `arm`.
    pub(super) fn declare_cycle(
        p: &mut Declarer,
        arm: &ArmParameters,
        count: usize,
        (goal_frame, tool_frame): (String, String),
        mut controlled: Arms,
        controller: impl FnOnce(&mut Declarer, Damping) -> Result<Controller, ParameterError>,
    ) -> Result<Self, ParameterError> {
        let reliability = p
            .one_of("states_reliability", &["auto", "reliable", "best_effort"], "auto".to_owned())
            .fixed(
                "",
                "QoS with which joint states are subscribed; auto: reliable until a publisher offers best effort only",
            );
        let events = p.boolean("events", false).live(
            "",
            "publish what comes to the servo on ~/events, for replay; once somebody subscribes and the arm stands this begins with a servo that is new, which has no goal until another one is sent, and does so again each time that it is set to true",
        );
        let mut settings = settings(p, PerJoint { joints: arm.chain.kinds(), count }, controller)?;
        controlled.set_tool_offset(&settings.tool_offset);
        let given = scene(p, &arm.joints, &controlled, &settings.limits.position)?;
        settings.scene = given.scene;
        let period = command_period(p, settings.interface, arm.period);
        Ok(Self {
            arms: controlled,
            joints: vec![JointOrder::new(arm.joints.clone()); count],
            goal_frame,
            tool_frame,
            settings,
            idle_keep_outs: given.idle,
            joint_states: match reliability.as_str() {
                "best_effort" => StatesReliability::BestEffort,
                "reliable" => StatesReliability::Reliable,
                _ => StatesReliability::Auto,
            },
            period,
            realtime_priority: arm.realtime_priority,
            simulated_time: arm.simulated_time,
            events,
        })
    }

    /// These, if a servo takes their settings: then it takes them while it runs too.
    pub(super) fn checked(self) -> Result<Self, ParameterError> {
        let Self { arms, settings, .. } = &self;
        let invalid = |why: SettingsError| ParameterError::Invalid {
            name: "settings",
            value: "as given".to_owned(),
            expected: format!("settings that a servo takes: {why}"),
        };
        settings.check(arms.joint_count(), settings.interface).map_err(invalid)?;
        Ok(self)
    }
}

fn settings(
    p: &mut Declarer,
    arms: PerJoint<'_>,
    controller: impl FnOnce(&mut Declarer, Damping) -> Result<Controller, ParameterError>,
) -> Result<Settings, ParameterError> {
    let none_at_zero = |seconds: f64| (seconds > 0.0).then(|| Duration::from_secs_f64(seconds));
    let sign_hysteresis = p
        .double("sign_hysteresis", 0.1, 0.0..=0.9)
        .live("", "how far past a half turn the sign of the goal is kept");
    let damping = damping(p);
    Ok(Settings {
        tool_offset: tool_offset(p)?,
        goal_frames: GoalFrames::default(),
        beyond_reach: p.one_of("goal_beyond_reach", BeyondReach::NAMES, BeyondReach::Reject).live(
            "",
            "what becomes of a goal that the arm cannot reach: reject, or approach, by which the arm goes as near as it can",
        ),
        feed_forward: p
            .boolean("feed_forward", true)
            .live("", "the motion of a goal that moves is added to the law's, so that the tool does not lag behind"),
        sign_hysteresis,
        limits: limits(p, arms)?,
        scene: None,
        posture: Posture::default(),
        goal_tolerance: tolerance(p),
        state_timeout: Duration::from_secs_f64(
            p.double("state_timeout", 0.1, 0.001..=10.0)
                .live("s", "age at which a joint state is stale: the arm decelerates"),
        ),
        rearm_timeout: Duration::from_secs_f64(p.double("rearm_timeout", 1.0, 0.1..=3600.0).live(
            "s",
            "a robot that was away for longer is driven again only by a new goal or ~/pause (false); a goal that was under way for longer is rejected; a stick silent for longer was let go of",
        )),
        latency: none_at_zero(p.double("latency", 0.0, 0.0..=0.5).live(
            "s",
            "time from a command to the joint state that shows it; 0: estimated from stamps and motion",
        )),
        integral: p.double("integral", 0.0, 0.0..=10.0).live(
            "1/s",
            "rate at which a payload, or gravity that the robot does not compensate, is balanced, and the joints are held against it; of an arm that takes velocities; 0: not at all",
        ),
        goal_timeout: none_at_zero(
            p.double("goal_timeout", 0.0, 0.0..=3600.0)
                .live("s", "age at which a goal is stale; 0: goals are latched"),
        ),
        twist_timeout: Duration::from_secs_f64(
            p.double("twist_timeout", 0.1, 0.01..=1.0)
                .live("s", "age at which a twist is stale: the arm decelerates, and holds"),
        ),
        progress_timeout: none_at_zero(p.double("progress_timeout", 5.0, 0.0..=3600.0).live(
            "s",
            "time without progress after which a motion is given up: the arm holds; 0: never",
        )),
        reconfigure: p.one_of("reconfigure", Reconfigure::NAMES, Reconfigure::Ask).live(
            "",
            "whether an arm that has stalled goes to another configuration in which the goal can be reached, along a straight line in joint space: never, where ~/reconfigure asks for it, or always",
        ),
        interface: command_interface(p),
        following_error: p.double("following_error", 0.2, 0.001..=3.0).live(
            "rad, m",
            "how far a joint that takes positions may be from where it was sent and should be: beyond, the arm holds",
        ),
        controller: controller(p, damping)?,
    })
}

/// Of servo and plant alike, so that one file can set both.
pub(super) fn command_interface(p: &mut Declarer) -> Interface {
    p.one_of("command_interface", Interface::NAMES, Interface::Velocity).fixed(
        "",
        "what the robot's controller takes: joint velocities, joint positions, or trajectories of one point each",
    )
}

/// The period of a servo's commands and of its cycle, where that of its other cycles is `period`. The guard has it too.
pub(super) fn command_period(p: &mut Declarer, interface: Interface, period: Duration) -> Duration {
    let trajectory_rate = p
        .integer("trajectory_rate", 100, 1..=500)
        .fixed("Hz", "rate of the servo's cycle, and of its points, where command_interface is trajectory");
    match interface {
        Interface::Trajectory => Duration::from_secs_f64(1.0 / trajectory_rate.max(1) as f64),
        Interface::Velocity | Interface::Position => period,
    }
}

fn tool_offset(p: &mut Declarer) -> Result<UnitDualQuaternion, ParameterError> {
    let offset = p.doubles("tool_offset", &NO_POSE).live(
        "",
        "the tool that goes to the goal, in tool_frame: x y z [m], then qx qy qz qw; another one stands until it is asked to move",
    );
    pose(&offset)
}

fn damping(p: &mut Declarer) -> Damping {
    Damping {
        max: p
            .double("damping.max", 0.05, 0.0..=1.0)
            .live("", "lambda of the damped inverse at a singularity; a rad of the tool's rotation and a m of its way, and a rad and a m of joints, weigh alike"),
        threshold: p
            .double("damping.threshold", 0.05, POSITIVE..=1.0)
            .live("", "smallest singular value below which damping begins"),
    }
}

fn tolerance(p: &mut Declarer) -> Tolerance {
    Tolerance {
        linear: p
            .double("goal_tolerance.linear", 0.001, POSITIVE..=1.0)
            .live("m", "distance to the goal that counts as arrived"),
        angular: p
            .double("goal_tolerance.angular", 0.01, POSITIVE..=3.0)
            .live("rad", "angle to the goal that counts as arrived"),
    }
}

fn limits(p: &mut Declarer, arms: PerJoint<'_>) -> Result<Limits, ParameterError> {
    let velocity = p
        .doubles("limits.joint_velocity", &[])
        .within(JOINT_SPEEDS)
        .required()
        .live("rad/s, m/s", "largest joint speeds, one a joint");
    let acceleration = p
        .doubles("limits.joint_acceleration", &[])
        .within(JOINT_SPEEDS)
        .required()
        .live("rad/s^2, m/s^2", "largest joint accelerations, one a joint");
    let deceleration = p.doubles("limits.joint_deceleration", &[]).within(JOINT_SPEEDS).live(
        "rad/s^2, m/s^2",
        "joint decelerations in a stop and before a position limit, one a joint; empty: the accelerations, or what stops in 1 s where that is more",
    );
    let jerk = p.doubles("limits.jerk", &[]).within(JOINT_JERKS).live(
        "rad/s^3, m/s^3",
        "how fast joint accelerations may change, stops included: one number for all joints or one a joint; empty: at once",
    );
    let position = position_limits(p, arms);
    let linear_speed =
        p.double("limits.linear_speed", 2.0, POSITIVE..=100.0).live("m/s", "largest speed of a tool point");
    let angular_speed = p
        .double("limits.angular_speed", 6.0, POSITIVE..=100.0)
        .live("rad/s", "largest angular speed of a tool");

    let (joint_velocity, joint_acceleration) = (arms.each(&velocity)?, arms.each(&acceleration)?);
    let joint_deceleration = if deceleration.items().is_empty() {
        joint_acceleration.clone()
    } else {
        let given = arms.each(&deceleration)?;
        check_stops(&deceleration, velocity.items(), arms)?;
        given
    };
    let limits = Limits {
        joint_jerk: arms.all_or_each(&jerk, f64::INFINITY)?,
        joint_velocity,
        joint_acceleration,
        joint_deceleration,
        linear_speed,
        angular_speed,
        position: position?,
    };
    check_ramps(&jerk, &limits, arms)?;
    Ok(limits)
}

/// Jerks that are given must bring the joints to their accelerations in time.
fn check_ramps(jerk: &List<f64>, limits: &Limits, arms: PerJoint<'_>) -> Result<(), ParameterError> {
    match (0..limits.joint_jerk.len()).find(|joint| limits.joint_jerk[*joint] < limits.jerk(*joint)) {
        Some(joint) => Err(jerk.invalid(
            limits.joint_jerk[joint],
            format!(
                "at least {} {}/s^3, which brings joint {} to its acceleration and deceleration in {RAMP_TIME} s",
                limits.jerk(joint),
                arms.unit(joint),
                joint + 1
            ),
        )),
        None => Ok(()),
    }
}

/// Decelerations that are given must stop the joints in time.
fn check_stops(deceleration: &List<f64>, velocity: &[f64], arms: PerJoint<'_>) -> Result<(), ParameterError> {
    let given = deceleration.items();
    match given.iter().zip(velocity).position(|(given, velocity)| given * STOP_TIME < *velocity) {
        Some(joint) => Err(deceleration.invalid(
            given[joint],
            format!(
                "at least {} {}/s^2, which stops joint {} from its velocity limit in {STOP_TIME} s",
                velocity[joint] / STOP_TIME,
                arms.unit(joint),
                joint + 1
            ),
        )),
        None => Ok(()),
    }
}

fn position_limits(p: &mut Declarer, arms: PerJoint<'_>) -> Result<PositionLimits, ParameterError> {
    let lower = p
        .doubles("limits.joint_position_lower", &[])
        .within(-bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE)
        .live("rad, m", "smallest joint positions, one a joint; empty: none");
    let upper = p
        .doubles("limits.joint_position_upper", &[])
        .within(-bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE)
        .live("rad, m", "largest joint positions, one a joint; empty: none");
    let margin = p
        .double("limits.position_margin", 0.1, 0.0..=3.0)
        .live("rad, m", "distance from a position limit inside which the joint is slowed");

    let limits = PositionLimits {
        lower: arms.each_or(&lower, f64::NEG_INFINITY)?,
        upper: arms.each_or(&upper, f64::INFINITY)?,
        margin,
    };
    for (joint, (lowest, highest)) in limits.lower.iter().zip(&limits.upper).enumerate() {
        check_range(&upper, Some((*lowest, *highest)), arms.unit(joint))?;
    }
    Ok(limits)
}

/// Fails where a joint's limits leave it no room; `upper` has the upper ones, in that unit.
pub(super) fn check_range(
    upper: &List<f64>,
    limits: Option<(f64, f64)>,
    unit: &str,
) -> Result<(), ParameterError> {
    match limits.filter(|(lower, upper)| lower >= upper) {
        Some((lowest, highest)) => {
            let expected = format!("a position above the joint's lower limit, {lowest} {unit}");
            Err(upper.invalid(highest, expected))
        }
        None => Ok(()),
    }
}
