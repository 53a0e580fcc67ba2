//! How long it takes until a command shows in the joint states: their age, and the robot's response.

use crate::command_history::CommandHistory;
use crate::comparison::Comparison;
use crate::samples::Displacement;
use crate::seconds;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Stamps count as set by a clock that agrees with ours while joint states are no older by them than this.
const LONGEST_AGE: Duration = Duration::from_millis(150);

/// Clocks must have agreed for so long before stamps are believed, and disagreed for so long before they are not: one late joint state says
/// nothing of clocks.
const AGREEMENT: Duration = Duration::from_millis(200);
const DISAGREEMENT: Duration = Duration::from_secs(2);

/// The responses that are compared with the motion: none, one step, …
const STEP: Duration = Duration::from_millis(4);
const CANDIDATES: usize = 49;
const LONGEST_RESPONSE: Duration = Duration::from_millis(200);

/// After so long what was compared counts e times less \[s\].
const FORGETTING: f64 = 0.5;

/// The least sum of squares \[rad²\] by which the responses must differ, so that noise does not choose.
const DISTINCT: f64 = 5e-5;

/// How much of the remaining difference a joint state brings the age nearer, and a motion the response.
const SMOOTHING: f64 = 0.2;
const RESPONSE_SMOOTHING: f64 = 0.36;

/// The squares by which commands miss a `motion` of such squares \[rad²\], of a robot that goes one part of what was asked, at most all of
/// it: `M − 2 f P + f² W` with `f = P/W`.
fn misfit(beside: &Comparison, motion: f64) -> f64 {
    let factor = beside.factor().clamp(0.0, 1.0);
    motion - factor * (2.0 * beside.product - factor * beside.square)
}

/// Estimates the delay of one arm, in two parts: how old a joint state is when it comes, by its stamp where the clocks agree, and
/// how long the robot takes to answer a command, by comparing the motion that was measured with the commands of before.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Latency {
    /// Since when stamps are plausible, and when one was last.
    agreeing_since: Option<Duration>,
    agreed: Option<Duration>,
    /// Whether stamps are believed.
    stamped: bool,
    /// Age of the joint states when they come \[s\], smoothed.
    age: f64,
    /// Time between joint states \[s\], smoothed.
    interval: f64,
    /// From a command to the state of the robot that shows it \[s\].
    response: f64,
    /// For each candidate, its commands beside the motion.
    beside: Vec<Comparison>,
    /// The squares of the motion itself \[rad²\].
    motion: f64,
}

impl Latency {
    /// Nothing known of joint states that come once a `period`.
    pub fn new(period: Duration) -> Self {
        Self {
            agreeing_since: None,
            agreed: None,
            stamped: false,
            age: 0.0,
            interval: period.as_secs_f64(),
            response: 0.0,
            beside: vec![Comparison::default(); CANDIDATES],
            motion: 0.0,
        }
    }

    /// Hears a joint state that came at `now`, after the one that came at `before`: how old it is.
    pub fn hear(&mut self, now: Duration, before: Option<Duration>, stamp_age: Option<Duration>) -> Duration {
        if let Some(before) = before {
            let interval = now.saturating_sub(before).min(LONGEST_AGE).as_secs_f64();
            self.interval += 0.05 * (interval - self.interval);
        }
        let plausible = stamp_age.filter(|age| *age <= LONGEST_AGE);
        if plausible.is_some() {
            self.agreed = Some(now);
            self.agreeing_since.get_or_insert(now);
        }
        let is_within =
            |since: Option<Duration>, time| since.is_some_and(|it| now.saturating_sub(it) <= time);
        if !is_within(self.agreed, DISAGREEMENT) {
            self.agreeing_since = None;
        }
        let stamped = self.agreeing_since.is_some() && !is_within(self.agreeing_since, AGREEMENT);
        let age = plausible.map(|age| age.as_secs_f64());
        if stamped != self.stamped {
            self.believe_stamps(stamped, age.unwrap_or_default());
        } else if let Some(age) = age.filter(|_| stamped) {
            self.age += SMOOTHING * (age - self.age);
        }
        let age = age.filter(|_| stamped).unwrap_or(self.age);
        seconds(age)
    }

    /// Whether stamps are believed.
    pub fn is_stamped(&self) -> bool {
        self.stamped
    }

    /// From now on states are so old \[s\] where they are `stamped`: what is seen of the robot is measured from other times, and what is
    /// known of both together stays.
    fn believe_stamps(&mut self, stamped: bool, age: f64) {
        let (total, age) = (self.total(), if stamped { age } else { 0.0 });
        (self.stamped, self.age, self.response) = (stamped, age, (total - age).max(0.0));
        self.beside.fill(Comparison::default());
        self.motion = 0.0;
    }

    /// Compares a motion with the commands of before.
    pub fn compare(&mut self, motion: &Displacement, history: &CommandHistory) {
        let keep = (-motion.after / FORGETTING).exp();
        self.motion = keep * self.motion + motion.moved.iter().map(|moved| moved * moved).sum::<f64>();
        self.beside.iter_mut().for_each(|beside| beside.fade(keep));
        // What moves long after the last command is no answer, whichever candidate is right.
        if !history.stood_after(motion.from.saturating_sub(LONGEST_RESPONSE)) {
            let mut window = history.window(motion.from, motion.to);
            for beside in &mut self.beside {
                for (asked, moved) in window.distances(motion.joints.clone()).zip(motion.moved) {
                    beside.add(asked, *moved);
                }
                window.move_back(STEP);
            }
        }
        if let Some(best) = self.best() {
            self.response += RESPONSE_SMOOTHING * (best - self.response);
        }
    }

    /// The response that explains the motion, if one does so and others do not \[s\].
    fn best(&self) -> Option<f64> {
        let misfits = || self.beside.iter().map(|beside| misfit(beside, self.motion));
        let at = |index: usize| Some(misfit(self.beside.get(index)?, self.motion));
        let worst = misfits().fold(0.0_f64, f64::max);
        let (index, least) = misfits().enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        if worst < DISTINCT || least > 0.25 * worst || least > 0.25 * self.motion {
            return None;
        }
        // The vertex of the parabola through the neighbours.
        let vertex = match (index.checked_sub(1).and_then(at), at(index + 1)) {
            (Some(before), Some(after)) => {
                0.5 * (before - after) / (before - 2.0 * least + after).max(f64::MIN_POSITIVE)
            }
            _ => 0.0,
        };
        Some(((index as f64 + vertex) * STEP.as_secs_f64()).max(0.0))
    }

    /// From a command to the state of the robot that shows it \[s\].
    pub fn response(&self) -> f64 {
        self.response
    }

    /// From a command to the arrival of the joint state that shows it \[s\].
    pub fn total(&self) -> f64 {
        self.age + self.response
    }

    /// Time between joint states \[s\].
    pub fn interval(&self) -> f64 {
        self.interval
    }
}
