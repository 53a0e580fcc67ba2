//! Whatever happens in whatever order: the invariants hold.

use crate::rig::{Rig, reading, state_of, twist};
use dq_algebra::UnitDualQuaternion;
use dq_config::ForArm;
use dq_core::servo::{
    self, Goal, GoalMotion, GoalReading, Limits, RAMP_TIME, Reconfigure, Rejection, Sent, State, TwistReading,
};
use dq_kinematics::arm::Chain;
use dq_kinematics::control::{Aim, Controller, Law, Map};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::time::Duration;

/// What may happen to a servo.
#[derive(Clone, Debug)]
enum Event {
    /// A goal of one of two publishers of streams, or of one that sends no other.
    Goal(Option<u32>, [f64; 3], [f64; 4]),
    BadGoal(usize),
    Stream(Stream),
    FrameLost,
    FeedForward(bool),
    /// A longer tool, or a shorter one.
    Tool(bool),
    BadJointState(usize),
    Law(usize),
    Gain(f64),
    /// Twists of one of two publishers: zero or not, how often, and how many cycles apart.
    Twists(u32, bool, usize, usize),
    Pause(bool),
    Stop,
    Connect(bool),
    Follow(bool),
    /// Another publisher of joint states.
    Source(u32),
    /// How much older stamps are than their messages \[ms\].
    Stamps(u64),
    /// This many changes of a parameter, 50 ms apart.
    Changes(u32),
    /// The delays of commands and of joint states [ms].
    Delay(u64, u64),
    /// The stuck joint, or all joints.
    Limit(Limit, usize, f64),
    ProgressTimeout(f64),
    /// Whether the arm goes to other configurations, and how long a search for one takes [ms].
    Round(Reconfigure, u64),
    /// Somebody asks for it.
    GoRound,
    Cycles(usize),
    LateCycle(u32),
}

/// Goals that go on from the one in force by a body twist `(ω, v)` [rad/s, m/s].
#[derive(Clone, Copy, Debug)]
struct Stream {
    twist: [f64; 6],
    count: usize,
    /// Cycles from one to the next.
    each: usize,
    stamped: bool,
    /// Their publisher.
    by: u32,
    /// Whether they are the goal in force, as its frame moves it.
    by_frame: bool,
}

impl Stream {
    fn run(&self, rig: &mut Rig) {
        let goal = rig.servo.status().goal.map(|goal| *goal.base_from_goal());
        let start = goal.or(rig.servo.pose()).unwrap_or(UnitDualQuaternion::identity());
        let began = rig.now;
        for _ in 0..self.count {
            let time = (rig.now - began).as_secs_f64();
            let goal = start * UnitDualQuaternion::screw_exp(&(time * Vector6::from(self.twist)));
            let stamp = if self.stamped { rig.now.as_nanos() as i64 } else { 0 };
            let sent = Sent { by: self.by, ago: Duration::ZERO };
            let goal = GoalReading { sent, ..reading(&goal, stamp) };
            match self.by_frame {
                true => drop(rig.move_goal(&GoalMotion::To(goal))),
                false => drop(rig.take_goal(&goal)),
            }
            (0..self.each).for_each(|_| rig.cycle());
        }
    }
}

fn stream() -> impl Strategy<Value = Stream> {
    let twist = prop::array::uniform6(-1.0..1.0f64);
    (twist, 1..20usize, 1..12usize, any::<bool>(), 0..2u32, any::<bool>()).prop_map(
        |(twist, count, each, stamped, by, by_frame)| Stream { twist, count, each, stamped, by, by_frame },
    )
}

/// A limit that a parameter sets.
#[derive(Clone, Copy, Debug)]
enum Limit {
    Velocity,
    Acceleration,
    Deceleration,
    Jerk,
    Linear,
    Angular,
}

impl Limit {
    fn set(self, limits: &mut Limits, joint: usize, value: f64) {
        let list = match self {
            Self::Velocity => &mut limits.joint_velocity,
            Self::Acceleration => &mut limits.joint_acceleration,
            Self::Deceleration => &mut limits.joint_deceleration,
            Self::Jerk => &mut limits.joint_jerk,
            Self::Linear => return limits.linear_speed = value.min(100.0),
            Self::Angular => return limits.angular_speed = value.min(100.0),
        };
        match list.get_mut(joint) {
            Some(of_one) => *of_one = value,
            None => list.fill(value),
        }
    }
}

