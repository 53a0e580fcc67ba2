//! Estimates the time from a command to the joint state that shows its effect. This time is the age of the joint state plus the
//! response time of the robot.

use crate::command_history::CommandHistory;
use crate::comparison::Comparison;
use crate::samples::Displacement;
use crate::seconds;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The clocks of the robot and of this host count as agreeing while joint states are at most this old by their stamps.
const LONGEST_AGE: Duration = Duration::from_millis(150);

/// How long the clocks of the robot and of this host must agree before stamps are used.
const AGREEMENT: Duration = Duration::from_millis(200);
/// How long the clocks of the robot and of this host must disagree before stamps are no longer used. A single late joint state does
/// not prove that the clocks disagree.
const DISAGREEMENT: Duration = Duration::from_secs(2);

/// The candidates for the response time: `CANDIDATES` multiples of `STEP`, from zero on. All are below `LONGEST_RESPONSE`.
const STEP: Duration = Duration::from_millis(4);
const CANDIDATES: usize = 49;
const LONGEST_RESPONSE: Duration = Duration::from_millis(200);

/// The time constant with which old comparisons lose weight \[s\].
const FORGETTING: f64 = 0.5;

/// A candidate for the response time is chosen only if the largest [misfit](Candidate::misfit) of the candidates is at least this
/// \[rad², prismatic: m²\]. Below it, the candidates differ only by noise.
const DISTINCT: f64 = 5e-5;

/// The weight of a new joint state in the smoothed age.
const SMOOTHING: f64 = 0.2;
/// The weight of a new motion in the smoothed response time.
const RESPONSE_SMOOTHING: f64 = 0.36;

/// Estimates the delay of one arm. The delay is the sum of the age of a joint state on arrival and the robot's response time. The
/// age comes from the stamps if the clocks agree; otherwise it is part of the estimated response time. The response time comes from
/// a comparison of the measured motion with earlier commands.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Latency {
    /// The time since which stamps have been plausible; `None` while the clocks disagree.
    agreeing_since: Option<Duration>,
    /// When the last plausible stamp arrived; `None` before the first one.
    agreed: Option<Duration>,
    /// Whether stamps are used.
    stamped: bool,
    /// Age of the joint states on arrival \[s\], smoothed.
    age: f64,
    /// Time between joint states \[s\], smoothed.
    interval: f64,
    /// The response time: the time from a command to the state of the robot that shows its effect \[s\].
    response: f64,
    /// The weighted number of compared motions.
    count: f64,
    /// The sum of each joint's measured displacements \[rad, prismatic: m\].
    moved: Vec<f64>,
    /// The sum of the squares of all measured displacements \[rad², prismatic: m²\].
    motion: f64,
    candidates: Vec<Candidate>,
}

/// The comparison of motion with commands for one candidate of the response time.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Candidate {
    /// The comparison of each motion with the commands that preceded it by the response time of this candidate.
    comparison: Comparison,
    /// The sum of each joint's commanded displacements \[rad, prismatic: m\].
    asked: Vec<f64>,
}

impl Candidate {
    /// Returns the misfit: the sum of the squared differences between the motion and the best prediction from the commands \[rad²,
    /// prismatic: m²\]. The prediction is a fraction f of the commands, from 0 to 1, plus a constant speed of each joint.
    ///
    /// The misfit is `M − 2 f P + f² W`. M is `motion`, the sum of the squared motions. P is the `product` and W is the `square` of
    /// [`Comparison`]. The best f is `P/W`, limited to the range from 0 to 1. All sums are about the means, so they do not depend on
    /// the constant speeds.
    fn misfit(&self, latency: &Latency, motion: f64) -> f64 {
        let count = latency.count.max(f64::MIN_POSITIVE);
        let joints = self.asked.iter().zip(&latency.moved);
        let means: Comparison = joints.map(|(asked, moved)| (*asked, *moved)).collect();
        let product = self.comparison.product - means.product / count;
        let square = (self.comparison.square - means.square / count).max(0.0);
        let factor = if square > 0.0 { (product / square).clamp(0.0, 1.0) } else { 1.0 };
        motion - factor * (2.0 * product - factor * square)
    }
}

