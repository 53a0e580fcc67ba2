//! Checks that a joint slows down as fast as its jerk limit allows.

/// Relative tolerance for rounding.
const ROUNDING: f64 = 1e-9;

/// The slowing of a joint with limited jerk, in the direction that slows it [rad/s].
pub(super) struct Slowing {
    /// The step of this cycle, and that of the one before.
    pub step: f64,
    pub before: f64,
    /// The largest step, and the largest change of a step.
    pub most: f64,
    pub jerk: f64,
}

impl Slowing {
    /// Returns the total slowing if the steps from this one on decrease as fast as possible.
    fn slows_by(&self) -> f64 {
        let parts = (self.step / self.jerk).max(0.0);
        let count = parts.floor() + 1.0;
        self.jerk * count * (parts - 0.5 * (count - 1.0))
    }

    /// Returns whether the joint, which is `gap` [rad/s] too fast, slows down as fast as it can.
    pub fn is_enough_for(&self, gap: f64) -> bool {
        let rising = self.step - self.before >= self.jerk * (1.0 - ROUNDING) - 4.0 * f64::EPSILON * gap.abs();
        rising || self.step >= self.most * (1.0 - ROUNDING) || self.slows_by() >= gap - self.slack(gap)
    }

    /// Returns whether the steps after this one can end at a slowing of `gap`, or at least decrease as fast as the jerk allows.
    pub fn ends_at(&self, gap: f64) -> bool {
        let falling =
            self.before - self.step >= self.jerk * (1.0 - ROUNDING) - 4.0 * f64::EPSILON * gap.abs();
        falling || self.slows_by() <= gap + self.slack(gap)
    }

    fn slack(&self, gap: f64) -> f64 {
        ROUNDING * (self.jerk + gap.abs())
    }
}

/// Returns `limit` with a tolerance for rounding in numbers of the size of `before`.
pub(super) fn rounded(limit: f64, before: f64) -> f64 {
    limit * (1.0 + ROUNDING) + f64::EPSILON * before.abs()
}
