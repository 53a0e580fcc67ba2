//! The guard monitors the commands to an arm from outside the servo. If the commands end during a motion, the guard stops the arm.
//! Most controllers have no timeout of their own, and continue at the last velocity forever.

use dq_common::named;
use dq_limits::Interface;
use std::f64::consts::TAU;
use std::time::Duration;

/// How long the guard repeats its stop command, because a single message may get lost. After that time, the guard is silent, so
/// that it does not disturb the next sender of commands.
const STOPPING: Duration = Duration::from_secs(1);

/// A servo may be silent for this many of its control periods, even if that is longer than the guard's timeout.
pub const PERIODS: u32 = 3;

/// The longest control period that the guard expects of a servo. A longer interval between two commands is a pause.
const LONGEST_PERIOD: Duration = Duration::from_millis(500);

/// The guard may have missed commands if the time between two joint states, or between two of its own steps, exceeds this fraction
/// of [`Guard::patience`]. Such a time is a gap.
const LONGEST_GAP: f64 = 0.5;

named! {
    /// Whether an arm has a guard, as far as its servo knows.
    "guard" GuardState {
        /// The servo has never seen a guard.
        None = "none",
        /// The guard is running.
        Watching = "watching",
        /// The guard has ended: nothing would stop the arm if the servo were killed.
        Gone = "gone",
    }
}

/// The guard of one arm. It reads no clock: time is an argument.
///
/// If no commands arrive, the guard's own connection may be at fault. So the guard concludes that the commands have ended only if
/// joint states have arrived without a gap for the whole timeout.
#[derive(Clone, Debug)]
pub struct Guard {
    interface: Interface,
    timeout: Duration,
    /// The last command; `None` before the first command.
    last: Option<Vec<f64>>,
    /// The last two intervals between commands; 0 for an interval above [`LONGEST_PERIOD`]. The guard takes the shorter one as the
    /// servo's control period. It waits for [`PERIODS`] such periods, even if they are longer than `timeout`.
    intervals: [Duration; 2],
    /// When the last command arrived.
    heard: Option<Duration>,
    /// Whether the last command moves the arm, and the guard has not finished a stop since.
    moves: bool,
    /// The last measured positions \[rad, prismatic: m\].
    measured: Vec<f64>,
    /// When the last measured positions arrived.
    measured_at: Option<Duration>,
    /// When the present silence of the commands began: when the last command arrived, or when a later gap (see [`LONGEST_GAP`]) in the
    /// joint states or in the guard's steps ended.
    silent_since: Duration,
    /// The time of the guard's last step.
    looked: Duration,
    /// When the guard began to stop the arm, and the stop command; `None` if the guard is not stopping the arm.
    stopping: Option<(Duration, Vec<f64>)>,
    stops: u64,
}

impl Guard {
    /// Creates the guard of an arm with `joint_count` joints that takes commands of the kind `interface`. The guard stops a moving
    /// arm that gets no command for `timeout`.
    pub fn new(interface: Interface, joint_count: usize, timeout: Duration) -> Self {
        Self {
            interface,
            timeout,
            last: None,
            intervals: [Duration::ZERO; 2],
            heard: None,
            moves: false,
            measured: vec![0.0; joint_count],
            measured_at: None,
            silent_since: Duration::ZERO,
            looked: Duration::ZERO,
            stopping: None,
            stops: 0,
        }
    }

    /// Sets the time without a command after which the guard stops a moving arm.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// Takes a command to the arm that arrived at `now`: velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\]. Call
    /// this for the commands of every sender except guards. A command ends the guard's stop, because its sender is now responsible
    /// for the arm. Ignores a command that is not finite, or that has another number of joints and so is for another arm.
    pub fn hear(&mut self, command: &[f64], now: Duration) {
        if !self.is_of_arm(command) {
            return;
        }
        let before = self.last.replace(command.to_vec());
        self.moves = match self.interface {
            Interface::Velocity => command.iter().any(|speed| *speed != 0.0),
            Interface::Position | Interface::Trajectory => before.is_some_and(|before| command != before),
        };
        let interval = self.heard.replace(now).map_or(Duration::ZERO, |before| now.saturating_sub(before));
        self.intervals =
            [self.intervals[1], if interval <= LONGEST_PERIOD { interval } else { Duration::ZERO }];
        (self.silent_since, self.stopping) = (now, None);
    }

