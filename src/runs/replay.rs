//! A recorded run once more, without DDS: its goals, joint states and parameters through the servo cycle, at the cycle's
//! own times, and the commands beside those recorded.

use super::motion_rows::MotionRows;
use super::replay_cycles::{Cycle, cycles};
use super::replay_inputs::Replica;
use super::{MotionRow, RunError, Timeline};
use crate::wire::ServoKind;
use serde::Serialize;
use std::time::Duration;

/// A servo's commands, recorded and replayed.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Replayed {
    /// The servo's node.
    pub node: String,
    /// Commands compared.
    pub commands: u64,
    /// Commands that differ in any bit.
    pub different: u64,
    /// Of these, commands where the replay sends none.
    pub not_sent: u64,
    /// Largest difference of a joint's command, in the `unit`.
    pub largest_difference: f64,
    /// The unit of the commands.
    pub unit: &'static str,
    /// The cycle's time of the first command that differs, from the first one on \[s\].
    pub first_difference_s: Option<f64>,
    /// From when to when commands were compared, by the cycle's time from the first one on \[s\].
    pub judged_s: Vec<(f64, f64)>,
    /// Commands that could not be compared: they follow inputs, or cycles, that are not in the bag, or a servo sent them that was started
    /// again.
    pub not_judged: u64,
    /// Inputs and cycles that the bag does not have, and that ended a comparison.
    pub inputs_missing: u64,
    /// The motions of the replay, which count from the first command on \[s\].
    pub motions: Vec<MotionRow>,
    /// Why nothing is replayed.
    pub why_not: Option<String>,
}

/// Replays every servo of a bag, from each moment on at which it stands and from which the bag has all that comes to it.
///
/// # Errors
/// [`RunError::NotReplayable`] where the bag has no servo with its parameters, or there is no such moment for any.
pub fn replay(timeline: &Timeline) -> Result<Vec<Replayed>, RunError> {
    /// Servos that are replayed; nobody runs more of them.
    const MOST: usize = 64;
    let mut replayed = Vec::new();
    for kind in ServoKind::ALL {
        for node in timeline.nodes_with(kind.own_parameter()).take(MOST) {
            replayed.push(replay_node(kind, timeline, node)?);
        }
    }
    let unknown = "no servo says in its ~/parameters with what it runs: that topic was not recorded (`dq_servo record` takes it), or the \
                   recording ended before a servo had said it";
    match replayed.iter().all(|servo| servo.why_not.is_some()) {
        true => {
            let why = replayed.into_iter().find_map(|servo| servo.why_not);
            Err(RunError::NotReplayable(why.unwrap_or_else(|| unknown.to_owned())))
        }
        false => Ok(replayed),
    }
}

fn replay_node(kind: ServoKind, timeline: &Timeline, node: &str) -> Result<Replayed, RunError> {
    let mut replica = Replica::new(kind, timeline, node)?;
    let (cycles, not_judged) = cycles(kind, timeline, node, replica.interface());
    let unit =
        if replica.interface().takes_positions() { "rad, prismatic: m" } else { "rad/s, prismatic: m/s" };
    let mut replayed = Replayed { node: node.to_owned(), unit, not_judged, ..Replayed::default() };
    let first = cycles.first().map_or(Duration::ZERO, |first| first.label.now);
    let mut motions = MotionRows::new(node);
    for (i, cycle) in cycles.iter().enumerate() {
        let time = cycle.label.now.saturating_sub(first).as_secs_f64();
        let goes_on = replica.is_running() && replica.misses(cycle) == 0;
        if replica.is_running() && !goes_on {
            replayed.inputs_missing = replayed.inputs_missing.saturating_add(replica.misses(cycle));
            replica.end();
        }
        let begins = !goes_on && replica.begin_at(&cycles, i)?;
        match replica.is_running() {
            true => replayed.compare(replica.cycle(cycle)?, cycle, time, begins),
            false => replayed.not_judged += 1,
        }
        for motion in replica.motions() {
            motions.take(time, 0, motion);
        }
    }
    replayed.motions = motions.finish();
    replayed.why_not = match (cycles.is_empty(), replayed.commands) {
        (true, _) => Some(format!("{node} has no commands that say what they were made from")),
        (false, 0) => Some(format!(
            "there is no moment at which {node} stands and the bag has all that comes to it from then on: its goals, its joint states \
             and the changes of its parameters (a motion whose goal was not recorded cannot be replayed; the next one can)"
        )),
        _ => None,
    };
    Ok(replayed)
}

impl Replayed {
    fn compare(&mut self, replayed: &[f64], cycle: &Cycle, time: f64, begins: bool) {
        self.commands += 1;
        match self.judged_s.last_mut().filter(|_| !begins) {
            Some((_, end)) => *end = time,
            None => self.judged_s.push((time, time)),
        }
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        let equal = replayed.len() == cycle.command.len();
        if !equal || !replayed.iter().zip(&cycle.command).all(same) {
            self.not_sent += u64::from(replayed.is_empty());
            let differences = replayed.iter().zip(&cycle.command).map(|(a, b)| (a - b).abs());
            self.different += 1;
            self.largest_difference = differences.fold(self.largest_difference, f64::max);
            self.first_difference_s.get_or_insert(time);
        }
    }
}
