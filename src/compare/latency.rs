//! How old joint states may be.

use super::closed_loop::{ClosedLoop, Outcome};
use super::conditions::{PERIOD, Plant};
use super::matching::{Matched, Pilots};
use super::{CompareError, Study};
use crate::control::Law;
use serde::{Deserialize, Serialize};

/// Ages that are tried, in cycles: 0 to 0.32 s.
const AGES: [usize; 8] = [0, 1, 2, 4, 8, 16, 32, 64];

/// A law at the age of joint states at which it begins to fail.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Ageing {
    /// The law's name.
    pub law: String,
    /// Whether the servo's limits held.
    pub limits: bool,
    /// Age \[ms\] and share \[%\] of the pilot tasks of all arms that settled.
    pub settled_percent: Vec<(f64, f64)>,
    /// The greatest age \[ms\] up to which at least 95 % as many settle as with fresh ones.
    pub holds_up_to_ms: f64,
}

/// Every law, with its gain for equal settling time, without and with limits.
///
/// # Errors
/// As the loops.
pub fn ageing(study: &Study) -> Result<Vec<Ageing>, CompareError> {
    let pilots = study.arms.iter().map(Pilots::new).collect::<Result<Vec<_>, _>>()?;
    let mut all = Vec::new();
    for law in Law::ALL {
        for limits in [false, true] {
            all.push(law_ageing(study, &pilots, law, limits)?);
        }
    }
    Ok(all)
}

fn law_ageing(study: &Study, pilots: &[Pilots], law: Law, limits: bool) -> Result<Ageing, CompareError> {
    let mut settled_percent = Vec::new();
    for latency in AGES {
        let plant = Plant { name: "latency", latency, noise: 0.0 };
        let (mut settled, mut runs) = (0, 0);
        for (arm, pilots) in study.arms.iter().zip(pilots) {
            let gain = study.gain(Matched::SettlingTime, &arm.name, law);
            let controller = arm.parameters.settings.controller.with_law(law, gain);
            let ended = pilots.run(&ClosedLoop { arm, controller, plant, limits })?;
            settled += ended.iter().filter(|ended| ended.outcome == Outcome::Settled).count();
            runs += ended.len();
        }
        let age = 1e3 * PERIOD.as_secs_f64() * latency as f64;
        settled_percent.push((age, 100.0 * settled as f64 / runs.max(1) as f64));
    }
    let enough = 0.95 * settled_percent[0].1;
    let holds = settled_percent.iter().take_while(|(_, share)| *share >= enough).last();
    let holds_up_to_ms = holds.map_or(0.0, |(age, _)| *age);
    Ok(Ageing { law: law.name().to_owned(), limits, settled_percent, holds_up_to_ms })
}
