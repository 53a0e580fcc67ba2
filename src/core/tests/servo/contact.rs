//! Tests of goals that yield to the wrench at the tool. The tool presses on a wall of springs, and the wrench sensor may fail.

use crate::reference::{parameters, puma};
use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{
    Compliance, ContactFault, Contended, Event, JointReading, Reason, Revocation, Rivals, Servo, State,
    WrenchReading,
};
use dq_params::ParameterStore;
use nalgebra::{Isometry3, Translation3, Vector3};
use std::collections::VecDeque;
use std::time::Duration;

/// Joint angles far from every singularity \[rad\].
const START: [f64; 6] = [0.2, -0.8, 0.4, 0.3, 0.9, 0.1];

const PERIOD: Duration = Duration::from_millis(2);

fn compliance() -> Compliance {
    ParameterStore::of::<Compliance>().and_then(|store| store.read()).unwrap()
}

/// The paper's arm in front of a wall. The arm follows without delay, and the tool begins 1 cm before the wall.
struct World {
    servo: Servo,
    names: Vec<String>,
    positions: Vec<f64>,
    now: Duration,
    /// The direction into the wall, in the base frame.
    into: Vector3<f64>,
    /// Stiffness of the wall [N/m].
    stiffness: f64,
    /// The delay of joint states and wrenches \[cycles\].
    delay: usize,
    under_way: VecDeque<(Vec<f64>, f64)>,
    start: UnitDualQuaternion,
    /// The factor by which the sensor multiplies the force that it reports: −1 for an inverted sensor.
    sign: f64,
    /// Whether the sensor reports nothing.
    silent: bool,
    /// The force of the wall in this cycle \[N\].
    force: f64,
    /// The largest force of the wall so far \[N\].
    largest: f64,
}

impl World {
    fn new(contact: Option<Compliance>) -> Self {
        let mut all: ServoParameters = parameters();
        all.settings.contact = contact;
        let names = all.joints[0].names().to_vec();
        Self {
            servo: all.build().unwrap(),
            names,
            positions: START.to_vec(),
            now: Duration::from_secs(10),
            into: Vector3::new(1.0, 0.0, 0.0),
            stiffness: 1e4,
            delay: 2,
            under_way: VecDeque::new(),
            start: puma().forward_kinematics(&START).unwrap(),
            sign: 1.0,
            silent: false,
            force: 0.0,
            largest: 0.0,
        }
    }

    fn tool(&self, positions: &[f64]) -> UnitDualQuaternion {
        puma().forward_kinematics(positions).unwrap()
    }

    /// Returns how far the tool is inside the wall \[m\]; negative if it is outside.
    fn depth(&self) -> f64 {
        (self.tool(&self.positions).translation() - self.start.translation()).dot(&self.into) - 0.01
    }

    fn wrench(&self, positions: &[f64], force: f64) -> WrenchReading<'static> {
        let force = self.tool(positions).rotation().inverse() * (-self.sign * force * self.into);
        let sensor = UnitDualQuaternion::identity();
        WrenchReading {
            force: force.into(),
            torque: [0.0; 3],
            frame_id: "",
            sensor,
            source: 1,
            stamp_age: Some(Duration::ZERO),
        }
    }

    /// Runs one cycle. The servo also receives the events `more`.
    fn cycle(&mut self, more: Vec<Event>) {
        self.now += PERIOD;
        self.force = self.stiffness * self.depth().max(0.0);
        self.largest = self.largest.max(self.force);
        self.under_way.push_back((self.positions.clone(), self.force));
        let (positions, force) = match self.under_way.len() > self.delay {
            true => self.under_way.pop_front().unwrap(),
            false => self.under_way[0].clone(),
        };
        let state = JointReading {
            names: &self.names,
            positions: &positions,
            velocities: &[],
            source: 0,
            stamp_age: Some(u32::try_from(self.delay).unwrap() * PERIOD),
        };
        let wrench = (!self.silent).then(|| Event::Wrench(self.wrench(&positions, force)));
        let events = [Some(Event::JointState(0, state)), wrench].into_iter().flatten().chain(more);
        let command = self.servo.cycle_with(self.now, events).to_vec();
        self.positions
            .iter_mut()
            .zip(&command)
            .for_each(|(position, speed)| *position += PERIOD.as_secs_f64() * speed);
    }

    fn run(&mut self, seconds: f64) {
        (0..(seconds / PERIOD.as_secs_f64()).round() as usize).for_each(|_| self.cycle(Vec::new()));
    }

    /// Sets a goal that is `depth` \[m\] beyond the surface of the wall.
    fn goal(&mut self, depth: f64) {
        let moved = self.start.translation() + (depth + 0.01) * self.into;
        self.servo.set_goal(Isometry3::from_parts(Translation3::from(moved), self.start.rotation()));
    }

    /// Moves the goal into the wall at 5 cm/s until it is `depth` \[m\] inside.
    fn touch(&mut self, depth: f64) {
        let mut at = -0.01;
        while at < depth {
            at += 0.05 * PERIOD.as_secs_f64();
            self.goal(at.min(depth));
            self.cycle(Vec::new());
        }
    }

    fn revocation(&self) -> Option<Revocation> {
        self.servo.consent().revocation()
    }
}

