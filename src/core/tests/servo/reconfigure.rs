//! Tests of rule 21 of the guide's safety page: after a motion has stalled, the arm may move to another configuration that reaches the goal.

use crate::arms::{anywhere, servo};
use crate::reference::{distance, pose, puma};
use crate::rig::{PERIOD, Rig};
use dq_core::servo::{
    Event, Interface, NoWayRound, Outcome, Reconfiguration, Reconfigure, Rejection, Revocation, Settings,
    Stall, State,
};
use dq_kinematics::control::Law;
use dq_search::{Found, STARTS};
use std::time::Duration;

/// A lower limit of joint 3 that keeps the arm from the goal theta_desired \[rad\]: on the way there from theta_initial, the joint
/// would go from 2.36 to 1.05 rad.
const LOWEST: f64 = 1.6;

/// Returns an arm in motion to a goal at which joint 3 would pass its limit.
fn rig(reconfigure: Reconfigure) -> Rig {
    rig_with(reconfigure, |_| {})
}

fn rig_with(reconfigure: Reconfigure, change: impl FnOnce(&mut Settings)) -> Rig {
    let mut rig = Rig::with(|settings| {
        settings.limits.position.lower[2] = LOWEST;
        settings.progress_timeout = Some(Duration::from_secs(1));
        settings.reconfigure = reconfigure;
        change(settings);
    });
    rig.goal("theta_desired");
    rig
}

/// Returns the arm of [`rig`] while it moves to another configuration.
fn underway() -> Rig {
    let mut rig = rig(Reconfigure::Always);
    rig.run_until(State::Reconfiguring, 20.0);
    rig.run(0.2);
    assert!(rig.state() == State::Reconfiguring && rig.speed() > 0.1, "{} {}", rig.state(), rig.speed());
    rig
}

fn reconfiguration(rig: &Rig) -> Reconfiguration {
    rig.servo.status().reconfiguration
}

fn ask(rig: &mut Rig) -> Result<(), Rejection> {
    rig.servo.begin(rig.now);
    rig.servo.take(Event::Reconfigure { ago: Duration::ZERO }).map(|_| ())
}

/// Returns the distance of the tool from the pose of theta_desired \[m\].
fn away(rig: &Rig) -> f64 {
    let goal = pose("theta_desired");
    (goal.translation() - rig.servo.pose().unwrap().translation()).norm()
}

#[test]
fn rule_21_an_arm_that_has_stalled_goes_round_where_it_always_may_and_arrives() {
    for (interface, law) in [
        (Interface::Velocity, Law::Logc),
        (Interface::Position, Law::Diffc),
        (Interface::Trajectory, Law::Logc),
    ] {
        let mut rig = rig_with(Reconfigure::Always, |settings| {
            (settings.interface, settings.controller.law) = (interface, law);
        });
        rig.run_until(State::Reconfiguring, 20.0);
        assert!(matches!(reconfiguration(&rig), Reconfiguration::Underway(_)));
        rig.run_until(State::Settled, 10.0);
        rig.cycle();
        assert_eq!(reconfiguration(&rig), Reconfiguration::Taken);
        assert!(away(&rig) < 1e-3, "{interface}: {}", away(&rig));
        rig.run(2.0);
        assert_eq!(rig.state(), State::Settled);
        let motions: Vec<_> = rig.servo.take_motions().collect();
        let outcomes: Vec<_> = motions.iter().map(|motion| (motion.outcome, motion.reconfigured)).collect();
        assert_eq!(outcomes, [(Outcome::Underway, false), (Outcome::Arrived, true)], "{interface}");
    }
}

#[test]
fn rule_21_the_way_is_a_straight_line_in_joint_space() {
    let mut rig = rig(Reconfigure::Always);
    rig.run_until(State::Reconfiguring, 20.0);
    let start = rig.positions();
    let mut places = Vec::new();
    while rig.state() == State::Reconfiguring {
        rig.cycle();
        places.push(rig.positions());
    }
    let end = places.last().unwrap();
    let joint =
        (0..6).max_by(|a, b| (end[*a] - start[*a]).abs().total_cmp(&(end[*b] - start[*b]).abs())).unwrap();
    for place in &places {
        let part = (place[joint] - start[joint]) / (end[joint] - start[joint]);
        let straight: Vec<_> =
            start.iter().zip(end).map(|(start, end)| start + part * (end - start)).collect();
        assert!(distance(place, &straight) < 1e-6, "{place:?} instead of {straight:?}");
    }
    // Most of the time, the slowest joint or the tool moves at its speed limit.
    assert!(places.len() as f64 * PERIOD.as_secs_f64() < 3.0, "{} cycles", places.len());
}

