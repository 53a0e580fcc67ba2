//! Tests of goals that move: the tool's lag and noise, with and without feed-forward of the goal's motion. One test checks the table in
//! the guide's page on moving goals, and prints the rows that are missing. Other tests check that the arm does not overshoot when a
//! stream of goals ends, and is not flung when a goal jumps.

use super::follow::{EPOCH, Follow, Path, Random, Stream, circle, line, moved, start_of};
use crate::rig::{PERIOD, reading};
use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{GoalMotion, Reason, Revocation, State};
use nalgebra::{UnitQuaternion, Vector3};
use std::time::Duration;

/// Returns the root mean square difference of the tool's velocities under two streams [mm/s]: a real stream, and an even stream
/// without noise.
fn shake(real: &Follow, even: &Follow) -> f64 {
    let (one, other) = (real.velocities(), even.velocities());
    let squares = one.iter().zip(&other).map(|(a, b)| (a - b).norm_squared());
    (squares.sum::<f64>() / one.len() as f64).sqrt()
}

/// Number of streams per row of the guide's table.
const SEEDS: u64 = 20;

/// Returns the median of `SEEDS` numbers and the bounds of its 96 % confidence interval. The bounds are the 6th and the 15th of the
/// sorted numbers. By the binomial distribution, the true median is outside these bounds with a probability of 4 %.
fn median(mut numbers: Vec<f64>) -> [f64; 3] {
    numbers.sort_by(f64::total_cmp);
    [0.5 * (numbers[9] + numbers[10]), numbers[5], numbers[14]]
}

/// Returns four figures in this order: the tool's lag \[mm\] without feed-forward and with feed-forward, then the noise of the tool's
/// velocity [mm/s] without feed-forward and with feed-forward. Each figure is a median with its bounds; see [`median`].
fn figures(arm: &(ServoParameters, Vec<f64>), stream: &Stream) -> [[f64; 3]; 4] {
    let mut figures = [[0.0; 3]; 4];
    for (i, feed_forward) in [false, true].into_iter().enumerate() {
        let run = |stream: &Stream| {
            let mut follow = Follow::begin(arm, feed_forward);
            follow.run(stream);
            follow
        };
        let even = run(&Stream { real: false, ..*stream });
        let real: Vec<_> = (0..SEEDS).map(|seed| run(&Stream { seed, ..*stream })).collect();
        figures[i] = median(real.iter().map(Follow::lag).collect());
        figures[2 + i] = median(real.iter().map(|real| shake(real, &even)).collect());
    }
    figures
}

fn row(name: &str, speed: f64, rate: f64, [lag, lag_fed, shake, shake_fed]: &[[f64; 3]; 4]) -> String {
    let [lag, shake, shake_fed] =
        [lag, shake, shake_fed].map(|[value, low, high]| format!("{value:.0} [{low:.0}, {high:.0}]"));
    let [value, low, high] = lag_fed;
    format!(
        "| {name} | {speed} | {rate} | {lag} | {value:.2} [{low:.2}, {high:.2}] | {shake} | {shake_fed} |\n"
    )
}

#[test]
fn the_tool_keeps_up_with_a_goal_that_moves_as_the_guide_has_it() {
    let guide = include_str!("../../../guide/moving_goals.md");
    let arm = start_of(-0.3);
    let mut missing = String::new();
    for (name, path) in [("line", line as Path), ("circle", circle)] {
        for speed in [0.1, 0.5] {
            for rate in [10.0, 50.0, 500.0] {
                let seconds = if name == "line" { 0.6 / speed } else { 6.0 };
                let stream = Stream { path, speed, rate, seconds, real: true, stamped: true, seed: 0 };
                let figures = figures(&arm, &stream);
                let row = row(name, speed, rate, &figures);
                if !guide.contains(&row) {
                    missing.push_str(&row);
                }
                assert!(figures[1][2] < 0.3 * figures[0][1], "{row}");
            }
        }
    }
    assert_eq!(missing, "", "rows that the guide has not");
}

/// Sends the goals of the stream that are due by now, but no goal that is due after the time `until` \[s\].
fn send_until(follow: &mut Follow, stream: &Stream, sent: &mut u32, until: f64) {
    while f64::from(*sent) / stream.rate <= follow.time().min(until) {
        let taken = f64::from(*sent) / stream.rate;
        let goal = (stream.path)(&follow.start, stream.speed, taken);
        follow.send(&goal, if stream.stamped { EPOCH + (taken * 1e9) as i64 } else { 0 });
        *sent += 1;
    }
}

