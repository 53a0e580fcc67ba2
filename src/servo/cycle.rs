//! The cycle itself.

use super::{Figures, Goal, JointOrder, Motion, Rejection, RejectionCounts, Settings, State};
use crate::arm::{ArmError, ArmState, Chain};
use crate::control::{self, SignMemory};
use crate::dq::UnitDualQuaternion;
use nalgebra::Vector6;
use std::time::Duration;

/// A settled arm counts as tracking again when an error exceeds this multiple of its tolerance.
const UNSETTLE: f64 = 2.0;

/// The goal in force and the motion to it.
struct Pursuit {
    goal: Goal,
    received: Duration,
    /// Chosen when the pursuit begins, by where the arm is then.
    sign: Option<SignMemory>,
    motion: Option<Motion>,
}

/// What interrupts the pursuit of a goal.
#[derive(Clone, Copy, PartialEq)]
enum Interruption {
    None,
    Paused,
    Stopping,
}

/// What the servo did in its last cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// The state.
    pub state: State,
    /// Number of different goals taken since the start.
    pub goal_count: u64,
    /// The goal in force.
    pub goal: Option<Goal>,
    /// Whether the goal is farther from the base than the arm can reach.
    pub goal_beyond_reach: bool,
    /// The sign chosen for the goal's dual quaternion (+1 or −1).
    pub sign: f64,
    /// Figures of the motion to the goal.
    pub figures: Figures,
    /// The screw log of the pose error, `(ω, v)` [rad, m].
    pub pose_error: Vector6<f64>,
    /// The smallest singular value of the body Jacobian.
    pub smallest_singular_value: f64,
}

/// The servo: takes joint states, goals and settings as they come, and makes one command a cycle.
pub struct Servo {
    chain: Chain,
    joints: JointOrder,
    base_frame: String,
    settings: Settings,
    period: f64,
    positions: Vec<f64>,
    positions_received: Option<Duration>,
    arm: ArmState,
    ahead: ArmState,
    ahead_positions: Vec<f64>,
    pursuit: Option<Pursuit>,
    interruption: Interruption,
    target: Vec<f64>,
    ahead_target: Vec<f64>,
    command: Vec<f64>,
    status: Status,
    rejections: RejectionCounts,
}

impl Servo {
    /// A servo at rest that waits for its first joint state; one cycle a `period`.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] where the joint names or the limits do not fit the arm.
    pub fn new(
        chain: Chain,
        joints: JointOrder,
        base_frame: &str,
        settings: Settings,
        period: Duration,
    ) -> Result<Self, ArmError> {
        let expected = chain.joint_count();
        let counts = [
            joints.names().len(),
            settings.limits.joint_velocity.len(),
            settings.limits.joint_acceleration.len(),
        ];
        if let Some(got) = counts.into_iter().find(|count| *count != expected) {
            return Err(ArmError::JointCount { expected, got });
        }
        let zeros = vec![0.0; expected];
        Ok(Self {
            arm: ArmState::new(&chain),
            ahead: ArmState::new(&chain),
            chain,
            joints,
            base_frame: base_frame.to_owned(),
            settings,
            period: period.as_secs_f64(),
            positions: zeros.clone(),
            positions_received: None,
            ahead_positions: zeros.clone(),
            pursuit: None,
            interruption: Interruption::None,
            target: zeros.clone(),
            ahead_target: zeros.clone(),
            command: zeros,
            status: Status {
                state: State::WaitingForState,
                goal_count: 0,
                goal: None,
                goal_beyond_reach: false,
                sign: 1.0,
                figures: Figures::default(),
                pose_error: Vector6::zeros(),
                smallest_singular_value: 0.0,
            },
            rejections: RejectionCounts::default(),
        })
    }

    /// Takes a joint state received at `now`: names with positions \[rad\].
    ///
    /// # Errors
    /// The [`Rejection`], which is counted; the last good joint state stays in force.
    pub fn take_joint_state(
        &mut self,
        names: &[String],
        positions: &[f64],
        now: Duration,
    ) -> Result<(), Rejection> {
        let matched = self.joints.positions(names, positions, &mut self.positions);
        self.counted(matched)?;
        self.positions_received = Some(now);
        Ok(())
    }

    /// Takes a goal received at `now`: position \[m\], orientation (x, y, z, w), frame. The same goal again only counts as
    /// heard; another one begins a new motion.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted; the last good goal stays in force.
    pub fn take_goal(
        &mut self,
        position: [f64; 3],
        orientation_xyzw: [f64; 4],
        frame_id: &str,
        now: Duration,
    ) -> Result<(), Rejection> {
        let goal = self.counted(Goal::new(position, orientation_xyzw, frame_id, &self.base_frame))?;
        match &mut self.pursuit {
            Some(pursuit) if pursuit.goal == goal => pursuit.received = now,
            _ => {
                self.pursuit = Some(Pursuit { goal, received: now, sign: None, motion: None });
                self.status.goal_count += 1;
                let distance = goal.base_from_goal().translation().norm();
                self.status.goal_beyond_reach = distance > self.chain.reach();
            }
        }
        Ok(())
    }

    /// Counts a message that could not even be decoded.
    pub fn count_malformed(&mut self, rejection: &Rejection) {
        self.rejections.count(rejection);
    }

    /// Puts new settings into force from the next cycle on.
    pub fn configure(&mut self, settings: Settings) {
        self.settings = settings;
    }

    /// Decelerates and holds, or goes on from the measured state.
    pub fn pause(&mut self, paused: bool) {
        self.interruption = if paused { Interruption::Paused } else { Interruption::None };
    }

    /// Decelerates to rest and drops the goal.
    pub fn stop(&mut self) {
        self.pursuit = None;
        self.interruption = Interruption::Stopping;
    }

