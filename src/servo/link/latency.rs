//! How long it takes until a command shows in the joint states: their age, and the robot's response.

use super::CommandHistory;
use super::samples::Displacement;
use std::time::Duration;

/// Stamps count as set by a clock that agrees with ours while joint states are no older by them than this.
const LONGEST_AGE: Duration = Duration::from_millis(150);

/// Clocks must have agreed for so long before stamps are believed.
const AGREEMENT: Duration = Duration::from_millis(200);

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

/// Estimates the delay of one arm, in two parts: how old a joint state is when it comes, by its stamp where the clocks agree, and
/// how long the robot takes to answer a command, by comparing the motion that was measured with the commands of before.
#[derive(Clone, Debug)]
pub(super) struct Latency {
    agreeing_since: Option<Duration>,
    /// Age of the joint states when they come \[s\], smoothed.
    age: f64,
    /// Time between joint states \[s\], smoothed.
    interval: f64,
    /// From a command to the state of the robot that shows it \[s\].
    response: f64,
    /// For each candidate, the squares by which it misses the motion \[rad²\].
    misfits: [f64; CANDIDATES],
    /// The squares of the motion itself \[rad²\].
    motion: f64,
}

impl Latency {
    pub fn new(period: Duration) -> Self {
        Self {
            agreeing_since: None,
            age: 0.0,
            interval: period.as_secs_f64(),
            response: 0.0,
            misfits: [0.0; CANDIDATES],
            motion: 0.0,
        }
    }

    /// A joint state came at `now`, `before` is when the last one did: how old it is, by its stamp where that can be believed.
    pub fn hear(&mut self, now: Duration, before: Option<Duration>, stamp_age: Option<Duration>) -> Duration {
        if let Some(before) = before {
            let interval = now.saturating_sub(before).min(LONGEST_AGE).as_secs_f64();
            self.interval += 0.05 * (interval - self.interval);
        }
        let agreed = |since: &Option<Duration>| since.is_some_and(|it| now.saturating_sub(it) >= AGREEMENT);
        let agreed_before = agreed(&self.agreeing_since);
        let plausible = stamp_age.filter(|age| *age <= LONGEST_AGE);
        self.agreeing_since = plausible.and(self.agreeing_since.or(Some(now)));
        let agreed_now = agreed(&self.agreeing_since);
        if agreed_now != agreed_before {
            // What is seen of the robot is measured from other times now.
            (self.misfits, self.motion) = ([0.0; CANDIDATES], 0.0);
            self.response =
                if agreed_now { (self.response - self.age).max(0.0) } else { self.response + self.age };
        }
        let age = plausible.filter(|_| agreed_now).unwrap_or_default();
        self.age +=
            if agreed_now == agreed_before { SMOOTHING } else { 1.0 } * (age.as_secs_f64() - self.age);
        age
    }

    /// Compares a motion with the commands of before.
    pub fn compare(&mut self, motion: &Displacement, commanded: &CommandHistory) {
        let keep = (-motion.after / FORGETTING).exp();
        let moved = motion.moved.iter().map(|moved| moved * moved).sum::<f64>();
        self.motion = keep * self.motion + moved;
        if commanded.stood_after(motion.from.saturating_sub(LONGEST_RESPONSE)) {
            // What moved was no answer, whichever candidate is right.
            self.misfits.iter_mut().for_each(|misfit| *misfit = keep * *misfit + moved);
        } else {
            let mut window = commanded.window(motion.from, motion.to);
            for misfit in &mut self.misfits {
                let ways = window.ways(motion.joints.clone()).zip(motion.moved);
                *misfit = keep * *misfit + ways.map(|(way, moved)| (moved - way).powi(2)).sum::<f64>();
                window.move_back(STEP);
            }
        }
        if let Some(best) = self.best() {
            self.response += RESPONSE_SMOOTHING * (best - self.response);
        }
    }

    /// The response that explains the motion, if one does so and others do not \[s\].
    fn best(&self) -> Option<f64> {
        let worst = self.misfits.iter().fold(0.0_f64, |a, b| a.max(*b));
        let (index, least) =
            self.misfits.iter().enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(i, m)| (i, *m))?;
        if worst < DISTINCT || least > 0.25 * worst || least > 0.25 * self.motion {
            return None;
        }
        // The vertex of the parabola through the neighbours.
        let neighbour = |i: usize| self.misfits.get(i).copied();
        let vertex = match (index.checked_sub(1).and_then(neighbour), neighbour(index + 1)) {
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