const LINE: Stream =
    Stream { path: line, speed: 0.5, rate: 50.0, seconds: 0.9, real: false, stamped: true, seed: 7 };

#[test]
fn a_stream_that_ends_is_overshot_by_no_more_than_its_interval() {
    let arm = start_of(-0.3);
    for stamped in [true, false] {
        for rate in [10.0, 50.0, 500.0] {
            let (mut follow, mut sent) = (Follow::begin(&arm, true), 0);
            let stream = Stream { rate, stamped, ..LINE };
            let mut farthest = 0.0_f64;
            while follow.time() < 4.0 {
                send_until(&mut follow, &stream, &mut sent, 0.9);
                let last = line(&follow.start, 0.5, f64::from(sent - 1) / rate);
                follow.cycle(&last);
                farthest = farthest.max(follow.errors.last().unwrap().y);
            }
            // Besides one interval of motion, the bound includes the distance in which the arm stops at 50 rad/s².
            assert!(farthest <= 0.5 / rate + 0.008, "{rate} Hz: {farthest} m");
            assert!(rate > 10.0 || farthest > 0.01, "the motion was fed forward: {farthest}");
            assert_eq!(follow.rig.state(), State::Settled, "where it was seen last");
        }
    }
}

#[test]
fn a_goal_that_leaps_flings_no_arm() {
    let arm = start_of(-0.3);
    let run = |feed_forward| {
        // In streams at 50 Hz, the goal moves at 1 m/s for one interval: to and fro, or once.
        let follow = Follow::goals(&arm, feed_forward, (1500, 10), |start, cycle| {
            let y = if [50, 60, 70].contains(&(cycle / 10)) || cycle > 800 { 0.1 } else { 0.0 };
            (moved(start, Vector3::new(0.0, y, 0.0)), EPOCH + cycle * 2_000_000)
        });
        follow.commands
    };
    assert_eq!(run(false), run(true), "no bit of it is a motion");
}

#[test]
fn goals_that_stand_or_come_once_change_no_bit() {
    let arm = start_of(-0.3);
    let run = |feed_forward, every| {
        let follow = Follow::goals(&arm, feed_forward, (1000, every), |start, cycle| {
            let goal = moved(start, Vector3::new(0.0, 0.1, 0.05));
            // q and −q are the same goal.
            (if (cycle / every) % 2 == 0 { goal } else { -goal }, 0)
        });
        follow.commands
    };
    for every in [1, 10, 50, 5000] {
        assert_eq!(run(false, every), run(true, every), "each {every} cycles");
    }
}

#[test]
fn the_sign_is_carried_from_goal_to_goal() {
    let arm = start_of(-0.3);
    let run = |alternating: bool| {
        let mut follow = Follow::begin(&arm, true);
        follow.along_line(0.5, 0.9, |follow, sent, goal| {
            let goal = if alternating && sent % 2 == 1 { -*goal } else { *goal };
            follow.send(&goal, EPOCH + 20_000_000 * sent);
        });
        follow.errors.last().unwrap().norm()
    };
    let (one, both) = (run(false), run(true));
    assert!((one - both).abs() < 1e-9, "{one} {both}");
}

#[test]
fn stamps_that_make_no_sense_are_not_believed() {
    let arm = start_of(-0.3);
    let run = |stamp: fn(i64) -> i64| {
        let mut follow = Follow::begin(&arm, true);
        follow.along_line(0.5, 1.0, |follow, sent, goal| follow.send(goal, stamp(sent)));
        1e3 * follow.errors.last().unwrap().norm()
    };
    for stamp in [
        (|_| 0) as fn(i64) -> i64,
        |_| i64::MAX,
        |sent| -sent * 20_000_000,
        |sent| EPOCH + sent,
        |sent| EPOCH + sent * sent * 1_000_000_000,
        |sent| if sent % 2 == 0 { i64::MIN } else { i64::MAX },
        |sent| EPOCH + sent * 20_000_000 - if sent > 25 { 3_600_000_000_000 } else { 0 },
    ] {
        let lag = run(stamp);
        assert!(lag < 40.0, "{lag} mm");
    }
}

