//! One test a filter, on the built-in arm.

use super::*;
use crate::config::{NodeParameters, ServoParameters};
use crate::servo::{Limits, Posture, Violation};
use crate::space::Body;

/// A cycle of the arm that is on its way to `goal`.
struct Cycle {
    settings: Settings,
    arms: Arms,
    positions: [f64; 6],
    link: Link,
    before: [f64; 6],
    held_limits: HeldLimits,
    moving: Option<MovingGoal>,
    gain_factor: f64,
    period: f64,
}

const PERIOD: f64 = 0.01;

impl Cycle {
    /// With 1 rad/s and 10 rad/s² for each joint and 1 m/s and 1 rad/s for the tool, at rest.
    fn new() -> Self {
        let (parameters, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
        let ServoParameters { mut arms, joints, mut settings, period, .. } =
            ServoParameters::from_store(&parameters).unwrap();
        let limits = &mut settings.limits;
        limits.joint_velocity.fill(1.0);
        limits.joint_acceleration.fill(10.0);
        limits.joint_deceleration.fill(20.0);
        (limits.linear_speed, limits.angular_speed) = (1.0, 1.0);
        limits.position.lower.fill(-3.0);
        limits.position.upper.fill(3.0);
        limits.position.margin = 0.1;
        let positions = [0.0, 0.4, -0.8, 0.0, 0.6, 0.0];
        arms.evaluate(&positions);
        let link = Link::new(joints, &arms.joint_kinds(), period, settings.interface);
        let held_limits = HeldLimits::new(&settings.limits);
        let (before, moving, gain_factor) = ([0.0; 6], None, 1.0);
        Self { settings, arms, positions, link, before, held_limits, moving, gain_factor, period: PERIOD }
    }

    /// What the filter makes of `velocity`, with a goal where the tool is.
    fn filtered(&self, mut filter: impl Filter, velocity: [f64; 6]) -> [f64; 6] {
        let (pose, moving, gain_factor) = (self.arms.pose(), self.moving, self.gain_factor);
        let given = Given {
            settings: &self.settings,
            arms: &self.arms,
            positions: &self.positions,
            by_tool: true,
            goal: Some(Towards { pose, moving, gain_factor, escape: None }),
            link: &self.link,
            before: &self.before,
            braking: self.link.braking(self.held_limits.each(), self.period),
            period: self.period,
        };
        let mut velocity = velocity;
        filter.apply(&given, &mut velocity);
        velocity
    }
}

#[track_caller]
fn assert_near(found: [f64; 6], expected: [f64; 6]) {
    let near = found.iter().zip(&expected).all(|(found, expected)| (found - expected).abs() < 1e-12);
    assert!(near, "{found:?} is not {expected:?}");
}

#[test]
fn speed_scales_all_joints_by_what_the_fastest_of_joints_and_tool_needs() {
    let mut cycle = Cycle::new();
    let slow = [0.0, 0.0, 0.0, 0.0, 0.0, 0.5];
    assert_near(cycle.filtered(Speed, slow), slow);
    assert_near(cycle.filtered(Speed, [0.0, 0.0, 0.0, 0.0, 0.0, 4.0]), [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    cycle.settings.limits.angular_speed = 0.25;
    assert_near(cycle.filtered(Speed, slow), [0.0, 0.0, 0.0, 0.0, 0.0, 0.25]);
}

#[test]
fn the_law_is_asked_for_the_part_of_its_gain_that_delays_allow() {
    let mut cycle = Cycle::new();
    cycle.gain_factor = 0.5;
    let asked = cycle.filtered(LawDemand::new(6), [0.0, 0.0, 0.0, 0.0, 0.0, 0.4]);
    assert_near(asked, [0.0, 0.0, 0.0, 0.0, 0.0, 0.2]);
}

#[test]
fn feed_forward_moves_the_tool_as_the_goal_moves() {
    let mut cycle = Cycle::new();
    let twist = nalgebra::Vector6::new(0.02, -0.01, 0.03, 0.01, 0.02, -0.03);
    cycle.moving = Some(MovingGoal { pose: cycle.arms.pose(), twist });
    let velocity = cycle.filtered(feed_forward::FeedForward::new(6), [0.0; 6]);
    let tool = cycle.arms.tool_speed(&velocity);
    assert!((tool.angular - twist.fixed_rows::<3>(0).norm()).abs() < 1e-9, "{tool:?}");
    assert!((tool.linear - twist.fixed_rows::<3>(3).norm()).abs() < 1e-9, "{tool:?}");
}

#[test]
fn six_joints_leave_the_null_space_no_motion() {
    let mut cycle = Cycle::new();
    cycle.settings.posture = Posture { positions: vec![1.0; 6], gain: 1.0 };
    assert_near(cycle.filtered(null_space::NullSpace::new(6), [0.1; 6]), [0.1; 6]);
}

#[test]
fn demanded_acceleration_scales_by_the_root_of_what_there_is() {
    let mut cycle = Cycle::new();
    // At rest at the goal the law asks for nothing; a cycle on, at 0.5 rad/s, it asks for nearly nothing still: a change of 50 rad/s².
    let filter = DemandedAcceleration::new(cycle.arms.clone());
    let velocity = cycle.filtered(filter, [0.0, 0.0, 0.0, 0.0, 0.0, 0.5]);
    let share = velocity[5] / 0.5;
    assert!((share - (10.0_f64 / 50.0).sqrt()).abs() < 0.01, "{share}");
    cycle.settings.limits.joint_acceleration.fill(1e6);
    let filter = DemandedAcceleration::new(cycle.arms.clone());
    assert_near(cycle.filtered(filter, [0.5; 6]), [0.5; 6]);
}

#[test]
fn position_range_slows_the_joint_near_its_limit_and_no_other() {
    let mut cycle = Cycle::new();
    cycle.positions[1] = 2.99;
    let mut filter = PositionRange::default();
    let velocity = cycle.filtered(&mut filter, [0.5; 6]);
    assert!(velocity[1] < 0.1 && velocity[0] == 0.5, "{velocity:?}");
    assert_eq!(filter.held_back, Some(1));
    assert_near(
        cycle.filtered(&mut filter, [0.5, -0.5, 0.5, 0.5, 0.5, 0.5]),
        [0.5, -0.5, 0.5, 0.5, 0.5, 0.5],
    );
    assert_eq!(filter.held_back, None);
}

#[test]
fn acceleration_scales_the_change_as_a_whole_unless_that_takes_longer_than_a_stop() {
    let mut cycle = Cycle::new();
    let velocity = cycle.filtered(Acceleration, [0.4, 0.2, 0.0, 0.0, 0.0, 0.0]);
    assert_near(velocity, [0.1, 0.05, 0.0, 0.0, 0.0, 0.0]);
    // One joint may hardly accelerate; the other one brakes by its own deceleration.
    cycle.settings.limits.joint_acceleration[1] = 1e-3;
    cycle.before[0] = 0.5;
    let velocity = cycle.filtered(Acceleration, [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert!((velocity[0] - 0.3).abs() < 1e-12 && velocity[1] < 1e-4, "{velocity:?}");
}

#[test]
fn braking_brings_one_joint_and_the_tool_back_within_their_limits() {
    let mut cycle = Cycle::new();
    cycle.before[0] = 2.0;
    let braked = cycle.filtered(JointBraking, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_near(braked, [1.8, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cycle.settings.limits.angular_speed = 0.5;
    cycle.before = [0.0, 0.0, 0.0, 0.0, 0.0, 0.9];
    let braked = cycle.filtered(ToolBraking::new(6), [0.0, 0.0, 0.0, 0.0, 0.0, 0.9]);
    assert_near(braked, [0.0, 0.0, 0.0, 0.0, 0.0, 0.7]);
}

#[test]
fn the_gate_lets_pass_what_is_within_limits_and_brakes_instead_of_the_rest() {
    let mut cycle = Cycle::new();
    let mut gate = Gate::default();
    assert_near(cycle.filtered(&mut gate, [0.1; 6]), [0.1; 6]);
    assert_eq!(gate.replaced, Replaced::default());
    cycle.before = [0.3; 6];
    for (bad, is_named) in [
        (f64::NAN, (|why| matches!(why, Violation::NonFinite { joint: 3, .. })) as fn(_) -> bool),
        (0.5, |why| matches!(why, Violation::Acceleration { joint: 3, .. })),
    ] {
        let mut velocity = [0.3; 6];
        velocity[2] = bad;
        assert_near(cycle.filtered(&mut gate, velocity), [0.1; 6]);
        assert!(gate.replaced.last.clone().is_some_and(is_named), "{:?}", gate.replaced);
    }
    assert_eq!(gate.replaced.count, 2);
}

#[test]
fn a_stop_slows_each_joint_by_the_most_that_its_deceleration_was_since_it_stood() {
    let mut cycle = Cycle::new();
    cycle.before = [0.3, -0.1, 0.0, 0.0, 0.0, 0.0];
    let weaker = Limits { joint_deceleration: vec![1.0; 6], ..cycle.settings.limits.clone() };
    cycle.held_limits.update(&weaker, &cycle.before);
    // The joints that stand have the 1 rad/s² of STOP_TIME, those that move their 20 still.
    assert_eq!(cycle.held_limits.each()[0][1..3], [20.0, 1.0]);
    assert_near(cycle.filtered(Stop, [9.0; 6]), [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
    // One that turned round counted on what was in force then, and goes on with what is there now.
    let weakest = |cycle: &mut Cycle, speed: f64| {
        cycle.held_limits.update(&weaker, &[speed; 6]);
        cycle.held_limits.each()[0][0]
    };
    cycle.held_limits.update(&cycle.settings.limits, &[-0.1; 6]);
    assert_eq!([0.1, -0.1].map(|speed| weakest(&mut cycle, speed)), [20.0, 1.0]);
}

/// Sixty hulls of a hundred points on a circle of that radius about the arm's base, and the built-in arm in capsules.
fn among_hulls(cycle: &Cycle, away: f64) -> Scene {
    let hull = |i: u32| {
        let (sin, cos) = (0.7 * f64::from(i)).sin_cos();
        let point = |k: u32| {
            let (up, turn) = (1.0 - (f64::from(k) + 0.5) / 50.0, 2.4 * f64::from(k));
            let across = 0.05 * (1.0 - up * up).sqrt();
            let z = 0.1 * f64::from(i % 6) - 0.2 + 0.05 * up;
            format!(" {} {} {z}", away * cos + across * turn.cos(), away * sin + across * turn.sin())
        };
        format!("hull{i} hull{}", (0..100).map(point).collect::<String>()).parse().unwrap()
    };
    let chains: Vec<_> = cycle.arms.chains().cloned().collect();
    Scene::new(Body::along(&chains, 0.05), (0..60).map(hull).collect(), &chains, &[(-3.0, 3.0); 6]).unwrap()
}

#[test]
fn what_is_far_is_not_measured_and_what_is_near_not_at_every_place_of_a_stop() {
    let mut counts = Vec::new();
    for away in [3.0, 0.75] {
        let mut cycle = Cycle::new();
        // A stop goes far.
        cycle.settings.limits.joint_deceleration.fill(1.5);
        cycle.held_limits = HeldLimits::new(&cycle.settings.limits);
        let scene = among_hulls(&cycle, away);
        let (mut constraints, mut stoppable) = (Constraints::new(6), Stoppable::new(6, PERIOD));
        constraints.set_scene(Some(&scene));
        stoppable.set_scene(Some(&scene));
        cycle.settings.scene = Some(std::sync::Arc::new(scene));
        for _ in 0..2 {
            constraints.placed.count.set(0);
            stoppable.placed.count.set(0);
            cycle.filtered(&mut constraints, [0.9, 0.4, -0.4, 0.3, 0.2, 0.1]);
            cycle.filtered(&mut stoppable, [0.9, 0.4, -0.4, 0.3, 0.2, 0.1]);
            counts.push((constraints.placed.count.get(), stoppable.placed.count.get()));
        }
    }
    assert_eq!(counts[..2], [(0, 0); 2]);
    let [constraints, stoppable] = [counts[3].0, counts[3].1];
    // Once each pair was measured that a ball does not part.
    assert!((1..=25).contains(&constraints) && (1..=10).contains(&stoppable), "{counts:?}");
}
