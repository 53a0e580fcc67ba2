//! Measures a cycle of the servo in each state, for one arm and for two: `cargo bench --bench servo_step`.

use criterion::{Criterion, criterion_group, criterion_main};
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_core::servo::{JointReading, Servo, State};
use dq_kinematics::control::Law;
use dq_params::{ParameterOverride, Value};
use std::hint::black_box;
use std::time::{Duration, Instant};

const PERIOD: Duration = Duration::from_millis(2);

/// A servo with ideal arms.
struct Loop {
    servo: Servo,
    names: Vec<Vec<String>>,
    positions: Vec<Vec<f64>>,
    now: Duration,
    next: usize,
}

/// Position \[m\] and orientation (x, y, z, w).
type Goal = ([f64; 3], [f64; 4]);

impl Loop {
    fn new(servo: Servo, names: Vec<Vec<String>>) -> Self {
        let positions = vec![START.to_vec(); names.len()];
        Self { servo, names, positions, now: Duration::ZERO, next: 0 }
    }

    fn take(&mut self, (position, orientation): Goal) {
        self.servo.take_goal(position, orientation, "", self.now).unwrap();
    }

    fn cycle(&mut self) {
        self.now += PERIOD;
        for (arm, (names, positions)) in self.names.iter().zip(&self.positions).enumerate() {
            let stamp_age = Some(Duration::ZERO);
            let reading = JointReading { names, positions, velocities: &[], source: 0, stamp_age };
            self.servo.take_joint_state(arm, &reading, self.now).unwrap();
        }
        let command = black_box(self.servo.step(self.now));
        for (angle, speed) in self.positions.iter_mut().flatten().zip(command) {
            *angle += PERIOD.as_secs_f64() * speed;
        }
    }

    /// Moves toward one of two goals and, when the arm has settled, toward the other.
    fn there_and_back(&mut self, goals: &[Goal; 2]) {
        if !matches!(self.servo.status().state, State::Tracking | State::JointLimit | State::Constrained) {
            self.next = 1 - self.next;
            self.take(goals[self.next]);
        }
        self.cycle();
    }

    fn bench(mut self, criterion: &mut Criterion, state: State) {
        (0..1000).for_each(|_| self.cycle());
        criterion.bench_function(state.name(), |bencher| bencher.iter(|| self.cycle()));
        assert_eq!(self.servo.status().state, state);
    }
}

/// Creates a loop with the gains and limits of the built-in arm. The servo does not detect stalls.
fn new_loop(parameters: ServoParameters, law: Law) -> Loop {
    let names = parameters.joints.iter().map(|arm| arm.names().to_vec()).collect();
    let parameters = parameters.with_period(PERIOD).with(|settings| {
        settings.progress_timeout = None;
        settings.controller.law = law;
    });
    Loop::new(parameters.build().unwrap(), names)
}

/// Returns the default parameters of a node.
fn builtin<P: NodeParameters>() -> P {
    let (store, _) = P::start("/servo", Vec::new()).unwrap();
    P::from_store(&store).unwrap()
}

/// Returns twenty keep-outs of all shapes around the arm, and a table.
fn things() -> Vec<String> {
    let thing = |i: usize| {
        let (sin, cos) = (0.7 * i as f64).sin_cos();
        let (x, y, z) = (0.75 * cos, 0.75 * sin, 0.1 * (i % 6) as f64 - 0.2);
        let shape = ["box", "cylinder", "sphere", "capsule"][i % 4];
        let sizes = ["0.1 0.1 0.3", "0.05 0.3", "0.1", "0.05 0.2"][i % 4];
        format!("thing{i} {shape} {x} {y} {z} {sizes}")
    };
    (0..19).map(thing).chain(["table half_space 0 0 1 -0.5".to_owned()]).collect()
}

/// Returns sixty hulls of a hundred points each, on a circle with the radius `away` \[m\]. Each hull is about 0.1 m large.
fn hulls(away: f64) -> Vec<String> {
    let hull = |i: usize| {
        let (sin, cos) = (0.7 * i as f64).sin_cos();
        let (x, y, z) = (away * cos, away * sin, 0.1 * (i % 6) as f64 - 0.2);
        let point = |k: usize| {
            let (up, turn) = (1.0 - (k as f64 + 0.5) / 50.0, 2.399_963 * k as f64);
            let across = 0.05 * (1.0 - up * up).sqrt();
            format!(" {} {} {}", x + across * turn.cos(), y + across * turn.sin(), z + 0.05 * up)
        };
        format!("hull{i} hull{}", (0..100).map(point).collect::<String>())
    };
    (0..60).map(hull).collect()
}