#[test]
fn a_goal_that_moves_for_long_neither_stalls_nor_arrives() {
    let arm = start_of(-0.3);
    for feed_forward in [false, true] {
        let mut follow = Follow::begin(&arm, feed_forward);
        follow.rig.change(|settings| settings.progress_timeout = Some(Duration::from_secs(1)));
        let stream = Stream { path: circle, speed: 0.1, seconds: 8.0, ..LINE };
        follow.run(&stream);
        assert_eq!(follow.rig.state(), State::Tracking);
        assert_eq!(follow.rig.servo.status().stall, None);
    }
}

/// Runs for `seconds` with a goal whose frame moves at 0.2 m/s. From 0 to `until` \[s\], TF moves the frame 50 times per second.
fn with_frame(follow: &mut Follow, seconds: f64, until: f64, sent: &mut u32) {
    let end = follow.time() + seconds;
    while follow.time() < end {
        while f64::from(*sent) / 50.0 <= follow.time().min(until) {
            let time = f64::from(*sent) / 50.0;
            let goal = line(&follow.start, 0.2, time);
            let reading = reading(&goal, EPOCH + (time * 1e9) as i64);
            follow.rig.move_goal(&GoalMotion::To(reading)).unwrap();
            *sent += 1;
        }
        let goal = line(&follow.start, 0.2, follow.time());
        follow.cycle(&goal);
    }
}

#[test]
fn a_goal_moves_with_its_frame_and_the_arm_holds_where_the_frame_is_lost() {
    let arm = start_of(-0.3);
    let mut follow = Follow::begin(&arm, true);
    let mut sent = 0;
    with_frame(&mut follow, 0.2, 9.0, &mut sent);
    assert_eq!(
        (follow.rig.state(), follow.rig.speed()),
        (State::Holding, 0.0),
        "without a goal nothing moves"
    );
    let start = follow.start;
    follow.send(&start, 0);
    with_frame(&mut follow, 1.2, 9.0, &mut sent);
    let status = follow.rig.servo.status();
    assert_eq!((status.state, status.goal_count), (State::Tracking, 1), "one goal, one motion");
    assert!(follow.errors.last().unwrap().norm() < 0.005, "{:?}", follow.errors.last());
    for (away, rearms) in [(0.3, false), (1.5, true)] {
        follow.rig.move_goal(&GoalMotion::Lost).unwrap();
        let gone = follow.time();
        with_frame(&mut follow, away, 0.0, &mut sent);
        let held = |follow: &Follow| matches!(follow.rig.revoked(), Some(Revocation::FrameWasAway(seconds)) if seconds < 1.1);
        let state = if rearms { State::Holding } else { State::StaleGoal };
        assert_eq!((follow.rig.state(), follow.rig.speed()), (state, 0.0));
        assert_eq!(
            (follow.rig.servo.status().reason == Some(Reason::FrameLost), held(&follow)),
            (!rearms, rearms)
        );
        sent = (50.0 * gone) as u32;
        with_frame(&mut follow, 0.3, 99.0, &mut sent);
        assert_eq!((follow.rig.state() == State::Holding, held(&follow)), (rearms, rearms), "after {away} s");
    }
    // The arm resumes when somebody requests it.
    follow.rig.pause(false);
    with_frame(&mut follow, 0.1, 99.0, &mut sent);
    assert_eq!(follow.rig.state(), State::Tracking);
    follow.rig.stop();
    with_frame(&mut follow, 1.0, 99.0, &mut sent);
    assert_eq!(
        (follow.rig.state(), follow.rig.speed()),
        (State::Holding, 0.0),
        "a stop drops the goal, frame or not"
    );
}

/// Follows a goal in a frame for 20 s. TF gives the frame every 20 ms, `late` cycles old. From the time `grasped` \[s\] on, the
/// tool carries the frame. Returns the largest joint speed in the last 10 s [rad/s], and the reason why the arm holds.
fn follow_what_the_tool_carries(feed_forward: bool, late: usize, grasped: f64) -> (f64, Option<Reason>) {
    let mut follow = Follow::begin(&start_of(-0.3), feed_forward);
    let goal = moved(&follow.start, Vector3::new(0.1, 0.2, 0.1));
    follow.send(&goal, 0);
    let (mut poses, mut tool_from_goal, mut fastest) = (Vec::new(), None, 0.0_f64);
    for cycle in 0..10_000 {
        poses.push(follow.rig.servo.pose().unwrap());
        let pose = poses[poses.len().saturating_sub(1 + late)];
        let place = match follow.time() < grasped {
            true => goal,
            false => pose * *tool_from_goal.get_or_insert(pose.inverse() * goal),
        };
        if cycle % 10 == 0 {
            let _ = follow.rig.move_goal(&GoalMotion::To(reading(&place, EPOCH + 2_000_000 * cycle)));
        }
        follow.rig.cycle();
        if cycle > 5000 {
            fastest = fastest.max(follow.rig.speed());
        }
    }
    (fastest, follow.rig.servo.status().reason)
}