    /// Returns the time without a command after which the guard stops a moving arm: the timeout, or [`PERIODS`] control periods of
    /// the servo if they are longer.
    fn patience(&self) -> Duration {
        self.timeout.max(PERIODS * self.intervals[0].min(self.intervals[1]))
    }

    /// Takes the measured joint `positions` \[rad, prismatic: m\], which arrived at `now`. Ignores positions with another number of
    /// joints, because they are of another arm, and positions that are not finite.
    pub fn measure(&mut self, positions: &[f64], now: Duration) {
        if !self.is_of_arm(positions) {
            return;
        }
        if !self.hears(now) {
            self.silent_since = now;
        }
        self.measured.copy_from_slice(positions);
        self.measured_at = Some(now);
    }

    fn is_of_arm(&self, numbers: &[f64]) -> bool {
        numbers.len() == self.measured.len() && numbers.iter().all(|number| number.is_finite())
    }

    /// Returns whether joint states arrive. Without joint states, the guard cannot know whether commands have ended, and sends
    /// nothing.
    pub fn hears(&self, now: Duration) -> bool {
        self.measured_at.is_some_and(|at| !self.is_gap(at, now))
    }

    fn is_gap(&self, from: Duration, to: Duration) -> bool {
        to.saturating_sub(from) > self.patience().mul_f64(LONGEST_GAP)
    }

    /// Returns the command that the guard must send at `now`; `None` if it must send nothing. The command consists of zeros or, if
    /// the arm takes positions, of the positions that were measured when the guard began to stop the arm.
    pub fn step(&mut self, now: Duration) -> Option<&[f64]> {
        let before = std::mem::replace(&mut self.looked, now);
        if self.is_gap(before, now) {
            self.silent_since = now;
        }
        let witnessed = self.measured_at.map_or(Duration::ZERO, |at| at.saturating_sub(self.silent_since));
        if !(self.moves && witnessed > self.patience() && self.hears(now)) {
            self.stopping = None;
            return None;
        }
        if self.stopping.as_ref().is_some_and(|(since, _)| now.saturating_sub(*since) > STOPPING) {
            (self.moves, self.stopping) = (false, None);
        } else if self.stopping.is_none() {
            self.stopping = Some((now, self.stand()));
            self.stops += 1;
        }
        self.stopping.as_ref().map(|(_, command)| command.as_slice())
    }

    /// Returns the command that stops the arm. For an arm that takes positions, it consists of the measured positions. Each position
    /// is shifted by whole turns to be nearest to the last command, because an encoder may not count turns.
    fn stand(&self) -> Vec<f64> {
        match (self.interface, &self.last) {
            (Interface::Velocity, _) | (_, None) => vec![0.0; self.measured.len()],
            (Interface::Position | Interface::Trajectory, Some(last)) => {
                let turned = |(is, last): (&f64, &f64)| is - TAU * ((is - last) / TAU).round();
                self.measured.iter().zip(last).map(turned).collect()
            }
        }
    }

    /// Returns whether the guard is stopping the arm.
    pub fn is_stopping(&self) -> bool {
        self.stopping.is_some()
    }

    /// Returns whether the arm would move on without the guard: the last command moves the arm, and the guard has not finished a
    /// stop since.
    pub fn is_needed(&self) -> bool {
        self.moves
    }

