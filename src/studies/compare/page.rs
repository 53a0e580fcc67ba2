//! Writes the page "What the laws do" from the findings.

use super::latency::FIRST;
use super::matching::PILOTS;
use super::numbers::percent;
use super::sentences::sentences;
use super::{ALL_ARMS, Findings, Interval, Matched, REFERENCE, Unmatched, tables};
use dq_kinematics::control::{Law, Map};
use std::fmt::Write as _;

/// Returns the page as Markdown. All its numbers come from the findings.
pub fn page(findings: &Findings) -> String {
    let mut page = String::from("# What the laws do\n\n");
    for sentence in sentences(findings) {
        let _ = writeln!(page, "- {sentence}");
    }
    page += &how(findings);
    for (matched, title) in
        [(Matched::SettlingTime, "Equal settling time"), (Matched::PeakSpeed, "Equal peak speed")]
    {
        for (limits, under) in [(false, "no limits"), (true, "the servo's limits")] {
            let _ = write!(
                page,
                "\n## {title}, {under}\n\nFresh joint states. {}\n\n",
                on_common(findings, matched, limits)
            );
            page += &tables::figures(findings, matched, limits);
            let _ = write!(page, "\nEach law less `{}`, on the tasks that both settle:\n\n", REFERENCE.0);
            page += &tables::differences(findings, matched, limits);
        }
    }
    page += "\n## What settles\n\nShare of the tasks that settled, with gains for equal settling time. Under limits the servo predicts where \
             the arm is by the age of the joint states, and lowers gains that their age makes unstable: these columns show that as well as \
             the laws.\n\n";
    page += &tables::settled(findings);
    for arm in &findings.arms {
        let _ = write!(
            page,
            "\n## {arm}\n\nFresh joint states, gains for equal settling time; differences in points.\n\n"
        );
        page += &tables::of_arm(findings, arm);
    }
    page += "\n## Why the others fail\n\nTasks under the servo's limits with fresh joint states, with gains for equal settling time.\n\n";
    page += &tables::failures(findings);
    page += "\n## How old joint states may be\n\nThe greatest age at which at least 95 % of the tasks settle that settle with fresh joint \
             states, with gains for equal settling time. The brackets reach from the greatest age at which that is sure to the least at \
             which it is sure not to be so, by Wilson's 95 % intervals; ages are tried in half octaves";
    let _ = write!(
        page,
        ", on all tasks; on the first {FIRST} of each arm where these leave no doubt (p < 1e-4).\n\n"
    );
    page += &tables::ages(findings);
    if !findings.peers.is_empty() {
        page += &peers(findings);
    }
    page
}

/// Returns the section about other programs.
fn peers(findings: &Findings) -> String {
    let tasks = findings.peers.iter().map(|peer| peer.cell.runs).max().unwrap_or(0);
    let mut page = format!(
        "\n## Other programs\n\nThe first {tasks} tasks, the same number of each arm, by `tests/benches/compare_peers.py`: `pink` is a frame \
         task of the Python package pin-pink; `dq_robotics` the pseudoinverse controller of DQ Robotics, under limits its quadratic program; \
         `logc_by_pinocchio` the law `{law}` written with Pinocchio's logarithm and Jacobian. Their gains are chosen on tasks of their own, so \
         that the median settling time without limits is that of `{law}`. Under limits they hold the joint speeds, accelerations and \
         positions that the servo holds too; the servo's limits of the tool's speed they do not have. The tests are those above, and counted \
         there.\n",
        law = REFERENCE.0
    );
    for (limits, under) in [(false, "No limits"), (true, "Under limits")] {
        let _ = write!(page, "\n{under}:\n\n{}", tables::peers(findings, limits));
    }
    page
}