#[test]
fn a_compliant_goal_presses_as_its_stiffness_says_and_a_rigid_one_as_hard_as_the_wall() {
    let mut rigid = World::new(None);
    rigid.touch(0.02);
    rigid.run(3.0);
    assert!(rigid.force > 150.0, "{}", rigid.force);
    for delay in [0, 2, 10, 25] {
        for stiffness in [1e3, 1e4, 1e5] {
            let settings =
                Compliance { stiffest: [stiffness, 100.0], largest_wrench: [500.0, 50.0], ..compliance() };
            let mut world = World { stiffness, delay, ..World::new(Some(settings)) };
            world.touch(0.02);
            // The law comes so near that the wall is as exact as the formula.
            world.run(8.0);
            // At rest, 500 N/m (y) = F − 1 N of the dead band, and y + F / k = 0.02 m.
            let expected = (500.0 * 0.02 + 1.0) / (1.0 + 500.0 / stiffness);
            assert!(
                (world.force - expected).abs() < 0.03 * expected,
                "{delay} {stiffness}: {} {expected}",
                world.force
            );
            assert!(world.servo.consent().is_given(), "{delay} {stiffness}: {:?}", world.revocation());
            // The goal's speed meets the damping; then the wall is pressed for the delay and the filter.
            let late = 2.0 * (PERIOD.as_secs_f64() * (delay as f64 + 2.0) + 0.008);
            let bound =
                1.0 + expected + 0.05 * (settings.least_damping(late / 2.0)[0].max(300.0) + stiffness * late);
            assert!(world.largest < bound, "{delay} {stiffness}: {} < {bound}", world.largest);
        }
    }
}

#[test]
fn a_wanted_force_is_kept_while_the_tool_slides_along_a_tilted_wall() {
    let mut settings = Compliance { stiffest: [1e4, 100.0], dead_band: [0.0; 2], ..compliance() };
    let mut world = World::new(None);
    let tool = world.start.rotation();
    // The tool's axis that points most into the wall presses.
    let axis = (0..3)
        .max_by(|a, b| {
            (tool * Vector3::ith(*a, 1.0))
                .dot(&world.into)
                .abs()
                .total_cmp(&(tool * Vector3::ith(*b, 1.0)).dot(&world.into).abs())
        })
        .unwrap();
    let towards = (tool * Vector3::ith(axis, 1.0)).dot(&world.into).signum();
    (settings.stiffness[axis], settings.force_goal[axis]) = (0.0, 10.0 * towards);
    settings.largest_offset = [0.3, 0.5];
    world = World { into: tool * Vector3::ith(axis, towards), ..World::new(Some(settings)) };
    let across = tool * Vector3::ith((axis + 1) % 3, 1.0);
    world.goal(0.0);
    world.run(3.0);
    assert!((world.force - 10.0).abs() < 0.5, "{}", world.force);
    let (press, mut goal) = (world.into, world.start.translation() + 0.01 * world.into);
    world.into = (press + 10_f64.to_radians().tan() * across).normalize();
    let mut worst = 0.0_f64;
    for step in 0..10_000 {
        goal -= 2e-5 * across;
        world.servo.set_goal(Isometry3::from_parts(Translation3::from(goal), world.start.rotation()));
        world.cycle(Vec::new());
        if step > 500 {
            worst = worst.max((world.force - 10.0).abs());
        }
    }
    assert!(worst < 1.0, "{worst} N while sliding by 0.2 m");
}