fn limit() -> impl Strategy<Value = Event> {
    use Limit::*;
    let which = prop::sample::select(vec![Velocity, Acceleration, Deceleration, Jerk, Linear, Angular]);
    // The ends of the parameters' ranges, and what is usual.
    let value = prop_oneof![
        1 => Just(1e-6),
        1 => Just(1e4),
        6 => (-2.0..2.0f64).prop_map(|exponent| 10f64.powf(exponent)),
    ];
    // One of the joints, or all where there are fewer.
    (which, 0..12usize, value).prop_map(|(which, joint, value)| Event::Limit(which, joint, value))
}

/// What no position limit has to fear.
fn gentle_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (prop::option::of(0..2u32), prop::array::uniform3(-1.0..1.0f64), prop::array::uniform4(-1.0..1.0f64))
            .prop_map(|(by, p, q)| Event::Goal(by, p, q)),
        (1..20u32).prop_map(Event::Changes),
        (0..4usize).prop_map(Event::BadGoal),
        stream().prop_map(Event::Stream),
        Just(Event::FrameLost),
        any::<bool>().prop_map(Event::FeedForward),
        (0..4usize).prop_map(Event::BadJointState),
        (0..Law::ALL.len()).prop_map(Event::Law),
        (0..2u32, any::<bool>(), 1..4usize, 1..80usize)
            .prop_map(|(by, zero, count, each)| Event::Twists(by, zero, count, each)),
        any::<bool>().prop_map(Event::Pause),
        Just(Event::Stop),
        any::<bool>().prop_map(Event::Connect),
        limit(),
        (0.01..0.2f64).prop_map(Event::ProgressTimeout),
        (prop::sample::select(vec![Reconfigure::Never, Reconfigure::Ask, Reconfigure::Always]), 0..200u64)
            .prop_map(|(reconfigure, ms)| Event::Round(reconfigure, ms)),
        Just(Event::GoRound),
        (1..80usize).prop_map(Event::Cycles),
        (1..80usize).prop_map(Event::Cycles),
    ]
}

/// All. A joint cannot be kept from a limit in cycles that were missed, nor by a servo that cannot know where the arm is.
fn any_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        15 => gentle_event(),
        1 => (1..60u32).prop_map(Event::LateCycle),
        1 => any::<bool>().prop_map(Event::Follow),
        1 => (0..20u32).prop_map(Event::Source),
        1 => (0..2000u64).prop_map(Event::Stamps),
        1 => any::<bool>().prop_map(Event::Tool),
        1 => (0..40u64, 0..40u64).prop_map(|(commands, states)| Event::Delay(commands, states)),
        1 => prop_oneof![Just(1e-6), Just(1e4), 0.1..100.0f64].prop_map(Event::Gain),
    ]
}

/// The law of that number, with the gains that it has.
fn switch(rig: &mut Rig, number: usize) {
    let two_arms = rig.plants.len() > 1;
    rig.change(|settings| {
        let controller = &mut settings.controller;
        if two_arms {
            let (map, aim) = ([Map::Transpose, Map::DampedInverse][number % 2], Aim::ALL[number % 5]);
            *controller = Controller::of_two_arms(map, aim, controller.gain(), controller.damping);
        } else {
            // Another task drops the goal: most switches keep it.
            let aim = [Aim::Position, Aim::PositionAndAxis].get(number % 8).copied().unwrap_or(Aim::Pose);
            (controller.law, controller.aim) = (Law::ALL[number], aim);
        }
    });
}

fn set_gain(rig: &mut Rig, gain: f64) {
    let two_arms = rig.plants.len() > 1;
    rig.change(|settings| {
        let controller = &mut settings.controller;
        if two_arms {
            *controller = controller.with_law(controller.law, gain.min(100.0));
        } else {
            controller.set_gains(Law::Diffc, [gain; 2]);
            controller.set_gains(Law::Logc, [1.0, gain.min(100.0)]);
            controller.set_gains(Law::DoubleGeodesic, [gain.min(100.0), 1.0]);
        }
    });
}

/// Changes a parameter as a speed override does: each 50 ms.
fn change_often(rig: &mut Rig, count: u32) {
    for number in 0..count {
        rig.change(|settings| settings.goal_tolerance.linear = 1e-3 + 1e-6 * f64::from(number % 2));
        (0..25).for_each(|_| rig.cycle());
    }
}

