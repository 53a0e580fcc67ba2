#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod realism;

pub use realism::{Measured, Realism};

use realism::Sensor;
use std::collections::VecDeque;
use std::time::Duration;
use thiserror::Error;

/// The reason why the plant rejects a command.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CommandError {
    /// The number of values differs from the number of joints.
    #[error("a command of {got} numbers, expected {expected}: one per joint")]
    WrongLength {
        /// Number of joints.
        expected: usize,
        /// Number of values in the command.
        got: usize,
    },
    /// A number is infinite or NaN.
    #[error("{value} for joint {joint}: expected a finite number")]
    NonFinite {
        /// The joint, counted from 1.
        joint: usize,
        /// The number.
        value: f64,
    },
}

/// A simulated arm. Its joints follow commands at once, except for the latency and the time constant of its [`Realism`].
///
/// An arm that follows velocity commands stops if no new command arrives within its command timeout. An arm that follows position
/// commands stops at the commanded positions.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    initial_positions: Vec<f64>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    command: Vec<f64>,
    commanded: Option<Duration>,
    target: Option<Target>,
    realism: Realism,
    /// The commands that have not taken effect yet, each with the time at which it takes effect.
    under_way: VecDeque<(Duration, Command)>,
    sensor: Sensor,
    /// The time of the last step; `None` before the first step.
    moved: Option<Duration>,
    /// The arm ignores position commands that it receives before this time.
    deaf_until: Duration,
    command_timeout: Duration,
}

/// An upper bound for the reaction time of a controller. The reaction time begins when the controller receives a joint state, and
/// ends when the plant receives the command that depends on this joint state.
const REACTION: Duration = Duration::from_millis(100);

/// A valid command.
#[derive(Clone, Debug, PartialEq)]
enum Command {
    Velocities(Vec<f64>),
    Positions(Target),
}

/// The positions that the joints should reach, and the time at which they should reach them.
#[derive(Clone, Debug, PartialEq)]
struct Target {
    positions: Vec<f64>,
    at: Duration,
}

impl Plant {
    /// Creates an arm at rest at `initial_positions` \[rad, prismatic: m\]. A velocity command older than `command_timeout` counts
    /// as zero.
    pub fn new(initial_positions: Vec<f64>, command_timeout: Duration) -> Self {
        let zeros = vec![0.0; initial_positions.len()];
        Self {
            positions: initial_positions.clone(),
            initial_positions,
            velocities: zeros.clone(),
            command: zeros,
            commanded: None,
            target: None,
            realism: Realism::default(),
            under_way: VecDeque::new(),
            sensor: Sensor::default(),
            moved: None,
            deaf_until: Duration::ZERO,
            command_timeout,
        }
    }

    /// Takes joint velocities [rad/s, prismatic: m/s] received at `now`.
    ///
    /// # Errors
    /// [`CommandError`] if the command is invalid. The previous command then stays in force until its timeout.
    pub fn take_command(&mut self, velocities: &[f64], now: Duration) -> Result<(), CommandError> {
        self.check(velocities)?;
        self.send(now + self.realism.command_latency, Command::Velocities(velocities.to_vec()));
        Ok(())
    }

    /// Queues a command that takes effect at `at`. Discards queued commands that would take effect later than this one, as happens
    /// if the latency has become shorter.
    fn send(&mut self, at: Duration, command: Command) {
        self.under_way.retain(|(before, _)| *before <= at);
        self.under_way.push_back((at, command));
    }

    /// Takes joint positions \[rad, prismatic: m\] received at `now`. The arm moves there at constant speed, and arrives `time` after
    /// the command takes effect.
    ///
    /// # Errors
    /// [`CommandError`] if the command is invalid. The arm then continues to the positions of the previous command.
    pub fn take_positions(
        &mut self,
        positions: &[f64],
        now: Duration,
        time: Duration,
    ) -> Result<(), CommandError> {
        self.check(positions)?;
        if now < self.deaf_until {
            return Ok(());
        }
        let begin = now + self.realism.command_latency;
        let target = Target { positions: positions.to_vec(), at: begin.saturating_add(time) };
        self.send(begin, Command::Positions(target));
        Ok(())
    }

    /// Applies the queued commands that take effect at or before `now`.
    fn obey(&mut self, now: Duration) {
        while let Some((at, _)) = self.under_way.front().filter(|(at, _)| *at <= now) {
            let at = *at;
            match self.under_way.pop_front() {
                Some((_, Command::Velocities(velocities))) => {
                    (self.command, self.commanded) = (velocities, Some(at));
                }
                Some((_, Command::Positions(target))) => self.target = Some(target),
                None => {}
            }
        }
    }

    fn check(&self, numbers: &[f64]) -> Result<(), CommandError> {
        let expected = self.command.len();
        if numbers.len() != expected {
            return Err(CommandError::WrongLength { expected, got: numbers.len() });
        }
        match numbers.iter().position(|value| !value.is_finite()) {
            Some(i) => Err(CommandError::NonFinite { joint: i + 1, value: numbers[i] }),
            None => Ok(()),
        }
    }