#[test]
fn without_a_usable_wrench_the_arm_brakes_and_after_a_while_a_new_request_is_needed() {
    let mut world = World::new(Some(compliance()));
    world.silent = true;
    world.goal(-0.005);
    world.run(0.5);
    assert_eq!(
        (world.servo.status().state, world.servo.status().reason),
        (State::StaleWrench, Some(Reason::NoWrench))
    );
    assert_eq!(world.positions, START, "nothing moves without a wrench");
    world.silent = false;
    world.run(1.0);
    assert_eq!(world.servo.status().state, State::Tracking, "the sensor came in time");
    world.silent = true;
    world.run(1.3);
    assert!(matches!(world.revocation(), Some(Revocation::WrenchWasAway(_))), "{:?}", world.revocation());
    world.silent = false;
    world.run(1.0);
    assert_eq!(world.servo.status().state, State::Holding, "nobody has asked again");
    world.goal(-0.004);
    world.run(0.3);
    assert!(world.servo.consent().is_given());
}

#[test]
fn an_invalid_wrench_counts_as_none_and_two_sensors_hold_the_arm() {
    let mut world = World::new(Some(compliance()));
    world.goal(-0.005);
    world.run(0.3);
    world.silent = true;
    for _ in 0..100 {
        let nan = WrenchReading { force: [f64::NAN, 0.0, 0.0], ..world.wrench(&world.positions, 0.0) };
        let elsewhere = WrenchReading { frame_id: "camera", ..world.wrench(&world.positions, 0.0) };
        world.cycle(vec![Event::Wrench(nan), Event::Wrench(elsewhere)]);
    }
    assert_eq!(world.servo.status().state, State::StaleWrench);
    assert_eq!(world.servo.rejections().total(), 200);
    world.silent = false;
    for _ in 0..100 {
        let other = WrenchReading { source: 2, ..world.wrench(&world.positions, 0.0) };
        world.cycle(vec![Event::Wrench(other)]);
    }
    let rivals = Rivals { of: Contended::Wrenches, first: 1, second: 2 };
    assert_eq!(world.servo.status().reason, Some(Reason::Rivals(rivals)));
    assert_eq!(world.servo.command(), [0.0; 6]);
}

#[test]
fn a_force_beyond_its_limit_stops_the_arm_and_it_may_leave_the_contact() {
    let mut world =
        World::new(Some(Compliance { largest_wrench: [20.0, 10.0], stiffness: [5e3; 6], ..compliance() }));
    world.touch(0.03);
    world.run(1.0);
    let Some(Revocation::Contact(fault @ ContactFault::Force(force))) = world.revocation() else {
        panic!("{:?}", world.revocation());
    };
    assert!((20.0..25.0).contains(&force) && world.largest < 35.0, "{fault:?} {}", world.largest);
    assert_eq!(fault.explain(), format!("contact: {force:.0} N"));
    assert_eq!(world.servo.status().state, State::Holding);
    // The force is still near its limit, and the arm may move away from the wall.
    world.run(2.0);
    world.goal(-0.01);
    world.run(3.0);
    assert_eq!((world.force, world.servo.status().state), (0.0, State::Settled));
}

#[test]
fn any_force_of_one_message_stops_the_arm() {
    for force in [1e3, 1e9, 1e12] {
        let mut world = World::new(Some(compliance()));
        world.goal(-0.001);
        world.run(0.2);
        let reading = WrenchReading { force: [force, 0.0, 0.0], ..world.wrench(&world.positions, 0.0) };
        let before = world.positions.clone();
        world.cycle(vec![Event::Wrench(reading)]);
        assert!(matches!(world.revocation(), Some(Revocation::Contact(_))), "{force}");
        world.run(1.0);
        let moved = world.positions.iter().zip(&before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 0.02, "{force}: {moved} rad to brake");
    }
}

