//! Events that may happen to a servo and its robot, for random sequences.

use crate::rig::{Rig, reading, state_of, twist};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{self, GoalMotion, GoalReading, Limits, Reconfigure, Rejection, Sent, TwistReading};
use dq_kinematics::control::{Aim, Controller, Law, Map};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use std::time::Duration;

/// An event that may happen to a servo.
#[derive(Clone, Debug)]
pub enum Event {
    /// A goal: its publisher, position and orientation. The publisher is one of two that stream; `None` stands for a publisher
    /// that sends only this goal.
    Goal(Option<u32>, [f64; 3], [f64; 4]),
    BadGoal(usize),
    /// A goal of joint positions: its publisher as in [`Event::Goal`], the angles by which the joints are to move \[rad\], and its
    /// age on arrival \[ms\].
    Joints(Option<u32>, [f64; 4], u64),
    Stream(Stream),
    FrameLost,
    FeedForward(bool),
    /// The tool becomes longer (true) or shorter (false).
    Tool(bool),
    BadJointState(usize),
    Law(usize),
    Gain(f64),
    /// Twists of one of two publishers: the publisher, whether the twists are zero, their number, the number of cycles between two
    /// twists, and their age on arrival \[ms\].
    Twists(u32, bool, usize, usize, u64),
    /// A request of `~/pause`: whether to pause (true) or to resume (false), and its age on arrival \[ms\].
    Pause(bool, u64),
    /// A goal that the arm reaches if its joints move by given angles. The values are the publisher as in [`Event::Goal`], the
    /// angles \[rad\], the time from sending to arrival \[ms\], and the time for which the goal then waits for its frame \[ms\].
    Near(Option<u32>, [f64; 4], u64, u64),
    /// TF loses the frame in which this publisher streams goals, for this number of cycles. The publisher continues meanwhile.
    FrameAway(u32, usize),
    TwistTimeout(f64),
    GoalTimeout(Option<f64>),
    /// Somebody moves this joint by hand, instantly, by this angle \[rad\].
    Jump(usize, f64),
    /// Joint states of the last arm begin or cease to arrive.
    ConnectLast(bool),
    /// Another publisher begins or ceases to send commands to the arm.
    Rival(bool),
    /// Another publisher begins or ceases to send joint states of the arm.
    SecondSource(bool),
    /// The servo misses this number of cycles. It receives the joint states of this time before (true) or after (false) its next
    /// cycle.
    Gap(u32, bool),
    /// An external force acts on a joint: the value of the parameter `integral`, the joint, and the speed that the force subtracts
    /// from the joint's commanded speed [rad/s].
    Pull(f64, usize, f64),
    /// Whether joint states have velocities, and the time between two joint states \[ms\].
    States(bool, u64),
    /// The time constant with which joints follow velocities \[ms\].
    Lag(u64),
    Stuck(Option<usize>),
    Stop,
    Connect(bool),
    Follow(bool),
    /// From now on, the publisher with this number sends the joint states.
    Source(u32),
    /// The time by which the stamps make joint states look older than they are \[ms\].
    Stamps(u64),
    /// A parameter changes this many times, every 50 ms.
    Changes(u32),
    /// The delays of commands and of joint states \[ms\].
    Delay(u64, u64),
    /// A new value of a limit. A joint limit changes for the joint with this index or, if the arm has no such joint, for all joints.
    Limit(Limit, usize, f64),
    ProgressTimeout(f64),
    /// The value of `reconfigure`, and how long a search takes \[ms\].
    Round(Reconfigure, u64),
    /// A request of `~/reconfigure`.
    GoRound,
    Cycles(usize),
    LateCycle(u32),
}

/// A stream of goals that starts at the goal in force and moves with a body twist `(ω, v)` [rad/s, m/s].
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    twist: [f64; 6],
    count: usize,
    /// Number of cycles from one goal to the next.
    each: usize,
    stamped: bool,
    /// The publisher of the goals.
    by: u32,
    /// Whether the stream moves the frame of the goal in force, instead of sending new goals.
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
pub enum Limit {
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
    // The ends of the parameters' ranges, and usual values.
    let value = prop_oneof![
        1 => Just(1e-6),
        1 => Just(1e4),
        6 => (-2.0..2.0f64).prop_map(|exponent| 10f64.powf(exponent)),
    ];
    // The limit of one joint; if the arm has no joint with this number, the limit of all joints.
    (which, 0..12usize, value).prop_map(|(which, joint, value)| Event::Limit(which, joint, value))
}

