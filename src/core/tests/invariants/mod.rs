//! Checks the rules that every stream of commands must keep.
//!
//! These checks are independent of the code with which the servo keeps its limits.

mod slowing;

use dq_kinematics::arm::ToolSpeed;
use dq_limits::{Limits, STOP_TIME, Violation};
use slowing::{Slowing, rounded};
use std::time::Duration;

/// How far a joint may pass a position limit, because joint states are some cycles old \[rad, prismatic: m\].
const POSITION_TOLERANCE: f64 = 1e-3;

/// The fraction by which a tool may exceed its speed limits, because the arm's positions are some cycles old.
const TOOL_TOLERANCE: f64 = 0.1;

/// An additional amount by which a tool may exceed its speed limits [m/s, rad/s]. The motions of several joints may cancel each
/// other at the tool. One cycle later, while the joints slow down, they no longer cancel exactly.
const TOOL_SLACK: f64 = 1e-4;

/// Checks a stream of commands and of joint positions against the rules.
#[derive(Clone, Debug)]
pub struct Invariants {
    limits: Limits,
    period: Duration,
    last: Option<Command>,
    /// Until this time the tool may exceed its speed limits, either because the limits were lowered or because the arm stops. In a
    /// stop each joint brakes independently, so that the tool leaves its path.
    tool_excused_until: Duration,
    /// How far each joint is allowed to be beyond its position limits \[rad, prismatic: m\]; `None` before the first check of
    /// positions.
    beyond: Option<Vec<f64>>,
}

/// A command that was checked.
#[derive(Clone, Debug)]
struct Command {
    time: Duration,
    speeds: Vec<f64>,
    standing: bool,
    /// The largest deceleration limit of each joint since the joint last stood [rad/s², prismatic: m/s²]. The next command may use this
    /// deceleration, even if the limit is lower now.
    decelerations: Vec<f64>,
    /// The largest jerk limit of each joint since the joint last stood [rad/s³, prismatic: m/s³]. The next command may use this jerk.
    jerks: Vec<f64>,
    /// The change of each joint's speed by this command [rad/s, prismatic: m/s]; `None` for the first command.
    steps: Option<Vec<f64>>,
}

impl Invariants {
    /// Creates the checks for commands that are sent once per `period` under `limits`. The checks know no earlier command.
    pub fn new(limits: Limits, period: Duration) -> Self {
        Self { limits, period, last: None, tool_excused_until: Duration::ZERO, beyond: None }
    }