/// Lets it happen; the rig checks the invariants.
fn apply(rig: &mut Rig, event: Event) {
    let now = rig.now;
    // Where the servo cannot know exactly where the arm is, it cannot hold the tool's speed exactly; the rig's own arms keep their tool.
    rig.check_tools &= !matches!(
        event,
        Event::Follow(_) | Event::Delay(..) | Event::LateCycle(_) | Event::Connect(_) | Event::Tool(_)
    );
    match event {
        Event::Goal(by, p, q) => {
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            let (position, orientation_xyzw) = (p, q.map(|x| x / norm));
            let goal =
                GoalReading { position, orientation_xyzw, ..reading(&UnitDualQuaternion::identity(), 0) };
            let _: Result<(), Rejection> = match by {
                Some(by) => rig.take_goal(&GoalReading { sent: Sent { by, ..goal.sent }, ..goal }),
                None => rig.take_single(&goal),
            };
        }
        Event::BadGoal(i) => {
            let (number, quaternion, frame) = [
                (f64::NAN, [0.0, 0.0, 0.0, 1.0], ""),
                (0.1, [0.0; 4], ""),
                (1e9, [0.0, 0.0, 0.0, 1.0], ""),
                (0.1, [0.0, 0.0, 0.0, 1.0], "map"),
            ][i];
            rig.take_point([number; 3], quaternion, frame).unwrap_err();
        }
        Event::Stream(stream) => stream.run(rig),
        Event::FrameLost => rig.move_goal(&GoalMotion::Lost).unwrap(),
        Event::FeedForward(fed) => rig.change(|settings| settings.feed_forward = fed),
        Event::Tool(longer) => {
            let point = Vector3::new(0.0, 0.05, if longer { 0.1 } else { 0.0 });
            let tool = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), point);
            rig.change(|settings| settings.tool_offset = tool);
        }
        Event::BadJointState(i) => {
            let names = &rig.names[..[6, 6, 5, 0][i]];
            let positions: &[f64] = [&[f64::NAN; 6][..], &[1e9; 6], &[0.0; 5], &[]][i];
            let reading = state_of(names, positions, 0);
            rig.servo.take_joint_state(0, &reading, now).unwrap_err();
        }
        Event::Law(i) => switch(rig, i),
        Event::Gain(gain) => set_gain(rig, gain),
        Event::Pause(paused) => rig.pause(paused),
        Event::Stop => rig.stop(),
        Event::Twists(by, zero, count, each) => {
            let linear = if zero { [0.0; 3] } else { [0.0, 0.3, 0.3] };
            for _ in 0..count {
                let reading =
                    TwistReading { sent: Sent { by, ..Sent::default() }, ..twist(linear, [0.0; 3], "") };
                rig.take_twist(&reading).unwrap();
                (0..each).for_each(|_| rig.cycle());
            }
        }
        Event::Connect(connected) => rig.connect(connected),
        Event::Follow(following) => rig.following = following,
        Event::Source(source) => rig.source = source,
        Event::Stamps(ms) => rig.stamp_error = Duration::from_millis(ms),
        Event::Changes(count) => change_often(rig, count),
        Event::Delay(commands, states) => {
            rig.command_delay = Duration::from_millis(commands);
            rig.state_delay = Duration::from_millis(states);
        }
        Event::Limit(which, joint, value) => {
            rig.change(|settings| which.set(&mut settings.limits, joint, value));
        }
        Event::ProgressTimeout(seconds) => {
            rig.change(|settings| settings.progress_timeout = Some(Duration::from_secs_f64(seconds)));
        }
        Event::Round(reconfigure, ms) => {
            rig.search_time = Duration::from_millis(ms);
            rig.change(|settings| settings.reconfigure = reconfigure);
        }
        // Most of the time there is nothing to go round.
        Event::GoRound => drop(rig.servo.take(servo::Event::Reconfigure { ago: Duration::ZERO })),
        Event::Cycles(count) => (0..count).for_each(|_| rig.cycle()),
        Event::LateCycle(missed) => rig.cycle_late(missed),
    }
}

/// A limit on jerk [rad/s³], or none.
pub fn jerk() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(f64::INFINITY), 3 => (1.0..5.0f64).prop_map(|exponent| 10f64.powf(exponent))]
}

fn limit_jerk(rig: &mut Rig, jerk: f64) {
    rig.change(|settings| settings.limits.joint_jerk.fill(jerk));
}

