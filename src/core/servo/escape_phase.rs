//! The phase of a motion while it passes a singularity.

use dq_search::ESCAPE_SPEED;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// An escape ends if the error grows by more than this fraction for each rad that the joints move along the escape. In that case
/// the law alone does better.
const RISE: f64 = 1e-3;

/// An escape that has moved the joints farther than this \[rad, prismatic: m\] has failed.
const LONGEST: f64 = 3.0;

/// The phase of a motion, and the law's error when its last escape began.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct EscapePhase {
    pub phase: Phase,
    /// The law's error when the last escape began; infinite if there was no escape.
    pub began: f64,
}

/// The phases of an escape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Phase {
    Free,
    Stuck {
        since: Duration,
    },
    Escaping {
        /// The distance along the escape so far \[rad, prismatic: m\].
        travelled: f64,
    },
    /// The law is stuck, and there is no escape.
    Closed,
}

impl Phase {
    /// Returns the next phase of an escape.
    ///
    /// The escape has moved the joints by `travelled` \[rad, prismatic: m\]. `speed` is the speed at which the law alone would move
    /// the joints along the escape [rad/s, prismatic: m/s]. `fall` is the fraction by which the error shrinks per rad of the escape
    /// [1/rad].
    ///
    /// The escape ends if `speed` is at least [`ESCAPE_SPEED`], if the error grows faster than [`RISE`], or if `speed` or `fall` is
    /// NaN. Otherwise, the escape fails if `travelled` exceeds [`LONGEST`] or is NaN.
    pub fn escaping(travelled: f64, speed: f64, fall: f64) -> Self {
        let leads_on = speed < ESCAPE_SPEED && fall >= -RISE;
        match leads_on {
            false => Self::Free,
            true if travelled <= LONGEST => Self::Escaping { travelled },
            true => Self::Closed,
        }
    }
}

impl Default for EscapePhase {
    fn default() -> Self {
        Self { phase: Phase::Free, began: f64::INFINITY }
    }
}

impl EscapePhase {
    /// Returns whether the arm is escaping from a singularity.
    pub fn is_escaping(&self) -> bool {
        matches!(self.phase, Phase::Escaping { .. })
    }

    /// Adds the motion along the escape in this cycle \[rad, prismatic: m\].
    pub fn travel(&mut self, further: f64) {
        if let Phase::Escaping { travelled } = &mut self.phase {
            *travelled += further;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_escape_ends_if_the_law_moves_along_it_or_the_error_rises_or_it_is_too_long() {
        let (slow, fast, nan) = (0.9 * ESCAPE_SPEED, ESCAPE_SPEED, f64::NAN);
        for (travelled, speed, fall, expected) in [
            (1.0, slow, 0.0, Phase::Escaping { travelled: 1.0 }),
            (1.0, slow, -0.9 * RISE, Phase::Escaping { travelled: 1.0 }),
            (1.0, fast, 0.0, Phase::Free),
            (1.0, slow, -1.1 * RISE, Phase::Free),
            (1.1 * LONGEST, slow, 0.0, Phase::Closed),
            (1.1 * LONGEST, fast, 0.0, Phase::Free),
            (nan, slow, 0.0, Phase::Closed),
            (1.0, nan, 0.0, Phase::Free),
            (1.0, slow, nan, Phase::Free),
            (nan, nan, nan, Phase::Free),
        ] {
            assert_eq!(Phase::escaping(travelled, speed, fall), expected, "{travelled} {speed} {fall}");
        }
    }
}