    /// Applies other limits, after a change of parameters. A joint that is faster than a lowered velocity limit may slow down to the
    /// limit at its deceleration limit.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
        self.excuse_tool();
        // After the limits were narrowed, joints may be outside without having moved.
        self.beyond = None;
    }

    /// Notes that the robot has appeared and may be moving. The next command may begin at the robot's speed.
    pub fn robot_came(&mut self) {
        self.last = None;
    }

    fn excuse_tool(&mut self) {
        let now = self.last.as_ref().map_or(Duration::ZERO, |last| last.time);
        self.tool_excused_until = now + Duration::from_secs_f64(STOP_TIME) + 2 * self.period;
    }

    /// Checks the joint velocities `command` [rad/s, prismatic: m/s], sent at `time`. `standing` is true if the arm must come to
    /// rest, for example because it is paused. If more than 1.5 periods have passed since the last command, commands were lost. Each joint
    /// may then change its speed for the whole elapsed time. Under a jerk limit, the check then accepts any speeds.
    ///
    /// # Errors
    /// The first [`Violation`] found. The next call compares its command with this `command` even after an error, unless a number was
    /// invalid.
    pub fn check(&mut self, time: Duration, command: &[f64], standing: bool) -> Result<(), Violation> {
        self.check_numbers(command)?;
        let last = self.last.take();
        let result = command.iter().enumerate().try_for_each(|(joint, speed)| match &last {
            Some(last) => self.check_joint(joint, *speed, last, time, standing),
            None => self.check_speed(joint, *speed, self.limits.joint_velocity[joint]),
        });
        let (decelerations, jerks) =
            (0..command.len()).map(|joint| self.latched(joint, last.as_ref())).unzip();
        let steps = last.map(|last| command.iter().zip(&last.speeds).map(|(now, last)| now - last).collect());
        self.last = Some(Command { time, speeds: command.to_vec(), standing, decelerations, jerks, steps });
        if standing && command.iter().any(|speed| *speed != 0.0) {
            self.excuse_tool();
        }
        result
    }

    /// Checks the speed limits of the tools. `tool` is the speed of the fastest tool under the last command, at the present joint
    /// positions. Does not check them while the arms must stand, nor in the second after a stop or a change of limits.
    ///
    /// # Errors
    /// [`Violation::ToolSpeed`] if a tool is too fast.
    pub fn check_tool(&self, tool: &ToolSpeed) -> Result<(), Violation> {
        let excused = |last: &Command| last.standing || last.time <= self.tool_excused_until;
        if self.last.as_ref().is_none_or(excused) {
            return Ok(());
        }
        let limits = &self.limits;
        let speeds =
            [(tool.linear, limits.linear_speed, "m/s"), (tool.angular, limits.angular_speed, "rad/s")];
        let too_fast = |(speed, limit, _): &(f64, f64, _)| {
            speed.is_nan() || *speed > limit * (1.0 + TOOL_TOLERANCE) + TOOL_SLACK
        };
        match speeds.into_iter().find(too_fast) {
            Some((speed, limit, unit)) => Err(Violation::ToolSpeed { speed, limit, unit }),
            None => Ok(()),
        }
    }

    /// Checks joint positions \[rad, prismatic: m\], in the order of the commands. A joint that is outside its limits at the first
    /// check may stay outside and come back, but must not move farther out.
    ///
    /// # Errors
    /// The first [`Violation`] found.
    pub fn check_positions(&mut self, positions: &[f64]) -> Result<(), Violation> {
        self.check_numbers(positions)?;
        let limits = &self.limits.position;
        let bounds = limits.lower.iter().zip(&limits.upper);
        let beyond: Vec<_> = positions
            .iter()
            .zip(bounds)
            .map(|(position, (lower, upper))| (lower - position).max(position - upper).max(0.0))
            .collect();
        let worst = self.beyond.get_or_insert_with(|| beyond.clone());
        for (joint, (now, worst)) in beyond.iter().zip(worst).enumerate() {
            let further = *now > *worst + POSITION_TOLERANCE;
            // A joint that has come back must then stay inside.
            *worst = if further { *now } else { worst.min(*now) };
            if further {
                return Err(Violation::Position {
                    joint: joint + 1,
                    position: positions[joint],
                    beyond: *now,
                });
            }
        }
        Ok(())
    }

    fn check_numbers(&self, numbers: &[f64]) -> Result<(), Violation> {
        let expected = self.limits.joint_velocity.len();
        if numbers.len() != expected {
            return Err(Violation::WrongLength { expected, got: numbers.len() });
        }
        match numbers.iter().position(|number| !number.is_finite()) {
            Some(joint) => Err(Violation::NonFinite { joint: joint + 1, value: numbers[joint] }),
            None => Ok(()),
        }
    }

    fn check_joint(
        &self,
        joint: usize,
        speed: f64,
        last: &Command,
        time: Duration,
        standing: bool,
    ) -> Result<(), Violation> {
        let (before, (latched, jerk)) = (last.speeds[joint], self.latched(joint, Some(last)));
        let elapsed = time.saturating_sub(last.time).max(self.period).as_secs_f64();
        let period = self.period.as_secs_f64();
        let jerk = jerk * period * period;
        if jerk.is_finite() {
            return match &last.steps {
                Some(steps) if elapsed <= 1.5 * period => {
                    let most = latched * period;
                    let change = Slowing { step: speed - before, before: steps[joint], most, jerk };
                    self.check_jerk(joint, speed, before, &change, standing)
                }
                _ => Ok(()),
            };
        }
        // A joint above a lowered limit must slow down by its deceleration.
        let slower = (before.abs() - self.limits.deceleration(joint) * period).max(0.0);
        self.check_speed(joint, speed, self.limits.joint_velocity[joint].max(slower))?;
        let goes_on = speed * before >= 0.0 && speed.abs() <= before.abs();
        let acceleration = self.limits.joint_acceleration[joint];
        let (step, joint) = ((speed - before).abs(), joint + 1);
        // If commands were lost, some of them may have slowed the joint down, and others not.
        let most = if goes_on || elapsed > 1.5 * period { acceleration.max(latched) } else { acceleration };
        if step > rounded(most * elapsed, before) {
            return Err(Violation::Acceleration { joint, step, limit: most * elapsed });
        }
        if standing && !(goes_on && speed.abs() <= rounded(slower, before)) {
            return Err(Violation::NotStanding { joint, speed, before });
        }
        Ok(())
    }

    /// Checks whether joint number `joint`, which has a jerk limit, may change its speed from `before` to `speed` [rad/s, prismatic:
    /// m/s]. `change` contains this change of speed and the previous one.
    fn check_jerk(
        &self,
        joint: usize,
        speed: f64,
        before: f64,
        change: &Slowing,
        standing: bool,
    ) -> Result<(), Violation> {
        let Slowing { step, before: last, most, jerk } = *change;
        let number = joint + 1;
        if (step - last).abs() > rounded(jerk, 4.0 * before) {
            return Err(Violation::Jerk { joint: number, change: (step - last).abs(), limit: jerk });
        }
        let goes_on = speed * before >= 0.0 && speed.abs() <= before.abs();
        let faster = self.limits.joint_acceleration[joint] * self.period.as_secs_f64();
        let limit = if goes_on { faster.max(most) } else { faster };
        // A joint above a lowered limit slows down to the limit as fast as the jerk allows.
        if step.abs() > rounded(limit, before) && step.abs() > rounded(last.abs() - jerk, 4.0 * before) {
            return Err(Violation::Acceleration { joint: number, step: step.abs(), limit });
        }
        let slows = if before == 0.0 { last.signum() } else { -before.signum() };
        let slowing = Slowing { step: slows * step, before: slows * last, most, jerk };
        let velocity = self.limits.joint_velocity[joint];
        if speed.abs() > rounded(velocity, velocity) && !slowing.is_enough_for(before.abs() - velocity) {
            return Err(Violation::Velocity { joint: number, speed, limit: velocity });
        }
        match standing && !(slowing.is_enough_for(before.abs()) && slowing.ends_at(before.abs())) {
            true => Err(Violation::NotStanding { joint: number, speed, before }),
            false => Ok(()),
        }
    }

    fn check_speed(&self, joint: usize, speed: f64, limit: f64) -> Result<(), Violation> {
        match speed.abs() > rounded(limit, limit) {
            true => Err(Violation::Velocity { joint: joint + 1, speed, limit }),
            false => Ok(()),
        }
    }

    /// Returns the largest deceleration limit [rad/s², prismatic: m/s²] and the largest jerk limit [rad/s³, prismatic: m/s³] since the
    /// joint was last at rest. A joint is at rest when two successive commands to it have speed 0.
    fn latched(&self, joint: usize, last: Option<&Command>) -> (f64, f64) {
        let stands = |last: &&Command| {
            last.speeds[joint] == 0.0 && last.steps.as_ref().is_none_or(|steps| steps[joint] == 0.0)
        };
        let moves = last.filter(|last| !stands(last));
        let (deceleration, jerk) =
            moves.map_or((0.0, 0.0), |last| (last.decelerations[joint], last.jerks[joint]));
        (deceleration.max(self.limits.deceleration(joint)), jerk.max(self.limits.jerk(joint)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_limits::PositionLimits;

    const PERIOD: Duration = Duration::from_millis(2);

    /// Returns the [`Invariants`] of one joint whose last command was 0.5 rad/s. The joint's limits are a speed of 1 rad/s, an
    /// acceleration of 10 rad/s², a deceleration of 20 rad/s², and positions from −1 to 1 rad. The tool's limits are 1 m/s and 1 rad/s.
    fn moving() -> Invariants {
        let limits = Limits {
            joint_velocity: vec![1.0],
            joint_acceleration: vec![10.0],
            joint_deceleration: vec![20.0],
            joint_jerk: vec![f64::INFINITY],
            linear_speed: 1.0,
            angular_speed: 1.0,
            position: PositionLimits { lower: vec![-1.0], upper: vec![1.0], margin: 0.1 },
        };
        let mut invariants = Invariants::new(limits, PERIOD);
        invariants.check(PERIOD, &[0.5], false).unwrap();
        invariants
    }

    #[test]
    fn each_violation_is_found() {
        let check = |time: u32, command: &[f64], standing| moving().check(PERIOD * time, command, standing);
        assert_eq!(check(2, &[0.52], false), Ok(()));
        assert!(matches!(check(2, &[0.53], false), Err(Violation::Acceleration { joint: 1, .. })));
        assert_eq!(check(2, &[0.46], false), Ok(()));
        assert!(matches!(check(2, &[0.45], false), Err(Violation::Acceleration { joint: 1, .. })));
        assert_eq!(check(3, &[0.53], false), Ok(()), "a command was lost between");
        assert!(matches!(check(2, &[f64::NAN], false), Err(Violation::NonFinite { joint: 1, .. })));
        assert_eq!(check(2, &[0.5; 2], false), Err(Violation::WrongLength { expected: 1, got: 2 }));
        assert!(matches!(check(1000, &[1.01], false), Err(Violation::Velocity { joint: 1, .. })));
    }

    #[test]
    fn standing_means_slowing_down_by_the_deceleration_to_rest() {
        let not_standing = |speed| Err(Violation::NotStanding { joint: 1, speed, before: 0.5 });
        for speed in [0.5, 0.47] {
            assert_eq!(moving().check(PERIOD * 2, &[speed], true), not_standing(speed));
        }
        let mut invariants = moving();
        let mut speed = 0.5;
        for cycle in 2..20 {
            speed = f64::max(speed - 0.04, 0.0);
            assert_eq!(invariants.check(PERIOD * cycle, &[speed], true), Ok(()), "{cycle}");
        }
        let again = Violation::NotStanding { joint: 1, speed: 1e-9, before: 0.0 };
        assert_eq!(invariants.check(PERIOD * 20, &[1e-9], true), Err(again));
    }

    /// Returns the [`Invariants`] of [`moving`] with a jerk limit of 500 rad/s³. With this limit, two successive changes of the joint's
    /// speed may differ by at most 0.002 rad/s. The last two commands were 0.002 and 0.006 rad/s, after a standstill.
    fn eased() -> Invariants {
        let mut invariants = moving();
        invariants.set_limits(Limits { joint_jerk: vec![500.0], ..invariants.limits.clone() });
        for (cycle, speed) in [(500, 0.0), (501, 0.0), (502, 0.002), (503, 0.006)] {
            invariants.check(PERIOD * cycle, &[speed], false).unwrap();
        }
        invariants
    }

    #[test]
    fn a_step_changes_by_at_most_the_jerk_limit() {
        let check = |speed, standing| eased().check(PERIOD * 504, &[speed], standing);
        assert_eq!((check(0.008, false), check(0.012, false)), (Ok(()), Ok(())));
        for speed in [0.0079, 0.0121, 0.006] {
            assert!(matches!(check(speed, false), Err(Violation::Jerk { joint: 1, .. })), "{speed}");
        }
        assert_eq!(check(0.008, true), Ok(()));
        assert!(matches!(check(0.009, true), Err(Violation::NotStanding { joint: 1, .. })));
    }

    #[test]
    fn a_stop_with_limited_jerk_is_as_short_as_possible() {
        let stop = |speeds: &[f64]| {
            let mut invariants = eased();
            let commands = speeds.iter().zip(504..);
            let mut checks =
                commands.map(|(speed, cycle)| invariants.check(PERIOD * cycle, &[*speed], true).is_ok());
            checks.position(|is_ok| !is_ok)
        };
        assert_eq!(stop(&[0.008, 0.008, 0.006, 0.002, 0.0, 0.0]), None);
        assert_eq!(stop(&[0.008, 0.008, 0.0065]), Some(2), "too slowly");
        assert_eq!(stop(&[0.008, 0.008, 0.006, 0.002, -0.004]), Some(4), "past 0");
    }

    #[test]
    fn a_joint_may_come_down_to_a_lowered_limit() {
        let lowered = || {
            let mut invariants = moving();
            let lower = Limits { joint_velocity: vec![0.1], ..invariants.limits.clone() };
            invariants.set_limits(lower);
            invariants
        };
        assert_eq!(lowered().check(PERIOD * 2, &[0.46], false), Ok(()));
        let stays = lowered().check(PERIOD * 2, &[0.5], false);
        assert_eq!(stays, Err(Violation::Velocity { joint: 1, speed: 0.5, limit: 0.46 }));
    }

    #[test]
    fn a_deceleration_lowered_in_motion_still_counts_for_the_moving_joint() {
        let mut invariants = moving();
        let lower = Limits {
            joint_deceleration: vec![1.0],
            joint_acceleration: vec![1.0],
            ..invariants.limits.clone()
        };
        invariants.set_limits(lower);
        assert_eq!(invariants.check(PERIOD * 2, &[0.46], true), Ok(()));
        assert_eq!(invariants.check(PERIOD * 25, &[0.0], false), Ok(()));
        assert!(matches!(invariants.check(PERIOD * 26, &[0.04], false), Err(Violation::Acceleration { .. })));
    }

    #[test]
    fn a_tool_keeps_its_limits_except_during_a_stop_after_they_were_lowered() {
        let fast = ToolSpeed { linear: 1.2, angular: 0.5 };
        let mut invariants = moving();
        let too_fast = Err(Violation::ToolSpeed { speed: 1.2, limit: 1.0, unit: "m/s" });
        assert_eq!(invariants.check_tool(&fast), too_fast);
        assert!(invariants.check_tool(&ToolSpeed { linear: 0.5, angular: f64::NAN }).is_err());
        invariants.set_limits(invariants.limits.clone());
        assert_eq!(invariants.check_tool(&fast), Ok(()));
        invariants.check(PERIOD * 510, &[0.5], false).unwrap();
        assert_eq!(invariants.check_tool(&fast), too_fast);
    }

    #[test]
    fn a_joint_found_outside_may_come_back_but_not_move_farther_out() {
        let mut invariants = moving();
        assert_eq!(invariants.check_positions(&[-1.5]), Ok(()));
        assert_eq!(invariants.check_positions(&[-1.2]), Ok(()));
        let on = Violation::Position { joint: 1, position: -1.6, beyond: 0.6000000000000001 };
        assert_eq!(invariants.check_positions(&[-1.6]), Err(on));
        let mut inside = moving();
        assert_eq!(inside.check_positions(&[0.9]), Ok(()));
        assert_eq!(inside.check_positions(&[1.0005]), Ok(()));
        assert!(inside.check_positions(&[1.002]).is_err());
    }
}
