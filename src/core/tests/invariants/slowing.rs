//! Checks that a joint slows down as fast as its jerk limit allows.

/// Tolerance for rounding errors, as a fraction of the compared number.
const ROUNDING: f64 = 1e-9;

/// How a joint with limited jerk slows down. A change of speed is positive if it slows the joint down.
pub(super) struct Slowing {
    /// The change of speed in this cycle [rad/s, prismatic: m/s].
    pub step: f64,
    /// The change of speed in the previous cycle [rad/s, prismatic: m/s].
    pub before: f64,
    /// The largest allowed change of speed per cycle [rad/s, prismatic: m/s].
    pub most: f64,
    /// The largest allowed difference between the changes of speed in two successive cycles [rad/s, prismatic: m/s].
    pub jerk: f64,
}

impl Slowing {
    /// Returns by how much the joint slows down in total, from this change of speed on, if the changes decrease by `jerk` per cycle
    /// [rad/s, prismatic: m/s].
    fn slows_by(&self) -> f64 {
        let parts = (self.step / self.jerk).max(0.0);
        let count = parts.floor() + 1.0;
        self.jerk * count * (parts - 0.5 * (count - 1.0))
    }

    /// Returns whether a joint that is too fast by `gap` [rad/s, prismatic: m/s] slows down as fast as its limits allow.
    pub fn is_enough_for(&self, gap: f64) -> bool {
        let rising = self.step - self.before >= self.jerk * (1.0 - ROUNDING) - 4.0 * f64::EPSILON * gap.abs();
        rising || self.step >= self.most * (1.0 - ROUNDING) || self.slows_by() >= gap - self.slack(gap)
    }

    /// Returns whether a joint that must slow down by `gap` [rad/s, prismatic: m/s] can avoid slowing down by more. This holds if
    /// the changes of speed decrease as fast as the jerk limit allows, or already add up to at most `gap`.
    pub fn ends_at(&self, gap: f64) -> bool {
        let falling =
            self.before - self.step >= self.jerk * (1.0 - ROUNDING) - 4.0 * f64::EPSILON * gap.abs();
        falling || self.slows_by() <= gap + self.slack(gap)
    }

    fn slack(&self, gap: f64) -> f64 {
        ROUNDING * (self.jerk + gap.abs())
    }
}

/// Returns `limit` plus a tolerance for the rounding errors of numbers as large as `limit` and `before`.
pub(super) fn rounded(limit: f64, before: f64) -> f64 {
    limit * (1.0 + ROUNDING) + f64::EPSILON * before.abs()
}
