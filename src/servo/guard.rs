//! What watches the commands to an arm from outside the servo, and stops the arm when they cease in motion: most controllers have no
//! timeout of their own, and go on at the last velocity for ever.

use super::Interface;
use crate::control::named;
use std::time::Duration;

/// A joint that takes positions is elsewhere that is measured this far from where it was sent \[rad, prismatic: m\], as the servo's
/// `following_error` is by default.
const ELSEWHERE: f64 = 0.2;

/// The arm is commanded to stand for so long: one command that arrives is enough, and whoever comes next is not disturbed.
const STOPPING: Duration = Duration::from_secs(1);

named! {
    /// Whether an arm has a guard, as its servo sees it.
    "guard" GuardState {
        /// There was none.
        None = "none",
        /// There is one.
        Watching = "watching",
        /// There was one: nobody would stop the arm if the servo were killed.
        Gone = "gone",
    }
}

/// The guard of one arm. Time is an argument, as everywhere in this room.
#[derive(Clone, Debug)]
pub struct Guard {
    interface: Interface,
    timeout: Duration,
    last: Vec<f64>,
    heard: Option<Duration>,
    /// Whether the last command was to move.
    moves: bool,
    /// Where the arm was measured last \[rad, prismatic: m\], and when.
    measured: Vec<f64>,
    measured_at: Option<Duration>,
    /// Since when the arm is being stopped, and the command for it.
    stopping: Option<(Duration, Vec<f64>)>,
    stops: u64,
    left_alone: u64,
}

impl Guard {
    /// Of an arm of so many joints that takes such commands; they have ceased when there was none for `timeout`.
    pub fn new(interface: Interface, joint_count: usize, timeout: Duration) -> Self {
        Self {
            interface,
            timeout,
            last: vec![0.0; joint_count],
            heard: None,
            moves: false,
            measured: vec![0.0; joint_count],
            measured_at: None,
            stopping: None,
            stops: 0,
            left_alone: 0,
        }
    }

    /// Changes after how long commands have ceased.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// Hears a command of anyone but a guard, velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\], at `now`: whoever commands the arm now is
    /// responsible for it. One of another length is for another arm, and one that is not finite is none.
    pub fn hear(&mut self, command: &[f64], now: Duration) {
        if !self.is_of_arm(command) {
            return;
        }
        self.moves = match self.interface {
            Interface::Velocity => command.iter().any(|speed| *speed != 0.0),
            Interface::Position | Interface::Trajectory => self.heard.is_some() && command != self.last,
        };
        self.last.copy_from_slice(command);
        (self.heard, self.stopping) = (Some(now), None);
    }

    /// Hears where the arm was measured at `now`: `positions` \[rad, prismatic: m\], one a joint. Positions of another length are of
    /// another arm, and those that are not finite are none.
    pub fn measure(&mut self, positions: &[f64], now: Duration) {
        if self.is_of_arm(positions) {
            self.measured.copy_from_slice(positions);
            self.measured_at = Some(now);
        }
    }

    fn is_of_arm(&self, numbers: &[f64]) -> bool {
        numbers.len() == self.last.len() && numbers.iter().all(|number| number.is_finite())
    }

    /// What is to be sent at `now`, if anything: zeros, or the positions that the arm was sent last, unless it is elsewhere.
    pub fn step(&mut self, now: Duration) -> Option<&[f64]> {
        let ceased = self.heard.is_some_and(|heard| now.saturating_sub(heard) > self.timeout);
        let begins = self.moves && ceased;
        self.moves &= !ceased;
        if begins {
            self.stopping = Some((now, self.stand()));
        }
        if self.is_stopping() && self.is_elsewhere() {
            self.stopping = None;
            self.left_alone += 1;
        } else if begins {
            self.stops += 1;
        }
        if self.stopping.as_ref().is_some_and(|(since, _)| now.saturating_sub(*since) > STOPPING) {
            self.stopping = None;
        }
        self.stopping.as_ref().map(|(_, command)| command.as_slice())
    }

    /// The command that lets the arm stand. Of positions that is the last: its controller has it already, so it is no step, however far
    /// the arm lags behind; where the arm was measured may be behind it, and would call it back.
    fn stand(&self) -> Vec<f64> {
        match self.interface {
            Interface::Velocity => vec![0.0; self.last.len()],
            Interface::Position | Interface::Trajectory => self.last.clone(),
        }
    }

    /// Whether the arm, which takes positions, was measured far from the last command since that came, as after a jump: then that would
    /// call it back. Where the arm only lags that far nothing is lost: its controller has the command already.
    fn is_elsewhere(&self) -> bool {
        let is_since = self.measured_at.is_some_and(|at| self.heard.is_some_and(|heard| at > heard));
        let mut ways = self.measured.iter().zip(&self.last).map(|(is, sent)| (is - sent).abs());
        self.interface.takes_positions() && is_since && ways.any(|way| way > ELSEWHERE)
    }

    /// Whether the arm is being stopped.
    pub fn is_stopping(&self) -> bool {
        self.stopping.is_some()
    }

