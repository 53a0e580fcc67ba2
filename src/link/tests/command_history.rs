//! Tests of [`CommandHistory`].

use super::MS;
use crate::command_history::*;
use dq_limits::Interface;
use std::time::Duration;

fn travel(history: &CommandHistory, from: u32, to: u32) -> f64 {
    let mut out = [0.0];
    history.travel(0..1, from * MS, to * MS, &mut out);
    out[0]
}

#[test]
fn the_travel_between_two_times_is_the_sum_of_the_commands_between() {
    let mut history = CommandHistory::new(1, 2 * MS, Interface::Velocity);
    for cycle in 0..10 {
        history.note(cycle * 2 * MS, &[f64::from(cycle)], &[0.0]);
    }
    // The commands are 3 rad/s from 6 to 8 ms and 4 rad/s from 8 to 10 ms. Half of the first command counts.
    assert!((travel(&history, 7, 10) - (0.003 + 0.008)).abs() < 1e-14);
    assert_eq!(travel(&history, 7, 7), 0.0);
    assert_eq!(travel(&history, 0, 0), 0.0);
    // The last command continues, but not forever.
    assert!((travel(&history, 18, 20) - 0.018).abs() < 1e-15);
    assert!((travel(&history, 18, 1000) - 0.9).abs() < 1e-12);
}

#[test]
fn positions_move_on_by_a_period_a_command_however_late_the_next_one_is() {
    let mut history = CommandHistory::new(1, 2 * MS, Interface::Position);
    [0, 9, 10, 30].into_iter().for_each(|late| history.note(late * MS, &[1.0], &[0.0]));
    for (until, steps) in [(1, 0.5), (8, 1.0), (9, 1.0), (10, 2.0), (29, 3.0), (31, 3.5), (99, 4.0)] {
        let distance = travel(&history, 0, until);
        assert!((distance - 0.002 * steps).abs() < 1e-14, "{until} ms: {distance}");
    }
}

#[test]
fn memory_is_bounded_and_a_clock_that_goes_back_forgets() {
    let mut history = CommandHistory::new(1, 2 * MS, Interface::Velocity);
    for cycle in 1000..5000 {
        history.note(cycle * 2 * MS, &[1.0], &[0.0]);
    }
    assert!((history.capacity..2 * history.capacity).contains(&history.times.len()));
    assert!((travel(&history, 9300, 10000) - 0.7).abs() < 1e-9);
    assert!(travel(&history, 0, 10000) < 1.5, "no further back than is remembered");
    history.note(MS, &[1.0], &[0.0]);
    assert_eq!(travel(&history, 0, 1), 0.0);
    assert!((travel(&history, 1, 3) - 0.002).abs() < 1e-15);
}

#[test]
fn a_window_that_moves_back_is_the_one_that_begins_there() {
    let mut history = CommandHistory::new(2, 2 * MS, Interface::Velocity);
    for cycle in 0..200_u32 {
        history.note(cycle * 2 * MS, &[f64::from(cycle % 7), -1.0], &[0.0; 2]);
    }
    let mut window = history.window(300 * MS, 400 * MS);
    for step in 1..90 {
        window.move_back(5 * MS);
        let at = |time: u32| (time * MS).saturating_sub(5 * step * MS);
        let direct: Vec<_> = history.window(at(300), at(400)).distances(0..2).collect();
        let moved: Vec<_> = window.distances(0..2).collect();
        assert!(direct.iter().zip(&moved).all(|(a, b)| (a - b).abs() < 1e-12), "{step}");
    }
}

#[test]
fn an_arm_stands_after_its_last_command_has_ended() {
    let mut history = CommandHistory::new(2, 2 * MS, Interface::Velocity);
    assert!(history.stood_after(Duration::ZERO));
    history.note(10 * MS, &[0.0, 0.1], &[0.0; 2]);
    assert!(!history.stood_after(20 * MS));
    history.note(30 * MS, &[0.0, 0.0], &[0.0; 2]);
    history.note(40 * MS, &[0.0, 0.0], &[0.0; 2]);
    assert!(history.stood_after(30 * MS) && !history.stood_after(29 * MS));
}