    /// Moves the arm for the time since the previous step. An arm that follows velocity commands moves for at most its command
    /// timeout in one step, so that the arm does not travel during a long pause of the whole simulation.
    pub fn step(&mut self, now: Duration) {
        self.obey(now);
        let fresh = self.commanded.is_some_and(|at| now.saturating_sub(at) <= self.command_timeout);
        let passed = self.moved.map_or(Duration::ZERO, |moved| now.saturating_sub(moved));
        if let Some(target) = self.target.take() {
            self.approach(target, now, passed);
            self.moved = Some(now);
            return;
        }
        let passed = passed.min(self.command_timeout).as_secs_f64();
        let time_constant = self.realism.velocity_time_constant.as_secs_f64();
        for (i, velocity) in self.velocities.iter_mut().enumerate() {
            let wanted = if fresh { self.command[i] } else { 0.0 };
            if time_constant > 0.0 {
                // v′ = (u − v)/τ, solved over the time since the previous step.
                let (lag, decay) = (*velocity - wanted, (-passed / time_constant).exp());
                self.positions[i] += wanted * passed + lag * time_constant * (1.0 - decay);
                *velocity = wanted + lag * decay;
            } else {
                *velocity = wanted;
                self.positions[i] += *velocity * passed;
            }
        }
        self.moved = Some(now);
    }

    /// Moves the joints toward `target` at constant speed, so that they arrive at the target's time. `passed` is the time since the
    /// previous step.
    fn approach(&mut self, target: Target, now: Duration, passed: Duration) {
        let left = target.at.saturating_sub(now);
        let part = if left.is_zero() { 1.0 } else { passed.as_secs_f64() / (passed + left).as_secs_f64() };
        let rate = if passed.is_zero() { 0.0 } else { 1.0 / passed.as_secs_f64() };
        let joints = self.positions.iter_mut().zip(&mut self.velocities).zip(&target.positions);
        for ((position, velocity), wanted) in joints {
            let way = part * (wanted - *position);
            *position = if left.is_zero() { *wanted } else { *position + way };
            *velocity = rate * way;
        }
        // If the arm has arrived, drop the target. The next step then sets the velocities to zero.
        self.target = (!left.is_zero()).then_some(target);
    }

    /// Returns the arm to its initial positions, at rest. Then ignores position commands until a controller can have seen the
    /// reset. Otherwise a servo at rest, which repeats its last positions, would move the arm back.
    pub fn reset(&mut self) {
        let now = self.moved.unwrap_or_default();
        self.deaf_until = now + self.realism.state_interval + self.realism.state_latency + REACTION;
        self.target = None;
        self.under_way.clear();
        self.sensor.clear();
        self.positions.copy_from_slice(&self.initial_positions);
        self.velocities.fill(0.0);
        self.commanded = None;
    }

    /// Returns the joint positions \[rad, prismatic: m\].
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// Returns the joint velocities [rad/s, prismatic: m/s].
    pub fn velocities(&self) -> &[f64] {
        &self.velocities
    }

    /// Returns the newest joint state that the robot publishes at `now`; `None` if it publishes none. `noise` returns random
    /// numbers from −1 to 1.
    pub fn measure(&mut self, now: Duration, noise: impl FnMut() -> f64) -> Option<Measured> {
        self.sensor.measure(now, &self.realism, (&self.positions, &self.velocities), noise)
    }

    /// Sets how the arm differs from an ideal arm, from now on.
    pub fn set_realism(&mut self, realism: Realism) {
        self.realism = realism;
    }

