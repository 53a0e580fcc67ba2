//! A servo in a program's own loop: the program passes goals and measurements, and the servo returns commands.

use dq_algebra::UnitDualQuaternion;
use dq_config::{ForArm, ServoParameters};
use dq_core::servo::{Interface, Measured, Rejection, Servo, State};
use dq_kinematics::arm::Chain;
use dq_kinematics::control::Law;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(2);
const START: [f64; 6] = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0];

/// A servo and joints that follow without delay.
struct Driven {
    servo: Servo,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    now: Duration,
}

impl Driven {
    fn new(servo: Servo, positions: &[f64]) -> Self {
        let velocities = vec![0.0; positions.len()];
        Self { servo, positions: positions.to_vec(), velocities, now: Duration::from_secs(1000) }
    }

    fn cycle(&mut self) -> Result<(), Rejection> {
        self.now += PERIOD;
        let measured = Measured { positions: &self.positions, velocities: &self.velocities };
        let takes_positions = self.servo.settings().interface.takes_positions();
        let Some(output) = self.servo.cycle(self.now, &measured)? else { return Ok(()) };
        for ((position, velocity), output) in self.positions.iter_mut().zip(&mut self.velocities).zip(output)
        {
            let next = if takes_positions { *output } else { *position + PERIOD.as_secs_f64() * output };
            (*velocity, *position) = ((next - *position) / PERIOD.as_secs_f64(), next);
        }
        Ok(())
    }

    fn run_until_settled(&mut self) {
        let settled = (0..10_000).any(|_| {
            self.cycle().unwrap();
            self.servo.status().state == State::Settled
        });
        assert!(settled, "{:?}", self.servo.status());
    }

    fn pose(&self) -> UnitDualQuaternion {
        self.servo.pose().unwrap()
    }
}

fn goal_by(start: &UnitDualQuaternion, way: Vector3<f64>) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(start.rotation(), start.translation() + way)
}

#[test]
fn an_arm_by_its_name_goes_to_a_goal_under_every_interface() {
    for interface in Interface::NAMES {
        let parameters = ServoParameters::for_arm("ur5e").unwrap().with(|settings| {
            settings.interface = interface.parse().unwrap();
            settings.controller.law = Law::DoubleGeodesic;
        });
        let mut driven = Driven::new(parameters.build().unwrap(), &START);
        driven.cycle().unwrap();
        assert_eq!(driven.servo.output(), None, "nobody has asked for anything");
        let goal = goal_by(&driven.pose(), Vector3::new(0.1, 0.05, -0.1));
        driven.servo.set_goal(goal);
        driven.run_until_settled();
        driven.cycle().unwrap();
        let off = (driven.pose().translation() - goal.translation()).norm();
        assert!(off < 1.1e-3, "{interface}: {off} m off");
    }
}

#[test]
fn a_goal_that_was_set_before_the_robot_was_heard_counts_however_late_the_clock_begins() {
    let chain = Chain::for_arm("ur5e").unwrap();
    let goal = goal_by(&chain.forward_kinematics(&START).unwrap(), Vector3::new(0.05, 0.0, 0.0));
    let mut servo = Servo::for_arm("ur5e").unwrap();
    servo.set_goal(goal.frame());
    Driven::new(servo, &START).run_until_settled();
}

#[test]
fn a_stop_drops_a_goal_that_was_set_before_and_not_one_that_is_set_after() {
    let goal = |driven: &Driven| goal_by(&driven.pose(), Vector3::new(0.05, 0.0, 0.0));
    let mut driven = Driven::new(Servo::for_arm("ur5e").unwrap(), &START);
    driven.cycle().unwrap();
    driven.servo.set_goal(goal(&driven));
    driven.servo.stop();
    (0..10).for_each(|_| driven.cycle().unwrap());
    assert_eq!(driven.servo.status().goal, None);
    driven.servo.stop();
    driven.servo.set_goal(goal(&driven));
    driven.run_until_settled();
    // Another tool revokes all earlier requests.
    let mut settings = driven.servo.settings().clone();
    settings.tool_offset = Isometry3::translation(0.0, 0.0, 0.1).into();
    driven.servo.set_goal(goal(&driven));
    driven.servo.configure(settings).unwrap();
    driven.cycle().unwrap();
    assert_ne!(driven.servo.status().state, State::Tracking);
}

#[test]
fn what_is_rejected_is_told_and_the_cycle_is_made_all_the_same() {
    let mut driven = Driven::new(Servo::for_arm("ur5e").unwrap(), &START);
    driven.cycle().unwrap();
    let goal = goal_by(&driven.pose(), Vector3::new(0.1, 0.0, 0.0));
    driven.servo.set_goal(goal);
    (0..50).for_each(|_| driven.cycle().unwrap());
    let before = driven.servo.command().to_vec();
    driven.servo.set_goal(Isometry3::translation(9.0, 0.0, 0.0));
    let refused = driven.cycle().unwrap_err();
    assert!(matches!(refused, Rejection::BeyondReach(_)), "{refused}");
    assert!(driven.servo.output().is_some_and(|output| output != before), "the cycle was made");
    for (positions, velocities) in [(&START[..5], &[][..]), (&START, &START[..2]), (&[], &[])] {
        driven.now += PERIOD;
        let refused = driven.servo.cycle(driven.now, &Measured { positions, velocities }).unwrap_err();
        let got = if positions.len() == 6 { 2 } else { positions.len() };
        assert_eq!(refused, Rejection::OnePerJoint { expected: 6, got });
    }
    driven.servo.set_goal(Isometry3::translation(f64::NAN, 0.0, 0.0));
    assert_eq!(driven.cycle().unwrap_err().label(), "non_finite");
    assert_eq!(driven.servo.rejections().total(), 5);
    assert!(driven.servo.status().goal.unwrap().base_from_goal().translation().x.abs() < 1.0);
}

#[test]
fn a_program_of_ones_own_allocates_nothing_in_its_loop() {
    let mut driven = Driven::new(Servo::for_arm("ur5e").unwrap(), &START);
    driven.cycle().unwrap();
    let start = driven.pose();
    let turn = |driven: &mut Driven, cycle: u32| {
        let angle = 0.002 * f64::from(cycle);
        driven.servo.set_goal(goal_by(&start, 0.05 * Vector3::new(angle.cos() - 1.0, angle.sin(), 0.0)));
        driven.cycle().unwrap();
    };
    (0..500).for_each(|cycle| turn(&mut driven, cycle));
    let measured = allocation_counter::measure(|| (500..2000).for_each(|cycle| turn(&mut driven, cycle)));
    assert_eq!(measured.count_total, 0);
    assert_eq!(driven.servo.status().state, State::Tracking);
}

#[test]
fn two_arms_move_as_one() {
    let base = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(0.0, 0.8, 0.0));
    let parameters = ServoParameters::for_two_arms("ur5e", &base).unwrap();
    let mut driven = Driven::new(parameters.build().unwrap(), &[START, START].concat());
    driven.cycle().unwrap();
    // Seen from a tool that points down, the point is 0.8 m to the side.
    assert!((driven.pose().translation().norm() - 0.8).abs() < 1e-12);
    driven.servo.set_goal(goal_by(&driven.pose(), Vector3::new(0.1, 0.1, 0.0)));
    driven.run_until_settled();
    let moved = |arm: usize| (driven.positions[6 * arm] - START[0]).abs() > 1e-3;
    assert!(moved(0) && moved(1), "{:?}", driven.positions);
}
