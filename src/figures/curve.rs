//! Selects the part of a curve that is drawn: its range, clipping and density. Also computes the ticks of axes.

use std::ops::Range;

/// Returns a copy of a curve with fewer points. Leaves out each point whose `distance` from the previous kept point is less than 1.
/// Keeps the first and the last point.
pub(super) fn spaced<P: Copy>(points: &[P], distance: impl Fn(&P, &P) -> f64) -> Vec<P> {
    let mut kept: Vec<P> = Vec::new();
    for (i, point) in points.iter().enumerate() {
        if i + 1 == points.len() || kept.last().is_none_or(|last| distance(point, last) >= 1.0) {
            kept.push(*point);
        }
    }
    kept
}

/// Returns the parts of a curve that are within the ranges, clipped at their borders.
pub fn clip(points: &[(f64, f64)], x: &Range<f64>, y: &Range<f64>) -> Vec<Vec<(f64, f64)>> {
    let mut parts: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in points.windows(2) {
        let Some((from, to)) = clip_segment(pair[0], pair[1], x, y) else { continue };
        match parts.last_mut() {
            Some(part) if part.last() == Some(&from) => part.push(to),
            _ => parts.push(vec![from, to]),
        }
    }
    parts
}

/// Returns the part of a segment that is within the ranges, if any (Liang & Barsky 1984).
fn clip_segment(
    from: (f64, f64),
    to: (f64, f64),
    x: &Range<f64>,
    y: &Range<f64>,
) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (direction, distance) in
        [(-dx, from.0 - x.start), (dx, x.end - from.0), (-dy, from.1 - y.start), (dy, y.end - from.1)]
    {
        if !(direction.is_finite() && distance.is_finite()) || (direction == 0.0 && distance < 0.0) {
            return None;
        }
        if direction < 0.0 {
            enter = enter.max(distance / direction);
        } else if direction > 0.0 {
            leave = leave.min(distance / direction);
        }
    }
    let inside = |value: f64, range: &Range<f64>| value.clamp(range.start, range.end);
    let at = |part: f64| (inside(from.0 + part * dx, x), inside(from.1 + part * dy, y));
    (enter <= leave).then(|| (at(enter), at(leave)))
}

/// Returns about `count` round values within a range, with their texts.
pub fn ticks(range: &Range<f64>, count: f64) -> Vec<(f64, String)> {
    let rough = (range.end - range.start) / count;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|step| *step >= rough).unwrap_or(power);
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let first = (range.start / step - 1e-9).ceil() as i64;
    let last = (range.end / step + 1e-9).floor() as i64;
    let text = |value: f64| format!("{value:.digits$}").replace('-', "−");
    (first..=last).map(|i| i as f64 * step).map(|value| (value, text(value + 0.0))).collect()
}

/// Returns the values 1, 2 and 5 of each decade within a range above 0, with their texts. If there are more than `most` such
/// values, returns only the values 1.
pub fn decades(range: &Range<f64>, most: f64) -> Vec<(f64, String)> {
    let powers = range.start.log10().floor() as i32..=range.end.log10().floor() as i32;
    let all = |digits: &[f64]| {
        let values = powers
            .clone()
            .flat_map(|power| digits.iter().map(move |digit| (power, digit * 10.0_f64.powi(power))));
        let shown = values.filter(|(_, value)| range.contains(value) || *value == range.end);
        let text = |power: i32, value| format!("{value:.*}", (-power).max(0) as usize);
        shown.map(|(power, value)| (value, text(power, value))).collect::<Vec<_>>()
    };
    let ticks = all(&[1.0, 2.0, 5.0]);
    if ticks.len() as f64 > most { all(&[1.0]) } else { ticks }
}

/// Returns a range that contains all `values`, with a margin.
pub fn range_of(values: impl Iterator<Item = f64>) -> Range<f64> {
    // Between values above `LARGEST` there may be no representable numbers; differences below `SMALLEST` have no ticks.
    const LARGEST: f64 = 1e100;
    const SMALLEST: f64 = 1e-60;
    let (low, high) = values
        .filter(|value| value.abs() < LARGEST)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    match high - low {
        room if room > 1e-12 * low.abs().max(high.abs()).max(SMALLEST) => {
            low - 0.05 * room..high + 0.05 * room
        }
        _ if low.is_finite() => low - 0.5..low + 0.5,
        _ => 0.0..1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ticks_are_round() {
        let texts = |range| ticks(&range, 5.0).into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(texts(0.0..10.0), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(texts(-0.09..0.09), ["−0.05", "0.00", "0.05"]);
    }

    #[test]
    fn a_curve_is_cut_where_it_leaves() {
        let points = [(0.0, 0.0), (1.0, 2.0), (2.0, 0.0)];
        let parts = clip(&points, &(0.0..2.0), &(-1.0..1.0));
        assert_eq!(parts, [vec![(0.0, 0.0), (0.5, 1.0)], vec![(1.5, 1.0), (2.0, 0.0)]]);
    }

    proptest! {
        #[test]
        fn nothing_is_drawn_outside_the_axes(points in prop::collection::vec((any::<f64>(), -9.0..9.0f64), 0..30)) {
            for (x, y) in clip(&points, &(-1.0..2.0), &(-3.0..1.0)).into_iter().flatten() {
                prop_assert!((-1.0..=2.0).contains(&x) && (-3.0..=1.0).contains(&y));
            }
        }
    }
}