    /// Changes the age from which a velocity command counts as zero.
    pub fn set_command_timeout(&mut self, command_timeout: Duration) {
        self.command_timeout = command_timeout;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(2);

    /// Returns a plant that is at rest at time 0.
    fn plant() -> Plant {
        let mut plant = Plant::new(vec![1.0, 2.0], Duration::from_millis(100));
        plant.step(Duration::ZERO);
        plant
    }

    #[test]
    fn integrates_a_fresh_command() {
        let mut plant = plant();
        for cycle in 1..=50 {
            plant.take_command(&[1.0, -2.0], PERIOD * cycle).unwrap();
            plant.step(PERIOD * cycle);
        }
        assert!((plant.positions()[0] - 1.1).abs() < 1e-12 && (plant.positions()[1] - 1.8).abs() < 1e-12);
    }

    #[test]
    fn late_steps_move_as_far_as_punctual_ones_up_to_the_command_timeout() {
        let ms = Duration::from_millis;
        let mut late = plant();
        for time in [2, 15, 16, 40] {
            late.take_command(&[1.0, 0.0], ms(time)).unwrap();
            late.step(ms(time));
        }
        assert!((late.positions()[0] - 1.04).abs() < 1e-12);
        late.take_command(&[1.0, 0.0], ms(5000)).unwrap();
        late.step(ms(5000));
        assert!((late.positions()[0] - 1.14).abs() < 1e-12);
    }

    #[test]
    fn stops_after_the_command_timeout() {
        let mut plant = plant();
        plant.take_command(&[1.0, 1.0], Duration::ZERO).unwrap();
        plant.step(Duration::from_millis(100));
        assert_eq!(plant.velocities(), [1.0, 1.0]);
        let before = plant.positions().to_vec();
        plant.step(Duration::from_millis(101));
        assert_eq!(plant.velocities(), [0.0, 0.0]);
        assert_eq!(plant.positions(), before);
    }

    #[test]
    fn positions_are_reached_at_once_or_at_constant_speed_within_their_time() {
        let mut plant = plant();
        let ms = Duration::from_millis;
        plant.take_positions(&[1.01, 2.0], ms(2), ms(0)).unwrap();
        plant.step(ms(2));
        assert_eq!(plant.positions(), [1.01, 2.0]);
        assert!((plant.velocities()[0] - 5.0).abs() < 1e-9, "by the way that it went");
        plant.step(ms(4));
        assert_eq!((plant.positions()[0], plant.velocities()[0]), (1.01, 0.0));
        plant.take_positions(&[1.05, 2.0], ms(4), ms(10)).unwrap();
        for (time, expected) in [(6, 1.018), (8, 1.026), (14, 1.05), (16, 1.05)] {
            plant.step(ms(time));
            assert!((plant.positions()[0] - expected).abs() < 1e-12, "{time} ms: {:?}", plant.positions());
        }
        assert_eq!(plant.velocities(), [0.0, 0.0]);
        assert!(plant.take_positions(&[f64::INFINITY, 0.0], ms(20), ms(0)).is_err());
    }

    #[test]
    fn commands_take_effect_after_the_latency_and_velocities_follow_with_first_order_lag() {
        let ms = Duration::from_millis;
        let mut plant = plant();
        plant.set_realism(Realism { command_latency: ms(20), ..Realism::default() });
        for time in (2..=40).step_by(2) {
            plant.take_command(&[1.0, 0.0], ms(time)).unwrap();
            plant.step(ms(time));
        }
        // The command takes effect from 22 ms on. The step that ends at that time is included.
        assert!((plant.positions()[0] - 1.02).abs() < 1e-12, "{:?}", plant.positions());
        let mut plant = self::plant();
        plant.set_realism(Realism { velocity_time_constant: ms(50), ..Realism::default() });
        for time in (2..=100).step_by(2) {
            plant.take_command(&[1.0, 0.0], ms(time)).unwrap();
            plant.step(ms(time));
        }
        let (gone, speed) = (plant.positions()[0] - 1.0, plant.velocities()[0]);
        assert!((speed - (1.0 - (-2.0_f64).exp())).abs() < 1e-12, "1 − exp(−t/τ): {speed}");
        assert!(
            (gone - (0.1 - 0.05 * (1.0 - (-2.0_f64).exp()))).abs() < 1e-12,
            "t − τ (1 − exp(−t/τ)): {gone}"
        );
    }

    #[test]
    fn overtaken_commands_do_not_delay_later_ones() {
        let ms = Duration::from_millis;
        let mut plant = plant();
        plant.set_realism(Realism { command_latency: ms(1000), ..Realism::default() });
        plant.take_command(&[-1.0, 0.0], ms(2)).unwrap();
        plant.step(ms(2));
        plant.set_realism(Realism { command_latency: ms(10), ..Realism::default() });
        for time in (4..=1100).step_by(2) {
            plant.take_command(&[1.0, 0.0], ms(time)).unwrap();
            plant.step(ms(time));
            assert_eq!(plant.velocities()[0], if time < 14 { 0.0 } else { 1.0 }, "{time} ms");
        }
    }

    #[test]
    fn invalid_commands_are_refused_and_change_nothing() {
        let mut plant = plant();
        let untouched = plant.clone();
        let wrong = CommandError::WrongLength { expected: 2, got: 3 };
        assert_eq!(plant.take_command(&[0.0; 3], PERIOD), Err(wrong));
        assert!(plant.take_command(&[0.0, f64::NAN], PERIOD).is_err());
        assert_eq!(plant, untouched);
    }

    #[test]
    fn reset_returns_to_the_initial_positions_at_rest() {
        let mut plant = plant();
        plant.take_command(&[1.0, 1.0], PERIOD).unwrap();
        plant.step(PERIOD);
        plant.reset();
        plant.step(2 * PERIOD);
        assert_eq!((plant.positions(), plant.velocities()), (&[1.0, 2.0][..], &[0.0; 2][..]));
    }

    #[test]
    fn positions_apply_again_once_a_reset_can_have_been_seen() {
        let ms = Duration::from_millis;
        let mut plant = plant();
        plant.take_positions(&[2.0, 2.0], ms(2), Duration::ZERO).unwrap();
        plant.step(ms(4));
        plant.reset();
        for (time, expected) in [(50, [1.0, 2.0]), (150, [3.0, 2.0])] {
            plant.take_positions(&[3.0, 2.0], ms(time), Duration::ZERO).unwrap();
            plant.step(ms(time + 2));
            assert_eq!(plant.positions(), expected, "{time} ms");
        }
    }
}
