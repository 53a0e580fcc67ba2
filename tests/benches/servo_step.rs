//! What a cycle of the servo takes in each state, for one arm and for two: `cargo bench --bench servo_step`.

use criterion::{Criterion, criterion_group, criterion_main};
use dq_servo::config::{
    BUILTIN_FILE, DualParameters, NodeParameters, ServoParameters, parameters_for,
};
use dq_servo::control::Law;
use dq_servo::servo::{JointReading, Servo, State, Task};
use std::hint::black_box;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(2);

/// A servo with its arms, which do at once what they are commanded.
struct Loop<T: Task> {
    servo: Servo<T>,
    names: Vec<Vec<String>>,
    positions: Vec<Vec<f64>>,
    now: Duration,
}

impl<T: Task> Loop<T> {
    fn new(servo: Servo<T>, names: Vec<Vec<String>>, start: &[f64]) -> Self {
        let positions = names.iter().map(|_| start.to_vec()).collect();
        Self { servo, names, positions, now: Duration::ZERO }
    }

    fn cycle(&mut self, with_states: bool) {
        self.now += PERIOD;
        if with_states {
            for (arm, (names, positions)) in self.names.iter().zip(&self.positions).enumerate() {
                let reading = JointReading {
                    names,
                    positions,
                    velocities: &[],
                    source: 0,
                    stamp_age: Some(Duration::ZERO),
                };
                self.servo.take_joint_state(arm, &reading, self.now).unwrap();
            }
        }
        let command = black_box(self.servo.step(self.now).unwrap());
        for (angle, speed) in self.positions.iter_mut().flatten().zip(command) {
            *angle += PERIOD.as_secs_f64() * speed;
        }
    }

    fn cycles(&mut self, count: usize) {
        (0..count).for_each(|_| self.cycle(true));
    }

    /// Towards one of two goals and, when it has settled, the other.
    fn there_and_back(&mut self, goals: &[([f64; 3], [f64; 4]); 2], next: &mut usize) {
        if !matches!(self.servo.status().state, State::Tracking | State::JointLimit) {
            *next = 1 - *next;
            let (position, orientation) = goals[*next];
            self.servo.take_goal(position, orientation, "", self.now).unwrap();
        }
        self.cycle(true);
    }

    fn bench(mut self, criterion: &mut Criterion, name: &str, expected: &[State]) {
        criterion.bench_function(name, |bencher| bencher.iter(|| self.cycle(true)));
        assert!(expected.contains(&self.servo.status().state), "{name}: {:?}", self.servo.status().state);
    }
}

fn one_arm(law: Law) -> Loop<dq_servo::servo::OneArm> {
    let mut store = ServoParameters::store();
    for (name, value) in parameters_for(BUILTIN_FILE, "puma560.yaml", "/dq_servo").unwrap() {
        store.override_initial(&name, value).unwrap();
    }
    let ServoParameters { task, joints, mut settings, goal_frame, .. } =
        ServoParameters::from_store(&store).unwrap();
    settings.controller.law = law;
    settings.progress_timeout = None;
    let names = joints.iter().map(|arm| arm.names().to_vec()).collect();
    let servo = Servo::new(task, joints, &goal_frame, settings, PERIOD).unwrap();
    Loop::new(servo, names, &START)
}

fn two_arms() -> Loop<dq_servo::servo::TwoArms> {
    let mut store = DualParameters::store();
    for (name, value) in parameters_for(BUILTIN_FILE, "puma560.yaml", "/dq_dual_servo").unwrap() {
        store.override_initial(&name, value).unwrap();
    }
    let DualParameters { task, joints, mut settings, goal_frame, .. } =
        DualParameters::from_store(&store).unwrap();
    settings.progress_timeout = None;
    let names = joints.iter().map(|arm| arm.names().to_vec()).collect();
    let servo = Servo::new(task, joints, &goal_frame, settings, PERIOD).unwrap();
    Loop::new(servo, names, &START)
}

const START: [f64; 6] = [0.7, 1.0, 2.3, 0.5, -0.7, 2.0];