#[test]
fn rule_21_an_arm_that_may_be_asked_stands_until_somebody_asks_and_says_how() {
    let mut rig = rig_with(Reconfigure::Ask, |settings| settings.rearm_timeout = Duration::from_secs(60));
    rig.search_time = Duration::from_millis(20);
    assert_eq!(ask(&mut rig), Err(NoWayRound::NothingStalled.into()), "it moves");
    rig.run_until(State::Stalled, 20.0);
    assert_eq!(ask(&mut rig), Err(NoWayRound::Searching.into()));
    rig.run(3.0);
    let Reconfiguration::Found(detour) = reconfiguration(&rig) else { panic!("{:?}", reconfiguration(&rig)) };
    assert!((detour.to - detour.from).abs() > 0.5, "{detour:?}");
    assert_eq!((rig.state(), rig.speed()), (State::Stalled, 0.0));
    let motions: Vec<_> = rig.servo.take_motions().collect();
    let why = motions.last().unwrap().why(|joint| format!("joint{joint}")).unwrap();
    assert!(
        why.starts_with("joint3 is at its position limit; with joint") && why.contains("~/reconfigure"),
        "{why}"
    );
    // A request that was sent before the search had a result does not apply to this result.
    let early = Event::Reconfigure { ago: rig.now - detour.found + PERIOD };
    rig.servo.begin(rig.now);
    assert!(matches!(rig.servo.take(early), Err(Rejection::Late(_))));
    ask(&mut rig).unwrap();
    rig.cycle();
    assert_eq!(rig.state(), State::Reconfiguring);
    rig.run_until(State::Settled, 10.0);
    assert_eq!(ask(&mut rig), Err(NoWayRound::NothingStalled.into()));
}

#[test]
fn rule_21_an_arm_that_never_may_looks_for_nothing() {
    let mut rig = rig(Reconfigure::Never);
    rig.run_until(State::Stalled, 20.0);
    rig.run(1.0);
    assert_eq!((rig.state(), reconfiguration(&rig)), (State::Stalled, Reconfiguration::Unknown));
    assert_eq!(ask(&mut rig), Err(NoWayRound::Never.into()));
}

#[test]
fn rule_21_where_nothing_is_found_the_arm_stands_and_says_so() {
    let mut rig = rig(Reconfigure::Always);
    rig.change(|settings| {
        // No other configuration keeps the limits either.
        settings.limits.position.upper[2] = 1.9;
        settings.limits.position.lower[0] = 0.0;
        settings.limits.position.upper[0] = 1.0;
    });
    rig.run_until(State::Stalled, 20.0);
    rig.run(1.0);
    let none = NoWayRound::NotFound { starts: STARTS };
    assert_eq!(reconfiguration(&rig), Reconfiguration::NotFound { starts: STARTS });
    assert_eq!((ask(&mut rig), rig.state()), (Err(none.into()), State::Stalled));
    // After a change of the limits, the result no longer applies.
    rig.change(|settings| settings.limits.position.upper[2] = f64::INFINITY);
    assert_eq!(ask(&mut rig), Err(NoWayRound::NothingStalled.into()));
    rig.change(|settings| {
        settings.limits.position.lower[0] = f64::NEG_INFINITY;
        settings.limits.position.upper[0] = f64::INFINITY;
    });
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_21_what_stalls_for_other_reasons_is_not_gone_round() {
    let mut rig = Rig::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        settings.beyond_reach = dq_core::servo::BeyondReach::Approach;
        settings.reconfigure = Reconfigure::Always;
    });
    let far = dq_algebra::UnitDualQuaternion::from_parts(
        nalgebra::UnitQuaternion::identity(),
        nalgebra::Vector3::new(1.5, 0.0, 0.2),
    );
    rig.goal_pose(&far);
    rig.run_until(State::Stalled, 60.0);
    rig.run(0.5);
    assert!(matches!(rig.servo.status().stall, Some(Stall::BeyondReach(_))));
    assert!(matches!(ask(&mut rig), Err(Rejection::NoWayRound(NoWayRound::NotLookedFor(_)))));
}

