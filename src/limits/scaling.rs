//! Numbers that are brought under others.

/// Brings `values` down to a part of themselves.
pub fn scale(values: &mut [f64], factor: f64) {
    if factor < 1.0 {
        values.iter_mut().for_each(|value| *value *= factor);
    }
}

/// `limit / value`, at most 1.
pub fn ratio(limit: f64, value: f64) -> f64 {
    if value > limit { limit / value } else { 1.0 }
}

/// `value`, but not below `lowest` nor above `highest`. Unlike `f64::clamp` it takes any numbers: a bound that is not one is none,
/// and what is not a number stays so, for the gate to see.
pub(crate) fn between(value: f64, lowest: f64, highest: f64) -> f64 {
    if value < lowest {
        lowest
    } else if value > highest {
        highest
    } else {
        value
    }
}