    /// Whether the last command was zero for every joint.
    pub fn at_rest(&self) -> bool {
        self.command.iter().all(|speed| *speed == 0.0)
    }

    /// The last joint velocity command [rad/s].
    pub fn command(&self) -> &[f64] {
        &self.command
    }

    /// What the last cycle did.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Messages rejected so far.
    pub fn rejections(&self) -> &RejectionCounts {
        &self.rejections
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The tool pose of the last joint state; none before the first.
    pub fn base_from_tool(&self) -> Option<UnitDualQuaternion> {
        self.positions_received.map(|_| self.arm.base_from_tool())
    }

    /// One cycle at time `now`: the next command, by what is known then.
    ///
    /// # Errors
    /// None in practice: the counts were checked when the servo was made.
    pub fn step(&mut self, now: Duration) -> Result<&[f64], ArmError> {
        self.chain.evaluate(&self.positions, &mut self.arm)?;
        let standing = self.reason_to_stand(now);
        self.target.fill(0.0);
        let errors = self.pursue(standing.is_none())?;
        let limits = &self.settings.limits;
        limits.approach(&mut self.command, &self.target, self.period);
        let errors_within = self.measure(now, errors);
        self.status.state = standing.unwrap_or(if errors_within { State::Settled } else { State::Tracking });
        self.status.goal = self.pursuit.as_ref().map(|pursuit| pursuit.goal);
        self.status.smallest_singular_value = self.arm.smallest_singular_value();
        if self.interruption == Interruption::Stopping && self.at_rest() {
            self.interruption = Interruption::None;
        }
        Ok(&self.command)
    }

    /// The state in which the arm must not be driven, if there is reason for one. The first reason that holds counts.
    fn reason_to_stand(&self, now: Duration) -> Option<State> {
        if self.interruption == Interruption::Stopping {
            return Some(State::Stopping);
        }
        let Some(received) = self.positions_received else { return Some(State::WaitingForState) };
        if now.saturating_sub(received) > self.settings.state_timeout {
            return Some(State::StaleState);
        }
        if self.interruption == Interruption::Paused {
            return Some(State::Paused);
        }
        let Some(pursuit) = &self.pursuit else { return Some(State::Holding) };
        match self.settings.goal_timeout {
            Some(timeout) if now.saturating_sub(pursuit.received) > timeout => Some(State::StaleGoal),
            _ => None,
        }
    }

    /// Sets the target velocities by the law where `driving`, and returns the errors (position \[m\], rotation \[rad\]).
    fn pursue(&mut self, driving: bool) -> Result<Option<(f64, f64)>, ArmError> {
        let (Some(pursuit), Some(_)) = (&mut self.pursuit, self.positions_received) else { return Ok(None) };
        let (base_from_goal, base_from_tool) = (pursuit.goal.base_from_goal(), self.arm.base_from_tool());
        let sign = pursuit.sign.get_or_insert_with(|| SignMemory::nearest(base_from_goal, &base_from_tool));
        let goal = sign.apply(base_from_goal, &base_from_tool, self.settings.sign_hysteresis);
        self.status.sign = sign.sign();
        let goal_from_tool = control::pose_error(&self.arm, &goal);
        self.status.pose_error = goal_from_tool.screw_log();
        if driving {
            self.drive_towards(&goal)?;
        }
        let rotation_error = self.status.pose_error.fixed_rows::<3>(0).norm();
        Ok(Some((goal_from_tool.translation().norm(), rotation_error)))
    }

    /// The law's velocities within all speed limits, slowed where following them would take too much acceleration.
    fn drive_towards(&mut self, goal: &UnitDualQuaternion) -> Result<(), ArmError> {
        let Settings { controller, limits, .. } = &self.settings;
        controller.joint_velocity(&self.arm, goal, &mut self.target);
        limits.limit_speed(&self.arm, &mut self.target);
        for ((ahead, position), speed) in
            self.ahead_positions.iter_mut().zip(&self.positions).zip(&self.target)
        {
            *ahead = position + self.period * speed;
        }
        self.chain.evaluate(&self.ahead_positions, &mut self.ahead)?;
        controller.joint_velocity(&self.ahead, goal, &mut self.ahead_target);
        limits.limit_speed(&self.ahead, &mut self.ahead_target);
        for (ahead, speed) in self.ahead_target.iter_mut().zip(&self.target) {
            *ahead -= speed;
        }
        limits.limit_demanded_acceleration(&mut self.target, &self.ahead_target, self.period);
        Ok(())
    }

    /// Adds this cycle to the motion's figures; true where the errors are within the tolerances.
    fn measure(&mut self, now: Duration, errors: Option<(f64, f64)>) -> bool {
        let (Some(pursuit), Some((position, rotation))) = (&mut self.pursuit, errors) else { return false };
        let (point, tolerance) = (self.arm.tool_point(), self.settings.goal_tolerance);
        let motion =
            pursuit.motion.get_or_insert_with(|| Motion::begin(now, point, position, rotation, &tolerance));
        let joint_speed = self.command.iter().fold(0.0_f64, |max, speed| max.max(speed.abs()));
        motion.update(now, point, position, rotation, joint_speed);
        let slack = if self.status.state == State::Settled { UNSETTLE } else { 1.0 };
        let within = position <= slack * tolerance.linear && rotation <= slack * tolerance.angular;
        if within {
            motion.arrived();
        }
        self.status.figures = motion.figures();
        within
    }

    fn counted<T>(&mut self, result: Result<T, Rejection>) -> Result<T, Rejection> {
        result.inspect_err(|rejection| self.rejections.count(rejection))
    }
}