#[test]
fn rule_21_a_stop_ends_it() {
    let mut rig = underway();
    rig.stop();
    rig.run(2.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    let last = rig.servo.take_motions().last().unwrap();
    assert_eq!((last.outcome, last.reconfigured), (Outcome::Revoked(Revocation::Stopped), true));
    assert_eq!(ask(&mut rig), Err(NoWayRound::NothingStalled.into()));
    rig.run(1.0);
    assert_eq!(rig.speed(), 0.0);
}

#[test]
fn rule_21_a_pause_holds_it_and_the_end_of_the_pause_lets_it_go_on() {
    let mut rig = underway();
    rig.pause(true);
    rig.run(2.0);
    let held = rig.positions();
    assert_eq!((rig.state(), rig.speed()), (State::Paused, 0.0));
    assert_eq!(ask(&mut rig), Err(NoWayRound::NothingStalled.into()), "nobody moves a paused arm");
    rig.run(1.0);
    assert_eq!(rig.positions(), held);
    rig.pause(false);
    rig.cycle();
    assert_eq!(rig.state(), State::Reconfiguring);
    rig.run_until(State::Settled, 10.0);
    assert!(away(&rig) < 1e-3);
}

#[test]
fn rule_21_another_goal_ends_it_and_the_same_one_does_not() {
    for sent_again in [true, false] {
        let mut rig = underway();
        if sent_again {
            rig.goal("theta_desired");
            rig.cycle();
            assert_eq!(rig.state(), State::Reconfiguring, "the same goal");
        }
        let beside: Vec<_> = rig.positions().iter().map(|position| position + 0.1).collect();
        rig.goal_pose(&puma().forward_kinematics(&beside).unwrap());
        rig.cycle();
        assert_eq!((rig.state(), reconfiguration(&rig)), (State::Tracking, Reconfiguration::Unknown));
        rig.run_until(State::Settled, 20.0);
        rig.run(2.0);
        let motions: Vec<_> = rig.servo.take_motions().collect();
        let last = motions.last().unwrap();
        assert_eq!((last.outcome, last.reconfigured), (Outcome::Arrived, false));
    }
}

#[test]
fn rule_21_another_law_changes_nothing_and_settings_that_do_not_allow_it_end_it() {
    let mut rig = underway();
    rig.set_law(Law::Diffc);
    rig.cycle();
    assert_eq!(rig.state(), State::Reconfiguring);
    rig.run_until(State::Settled, 20.0);
    assert!(away(&rig) < 1e-3);

    let mut rig = underway();
    rig.change(|settings| settings.reconfigure = Reconfigure::Never);
    rig.cycle();
    assert!(rig.state() != State::Reconfiguring, "{}", rig.state());

    let mut rig = underway();
    let Reconfiguration::Underway(detour) = reconfiguration(&rig) else { panic!() };
    let (joint, middle) = (detour.joint - 1, 0.5 * (rig.positions()[detour.joint - 1] + detour.to));
    rig.change(|settings| {
        let limits = &mut settings.limits.position;
        if detour.to > middle { limits.upper[joint] = middle } else { limits.lower[joint] = middle }
    });
    rig.cycle();
    assert!(rig.state() != State::Reconfiguring, "{}", rig.state());
    rig.run(3.0);
}

#[test]
fn rule_21_a_twist_a_robot_that_is_away_and_one_that_is_blocked_end_it() {
    let mut rig = underway();
    rig.twist([0.0, 0.0, 0.05], [0.0; 3], "base_link").unwrap();
    rig.cycle();
    assert_eq!(rig.state(), State::Jogging);

    let mut rig = underway();
    rig.connect(false);
    rig.run(3.0);
    rig.connect(true);
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0), "its consent is revoked");
    assert_eq!(ask(&mut rig), Err(NoWayRound::NothingStalled.into()));

    let mut rig = underway();
    rig.connect(false);
    rig.run(0.5);
    assert_eq!(rig.state(), State::StaleState);
    rig.connect(true);
    rig.run_until(State::Settled, 10.0);
}

#[test]
fn rule_21_an_answer_that_comes_late_or_is_of_no_use_is_none() {
    // The result is for a goal that was replaced.
    let mut rig = rig(Reconfigure::Always);
    rig.search_time = Duration::from_millis(300);
    rig.run_until(State::Stalled, 20.0);
    rig.run(0.1);
    rig.goal("theta_initial");
    rig.run(0.5);
    assert_eq!(reconfiguration(&rig), Reconfiguration::Unknown);
    rig.run_until(State::Settled, 20.0);

    // A stop dropped the goal.
    let mut rig = self::rig(Reconfigure::Always);
    rig.search_time = Duration::from_millis(300);
    rig.run_until(State::Stalled, 20.0);
    rig.run(0.1);
    rig.stop();
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));

    // The result is for an earlier stall at the same goal. The arm has moved in between, so the result is out of date.
    let mut rig = self::rig(Reconfigure::Ask);
    rig.search = None;
    rig.run_until(State::Stalled, 20.0);
    rig.run(0.1);
    let Reconfiguration::Searching(before) = reconfiguration(&rig) else { panic!() };
    rig.set_law(Law::Diffc);
    rig.run(0.1);
    rig.run_until(State::Stalled, 20.0);
    let Reconfiguration::Searching(since) = reconfiguration(&rig) else { panic!() };
    let mut take = |asked, positions: Option<&[f64]>| {
        rig.servo.begin(rig.now);
        rig.servo.take(Event::Found(Found { asked, starts: 9, positions })).unwrap();
        rig.cycle();
        reconfiguration(&rig)
    };
    let there = [0.0, 0.5, 2.0, 0.0, 0.0, 0.0];
    assert_eq!(take(before, Some(&there)), Reconfiguration::Searching(since));
    // The joint positions are meaningless, too few, or outside the limits.
    let nothing = Reconfiguration::NotFound { starts: 9 };
    assert_eq!(take(since, Some(&[f64::NAN; 6])), nothing);
    for positions in [&[0.0; 5][..], &[0.0; 7], &[0.0, 0.0, LOWEST - 0.1, 0.0, 0.0, 0.0], &[f64::INFINITY; 6]]
    {
        let mut rig = self::rig(Reconfigure::Always);
        rig.search = None;
        rig.run_until(State::Stalled, 20.0);
        let Reconfiguration::Searching(asked) = reconfiguration(&rig) else { panic!() };
        rig.servo.take(Event::Found(Found { asked, starts: 9, positions: Some(positions) })).unwrap();
        rig.cycle();
        assert_eq!(reconfiguration(&rig), nothing, "{positions:?}");
    }
}