fn how(findings: &Findings) -> String {
    let off = |matched, map| {
        let off = findings.most_off(matched, |law| law.map() == map);
        off.map_or("more than half of the tasks".to_owned(), |off| format!("{off:.1} %"))
    };
    format!(
        "\nEach number on this page was written by `dq_servo compare --out DIR --tasks {} --seed {}`. The arms are {}; start and goal of \
         a task are poses of random joint angles between the arm's position limits. Every loop runs in cycles of {} ms and \
         ends when the error has been within 2 % of its initial value (or the goal tolerances) for half a second, or after {} s as a \
         failure. The gains of the laws are chosen for each arm on tasks of their own, so that the median settling time is that of \
         `{}` with gain {}, and again so that the median peak joint speed is. On as many other tasks the settling times are off by at most {} \
         with the damped inverse and {} with the transpose, the peak speeds by {} and {}; † marks a law that is off by more than 2 % on some arm. \
         {}`lq` and `h_infinity` are `diffc_inverse` and `unit_quaternion` with a gain for the translation that is twice that for the \
         rotation. With the transpose such gains lie at the edge of what this cycle allows: joint states that are one cycle old undo them.\n\n\
         All laws run the same tasks, so they are compared pair by pair: shares by the exact test of McNemar, other figures by the exact \
         sign test on the tasks that both settle. A p is by Holm for all {} comparisons that were made; ∗ marks a difference with a p below 0.05 \
         whose interval leaves out zero. Brackets hold 95 % confidence intervals: Wilson's for shares, those of Agresti and Min for \
         differences of shares, order statistics for medians.\n",
        findings.tasks,
        findings.seed,
        findings.arms.join(", "),
        1e3 * findings.period_s,
        findings.horizon_s,
        REFERENCE.0,
        REFERENCE.1,
        off(Matched::SettlingTime, Map::DampedInverse),
        off(Matched::SettlingTime, Map::Transpose),
        off(Matched::PeakSpeed, Map::DampedInverse),
        off(Matched::PeakSpeed, Map::Transpose),
        why_unmatched(findings),
        findings.comparisons.len(),
    )
}

/// Explains why gains miss their targets: one sentence for each matched quantity, followed by a space.
fn why_unmatched(findings: &Findings) -> String {
    let of = |matched| findings.unmatched.iter().filter(move |unmatched| unmatched.gain.matched == matched);
    let mut why = String::new();
    let fastest = of(Matched::SettlingTime).filter(|unmatched| unmatched.is_fastest()).count();
    match of(Matched::SettlingTime).count() {
        0 => {}
        all => {
            let _ = write!(
                why,
                "Of the {all} gains that miss the settling time {fastest} are as fast as their law gets in this cycle: on the same tasks it \
                 is slower both with half an octave less and with half an octave more, with which it swings. "
            );
        }
    }
    let most = |value: fn(&Unmatched) -> f64| of(Matched::PeakSpeed).map(value).fold(0.0, f64::max);
    if of(Matched::PeakSpeed).count() > 0 {
        let _ = write!(
            why,
            "Peak speeds differ too much from task to task: on {PILOTS} tasks the {} medians that are off are known to ± {:.1} % at worst; \
             to know that one to ± 2 % would take {:.0} tasks for each step of the search. ",
            of(Matched::PeakSpeed).count(),
            most(Unmatched::uncertain_percent),
            most(Unmatched::tasks_needed),
        );
    }
    why
}

/// Explains on which tasks the medians are computed.
fn on_common(findings: &Findings, matched: Matched, limits: bool) -> String {
    let cell = |law| findings.cell(matched, law, ALL_ARMS, limits, "ideal");
    let common = Law::all().filter_map(cell).find_map(|cell| Some((cell.common?, cell.runs)));
    let (common, runs) = common.unwrap_or((0, 0));
    let share = percent(Some(Interval::share(common, runs, super::summary::Z)));
    format!(
        "Settling time is the median of all tasks, where one that failed settles later than {} s. The figures after it are medians on the \
         same tasks for all laws: the {common} ({share}) that every law settles which settles at least half of all.",
        findings.horizon_s
    )
}
