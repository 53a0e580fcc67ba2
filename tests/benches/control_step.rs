//! Measures a control step, and the same step written as plain formulas: `cargo bench --bench control_step`.
//!
//! Each call takes the next of 1024 random configurations of the PUMA 560. The goal is the pose of another configuration.

#[path = "../../src/kinematics/tests/plain.rs"]
mod plain;

use criterion::{Criterion, criterion_group, criterion_main};
use dq_algebra::{UnitDualQuaternion, Vector8};
use dq_config::{NodeParameters, ServoParameters};
use dq_kinematics::arm::{ArmState, Convention, DhRow};
use dq_kinematics::control::{Controller, Law};
use plain::PlainArm;
use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI};
use std::hint::black_box;

const COUNT: usize = 1024;

struct Bench {
    parameters: ServoParameters,
    thetas: Vec<[f64; 6]>,
    goals: Vec<UnitDualQuaternion>,
    next: Cell<usize>,
}

fn built_in() -> ServoParameters {
    let (store, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
    ServoParameters::from_store(&store).unwrap()
}

/// Returns joint angles in [−π, π], which are the same in every run. Multiples of numbers like the golden ratio are spread evenly.
fn angles(number: usize) -> [f64; 6] {
    std::array::from_fn(|joint| {
        let step = [0.618_034, 0.414_214, 0.732_051, 0.236_068, 0.645_751, 0.316_625][joint];
        PI * (2.0 * (0.5 + step * number as f64).fract() - 1.0)
    })
}

/// Returns the PUMA 560 of msg_config/puma560.yaml.
fn plain_puma() -> PlainArm {
    let row = |i: usize| DhRow {
        alpha: [0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2][i],
        a: [0.0, 0.0, 0.4318, 0.019, 0.0, 0.0][i],
        d: [0.0, 0.0, 0.125, 0.432, 0.0, 0.0][i],
        theta_offset: 0.0,
    };
    PlainArm::new(Convention::ModifiedDh, &(0..6).map(row).collect::<Vec<_>>())
}

impl Bench {
    fn new() -> Self {
        let parameters = built_in();
        let pose = |number| parameters.arms.chain().forward_kinematics(&angles(number)).unwrap();
        let goals = (0..COUNT).map(|number| pose(number + COUNT)).collect();
        Self { thetas: (0..COUNT).map(angles).collect(), goals, next: Cell::new(0), parameters }
    }

    fn next(&self) -> (&[f64; 6], &UnitDualQuaternion) {
        let next = self.next.get();
        self.next.set((next + 1) % COUNT);
        (&self.thetas[next], &self.goals[next])
    }

    /// Measures `ours` and `plain` on the same inputs, one after the other.
    fn compare(
        &self,
        criterion: &mut Criterion,
        task: &str,
        mut ours: impl FnMut(&[f64], &UnitDualQuaternion),
        mut plain: impl FnMut(&[f64], &UnitDualQuaternion),
    ) {
        let mut group = criterion.benchmark_group(task);
        group.bench_function("ours", |bencher| {
            bencher.iter(|| {
                let (theta, goal) = self.next();
                ours(black_box(theta), black_box(goal))
            })
        });
        group.bench_function("plain", |bencher| {
            bencher.iter(|| {
                let (theta, goal) = self.next();
                plain(black_box(theta), black_box(goal))
            })
        });
        group.finish();
    }
}

fn control_step(criterion: &mut Criterion) {
    let bench = Bench::new();
    let chain = bench.parameters.arms.chain();
    let mut plain = plain_puma();
    let mut arm = ArmState::new(chain);
    bench.compare(
        criterion,
        "kinematics",
        |theta, _| {
            black_box(chain.forward_kinematics(theta).unwrap());
        },
        |theta, _| {
            plain.evaluate(theta);
            black_box(&plain.base_from_tool);
        },
    );
    let mut columns = [Vector8::zeros(); 6];
    bench.compare(
        criterion,
        "pose_jacobian",
        |theta, _| {
            chain.evaluate(theta, &mut arm).unwrap();
            let mut slots = columns.iter_mut();
            arm.for_each_pose_column(|column| *slots.next().unwrap() = column);
            black_box(&columns);
        },
        |theta, _| {
            plain.evaluate(theta);
            let mut columns = [Vector8::zeros(); 6];
            columns.iter_mut().zip(plain.pose_columns()).for_each(|(slot, column)| *slot = column);
            black_box(&columns);
        },
    );
    bench.compare(
        criterion,
        "smallest_singular_value",
        |theta, _| {
            chain.evaluate(theta, &mut arm).unwrap();
            black_box(arm.smallest_singular_value());
        },
        |theta, _| {
            plain.evaluate(theta);
            black_box(plain.smallest_singular_value());
        },
    );
    for law in [Law::Diffc, Law::DoubleGeodesic, Law::Logc] {
        let controller = Controller { law, ..bench.parameters.settings.controller };
        let (mut speeds, mut plain_speeds) = ([0.0; 6], [0.0; 6]);
        bench.compare(
            criterion,
            law.name(),
            |theta, goal| {
                chain.evaluate(theta, &mut arm).unwrap();
                controller.joint_velocity(&arm, goal, &mut speeds);
                black_box(&speeds);
            },
            |theta, goal| {
                plain.evaluate(theta);
                let (gains, damping) = (controller.gains(law), &controller.damping);
                match law.name() {
                    "logc" => plain.logc(gains, damping, goal, &mut plain_speeds),
                    "double_geodesic" => plain.double_geodesic(gains, damping, goal, &mut plain_speeds),
                    _ => plain.diffc(controller.gain(), goal, &mut plain_speeds),
                }
                black_box(&plain_speeds);
            },
        );
    }
}

criterion_group!(benches, control_step);
criterion_main!(benches);
