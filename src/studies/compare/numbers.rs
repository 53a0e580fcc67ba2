//! Formats numbers, intervals and probabilities for the page "What the laws do".

use super::Interval;

/// Formats a number with three digits. The confidence intervals do not justify more.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        v if !v.is_finite() => "-".to_owned(),
        v if v < 0.0005 => "0".to_owned(),
        v if v < 1.0 => format!("{value:.3}"),
        v if v < 10.0 => format!("{value:.2}"),
        v if v < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

pub(super) fn range([low, high]: [f64; 2]) -> String {
    match number(low) == number(high) {
        true => number(low),
        false => format!("{} to {}", number(low), number(high)),
    }
}

/// Formats an interval; a dash for `None`.
pub(super) fn brief(interval: Option<Interval>) -> String {
    interval.map_or("-".to_owned(), |interval| bracketed(interval, number))
}

/// Formats a time \[s\]. A time beyond the horizon is written as "> horizon".
pub(super) fn time(interval: Option<Interval>, horizon: f64) -> String {
    let told = |time: f64| if time < horizon { number(time) } else { format!("> {horizon}") };
    match interval {
        Some(interval) if interval.low >= horizon => told(interval.low),
        Some(interval) => bracketed(interval, told),
        None => "-".to_owned(),
    }
}

/// Formats a percentage without the percent sign, for a column whose heading has the unit.
pub(super) fn share(interval: Interval) -> String {
    bracketed(interval, |value| format!("{value:.1}"))
}

pub(super) fn percent(interval: Interval) -> String {
    share(interval).replacen(' ', " % ", 1)
}

/// Formats a difference with a plus or minus sign.
pub(super) fn signed(interval: Interval) -> String {
    bracketed(interval, |value| match number(value) {
        text if value > 0.0 && text != "0" => format!("+{text}"),
        text => text.replace('-', "−"),
    })
}

fn bracketed(Interval { value, low, high }: Interval, write: impl Fn(f64) -> String) -> String {
    format!("{} [{}, {}]", write(value), write(low), write(high))
}

/// Formats a probability.
pub(super) fn probability(p: f64) -> String {
    match p {
        p if p < 1e-99 => "p < 1e-99".to_owned(),
        p if p < 0.001 => format!("p = {p:.0e}"),
        p => format!("p = {p:.3}"),
    }
}