/// Returns events that cannot make an arm exceed a position limit.
pub fn gentle_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (prop::option::of(0..2u32), prop::array::uniform3(-1.0..1.0f64), prop::array::uniform4(-1.0..1.0f64))
            .prop_map(|(by, p, q)| Event::Goal(by, p, q)),
        (prop::option::of(0..2u32), prop::array::uniform4(-1.0..1.0f64))
            .prop_map(|(by, turns)| Event::Joints(by, turns, 0)),
        (1..20u32).prop_map(Event::Changes),
        (0..4usize).prop_map(Event::BadGoal),
        stream().prop_map(Event::Stream),
        Just(Event::FrameLost),
        any::<bool>().prop_map(Event::FeedForward),
        (0..4usize).prop_map(Event::BadJointState),
        (0..Law::ALL.len()).prop_map(Event::Law),
        (0..2u32, any::<bool>(), 1..4usize, 1..80usize)
            .prop_map(|(by, zero, count, each)| Event::Twists(by, zero, count, each, 0)),
        any::<bool>().prop_map(|paused| Event::Pause(paused, 0)),
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

/// Returns the events of [`gentle_event`], and events after which a servo cannot always keep the position limits, because it misses
/// cycles or does not know the arm's position.
pub fn any_event() -> impl Strategy<Value = Event> {
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

/// Returns requests of any age, faults of the robot and its network, and changes of settings.
fn attack() -> impl Strategy<Value = Event> {
    // The ages leave out the times for which the guide's safety page does not say whether a message is late.
    let ago = || prop_oneof![3 => Just(0), 2 => 10..900u64, 1 => 1100..3000u64];
    let by = || prop::option::of(0..2u32);
    prop_oneof![
        5 => (by(), prop::array::uniform4(-0.4..0.4f64), ago(), prop_oneof![3 => Just(0), 1 => 0..1500u64])
            .prop_map(|(by, turns, ago, waited)| Event::Near(by, turns, ago, waited)),
        2 => (by(), prop::array::uniform4(-0.4..0.4f64), ago())
            .prop_map(|(by, turns, ago)| Event::Joints(by, turns, ago)),
        2 => stream().prop_map(Event::Stream),
        2 => (0..2u32, prop::bool::weighted(0.2), 1..60usize, 1..40usize, prop_oneof![4 => Just(0), 1 => 0..300u64])
            .prop_map(|(by, zero, count, each, ago)| Event::Twists(by, zero, count, each, ago)),
        2 => (any::<bool>(), ago()).prop_map(|(paused, ago)| Event::Pause(paused, ago)),
        1 => Just(Event::Pause(false, 0)),
        1 => Just(Event::Stop),
        1 => (0..2u32, 1..1500usize).prop_map(|(by, cycles)| Event::FrameAway(by, cycles)),
        1 => (0.02..0.5f64).prop_map(Event::TwistTimeout),
        1 => prop::option::of(0.05..2.0f64).prop_map(Event::GoalTimeout),
        1 => (0..12usize, -1.5..1.5f64).prop_map(|(joint, by)| Event::Jump(joint, by)),
        1 => any::<bool>().prop_map(Event::ConnectLast),
        1 => any::<bool>().prop_map(Event::Connect),
        1 => any::<bool>().prop_map(Event::Rival),
        1 => any::<bool>().prop_map(Event::SecondSource),
        1 => (1..700u32, any::<bool>()).prop_map(|(missed, heard)| Event::Gap(missed, heard)),
        1 => (prop_oneof![Just(0.0), 1.0..10.0f64], 0..12usize, -0.15..0.15f64)
            .prop_map(|(integral, joint, pull)| Event::Pull(integral, joint, pull)),
        1 => (any::<bool>(), 0..20u64).prop_map(|(velocities, ms)| Event::States(velocities, ms)),
        1 => prop_oneof![Just(0), 1..85u64].prop_map(Event::Lag),
        1 => (0..40u64, 0..40u64).prop_map(|(commands, states)| Event::Delay(commands, states)),
        1 => prop::option::of(0..12usize).prop_map(Event::Stuck),
        1 => any::<bool>().prop_map(Event::Follow),
        1 => any::<bool>().prop_map(Event::Tool),
        1 => (0..Law::ALL.len()).prop_map(Event::Law),
        1 => limit(),
        6 => prop_oneof![1..100usize, 100..1200usize].prop_map(Event::Cycles),
    ]
}

/// Returns a sequence of five events: a goal, some cycles, any event, a second request, and some cycles. The second request may have
/// been sent before the event in the middle.
fn interruption() -> impl Strategy<Value = Vec<Event>> {
    let turns = || prop::array::uniform4(-0.4..0.4f64);
    let between = prop_oneof![
        3 => attack(),
        1 => Just(Event::Stop),
        1 => turns().prop_map(|turns| Event::Near(Some(2), turns, 0, 0)),
        1 => (500..700usize).prop_map(|cycles| Event::FrameAway(0, cycles)),
        1 => (60..300u32, any::<bool>()).prop_map(|(missed, heard)| Event::Gap(missed, heard)),
    ];
    let second = prop_oneof![
        2 => turns().prop_map(|turns| Event::Near(Some(0), turns, 0, 0)),
        1 => (turns(), 10..900u64).prop_map(|(turns, ago)| Event::Near(None, turns, ago, 0)),
        1 => (10..900u64).prop_map(|ago| Event::Pause(false, ago)),
    ];
    (turns(), 1..200usize, between, second, 1..1200usize).prop_map(
        |(first, before, between, second, after)| {
            let first = Event::Near(Some(0), first, 0, 0);
            vec![first, Event::Cycles(before), between, second, Event::Cycles(after)]
        },
    )
}

/// Returns sequences of requests and faults. Some sequences interrupt a stream of goals. Some begin with an external force on a
/// joint, which the parameter `integral` balances.
pub fn attacks() -> impl Strategy<Value = Vec<Event>> {
    let pull = (1.0..10.0f64, 0..12usize, -0.15..0.15f64)
        .prop_map(|(integral, joint, pull)| Event::Pull(integral, joint, pull));
    let part = prop_oneof![2 => attack().prop_map(|event| vec![event]), 1 => interruption()];
    (prop::option::weighted(0.3, pull), prop::collection::vec(part, 1..15))
        .prop_map(|(pull, parts)| pull.into_iter().chain(parts.into_iter().flatten()).collect())
}

/// Switches to another law and sometimes to another task. `number` selects both.
fn switch(rig: &mut Rig, number: usize) {
    let two_arms = rig.plants.len() > 1;
    rig.change(|settings| {
        let controller = &mut settings.controller;
        if two_arms {
            let (map, aim) = ([Map::Transpose, Map::DampedInverse][number % 2], Aim::ALL[number % 5]);
            *controller = Controller::of_two_arms(map, aim, controller.gain(), controller.damping);
        } else {
            // Another task drops the goal, so most switches keep the task.
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

/// Changes a parameter every 50 ms, as a speed override does.
pub fn change_often(rig: &mut Rig, count: u32) {
    for number in 0..count {
        rig.change(|settings| settings.goal_tolerance.linear = 1e-3 + 1e-6 * f64::from(number % 2));
        (0..25).for_each(|_| rig.cycle());
    }
}

impl Event {
    /// Returns whether the servo cannot know the arm's exact position after the event.
    fn hides_the_arm(&self) -> bool {
        matches!(
            self,
            Self::Follow(_)
                | Self::Delay(..)
                | Self::LateCycle(_)
                | Self::Connect(_)
                | Self::ConnectLast(_)
                | Self::Tool(_)
                | Self::Jump(..)
                | Self::Gap(..)
                | Self::Pull(..)
                | Self::States(..)
                | Self::Lag(_)
                | Self::Stuck(_)
                | Self::SecondSource(_)
        )
    }
}

/// Sends a goal at [`pose_near`]. The goal is under way for the time `ago`, and then waits for its frame for the time `waited`.
pub fn near(rig: &mut Rig, by: Option<u32>, turns: [f64; 4], (ago, waited): (Duration, Duration)) {
    let pose = pose_near(rig, turns);
    let sent = Sent { by: by.unwrap_or_else(|| rig.next_publisher()), ago };
    let arrived = rig.now;
    if !waited.is_zero() {
        rig.goal_waits(sent);
    }
    while rig.now < arrived + waited {
        rig.cycle();
    }
    let waited = rig.now - arrived;
    let _: Result<(), Rejection> = rig.take_goal(&GoalReading { waited, sent, ..reading(&pose, 0) });
}

/// Returns the joint positions after the joints move by `turns` \[rad\]. The four numbers repeat: the fifth joint moves by the first.
fn place_near(rig: &Rig, turns: [f64; 4]) -> Vec<f64> {
    rig.positions().iter().zip(turns.iter().cycle()).map(|(is, turn)| is + turn).collect()
}

/// Returns the tool's pose at [`place_near`].
fn pose_near(rig: &Rig, turns: [f64; 4]) -> UnitDualQuaternion {
    let mut arms = rig.arms().clone();
    arms.evaluate(&place_near(rig, turns));
    arms.pose()
}

/// Sends a stream of goals at 10 Hz. Then TF loses their frame for `cycles` cycles, so that later goals wait. When TF has the frame
/// again, the servo receives the latest goal.
pub fn lose_frame(rig: &mut Rig, by: u32, cycles: usize) {
    let turns = [0.2, -0.2, 0.1, 0.2];
    for _ in 0..6 {
        near(rig, Some(by), turns, Default::default());
        (0..50).for_each(|_| rig.cycle());
    }
    let _: Result<(), Rejection> = rig.move_goal(&GoalMotion::Lost);
    let sent = Sent { by, ago: Duration::ZERO };
    for cycle in 0..cycles {
        if cycle % 50 == 0 {
            rig.goal_waits(sent);
        }
        rig.cycle();
    }
    let waited = rig.period() * ((cycles - 1) % 50 + 1) as u32;
    let goal = reading(&pose_near(rig, turns), 0);
    let _: Result<(), Rejection> = rig.take_goal(&GoalReading { waited, sent, ..goal });
}

/// Applies the event. The rig checks the invariants.
pub fn apply(rig: &mut Rig, event: Event) {
    let now = rig.now;
    // The servo cannot keep the tool's speed limit exactly if it cannot know the arm's position. A change of the tool changes the
    // speed of the tool point at once.
    rig.check_tools &= !event.hides_the_arm();
    let ms = Duration::from_millis;
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
        Event::Joints(by, turns, ago) => {
            let place: Vec<_> = place_near(rig, turns).into_iter().map(Some).collect();
            let sent = Sent { by: by.unwrap_or_else(|| rig.next_publisher()), ago: ms(ago) };
            let _: Result<(), Rejection> = rig.take_joint_goal(&place, sent);
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
            let count = rig.names.len();
            let names = &rig.names[..[count, count, count - 1, 0][i]];
            let positions = &[[f64::NAN; 12], [1e9; 12], [0.0; 12], [0.0; 12]][i][..names.len()];
            let reading = state_of(names, positions, 0);
            rig.servo.take_joint_state(0, &reading, now).unwrap_err();
        }
        Event::Law(i) => switch(rig, i),
        Event::Gain(gain) => set_gain(rig, gain),
        Event::Pause(paused, ago) => rig.pause_ago(paused, ms(ago)),
        Event::Stop => rig.stop(),
        Event::Twists(by, zero, count, each, ago) => {
            let linear = if zero { [0.0; 3] } else { [0.0, 0.3, 0.3] };
            for _ in 0..count {
                let reading = TwistReading { sent: Sent { by, ago: ms(ago) }, ..twist(linear, [0.0; 3], "") };
                let taken = rig.take_twist(&reading);
                assert!(ago > 0 || taken.is_ok(), "{taken:?}");
                (0..each).for_each(|_| rig.cycle());
            }
        }
        Event::Near(by, turns, ago, waited) => near(rig, by, turns, (ms(ago), ms(waited))),
        Event::FrameAway(by, cycles) => lose_frame(rig, by, cycles),
        Event::TwistTimeout(seconds) => {
            rig.change(|settings| settings.twist_timeout = Duration::from_secs_f64(seconds));
        }
        Event::GoalTimeout(seconds) => {
            rig.change(|settings| settings.goal_timeout = seconds.map(Duration::from_secs_f64));
        }
        Event::Jump(joint, by) => rig.jump(joint % rig.pull.len(), by),
        Event::ConnectLast(connected) => {
            rig.connected.iter_mut().last().into_iter().for_each(|it| *it = connected)
        }
        Event::Rival(rival) => rig.set_rival(rival),
        Event::SecondSource(second) => rig.second_source = second.then_some(77),
        Event::Gap(missed, heard) => rig.gap(missed, heard),
        Event::Pull(integral, joint, pull) => {
            rig.change(|settings| settings.integral = integral);
            let joint = joint % rig.pull.len();
            rig.pull[joint] = pull;
        }
        Event::States(velocities, interval) => {
            (rig.with_velocities, rig.state_interval) = (velocities, ms(interval));
        }
        Event::Lag(time) => rig.set_lag(ms(time)),
        Event::Stuck(joint) => rig.stuck_joint = joint.map(|joint| joint % rig.pull.len()),
        Event::Connect(connected) => rig.connect(connected),
        Event::Follow(following) => rig.following = following,
        Event::Source(source) => rig.source = source,
        Event::Stamps(ms) => rig.stamp_error = Duration::from_millis(ms),
        Event::Changes(count) => change_often(rig, count),
        Event::Delay(commands, states) => rig.set_delays(ms(commands), ms(states)),
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
        // Most of the time there is no configuration to go to.
        Event::GoRound => drop(rig.servo.take(servo::Event::Reconfigure { ago: Duration::ZERO })),
        Event::Cycles(count) => (0..count).for_each(|_| rig.cycle()),
        Event::LateCycle(missed) => rig.cycle_late(missed),
    }
}