    /// Whether the arm has nobody else who would bring it to rest: the last command was to move, or it is being stopped.
    pub fn is_needed(&self) -> bool {
        self.moves || self.is_stopping()
    }

    /// How often it has stopped the arm.
    pub fn stops(&self) -> u64 {
        self.stops
    }

    /// How often it has left an arm alone that was elsewhere than where it was sent.
    pub fn left_alone(&self) -> u64 {
        self.left_alone
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// What a guard sends and when first, of commands that come each 2 ms until 100 ms.
    fn after(interface: Interface, command: impl Fn(f64) -> [f64; 2]) -> Option<(u32, Vec<f64>)> {
        let mut guard = Guard::new(interface, 2, 100 * MS);
        for time in 0..3000 {
            let now = MS * time;
            if time <= 100 && time % 2 == 0 {
                guard.hear(&command(f64::from(time) * 1e-3), now);
            }
            if let Some(sent) = guard.step(now) {
                return Some((time, sent.to_vec()));
            }
        }
        None
    }

    #[test]
    fn an_arm_in_motion_is_stopped_when_commands_cease() {
        assert_eq!(after(Interface::Velocity, |_| [0.0, 0.1]), Some((201, vec![0.0; 2])));
        for interface in [Interface::Position, Interface::Trajectory] {
            assert_eq!(
                after(interface, |time| [1.0, time]),
                Some((201, vec![1.0, 0.1])),
                "where it was sent"
            );
        }
    }

    #[test]
    fn what_is_no_measurement_of_this_arm_is_ignored() {
        let mut guard = Guard::new(Interface::Position, 2, 100 * MS);
        guard.hear(&[0.0, 0.0], MS);
        guard.hear(&[0.0, 0.1], 2 * MS);
        guard.measure(&[0.0, 0.1], 3 * MS);
        // Taken for a measurement, each would have the arm left alone.
        guard.measure(&[9.0; 3], 4 * MS);
        guard.measure(&[9.0], 5 * MS);
        guard.measure(&[9.0, f64::NAN], 6 * MS);
        assert_eq!(guard.step(103 * MS), Some(&[0.0, 0.1][..]));
        assert_eq!((guard.stops(), guard.left_alone()), (1, 0));
    }

    #[test]
    fn a_servo_that_stopped_cleanly_is_none_of_its_business() {
        assert_eq!(after(Interface::Velocity, |time| if time < 0.09 { [1.0; 2] } else { [0.0; 2] }), None);
        assert_eq!(after(Interface::Position, |time| [time.min(0.09); 2]), None);
        assert_eq!(after(Interface::Velocity, |_| [0.0; 2]), None);
    }

    #[test]
    fn an_arm_that_is_elsewhere_than_where_it_was_sent_is_not_called_back() {
        // When it is measured where, and whether that is a reason to send nothing.
        let cases = [(90, 0.5, false), (150, 1.0, false), (150, 0.5, true), (400, 0.5, true)];
        for (measured_at, position, expected) in cases {
            let mut guard = Guard::new(Interface::Position, 1, 100 * MS);
            for time in 90..1000 {
                match time {
                    98 => guard.hear(&[1.0], 98 * MS),
                    100 => guard.hear(&[1.1], 100 * MS),
                    time if time == measured_at => guard.measure(&[position], MS * time),
                    _ => {}
                }
                guard.step(MS * time);
            }
            let (stops, left_alone) = (u64::from(measured_at > 200 || !expected), u64::from(expected));
            assert_eq!((guard.stops(), guard.left_alone()), (stops, left_alone), "{measured_at} {position}");
            assert_eq!((guard.is_stopping(), guard.is_needed()), (!expected, !expected));
        }
        let mut guard = Guard::new(Interface::Velocity, 1, 100 * MS);
        guard.hear(&[1.0], MS);
        guard.measure(&[7.0], 90 * MS);
        assert_eq!(guard.step(102 * MS), Some(&[0.0][..]), "speeds are not places");
    }

    #[test]
    fn it_ends_when_another_takes_over_or_after_a_second() {
        let mut guard = Guard::new(Interface::Velocity, 1, 100 * MS);
        assert_eq!(guard.step(MS), None);
        assert!(!guard.is_needed());
        guard.hear(&[1.0], MS);
        guard.hear(&[1.0, 1.0], 90 * MS);
        assert!(guard.is_needed());
        assert_eq!(guard.step(102 * MS), Some(&[0.0][..]), "commands to another arm are none to this one");
        assert_eq!(guard.step(1000 * MS), Some(&[0.0][..]));
        assert!(guard.is_needed());
        assert_eq!(guard.step(1103 * MS), None);
        assert!(!guard.is_needed());
        assert_eq!((guard.stops(), guard.is_stopping()), (1, false));
        guard.hear(&[1.0], 2000 * MS);
        assert!(guard.step(2101 * MS).is_some());
        guard.hear(&[0.5], 2102 * MS);
        assert_eq!(guard.step(2103 * MS), None, "another servo");
        assert_eq!(guard.step(2203 * MS), Some(&[0.0][..]), "which is watched too");
    }
}
