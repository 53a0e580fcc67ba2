//! What watches the commands to an arm from outside the servo, and stops the arm when they cease in motion: most controllers have no
//! timeout of their own, and go on at the last velocity for ever.

use super::Interface;
use crate::control::named;
use std::time::Duration;

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
    /// Since when the arm is being stopped, and the command for it.
    stopping: Option<(Duration, Vec<f64>)>,
    stops: u64,
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
            stopping: None,
            stops: 0,
        }
    }

    /// Changes after how long commands have ceased.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// Hears a command of anyone but a guard, velocities [rad/s] or positions \[rad\], at `now`: whoever commands the arm now is
    /// responsible for it. One of another length is for another arm, and one that is not finite is none.
    pub fn hear(&mut self, command: &[f64], now: Duration) {
        if command.len() != self.last.len() || !command.iter().all(|number| number.is_finite()) {
            return;
        }
        self.moves = match self.interface {
            Interface::Velocity => command.iter().any(|speed| *speed != 0.0),
            Interface::Position | Interface::Trajectory => self.heard.is_some() && command != self.last,
        };
        self.last.copy_from_slice(command);
        (self.heard, self.stopping) = (Some(now), None);
    }

    /// What is to be sent at `now`, if anything: zeros, or the positions that the arm was sent last.
    pub fn step(&mut self, now: Duration) -> Option<&[f64]> {
        let ceased = self.heard.is_some_and(|heard| now.saturating_sub(heard) > self.timeout);
        if std::mem::take(&mut self.moves) {
            self.moves = !ceased;
            if ceased {
                self.stops += 1;
                self.stopping = Some((now, self.stand()));
            }
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
    fn a_servo_that_stopped_cleanly_is_none_of_its_business() {
        assert_eq!(after(Interface::Velocity, |time| if time < 0.09 { [1.0; 2] } else { [0.0; 2] }), None);
        assert_eq!(after(Interface::Position, |time| [time.min(0.09); 2]), None);
        assert_eq!(after(Interface::Velocity, |_| [0.0; 2]), None);
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
