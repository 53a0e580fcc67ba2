//! Whether a joint slows down as fast as its jerk lets it.

/// Room for rounding, relative.
const ROUNDING: f64 = 1e-9;

/// How a joint slows down whose jerk is limited, along the direction that slows it [rad/s].
pub(super) struct Slowing {
    /// What a cycle changes, and what the one before has changed.
    pub step: f64,
    pub before: f64,
    /// The most that it may be, and by how much it may be another one.
    pub most: f64,
    pub jerk: f64,
}

impl Slowing {
    /// What steps from this one on slow down by that get smaller as fast as they may.
    fn slows_by(&self) -> f64 {
        let parts = (self.step / self.jerk).max(0.0);
        let count = parts.floor() + 1.0;
        self.jerk * count * (parts - 0.5 * (count - 1.0))
    }

    /// Whether nothing that is `gap` [rad/s] too fast could slow down faster.
    pub fn is_enough_for(&self, gap: f64) -> bool {
        let rising = self.step - self.before >= self.jerk * (1.0 - ROUNDING) - 4.0 * f64::EPSILON * gap.abs();
        rising || self.step >= self.most * (1.0 - ROUNDING) || self.slows_by() >= gap - self.slack(gap)
    }

    /// Whether it can slow down by `gap` and no more, or does all for that.
    pub fn ends_at(&self, gap: f64) -> bool {
        let falling =
            self.before - self.step >= self.jerk * (1.0 - ROUNDING) - 4.0 * f64::EPSILON * gap.abs();
        falling || self.slows_by() <= gap + self.slack(gap)
    }

    fn slack(&self, gap: f64) -> f64 {
        ROUNDING * (self.jerk + gap.abs())
    }
}

/// `limit` with room for rounding: the digits of what was computed from `before` end somewhere.
pub(super) fn rounded(limit: f64, before: f64) -> f64 {
    limit * (1.0 + ROUNDING) + f64::EPSILON * before.abs()
}