#[test]
fn an_inverted_sensor_is_named_within_half_a_second_of_contact() {
    for stiffness in [1e3, 1e4, 1e5] {
        let settings = Compliance { stiffest: [stiffness, 100.0], ..compliance() };
        let mut world = World { sign: -1.0, stiffness, ..World::new(Some(settings)) };
        let (mut touched, mut at) = (None, -0.01);
        while world.revocation().is_none() {
            at += 0.05 * PERIOD.as_secs_f64();
            world.goal(at);
            world.cycle(Vec::new());
            if world.force > 0.0 {
                touched.get_or_insert(world.now);
            }
            assert!(
                touched.is_none_or(|touched| world.now - touched < Duration::from_millis(500)),
                "{stiffness}"
            );
        }
        let Some(Revocation::Contact(fault @ ContactFault::Sign(_))) = world.revocation() else {
            panic!("{stiffness}: {:?}", world.revocation());
        };
        assert!(fault.explain().contains("is the sign of wrench right"), "{fault:?}");
        let reversed = Compliance { reversed: true, largest_wrench: [500.0, 50.0], ..settings };
        let mut world = World { sign: -1.0, stiffness, ..World::new(Some(reversed)) };
        world.touch(0.01);
        world.run(1.0);
        assert!(world.servo.consent().is_given(), "{stiffness}: {:?}", world.revocation());
    }
}

#[test]
fn a_sensor_that_repeats_one_force_is_stale_once_the_tool_has_moved() {
    let mut world = World::new(Some(Compliance { stiffness: [0.0; 6], ..compliance() }));
    world.goal(-0.008);
    world.run(0.2);
    world.silent = true;
    for _ in 0..1000 {
        let frozen = WrenchReading { force: [0.0, 0.0, 12.0], ..world.wrench(&world.positions, 0.0) };
        world.cycle(vec![Event::Wrench(frozen)]);
    }
    assert_eq!(world.servo.status().state, State::StaleWrench);
    assert_eq!(world.servo.status().reason, Some(Reason::FrozenWrench));
    assert_eq!(world.servo.command(), [0.0; 6]);
}

#[test]
fn a_hand_guides_the_tool_in_free_directions_and_its_place_is_kept() {
    let free = Compliance { stiffness: [0.0; 6], largest_offset: [0.3, 1.0], ..compliance() };
    let mut world = World::new(Some(free));
    world.goal(-0.01);
    world.run(0.5);
    let hand = |world: &World, force: f64| WrenchReading {
        force: (world.tool(&world.positions).rotation().inverse() * Vector3::new(0.0, force, 0.0)).into(),
        ..world.wrench(&world.positions, 0.0)
    };
    world.silent = true;
    for step in 0..1000 {
        let reading = hand(&world, 31.0 + 1e-6 * f64::from(step));
        world.cycle(vec![Event::Wrench(reading)]);
    }
    let moved = world.tool(&world.positions).translation() - world.start.translation();
    // 30 N beyond the dead band at 300 N s/m for 2 s.
    assert!((moved.y - 0.2).abs() < 0.01 && moved.xz().norm() < 1e-3, "{moved}");
    for _ in 0..1000 {
        let reading = hand(&world, 0.0);
        world.cycle(vec![Event::Wrench(reading)]);
    }
    assert_eq!(world.servo.status().state, State::Settled);
    let stayed = world.tool(&world.positions).translation() - world.start.translation();
    assert!((stayed - moved).norm() < 0.02, "{stayed} {moved}");
    let offset = world.servo.status().contact.unwrap().offset[0];
    assert!((offset - stayed.norm()).abs() < 2e-3, "{offset}");
}

#[test]
fn a_restored_servo_yields_bit_for_bit_as_the_saved_one() {
    let mut world = World::new(Some(compliance()));
    world.touch(0.01);
    let saved = postcard::to_allocvec(&world.servo.saved()).unwrap();
    let mut other = World::new(Some(compliance()));
    other.servo.restore(&mut postcard::Deserializer::from_bytes(&saved)).unwrap();
    (other.positions, other.now, other.under_way) =
        (world.positions.clone(), world.now, world.under_way.clone());
    for _ in 0..500 {
        world.cycle(Vec::new());
        other.cycle(Vec::new());
        assert_eq!(world.servo.command(), other.servo.command());
    }
    assert!(world.force > 3.0);
}