#[test]
fn a_goal_that_the_arm_itself_carries_is_held_and_named() {
    for feed_forward in [false, true] {
        // The goal is on the tool from the beginning, or grasped on the way. TF is up to date, or 20 ms late.
        for (late, grasped) in [(0, 0.0), (10, 0.0), (0, 0.25), (10, 0.25)] {
            let (fastest, reason) = follow_what_the_tool_carries(feed_forward, late, grasped);
            let carried = Some(Reason::Revoked(Revocation::MovesWithTool));
            assert_eq!((fastest, reason), (0.0, carried), "{feed_forward} {late} {grasped}");
        }
    }
}

/// Returns an arm at rest whose goal's frame was lost during the motion.
fn with_frame_lost() -> Follow {
    let mut follow = Follow::begin(&start_of(-0.3), true);
    let goal = moved(&follow.start, Vector3::new(0.0, 0.1, 0.0));
    follow.send(&goal, 0);
    follow.rig.run(0.05);
    follow.rig.move_goal(&GoalMotion::Lost).unwrap();
    follow.rig.run(1.0);
    assert_eq!((follow.rig.state(), follow.rig.speed()), (State::StaleGoal, 0.0));
    follow
}

#[test]
fn a_goal_that_is_sent_again_is_where_its_sender_says_whatever_its_frame_does() {
    let mut follow = with_frame_lost();
    let goal = moved(&follow.start, Vector3::new(0.0, 0.1, 0.0));
    follow.send(&goal, 0);
    follow.rig.cycle();
    assert_eq!((follow.rig.state(), follow.rig.servo.status().goal_count), (State::Tracking, 1));
    follow.rig.run_until(State::Settled, 10.0);
}

/// The rig checks in every cycle that the servo does not move the arm.
#[test]
fn another_tool_finds_no_frame_that_is_lost() {
    let mut follow = with_frame_lost();
    follow.rig.check_tools = false;
    follow.rig.change(|settings| settings.tool_offset = moved(&settings.tool_offset, Vector3::z()));
    follow.rig.pause(false);
    follow.rig.run(0.1);
    assert_eq!((follow.rig.state(), follow.rig.speed()), (State::StaleGoal, 0.0));
}

#[test]
fn a_goal_that_shakes_is_hardly_a_motion() {
    let arm = start_of(-0.3);
    let run = |feed_forward, every| {
        let mut random = Random(3);
        let follow = Follow::goals(&arm, feed_forward, (3000, every), |start, cycle| {
            let goal = moved(start, Vector3::new(0.0, 0.1, 0.05) + 2e-4 * random.vector());
            (goal, EPOCH + 2_000_000 * cycle)
        });
        let speeds = follow.velocities();
        (speeds.iter().map(Vector3::norm_squared).sum::<f64>() / speeds.len() as f64).sqrt()
    };
    for every in [1, 10, 50] {
        let (fed, unfed) = (run(true, every), run(false, every));
        assert!(fed < 1.5 * unfed, "each {every} cycles: {fed} and {unfed} mm/s");
    }
}

/// The goal rotates. Seen from the goal, the tool's error decays along one screw.
#[test]
fn the_error_decays_as_towards_a_goal_that_stands() {
    let arm = start_of(-0.3);
    let mut follow = Follow::begin(&arm, true);
    let place = moved(&follow.start, Vector3::new(0.0, 0.1, 0.0));
    let mut errors = Vec::new();
    for cycle in 0..500 {
        let time = f64::from(cycle) * PERIOD.as_secs_f64();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.5 * time));
        let goal = place * UnitDualQuaternion::from_parts(turn, Vector3::zeros());
        follow.send(&goal, 0);
        follow.cycle(&goal);
        errors.push(follow.rig.servo.status().pose_error.fixed_rows::<3>(3).into_owned());
    }
    let (before, after) = (errors[200], errors[400]);
    assert!(before.angle(&after) < 0.03, "{before:?} {after:?}");
    assert!((after.norm() / before.norm() - (-1.6_f64).exp()).abs() < 0.02, "{before:?} {after:?}");
}