impl Latency {
    /// Creates the estimator for `joint_count` joints whose states arrive once per `period`.
    pub fn new(joint_count: usize, period: Duration) -> Self {
        let candidate = Candidate { comparison: Comparison::default(), asked: vec![0.0; joint_count] };
        Self {
            agreeing_since: None,
            agreed: None,
            stamped: false,
            age: 0.0,
            interval: period.as_secs_f64(),
            response: 0.0,
            count: 0.0,
            moved: vec![0.0; joint_count],
            motion: 0.0,
            candidates: vec![candidate; CANDIDATES],
        }
    }

    /// Notes a joint state that arrived at `now`, after the previous one at `before`. `stamp_age` is the age of the new joint state
    /// by its stamp. Returns the age that the estimator assumes for this joint state.
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

    /// Returns whether stamps are used.
    pub fn is_stamped(&self) -> bool {
        self.stamped
    }

    /// Starts or stops using stamps. The age of a joint state then has another meaning, so the comparisons restart. The estimated
    /// total delay stays the same.
    fn believe_stamps(&mut self, stamped: bool, age: f64) {
        let (total, age) = (self.total(), if stamped { age } else { 0.0 });
        (self.stamped, self.age, self.response) = (stamped, age, (total - age).max(0.0));
        self.fade(0.0);
    }

    /// Multiplies the weights of all earlier comparisons by `keep`.
    fn fade(&mut self, keep: f64) {
        (self.count, self.motion) = (keep * self.count, keep * self.motion);
        self.moved.iter_mut().for_each(|moved| *moved *= keep);
        for Candidate { comparison, asked } in &mut self.candidates {
            comparison.fade(keep);
            asked.iter_mut().for_each(|asked| *asked *= keep);
        }
    }

    /// Compares a motion with earlier commands.
    pub fn compare(&mut self, motion: &Displacement, history: &CommandHistory) {
        self.fade((-motion.after / FORGETTING).exp());
        self.count += 1.0;
        self.motion += motion.moved.iter().map(|moved| moved * moved).sum::<f64>();
        self.moved.iter_mut().zip(motion.moved).for_each(|(sum, moved)| *sum += moved);
        // A motion long after the last command is not a response to that command, whatever the response time is.
        if !history.stood_after(motion.from.saturating_sub(LONGEST_RESPONSE)) {
            let mut window = history.window(motion.from, motion.to);
            for Candidate { comparison, asked: sums } in &mut self.candidates {
                let distances = window.distances(motion.joints.clone()).zip(motion.moved).zip(sums);
                for ((asked, moved), sum) in distances {
                    comparison.add(asked, *moved);
                    *sum += asked;
                }
                window.move_back(STEP);
            }
        }
        if let Some(best) = self.best() {
            self.response += RESPONSE_SMOOTHING * (best - self.response);
        }
    }

    /// Returns the response time with which the commands fit the motion best \[s\]. Returns `None` if all candidates fit about
    /// equally well, or if even the best one fits badly.
    fn best(&self) -> Option<f64> {
        let count = self.count.max(f64::MIN_POSITIVE);
        let motion = self.motion - self.moved.iter().map(|moved| moved * moved).sum::<f64>() / count;
        let misfit = |candidate: &Candidate| candidate.misfit(self, motion);
        let at = |index: usize| self.candidates.get(index).map(misfit);
        let worst = self.candidates.iter().map(misfit).fold(0.0_f64, f64::max);
        let misfits = self.candidates.iter().map(misfit).enumerate();
        let (index, least) = misfits.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        if worst < DISTINCT || least > 0.25 * worst || least > 0.25 * motion {
            return None;
        }
        // The vertex of the parabola through the best candidate and its neighbors.
        let vertex = match (index.checked_sub(1).and_then(at), at(index + 1)) {
            (Some(before), Some(after)) => {
                0.5 * (before - after) / (before - 2.0 * least + after).max(f64::MIN_POSITIVE)
            }
            _ => 0.0,
        };
        Some(((index as f64 + vertex) * STEP.as_secs_f64()).max(0.0))
    }

    /// Returns the response time: the time from a command to the state of the robot that shows its effect \[s\].
    pub fn response(&self) -> f64 {
        self.response
    }

    /// Returns the time from a command to the arrival of the joint state that shows its effect \[s\].
    pub fn total(&self) -> f64 {
        self.age + self.response
    }

    /// Returns the time between joint states \[s\].
    pub fn interval(&self) -> f64 {
        self.interval
    }
}
