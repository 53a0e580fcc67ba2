//! What a cycle of the servo takes in each state, for one arm and for two: `cargo bench --bench servo_step`.

use criterion::{Criterion, criterion_group, criterion_main};
use dq_servo::config::{DualParameters, NodeParameters, ServoParameters};
use dq_servo::control::Law;
use dq_servo::servo::{JointReading, Servo, State};
use std::hint::black_box;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(2);

/// A servo with its arms, which do at once what they are commanded.
struct Loop {
    servo: Servo,
    names: Vec<Vec<String>>,
    positions: Vec<Vec<f64>>,
    now: Duration,
    next: usize,
}

/// Position [m] and orientation (x, y, z, w).
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

    /// Towards one of two goals and, when it has settled, the other.
    fn there_and_back(&mut self, goals: &[Goal; 2]) {
        if !matches!(self.servo.status().state, State::Tracking | State::JointLimit) {
            self.next = 1 - self.next;
            self.take(goals[self.next]);
        }
        self.cycle();
    }

    fn bench(mut self, criterion: &mut Criterion, state: State) {
        self.cycle();
        criterion.bench_function(state.name(), |bencher| bencher.iter(|| self.cycle()));
        assert_eq!(self.servo.status().state, state);
    }
}

/// Gains and limits as the built-in arm has them; no stall ends what is measured.
fn new_loop(parameters: ServoParameters, law: Law) -> Loop {
    let names = parameters.joints.iter().map(|arm| arm.names().to_vec()).collect();
    let parameters = parameters.with_period(PERIOD).with(|settings| {
        settings.progress_timeout = None;
        settings.controller.law = law;
    });
    Loop::new(parameters.build().unwrap(), names)
}

/// The parameters of a node to which nothing is given.
fn builtin<P: NodeParameters>() -> P {
    let (store, _) = P::start("/servo", Vec::new()).unwrap();
    P::from_store(&store).unwrap()
}

/// The paper's start, its goal, and the two tools' poses seen from each other, one of which is a little further away.
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
