//! Computes the values of the texts on the page "What the laws do". A value is missing if the findings do not support the sentence
//! that needs it.

use super::latency::FIRST;
use super::matching::PILOTS;
use super::numbers::{brief, percent, probability, range, signed, time};
use super::tables::age;
use super::templates::{Values, fill};
use super::{ALL_ARMS, Comparison, Findings, Key, Matched, Quantity, REFERENCE, Unmatched};
use dq_kinematics::control::Map;

pub(super) fn values(findings: &Findings) -> Values {
    let off = |matched, map| {
        let off = findings.most_off(matched, map);
        off.map_or("an unknown amount".to_owned(), |off| format!("{off:.1} %"))
    };
    let mut values = Values::from([
        ("tasks", findings.tasks.to_string()),
        ("seed", findings.seed.to_string()),
        ("arm_names", findings.arms.join(", ")),
        ("arms", findings.arms.len().to_string()),
        ("period", (1e3 * findings.period_s).to_string()),
        ("horizon", findings.horizon_s.to_string()),
        ("reference", REFERENCE.0.to_string()),
        ("reference_gain", REFERENCE.1.to_string()),
        ("pilots", PILOTS.to_string()),
        ("time_inverse", off(Matched::SettlingTime, Map::DampedInverse)),
        ("time_transpose", off(Matched::SettlingTime, Map::Transpose)),
        ("speed_inverse", off(Matched::PeakSpeed, Map::DampedInverse)),
        ("speed_transpose", off(Matched::PeakSpeed, Map::Transpose)),
        ("first", FIRST.to_string()),
        ("baseline", findings.baseline().to_owned()),
        ("comparisons", findings.comparisons.len().to_string()),
    ]);
    if let Some(tasks) = findings.peers.iter().map(|peer| peer.cell.runs).max() {
        values.insert("peer_tasks", tasks.to_string());
    }
    values.extend(of_unmatched_gains(findings));
    values.extend(of_best_law(findings).unwrap_or_default());
    values.extend(reversed_arms(findings).map(|reversed| ("reversed", reversed)));
    values
}

/// Returns the values that explain why gains miss their targets.
fn of_unmatched_gains(findings: &Findings) -> Values {
    let of = |matched| findings.unmatched.iter().filter(move |it| it.gain.matched == matched);
    let [times, speeds] = [Matched::SettlingTime, Matched::PeakSpeed].map(|matched| of(matched).count());
    let mut values = Values::new();
    if times > 0 {
        let fastest = of(Matched::SettlingTime).filter(|it| it.is_fastest()).count();
        values.extend([("missed_times", times.to_string()), ("fastest", fastest.to_string())]);
    }
    if speeds > 0 {
        let most = of(Matched::PeakSpeed).map(Unmatched::uncertain_percent).fold(0.0, f64::max);
        values.extend([("missed_speeds", speeds.to_string()), ("uncertain", format!("{most:.1}"))]);
    }
    values
}

fn key(law: &str, arm: &str) -> Key {
    Key::fresh(Matched::SettlingTime, law, arm, true)
}

/// Formats a difference and its probability. `unit` is written directly after the difference, so it begins with a space.
fn told(compared: &Comparison, unit: &str) -> String {
    format!("{}{unit} ({})", signed(compared.difference), probability(compared.p_holm))
}

/// Returns the values about the best laws: the law that settles the most tasks under the servo's limits, and the laws that settle
/// about as many. If one of these laws has a significantly straighter path than the others, also returns the values about its path.
fn of_best_law(findings: &Findings) -> Option<Values> {
    let laws = findings.laws();
    let cell = |law: &str| findings.cell(&key(law, ALL_ARMS));
    let share = |law: &str| cell(law).map_or(0.0, |cell| cell.settled_percent.value);
    let best = laws.iter().copied().max_by(|a, b| share(a).total_cmp(&share(b)))?;
    let compared =
        |quantity, law: &str, other: &str| findings.comparison(quantity, &key(law, ALL_ARMS), other);
    let is_worse =
        |law: &str| compared(Quantity::Settled, law, best).is_some_and(|compared| compared.tells());
    let (rest, good): (Vec<&str>, Vec<_>) = laws.iter().copied().partition(|law| is_worse(law));
    // Returns the comparison of `law` with the law among `others` that differs from it the least significantly.
    let nearest = |quantity, others: &[&str], law: &str| {
        let each = others.iter().filter_map(|other| compared(quantity, other, law));
        let size = |compared: &Comparison| compared.difference.value.abs();
        each.max_by(|a, b| a.p_holm.total_cmp(&b.p_holm).then(size(b).total_cmp(&size(a))))
    };
    let gain = range(findings.gain_range(Matched::SettlingTime, best));
    let [free, limited] = [false, true].map(|limits| {
        let cell = findings.cell(&Key { limits, ..key(best, ALL_ARMS) });
        time(cell.and_then(|cell| cell.settling_s), findings.horizon_s)
    });
    let mut values = Values::from([
        ("best", best.to_owned()),
        ("runs", cell(best)?.runs.to_string()),
        ("settled", percent(cell(best)?.settled_percent)),
        ("gain", gain),
        ("free", free),
        ("limited", limited),
        ("free_age", age(findings, best, false)),
        ("limited_age", age(findings, best, true)),
    ]);
    let Some(next) = nearest(Quantity::Settled, &rest, best) else {
        values.insert("undecided", String::new());
        return Some(values);
    };
    let names = good.iter().map(|law| format!("`{law}`")).collect::<Vec<_>>().join(", ");
    let alike = if good.len() > 1 { fill("alike", &values)? } else { String::new() };
    let one_of = if good.len() > 1 { "one of " } else { "" };
    values.extend([("good", one_of.to_owned() + &names), ("alike", alike)]);
    values.extend([("next", next.laws[0].clone()), ("next_told", told(&next, " points"))]);
    let path = |law: &str| cell(law).and_then(|cell| cell.path_ratio);
    let length = |law: &str| path(law).map_or(f64::INFINITY, |path| path.value);
    let straightest = good.iter().copied().min_by(|a, b| length(a).total_cmp(&length(b)))?;
    let next = nearest(Quantity::PathRatio, &good, straightest).map(|next| next.reversed());
    if let Some(next) = next.filter(|next| next.tells() && next.difference.high < 0.0) {
        values.extend([("straightest", straightest.to_owned()), ("path", brief(path(straightest)))]);
        values.extend([("path_next", next.laws[1].clone()), ("path_told", told(&next, ""))]);
    }
    Some(values)
}

/// Lists contradictions between one arm and all arms together: on both, a law differs significantly from the baseline, but in
/// opposite directions. Returns `None` if there are no contradictions.
fn reversed_arms(findings: &Findings) -> Option<String> {
    let compared = |law: &str, arm: &str| {
        let compared = findings.comparison(Quantity::Settled, &key(law, arm), findings.baseline());
        compared.filter(Comparison::tells)
    };
    let reversed = |(arm, law): (&String, &str)| {
        let (here, all) = (compared(law, arm)?, compared(law, ALL_ARMS)?);
        let is_reversed = here.difference.value * all.difference.value < 0.0;
        let [law, arm] = [law, arm].map(str::to_owned);
        fill("arm_reversed", &[("law", law), ("arm", arm), ("told", told(&here, " points"))].into())
            .filter(|_| is_reversed)
    };
    let each = findings.arms.iter().flat_map(|arm| findings.laws().into_iter().map(move |law| (arm, law)));
    let reversed: Vec<_> = each.filter_map(reversed).collect();
    (!reversed.is_empty()).then(|| reversed.join("; "))
}
