//! Chains and servos of arms by name, by robot description and by DH rows, as a program of one's own makes and drives them.

use dq_algebra::UnitDualQuaternion;
use dq_config::{ARMS, BUILTIN_FILE, ForArm, NodeParameters, ServoParameters, SetupError};
use dq_core::servo::{Interface, Measured, Rejection, Servo, State};
use dq_kinematics::arm::{Chain, Convention, DhRow};
use dq_kinematics::control::Law;
use dq_params::parameters_for;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(2);
const START: [f64; 6] = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0];

/// A servo and joints that follow at once.
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
fn every_arm_of_the_box_has_its_servo_by_its_name_and_another_name_is_refused_with_theirs() {
    for (name, text) in ARMS {
        let parameters = ServoParameters::for_arm(name).unwrap();
        let values = parameters_for(text, name, "/dq_servo").unwrap();
        assert_eq!(parameters, ServoParameters::from_values(values, name).unwrap());
        assert_eq!(&Chain::for_arm(name).unwrap(), parameters.arms.chain());
        assert_eq!(Servo::for_arm(name).unwrap().settings(), &parameters.settings);
    }
    let refused = Chain::for_arm("ur6e").unwrap_err();
    assert_eq!(refused, SetupError::UnknownArm("ur6e".to_owned()));
    assert!(
        refused.to_string().starts_with("no built-in arm is called \"ur6e\": expected one of puma560, ur3e")
    );
    assert!(Servo::for_arm("").is_err());
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
    // Another tool revokes what was asked for until then.
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
    // Seen from a tool that looks down: 0.8 m beside it.
    assert!((driven.pose().translation().norm() - 0.8).abs() < 1e-12);
    driven.servo.set_goal(goal_by(&driven.pose(), Vector3::new(0.1, 0.1, 0.0)));
    driven.run_until_settled();
    let moved = |arm: usize| (driven.positions[6 * arm] - START[0]).abs() > 1e-3;
    assert!(moved(0) && moved(1), "{:?}", driven.positions);
}

#[test]
fn a_robot_description_gives_the_servo_its_limits_and_what_it_lacks_is_told() {
    let urdf = "<robot name='crane'><link name='mast'/><link name='boom'/><link name='hook'/>
      <joint name='turn' type='revolute'><parent link='mast'/><child link='boom'/><axis xyz='0 0 1'/>
        <limit lower='-2' upper='2' velocity='0.5' effort='1'/></joint>
      <joint name='lower' type='prismatic'><parent link='boom'/><child link='hook'/><origin xyz='4 0 0'/>
        <axis xyz='0 0 -1'/><limit lower='0' upper='3' velocity='1' effort='1'/></joint></robot>";
    let parameters = ServoParameters::from_urdf(urdf, "mast", "hook").unwrap();
    assert_eq!(parameters.joints[0].names(), ["turn", "lower"]);
    assert_eq!(parameters.arms.chain().forward_kinematics(&[0.0, 1.0]).unwrap().translation().z, -1.0);
    let servo = ServoParameters::from_urdf(urdf, "mast", "hook").unwrap().build().unwrap();
    let limits = &servo.settings().limits;
    assert_eq!(limits.joint_velocity, [0.5, 1.0]);
    assert_eq!((&limits.position.lower, &limits.position.upper), (&vec![-2.0, 0.0], &vec![2.0, 3.0]));
    let why = |text: &str, tool| ServoParameters::from_urdf(text, "mast", tool).err().unwrap().to_string();
    assert!(why(urdf, "jib").contains("jib"), "{}", why(urdf, "jib"));
    let without = urdf.replace("velocity='0.5'", "");
    assert!(why(&without, "hook").contains("\"turn\" has no velocity limit"), "{}", why(&without, "hook"));
    assert!(!why("<robot", "hook").is_empty());
}

#[test]
fn an_arm_of_ones_own_needs_one_limit_a_joint() {
    let row = |a| DhRow { alpha: 0.0, a, d: 0.0, theta_offset: 0.0 };
    let chain = Chain::new(Convention::StandardDh, &[row(0.5), row(0.25)]).unwrap();
    let of = |velocity: &[f64], acceleration: &[f64]| {
        ServoParameters::for_chain(chain.clone(), velocity, acceleration)
    };
    let parameters = of(&[1.0, 2.0], &[3.0, 4.0]).unwrap();
    assert_eq!(parameters.joints[0].names(), ["joint1", "joint2"]);
    let limits = &parameters.settings.limits;
    assert_eq!((limits.deceleration(0), limits.position.upper[1]), (3.0, f64::INFINITY));
    // All else is as a node has it to which nothing is given.
    let values = parameters_for(BUILTIN_FILE, "", "/dq_servo").unwrap();
    let node = ServoParameters::from_values(values, "").unwrap();
    assert_eq!(parameters.settings.controller, node.settings.controller);
    let refused = of(&[1.0], &[3.0, 4.0]).unwrap_err().to_string();
    assert_eq!(refused, "limits.joint_velocity has 1 entries, expected 2: one a joint");
    assert!(of(&[1.0, f64::NAN], &[3.0, 4.0]).is_err());
    let never = parameters.with_period(Duration::ZERO).build().err().unwrap().to_string();
    assert_eq!(never, "period has 0, expected a time above 0");
}

#[test]
fn poses_come_from_and_go_to_nalgebra() {
    let rotation = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.4);
    let frame = Isometry3::from_parts(Translation3::new(0.1, 0.2, 0.3), rotation);
    let back = Isometry3::from(UnitDualQuaternion::from(frame));
    assert!((back.to_homogeneous() - frame.to_homogeneous()).norm() < 1e-15);
    let turned = UnitDualQuaternion::from(rotation);
    assert_eq!((turned.rotation(), turned.translation()), (rotation, Vector3::zeros()));
}