/// Returns the parameters of the built-in arm with twelve capsules on its links, and with these keep-outs.
fn among_keep_outs(things: Vec<String>) -> ServoParameters {
    let capsule = |i: usize| {
        let (joint, from) = (["joint2", "joint3"][i % 2], 0.07 * (i / 2) as f64);
        let [x, z] = if i.is_multiple_of(2) { [1.0, 0.0] } else { [0.0, 0.4] };
        let y = 1.0 - x;
        format!("{joint} {} {} {z} {} {} {z} 0.04", x * from, y * from, x * (from + 0.07), y * (from + 0.07))
    };
    let texts = |name: &str, list: Vec<String>| ParameterOverride {
        name: name.to_owned(),
        value: Value::StringArray(list),
        source: "the bench".to_owned(),
        by_name: true,
    };
    let on = ParameterOverride { value: Value::Bool(true), ..texts("constraints", Vec::new()) };
    let given = vec![on, texts("body", (0..12).map(capsule).collect()), texts("keep_out", things)];
    let (store, _) = ServoParameters::start("/servo", given).unwrap();
    ServoParameters::from_store(&store).unwrap()
}

/// Prints the times that this many cycles take, and the longest ones. The motion to a goal and back is the same each time. So for
/// each of its cycles, the fastest run shows the time of the servo, and the others include other work of the machine.
fn spread(name: &str, arm: &mut Loop) {
    const CYCLES: usize = 1_000_000;
    let (mut times, mut starts) = (Vec::with_capacity(CYCLES), Vec::new());
    // The first motion begins at another pose.
    (0..10_000).for_each(|_| arm.there_and_back(&GOALS));
    for cycle in 0..CYCLES {
        let (began, next) = (Instant::now(), arm.next);
        arm.there_and_back(&GOALS);
        times.push(began.elapsed());
        if (next, arm.next) == (1, 0) {
            starts.push(cycle);
        }
    }
    let laps: Vec<_> = starts.windows(2).map(|ends| &times[ends[0]..ends[1]]).collect();
    let length = laps.iter().map(|lap| lap.len()).min().unwrap_or_default();
    let by_itself =
        (0..length).filter_map(|cycle| laps.iter().map(|lap| lap[cycle]).min()).max().unwrap_or_default();
    println!("{name}: the worst cycle of {length}, each at its best of {} laps: {by_itself:?}", laps.len());
    times.sort();
    let at = |part: f64| times[((CYCLES - 1) as f64 * part) as usize];
    println!(
        "{name}: median {:?}, 99 % {:?}, 99.99 % {:?}, worst of 10^6 {:?}",
        at(0.5),
        at(0.99),
        at(0.9999),
        at(1.0)
    );
}

/// The paper's start and goal, and two poses of one tool relative to the other. The tools are slightly farther apart in the second
/// pose.
const START: [f64; 6] = [0.7, 1.0, 2.3, 0.5, -0.7, 2.0];
const GOALS: [Goal; 2] =
    [([-0.125, 0.2, 0.2], [0.0, 0.0, 0.0, 1.0]), ([-0.2, 0.3, 0.1], [0.0, 0.0, 0.0, 1.0])];
const RELATIVE_GOALS: [Goal; 2] =
    [([0.4, -0.4, -0.5], [0.0, 0.0, 0.0, 1.0]), ([0.3, -0.3, -0.5], [0.0, 0.0, 0.0, 1.0])];

fn servo_step(criterion: &mut Criterion) {
    let one_arm = |law| new_loop(builtin::<ServoParameters>(), law);
    for law in [Law::Diffc, Law::DiffcInverse, Law::Logc] {
        let mut arm = one_arm(law);
        let name = format!("tracking/{}", law.name());
        criterion.bench_function(&name, |bencher| bencher.iter(|| arm.there_and_back(&GOALS)));
    }
    for (name, away) in [("far", 3.0), ("near", 0.75)] {
        let mut among = new_loop(among_keep_outs(hulls(away)), Law::Logc);
        let name = format!("tracking/among_60_hulls_{name}");
        criterion.bench_function(&name, |bencher| bencher.iter(|| among.there_and_back(&GOALS)));
    }
    let mut among = new_loop(among_keep_outs(things()), Law::Logc);
    criterion
        .bench_function("tracking/among_keep_outs", |bencher| bencher.iter(|| among.there_and_back(&GOALS)));
    spread("tracking/among_keep_outs", &mut among);
    let mut arms = new_loop(builtin::<DualParameters>().0, Law::DiffcInverse);
    criterion
        .bench_function("tracking/two_arms", |bencher| bencher.iter(|| arms.there_and_back(&RELATIVE_GOALS)));
    one_arm(Law::Logc).bench(criterion, State::Holding);
    let mut paused = one_arm(Law::Logc);
    paused.take(GOALS[0]);
    paused.servo.pause(true);
    paused.bench(criterion, State::Paused);
    let mut settled = one_arm(Law::Logc);
    settled.take(GOALS[0]);
    (0..10_000).for_each(|_| settled.cycle());
    settled.bench(criterion, State::Settled);
}

criterion_group!(benches, servo_step);
criterion_main!(benches);