#[test]
fn rule_21_where_nobody_answers_the_motion_is_recorded_all_the_same() {
    let mut rig = rig(Reconfigure::Always);
    rig.search = None;
    rig.run_until(State::Stalled, 20.0);
    let stalls = |rig: &mut Rig| {
        rig.servo.take_motions().filter(|motion| matches!(motion.outcome, Outcome::Stalled(_))).count()
    };
    rig.run(1.9);
    assert_eq!(stalls(&mut rig), 0);
    rig.run(0.3);
    assert_eq!((stalls(&mut rig), reconfiguration(&rig)), (1, Reconfiguration::Unknown));
    assert!(matches!(ask(&mut rig), Err(Rejection::NoWayRound(NoWayRound::NotLookedFor(_)))));
}

#[test]
fn rule_21_a_cycle_that_asks_hears_and_goes_round_allocates_nothing() {
    let mut rig = rig(Reconfigure::Always);
    rig.run(0.5);
    rig.servo.take_motions().for_each(drop);
    rig.allocations = 0;
    rig.run_until(State::Reconfiguring, 20.0);
    rig.run(0.5);
    assert_eq!((rig.state(), rig.allocations), (State::Reconfiguring, 0));
}

/// The rig checks speeds, accelerations, position limits and tool speeds in every cycle.
#[test]
fn rule_21_arms_of_the_box_keep_their_limits_on_ways_round() {
    let mut rounds = 0;
    for name in ["ur5e", "xarm6", "panda", "iiwa14"] {
        for number in 0..12 {
            let mut parameters = servo(name);
            let limits = parameters.settings.limits.position.clone();
            let (start, there) = (anywhere(&limits, number), anywhere(&limits, 500 + number));
            let joints = parameters.arms.joint_count();
            let goal = parameters.arms.chain().forward_kinematics(&there[..joints]).unwrap();
            parameters.settings.reconfigure = Reconfigure::Always;
            parameters.settings.progress_timeout = Some(Duration::from_millis(500));
            let mut rig = Rig::of(parameters, start[..joints].to_vec());
            rig.run(0.1);
            rig.goal_pose(&goal);
            rig.run(0.1);
            let end = rig.now + Duration::from_secs(40);
            while rig.state() != State::Settled && rig.now < end {
                rig.cycle();
                rounds += u32::from(rig.state() == State::Reconfiguring);
            }
            assert_eq!(rig.state(), State::Settled, "{name}, task {number}: {:?}", rig.servo.status().stall);
        }
    }
    assert!(rounds > 2000, "{rounds} cycles");
}

/// On some tasks, iiwa 14 slides along limits for minutes under logc with a gain of 1 1/s.
#[test]
fn rule_21_a_law_that_creeps_along_a_limit_is_waited_for_unless_the_arm_always_may_go_round() {
    let crept = |reconfigure| {
        let mut parameters = servo("iiwa14");
        parameters.settings.reconfigure = reconfigure;
        parameters.settings.controller.set_gains(Law::Logc, [1.0, 1.0]);
        let limits = parameters.settings.limits.position.clone();
        let chain = parameters.arms.chain().clone();
        (0..40).any(|number| {
            let (start, there) = (anywhere(&limits, number), anywhere(&limits, 500 + number));
            let mut rig = Rig::of(parameters.clone(), start[..7].to_vec());
            rig.run(0.1);
            rig.goal_pose(&chain.forward_kinematics(&there[..7]).unwrap());
            rig.run(25.0);
            rig.state() == State::JointLimit
        })
    };
    assert!(crept(Reconfigure::Ask), "no law creeps");
    assert!(!crept(Reconfigure::Always));
}
