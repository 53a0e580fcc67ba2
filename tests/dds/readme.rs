//! Tests that the numbers that the README prints after a command are those that the command prints.

use crate::host::Host;

const README: &str = include_str!("../../README.md");

/// The largest relative and absolute differences between a number and the README's. The demo's cycles are those of a busy machine.
const RELATIVE: f64 = 0.15;
const ABSOLUTE: f64 = 0.1;

/// Returns the numbers in the line of `text` that contains `word`.
fn numbers(text: &str, word: &str) -> Vec<f64> {
    let line = text.lines().find(|line| line.contains(word)).unwrap_or_else(|| panic!("no {word:?}: {text}"));
    let (_, after) = line.split_once(word).unwrap();
    after.split_whitespace().filter_map(|part| part.trim_end_matches([':', ',']).parse().ok()).collect()
}

/// Compares the numbers after `printed_word` in the text that a command printed with those after `word` in the README.
#[track_caller]
fn assert_printed(printed: &str, printed_word: &str, word: &str) {
    let (ours, readme) = (numbers(printed, printed_word), numbers(README, word));
    assert!(!readme.is_empty() && ours.len() >= readme.len(), "{ours:?}, README: {readme:?}");
    for (one, other) in ours.iter().zip(&readme) {
        assert!((one - other).abs() <= RELATIVE * other.abs() + ABSOLUTE, "{ours:?}, README: {readme:?}");
    }
}

#[test]
fn the_readme_s_table_is_the_demo_s() {
    let printed = Host::new().output(&["demo"]);
    assert_printed(&printed, "logc  ", "logc  ");
    assert_printed(&printed, "diffc  ", "diffc  ");
}

#[test]
fn the_readme_s_goal_takes_the_time_and_the_path_that_it_says() {
    let host = Host::with_nodes(&[], &[]);
    let goal = README.lines().find_map(|line| line.strip_prefix("dq_servo goal ")).unwrap();
    let (pose, _) = goal.split_once('#').unwrap();
    let command: Vec<_> = ["goal"].into_iter().chain(pose.split_whitespace()).collect();
    assert_printed(&host.output(&command), "arrived with", "arrived in");
}
