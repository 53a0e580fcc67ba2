//! Scaling of numbers to limits.

/// Multiplies `values` by `factor` if the factor is below 1.
pub fn scale(values: &mut [f64], factor: f64) {
    if factor < 1.0 {
        values.iter_mut().for_each(|value| *value *= factor);
    }
}

/// Returns the factor, at most 1, that scales `value` to at most `limit`.
pub fn ratio(limit: f64, value: f64) -> f64 {
    if value > limit { limit / value } else { 1.0 }
}

/// Returns `value`, but at least `lowest` and at most `highest`. Unlike `f64::clamp` it never panics. A NaN bound has no effect. A
/// NaN value stays NaN, and the servo's final check of the command detects it.
pub(crate) fn between(value: f64, lowest: f64, highest: f64) -> f64 {
    if value < lowest {
        lowest
    } else if value > highest {
        highest
    } else {
        value
    }
}