    /// Returns the number of times that the guard has stopped the arm.
    pub fn stops(&self) -> u64 {
        self.stops
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Runs a guard with a timeout of 100 ms for three seconds, in steps of 2 ms. In each step, the functions `command` and `state`
    /// give the messages that are sent. The guard runs, and receives all messages so far, only in the steps in which `looks` is
    /// true. Returns the time \[ms\] and the value of the first command that the guard sends.
    fn watches(
        interface: Interface,
        command: impl Fn(f64) -> Option<[f64; 2]>,
        state: impl Fn(f64) -> Option<[f64; 2]>,
        looks: impl Fn(u32) -> bool,
    ) -> Option<(u32, Vec<f64>)> {
        let mut guard = Guard::new(interface, 2, 100 * MS);
        let (mut states, mut commands) = (Vec::new(), Vec::new());
        for time in (0..3000).step_by(2) {
            let seconds = f64::from(time) * 1e-3;
            states.extend(state(seconds));
            commands.extend(command(seconds));
            if looks(time) {
                let now = MS * time;
                states.drain(..).for_each(|state| guard.measure(&state, now));
                commands.drain(..).for_each(|command| guard.hear(&command, now));
                if let Some(sent) = guard.step(now) {
                    return Some((time, sent.to_vec()));
                }
            }
        }
        None
    }

    /// Runs a guard whose arm moves all the time. The guard receives the commands of the function `command` up to 100 ms, and none
    /// afterwards. Returns the time \[ms\] and the value of the first command that the guard sends.
    fn after(interface: Interface, command: impl Fn(f64) -> [f64; 2]) -> Option<(u32, Vec<f64>)> {
        watches(interface, |time| (time <= 0.1).then(|| command(time)), |time| Some([1.0, time]), |_| true)
    }

    #[test]
    fn an_arm_in_motion_is_stopped_when_commands_end() {
        assert_eq!(after(Interface::Velocity, |_| [0.0, 0.1]), Some((202, vec![0.0; 2])));
        for interface in [Interface::Position, Interface::Trajectory] {
            let (time, sent) = after(interface, |time| [1.0, time]).unwrap();
            let ways = sent.iter().zip([1.0, 0.202]).map(|(sent, is)| (sent - is).abs());
            assert!(time == 202 && ways.fold(0.0, f64::max) < 1e-12, "where it is: {sent:?}");
        }
    }

    /// Returns commands at 5 Hz until `end` \[s\].
    fn slow(end: f64) -> impl Fn(f64) -> Option<[f64; 2]> {
        move |time| (((1000.0 * time) as u32).is_multiple_of(200) && time <= end).then_some([1.0, time])
    }

    #[test]
    fn a_servo_slower_than_the_timeout_is_stopped_only_after_three_of_its_periods() {
        let mut guard = Guard::new(Interface::Velocity, 2, 100 * MS);
        let mut sent = Vec::new();
        for time in (0..3000).step_by(2) {
            let (now, seconds) = (MS * time, f64::from(time) * 1e-3);
            guard.measure(&[1.0, seconds], now);
            slow(2.0)(seconds).iter().for_each(|command| guard.hear(command, now));
            sent.extend(guard.step(now).map(|_| time));
        }
        // The guard knows the servo's period only after the third command.
        let after_third: Vec<_> = sent.into_iter().filter(|time| *time > 400).collect();
        assert_eq!(after_third.first(), Some(&2602));
    }

    #[test]
    fn a_guard_that_hears_nothing_sends_nothing() {
        let silent = |time: f64| (0.5..0.8).contains(&time);
        let moving = |time: f64| (!silent(time)).then_some([1.0, time]);
        for interface in [Interface::Velocity, Interface::Position] {
            // The guard either loses the messages that came while it did not run, or receives them at its next step.
            assert_eq!(watches(interface, moving, moving, |_| true), None);
            let all = |time| Some([1.0, time]);
            assert_eq!(watches(interface, all, all, |time| !(500..800).contains(&time)), None);
            // Commands arrive a moment after the joint states.
            let later = |time| (!(0.5..0.84).contains(&time)).then_some([1.0, time]);
            assert_eq!(watches(interface, later, moving, |_| true), None);
            // Old messages do not justify a stop while the guard receives nothing.
            let until = |time: f64| (time <= 0.1).then_some([1.0, time]);
            assert_eq!(watches(interface, until, |time| until(time - 0.06), |_| true), None);
            assert_eq!(watches(interface, until, |_| None, |_| true), None, "no joint states at all");
        }
    }

    #[test]
    fn the_silence_begins_again_after_a_gap_between_steps_of_the_guard() {
        let until = |time: f64| (time <= 0.1).then_some([0.0, 0.1]);
        let (state, looks) = (|time| Some([1.0, time]), |time| !(150..250).contains(&time));
        assert_eq!(watches(Interface::Velocity, until, state, looks), Some((352, vec![0.0; 2])));
    }

    #[test]
    fn a_stop_interrupted_by_a_gap_between_steps_continues_after_another_silence() {
        let mut guard = Guard::new(Interface::Velocity, 1, 100 * MS);
        let mut sent = Vec::new();
        guard.hear(&[1.0], MS);
        for time in (1..2000).filter(|time| !(300..400).contains(time)) {
            guard.measure(&[0.5], MS * time);
            sent.extend(guard.step(MS * time).map(|_| time));
        }
        let expected: Vec<_> = (102..300).chain(501..=1501).collect();
        assert_eq!((sent, guard.stops(), guard.is_needed()), (expected, 2, false));
    }

    #[test]
    fn positions_of_another_length_or_not_finite_are_ignored() {
        let mut guard = Guard::new(Interface::Position, 2, 100 * MS);
        for time in 1..=103 {
            guard.measure(&[0.0, 0.1], MS * time);
            if time <= 2 {
                guard.hear(&[0.0, f64::from(time)], MS * time);
            }
            // If the guard accepted these positions, it would send the arm there.
            guard.measure(&[9.0; 3], MS * time);
            guard.measure(&[9.0], MS * time);
            guard.measure(&[9.0, f64::NAN], MS * time);
            assert_eq!(guard.step(MS * time), (time == 103).then_some(&[0.0, 0.1][..]));
        }
    }

    #[test]
    fn a_servo_that_stopped_cleanly_is_left_alone() {
        assert_eq!(after(Interface::Velocity, |time| if time < 0.09 { [1.0; 2] } else { [0.0; 2] }), None);
        assert_eq!(after(Interface::Position, |time| [time.min(0.09); 2]), None);
        assert_eq!(after(Interface::Velocity, |_| [0.0; 2]), None);
    }

    #[test]
    fn an_arm_away_from_its_last_setpoint_is_held_where_it_is() {
        // Each measured position, with the position that the guard commands. Controllers count turns, encoders do not.
        for (measured, held) in [(0.5, 0.5), (-2.0, -2.0), (1.1, 1.1), (1.0 - TAU, 1.0), (1.2 + TAU, 1.2)] {
            let mut guard = Guard::new(Interface::Position, 1, 100 * MS);
            for time in 0..=200 {
                guard.measure(&[if time < 150 { 1.05 } else { measured }], MS * time);
                if time <= 100 {
                    guard.hear(&[1.0 + 1e-3 * f64::from(time)], MS * time);
                }
                assert_eq!(guard.step(MS * time), None);
            }
            guard.measure(&[measured], 201 * MS);
            let sent = guard.step(201 * MS).unwrap();
            assert!((sent[0] - held).abs() < 1e-12, "{sent:?} instead of {held}");
        }
    }

    #[test]
    fn a_stop_ends_when_another_commander_takes_over_or_after_a_second() {
        let mut guard = Guard::new(Interface::Velocity, 1, 100 * MS);
        let mut at = |time: u32, command: Option<&[f64]>| {
            guard.measure(&[0.0], MS * time);
            command.iter().for_each(|command| guard.hear(command, MS * time));
            let sent = guard.step(MS * time).map(<[f64]>::to_vec);
            (sent, guard.is_needed())
        };
        let (stop, silence) = (Some(vec![0.0]), None::<Vec<f64>>);
        assert_eq!(at(0, None), (silence.clone(), false));
        assert_eq!(at(1, Some(&[1.0])), (silence.clone(), true));
        for time in 2..102 {
            let of_another_arm = (time == 90).then_some(&[1.0, 1.0][..]);
            assert_eq!(at(time, of_another_arm), (silence.clone(), true));
        }
        for time in 102..=1102 {
            assert_eq!(at(time, None), (stop.clone(), true), "{time}");
        }
        for time in 1103..2000 {
            assert_eq!(at(time, None), (silence.clone(), false), "{time}");
        }
        at(2000, Some(&[1.0]));
        for time in 2001..2101 {
            assert_eq!(at(time, None), (silence.clone(), true));
        }
        assert_eq!(at(2101, None), (stop.clone(), true));
        assert_eq!(at(2102, Some(&[0.5])), (silence.clone(), true), "another servo");
        for time in 2103..2203 {
            assert_eq!(at(time, None), (silence.clone(), true));
        }
        assert_eq!(at(2203, None), (stop, true), "which is watched too");
    }
}