/// Lets all happen, and then a stop, which from any limits ends within a second, and the time that accelerations need.
fn apply_all(mut rig: Rig, events: Vec<Event>, jerk: f64) {
    limit_jerk(&mut rig, jerk);
    rig.check_positions = false;
    // The servo knows the time from its first cycle on.
    rig.cycle();
    events.into_iter().for_each(|event| apply(&mut rig, event));
    rig.cycle();
    rig.stop();
    let is_eased = rig.servo.settings().limits.joint_jerk.iter().any(|jerk| jerk.is_finite());
    rig.run(if is_eased { 1.01 + 2.0 * RAMP_TIME } else { 1.01 });
    assert_eq!(rig.speed(), 0.0);
    assert_eq!(rig.servo.replaced().last, None);
}

/// The paper's arm, a UR5e (six joints, standard rows) and a Panda (seven, modified), each where it can move.
pub fn arms() -> [Rig; 3] {
    let [ur5e, panda] = ["ur5e", "panda"].map(|name| Chain::for_arm(name).unwrap());
    [
        Rig::new(),
        Rig::of_arm(ur5e, vec![0.3, -1.2, 1.5, -1.8, -1.4, 0.2]),
        Rig::of_arm(panda, vec![0.1, -0.7, 0.2, -2.3, 0.1, 1.6, 0.8]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_order_of_events_breaks_an_invariant(arm in 0..3usize, events in prop::collection::vec(any_event(), 1..40), jerk in jerk()) {
        apply_all(arms().into_iter().nth(arm).unwrap(), events, jerk);
    }

    #[test]
    fn no_order_of_events_breaks_an_invariant_of_two_arms(events in prop::collection::vec(any_event(), 1..40), jerk in jerk()) {
        apply_all(Rig::two_arms(), events, jerk);
    }
}

/// What is sent while all happens, where another servo takes over every this many cycles.
fn sent(
    mut rig: Rig,
    events: &[Event],
    (jerk, integral): (f64, f64),
    restored_each: u32,
) -> Vec<Option<Vec<f64>>> {
    (rig.check_positions, rig.restored_each, rig.sent) = (false, restored_each, Some(Vec::new()));
    rig.change(|settings| settings.integral = integral);
    limit_jerk(&mut rig, jerk);
    rig.cycle();
    events.iter().cloned().for_each(|event| apply(&mut rig, event));
    rig.sent.unwrap()
}

/// The first cycle in which the two differ in any bit.
pub fn first_difference(one: &[Option<Vec<f64>>], other: &[Option<Vec<f64>>]) -> Option<usize> {
    let bits = |sent: &Option<Vec<f64>>| {
        sent.as_ref().map(|sent| sent.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
    };
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).position(|(one, other)| bits(one) != bits(other))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// So a replay can begin in any cycle.
    #[test]
    fn another_servo_that_knows_what_this_one_knew_goes_on_to_the_bit(
        arm in 0..4usize,
        events in prop::collection::vec(any_event(), 1..30),
        (jerk, integral) in (jerk(), prop_oneof![Just(0.0), 0.0..10.0f64]),
        each in 1..60u32,
    ) {
        let rig = || arms().into_iter().nth(arm).unwrap_or_else(Rig::two_arms);
        let [one, other] = [0, each].map(|each| sent(rig(), &events, (jerk, integral), each));
        prop_assert_eq!(first_difference(&one, &other), None);
    }
}

/// How far the tool is from its goal, by the size of the error's log.
fn error(rig: &Rig) -> f64 {
    rig.servo.status().pose_error.norm()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Liveness: whatever happened, whoever asks afresh moves the arm, and it arrives, gets nearer all the time, or is stalled within its
    /// timeouts, however often a parameter changes meanwhile.
    #[test]
    fn whatever_happened_a_fresh_goal_is_gone_to_or_stalls(arm in 0..3usize, events in prop::collection::vec(gentle_event(), 1..15)) {
        let mut rig = arms().into_iter().nth(arm).unwrap();
        rig.check_positions = false;
        rig.cycle();
        events.into_iter().for_each(|event| apply(&mut rig, event));
        rig.connect(true);
        rig.change(|settings| {
            let Limits { joint_velocity, joint_acceleration, joint_deceleration, joint_jerk, .. } = &mut settings.limits;
            joint_velocity.fill(2.0);
            [joint_acceleration, joint_deceleration].into_iter().for_each(|list| list.fill(20.0));
            joint_jerk.fill(f64::INFINITY);
            (settings.limits.linear_speed, settings.limits.angular_speed) = (1.0, 2.0);
            settings.progress_timeout = Some(Duration::from_millis(200));
            settings.controller.aim = Aim::Pose;
        });
        // Sticks and streams of before have let go by then.
        change_often(&mut rig, 60);
        rig.pause(false);
        let here = rig.servo.pose().unwrap();
        let goal = here * UnitDualQuaternion::screw_exp(&[0.0, 0.1, 0.0, 0.05, 0.0, 0.0].into());
        let taken = rig.take_single(&reading(&goal, 0));
        prop_assert!(matches!(taken, Ok(()) | Err(Rejection::BeyondReach(_))), "{taken:?}");
        let mut before = f64::INFINITY;
        for _ in 0..10 {
            change_often(&mut rig, 40);
            if matches!(rig.state(), State::Settled | State::Stalled) || taken.is_err() {
                break;
            }
            // On its way to another configuration the tool may go away from the goal.
            let goes_round = rig.state() == State::Reconfiguring;
            prop_assert!(goes_round || error(&rig) < before, "{} {:?} {before}", rig.state(), rig.servo.status());
            before = error(&rig);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn no_order_of_events_passes_a_position_limit(
        // From outside by 0.3 rad to inside by 1 rad.
        room in prop::array::uniform6((-0.3..1.0f64, -0.3..1.0f64)),
        margin in prop_oneof![Just(0.0), 0.0..0.5f64],
        events in prop::collection::vec(gentle_event(), 1..40),
        jerk in jerk(),
        integral in prop_oneof![Just(0.0), 0.0..10.0f64],
    ) {
        let mut rig = Rig::with(|settings| {
            settings.integral = integral;
            let start = crate::reference::theta("theta_initial");
            let position = &mut settings.limits.position;
            position.lower = start.iter().zip(room).map(|(angle, (below, _))| angle - below).collect();
            position.upper = start.iter().zip(room).map(|(angle, (_, above))| angle + above).collect();
            // As the parameters are checked: a joint has room.
            for (lower, upper) in position.lower.iter_mut().zip(&mut position.upper) {
                *upper = upper.max(*lower + 0.01);
            }
            position.margin = margin;
        });
        limit_jerk(&mut rig, jerk);
        rig.cycle();
        events.into_iter().for_each(|event| apply(&mut rig, event));
        rig.run(0.1);
    }

    #[test]
    fn goals_of_any_numbers_are_taken_or_rejected(p in prop::array::uniform3(any::<f64>()), q in prop::array::uniform4(any::<f64>())) {
        if let Ok(goal) = Goal::new(p, q, "", "base") {
            prop_assert!(goal.base_from_goal().to_vector8().iter().all(|x| x.is_finite()));
        }
    }
}

/// Arms with narrow limits that always go round, each event in the middle of what the one before led to.
#[test]
fn no_order_of_events_on_ways_round_passes_a_limit() {
    let underway = std::cell::Cell::new(0_u32);
    let room = prop::array::uniform6((0.2..2.0f64, 0.2..2.0f64));
    // Goals that are reached within the limits, in another configuration or not, and what else may happen.
    let places = prop::collection::vec(prop::array::uniform6(0.0..1.0f64), 1..5);
    let strategy = (room, places, prop::collection::vec(gentle_event(), 1..8), 0..40u64);
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 150,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let ended = runner.run(&strategy, |(room, places, events, search)| {
        let start = crate::reference::theta("theta_initial");
        let limits = start.iter().zip(room).map(|(angle, (below, above))| (angle - below, angle + above));
        let limits: Vec<_> = limits.collect();
        let mut rig = Rig::with(|settings| {
            settings.reconfigure = Reconfigure::Always;
            settings.progress_timeout = Some(Duration::from_millis(100));
            settings.limits.position.lower = limits.iter().map(|(lower, _)| *lower).collect();
            settings.limits.position.upper = limits.iter().map(|(_, upper)| *upper).collect();
        });
        rig.search_time = Duration::from_millis(search);
        rig.run(0.1);
        for (number, event) in events.into_iter().enumerate() {
            let parts = places[number % places.len()];
            let place: Vec<_> = limits
                .iter()
                .zip(parts)
                .map(|((lower, upper), part)| lower + part * (upper - lower))
                .collect();
            let _: Result<(), Rejection> =
                rig.take_goal(&reading(&crate::reference::puma().forward_kinematics(&place).unwrap(), 0));
            for _ in 0..1500 {
                rig.cycle();
                if rig.state() == State::Reconfiguring {
                    underway.set(underway.get() + 1);
                    if underway.get().is_multiple_of(97) {
                        break;
                    }
                }
            }
            apply(&mut rig, event);
        }
        rig.run(0.1);
        Ok(())
    });
    ended.unwrap();
    assert!(underway.get() > 1000, "{} cycles on ways round", underway.get());
}
