//! The recent commands. They predict the motion that joint states do not show yet.

use crate::lateness::LONGEST_HOLD;
use dq_limits::Interface;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Duration;

/// The least time for which commands are kept. It is long enough to compare a motion with its commands, even at the longest delay.
const MEMORY: Duration = Duration::from_millis(700);

/// The recent commands of all joints, stored as sums of displacements.
#[derive(Serialize, Deserialize)]
pub(crate) struct CommandHistory {
    joint_count: usize,
    /// How long each command moves the joints \[s\]; `None` if each command moves the joints until the next command.
    step: Option<f64>,
    /// Longest time for which a command moves the joints, even if no other command follows \[s\].
    longest: f64,
    /// The number of commands that remain when the older half is dropped. At most twice this number are kept.
    pub(super) capacity: usize,
    /// When each command took effect \[s\], the oldest first.
    pub(super) times: Vec<f64>,
    /// One row per command: the displacement of each joint by all earlier commands \[rad, prismatic: m\].
    sums: Vec<f64>,
    /// One row per command: the speed of each joint [rad/s, prismatic: m/s].
    speeds: Vec<f64>,
    /// Whether the newest command moves the joints.
    moves: bool,
    /// The latest time at which a command other than the newest one moved a joint \[s\].
    moved_until: f64,
}

impl CommandHistory {
    /// Creates an empty history of `joint_count` joints for a servo with the control period `period`. If `interface` takes
    /// positions, a command moves the joints for one period, even if the next command is late.
    pub fn new(joint_count: usize, period: Duration, interface: Interface) -> Self {
        let cycles = MEMORY.as_nanos() / period.as_nanos().max(1) + 2;
        let capacity = usize::try_from(cycles).unwrap_or(usize::MAX).min(2000);
        let numbers = 2 * capacity * joint_count;
        let step = interface.takes_positions().then_some(period.as_secs_f64());
        Self {
            joint_count,
            step,
            longest: step.unwrap_or(LONGEST_HOLD.as_secs_f64()),
            capacity,
            times: Vec::with_capacity(2 * capacity),
            sums: Vec::with_capacity(numbers),
            speeds: Vec::with_capacity(numbers),
            moves: false,
            moved_until: f64::NEG_INFINITY,
        }
    }

    /// Adds the joint velocities `command` [rad/s, prismatic: m/s], which are in force from `now` on. Their part `hold` only balances
    /// a payload or gravity, so a command that equals `hold` moves no joint.
    pub fn note(&mut self, now: Duration, command: &[f64], hold: &[f64]) {
        let now = now.as_secs_f64();
        match self.times.last() {
            Some(last) => {
                let lasted = self.step.unwrap_or((now - last).clamp(0.0, LONGEST_HOLD.as_secs_f64()));
                let before = self.sums.len() - self.joint_count;
                for slot in before..before + self.joint_count {
                    self.sums.push(self.sums[slot] + lasted * self.speeds[slot]);
                }
                if self.moves {
                    self.moved_until = now;
                }
            }
            None => self.sums.resize(self.joint_count, 0.0),
        }
        self.speeds.extend_from_slice(command);
        self.moves = command != hold;
        // If the clock went back, all earlier commands are dropped. If the memory is full, its older half is dropped.
        let forgotten = match self.times.last() {
            Some(last) if now < *last => self.times.len(),
            _ if self.times.len() + 1 == 2 * self.capacity => self.capacity,
            _ => 0,
        };
        self.times.push(now);
        self.times.drain(..forgotten);
        self.sums.drain(..forgotten * self.joint_count);
        self.speeds.drain(..forgotten * self.joint_count);
    }

    /// Sets `into` to the commanded displacement of the joints of `range` between two times \[rad, prismatic: m\].
    pub fn travel(&self, range: Range<usize>, from: Duration, to: Duration, into: &mut [f64]) {
        let window = self.window(from, to);
        into.iter_mut().zip(window.distances(range)).for_each(|(slot, distance)| *slot = distance);
    }

    /// Sets `into` to the commanded displacement of the joints of `range` from the first command to `time` \[rad, prismatic: m\].
    /// It includes the displacement by commands that are no longer kept.
    pub fn total(&self, range: Range<usize>, time: Duration, into: &mut [f64]) {
        let InForce { sums, speeds, time } = self.in_force(&self.place(time), &range);
        let joints = into.iter_mut().zip(sums.iter().zip(speeds));
        joints.for_each(|(slot, (before, speed))| *slot = before + time * speed);
    }

    /// Returns the commands between two times.
    pub fn window(&self, from: Duration, to: Duration) -> Window<'_> {
        Window { history: self, from: self.place(from), to: self.place(to) }
    }

    fn place(&self, time: Duration) -> Place {
        let time = time.as_secs_f64();
        let after = self.times.partition_point(|entry| *entry <= time);
        Place { time, index: after.saturating_sub(1) }
    }

    /// Returns the command in force at `place` for the joints of `range`.
    #[inline]
    fn in_force(&self, place: &Place, range: &Range<usize>) -> InForce<'_> {
        let Some(since) = self.times.get(place.index) else { return InForce::default() };
        let row = self.joint_count * place.index;
        let range = row + range.start..row + range.end;
        let time = (place.time - since).max(0.0).min(self.longest);
        InForce { sums: &self.sums[range.clone()], speeds: &self.speeds[range], time }
    }

    /// Returns whether no command moved a joint after `time`.
    pub fn stood_after(&self, time: Duration) -> bool {
        self.moved_until <= time.as_secs_f64() && !self.moves
    }
}

/// The commands between two times.
pub(crate) struct Window<'a> {
    history: &'a CommandHistory,
    from: Place,
    to: Place,
}

/// A time \[s\], and the index of the command in force at that time; before the first command, the index of the first command.
struct Place {
    time: f64,
    index: usize,
}

impl Window<'_> {
    /// Moves both ends of the window back in time by `by`. The search for the commands in force at the new ends starts at the old ends,
    /// so a small `by` takes little time.
    pub fn move_back(&mut self, by: Duration) {
        for place in [&mut self.from, &mut self.to] {
            place.time -= by.as_secs_f64();
            while place.index > 0 && self.history.times[place.index] > place.time {
                place.index -= 1;
            }
        }
    }

    /// Returns the commanded displacement of each joint of `range` \[rad, prismatic: m\].
    ///
    /// Reads four lists of equal length together, for speed: each joint state needs about fifty of these windows.
    #[inline]
    pub fn distances(&self, range: Range<usize>) -> impl Iterator<Item = f64> + '_ {
        let [start, end] = [&self.from, &self.to].map(|place| self.history.in_force(place, &range));
        let sums = start.sums.iter().zip(end.sums);
        let speeds = start.speeds.iter().zip(end.speeds);
        sums.zip(speeds)
            .map(move |((from, to), (before, after))| to - from + (end.time * after - start.time * before))
    }
}

/// The command in force at a time.
#[derive(Default)]
struct InForce<'a> {
    /// The displacement of each joint by all earlier commands \[rad, prismatic: m\].
    sums: &'a [f64],
    /// The commanded speed of each joint [rad/s, prismatic: m/s].
    speeds: &'a [f64],
    /// How long the command has moved the joints \[s\].
    time: f64,
}
