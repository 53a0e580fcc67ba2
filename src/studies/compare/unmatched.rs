//! Explains why gains miss their targets. For each such gain, runs the law on the tasks on which the study judges its gains.

use super::closed_loop::HORIZON;
use super::matching::{PILOTS, Tasks};
use super::summary::{Interval, Z};
use super::{CompareError, Gain, Matched, Study};
use serde::{Deserialize, Serialize};

/// A gain that misses its target by more than 2 %.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Unmatched {
    /// The gain, its target, and the value that it reaches.
    #[serde(flatten)]
    pub gain: Gain,
    /// The median of the matched quantity with this gain [s or rad/s], with its 95 % interval. The settling time of a failed task
    /// counts as the horizon.
    pub median: Interval,
    /// The median settling times \[s\] with two other gains: this gain divided by √2, and this gain multiplied by √2. They show
    /// whether the law settles earlier with another gain. `None` if the gain is for equal peak speed, because a peak speed always
    /// grows with the gain.
    pub beside: Option<[f64; 2]>,
}

impl Unmatched {
    /// Returns whether the law settles later, or at the same time, with both gains in `beside`. Then no gain reaches the target.
    pub fn is_fastest(&self) -> bool {
        self.beside.is_some_and(|beside| beside.iter().all(|median| *median >= self.median.value))
    }

    /// Returns half the width of the median's interval, as a percentage of the median.
    pub fn uncertain_percent(&self) -> f64 {
        50.0 * (self.median.high - self.median.low) / self.median.value
    }
}

/// Returns the gains of a study that do not reach their targets within 2 %, with the reasons.
///
/// # Errors
/// The first error of a simulated run. In practice, no simulated run fails.
pub(super) fn unmatched(study: &Study) -> Result<Vec<Unmatched>, CompareError> {
    let mut all = Vec::new();
    for arm in &study.arms {
        let judges = Tasks::judges(arm)?;
        for gain in study.gains.iter().filter(|gain| gain.arm == arm.name && !gain.is_matched()) {
            let Some(law) = study.laws.iter().find(|law| law.name() == gain.law) else { continue };
            let sorted = |factor: f64| {
                let mut values = gain.matched.sorted(&judges.run(*law, factor * gain.gain, PILOTS)?);
                // A settling time of a failed task is the horizon, the largest time that can be measured.
                if gain.matched == Matched::SettlingTime {
                    values.iter_mut().for_each(|value| *value = value.min(HORIZON.as_secs_f64()));
                }
                Ok::<_, CompareError>(values)
            };
            let Some(median) = Interval::median(&sorted(1.0)?, Z) else { continue };
            let beside = match gain.matched {
                Matched::SettlingTime => {
                    let half_octave = f64::sqrt(2.0);
                    Some([sorted(1.0 / half_octave)?[PILOTS / 2], sorted(half_octave)?[PILOTS / 2]])
                }
                Matched::PeakSpeed => None,
            };
            all.push(Unmatched { gain: gain.clone(), median, beside });
        }
    }
    Ok(all)
}
