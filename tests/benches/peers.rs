//! One of the peers that `tests/benches/peers.sh` measures: the control step of this program, or nalgebra's own dual quaternions.
//! Answers the requests of `peers/measure.py` on stdin and stdout.

use dq_algebra::{UnitDualQuaternion, Vector8};
use dq_config::{NodeParameters, ServoParameters};
use dq_kinematics::arm::{ArmState, Chain};
use dq_kinematics::control::{Controller, Law, nearer_goal};
use nalgebra::{Quaternion, Translation3, UnitDualQuaternion as Dual, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::io::BufRead;
use std::ops::Range;
use std::time::Instant;

/// The start and the goal of each configuration \[rad\].
type Inputs = Vec<([f64; 6], [f64; 6])>;

/// A task that runs over these configurations.
type Task<'a> = Box<dyn FnMut(Range<usize>) + 'a>;

struct Peer<'a> {
    tasks: BTreeMap<&'static str, Task<'a>>,
    /// The poses and Jacobians of all configurations, once in each form.
    check: Vec<f64>,
}

const ROUNDS: usize = 4;

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    let (Some(who), Some(file)) = (arguments.next(), arguments.next()) else {
        return eprintln!("run tests/benches/peers.sh: it gives this one its inputs");
    };
    let numbers = std::fs::read_to_string(file).unwrap();
    let numbers: Vec<f64> = numbers.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let inputs: Inputs =
        numbers.chunks(12).map(|row| (row[..6].try_into().unwrap(), row[6..].try_into().unwrap())).collect();
    let (store, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
    let parameters = ServoParameters::from_store(&store).unwrap();
    let chain = parameters.arms.chain();
    answer(match who.as_str() {
        "nalgebra" => products(&inputs),
        "ours" => ours(&inputs, chain, &parameters.settings.controller),
        _ => ours_as_twists(&inputs, chain),
    });
}

fn answer(mut peer: Peer) {
    for question in std::io::stdin().lock().lines() {
        match question.unwrap().as_str() {
            "tasks" => println!("{}", peer.tasks.keys().copied().collect::<Vec<_>>().join(" ")),
            "check" => println!("{}", peer.check.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")),
            name => {
                let task = peer.tasks.get_mut(name).unwrap();
                println!("{}", measure(task));
            }
        }
    }
}

/// Returns the nanoseconds per configuration. Of each slice the shortest time is used, so that interruptions do not count.
fn measure(task: &mut Task) -> f64 {
    let slices = (0..COUNT).step_by(SLICE).map(|first| {
        let times = (0..ROUNDS).map(|_| {
            let begin = Instant::now();
            task(first..first + SLICE);
            begin.elapsed()
        });
        times.min().unwrap_or_default().as_nanos() as f64
    });
    slices.sum::<f64>() / COUNT as f64
}

/// The number of configurations, the same as in measure.py.
const COUNT: usize = 1024;

/// The number of configurations that are measured at once.
const SLICE: usize = 64;

fn state(chain: &Chain, theta: &[f64]) -> ArmState {
    let mut state = ArmState::new(chain);
    chain.evaluate(theta, &mut state).unwrap();
    state
}

fn ours<'a>(inputs: &'a Inputs, chain: &'a Chain, settings: &Controller) -> Peer<'a> {
    let pose = |theta: &[f64; 6]| chain.forward_kinematics(theta).unwrap();
    let goals: Vec<UnitDualQuaternion> =
        inputs.iter().map(|(start, goal)| nearer_goal(&pose(goal), &pose(start))).collect();
    let mut tasks = BTreeMap::<_, Task>::new();
    let kinematics = move |slice: Range<usize>| {
        for (start, _) in &inputs[slice] {
            black_box(chain.forward_kinematics(black_box(start)).unwrap());
        }
    };
    tasks.insert("kinematics", Box::new(kinematics));
    let mut arm = ArmState::new(chain);
    let mut columns = [Vector8::zeros(); 6];
    let jacobian = move |slice: Range<usize>| {
        for (start, _) in &inputs[slice] {
            chain.evaluate(black_box(start), &mut arm).unwrap();
            let mut slots = columns.iter_mut();
            arm.for_each_pose_column(|column| *slots.next().unwrap() = column);
            black_box(&columns);
        }
    };
    tasks.insert("pose_jacobian", Box::new(jacobian));
    for law in [Law::Diffc, Law::UnitQuaternion, Law::Logc] {
        let controller = Controller { law, ..*settings };
        let (mut arm, goals, mut speeds) = (ArmState::new(chain), goals.clone(), [0.0; 6]);
        let step = move |slice: Range<usize>| {
            for ((start, _), goal) in inputs[slice.clone()].iter().zip(&goals[slice]) {
                chain.evaluate(black_box(start), &mut arm).unwrap();
                controller.joint_velocity(&arm, black_box(goal), &mut speeds);
                black_box(&speeds);
            }
        };
        tasks.insert(law.name(), Box::new(step));
    }
    let check = inputs.iter().flat_map(|(start, _)| {
        let state = state(chain, start);
        let columns: Vec<_> = state.pose_jacobian().iter().copied().collect();
        state.base_from_tool().to_vector8().data.0[0].into_iter().chain(columns)
    });
    Peer { tasks, check: check.collect() }
}

/// Returns this program's step in the form of the peers without dual quaternions: position, rotation matrix and twist Jacobian, row
/// by row.
fn ours_as_twists<'a>(inputs: &Inputs, chain: &Chain) -> Peer<'a> {
    let check = inputs.iter().flat_map(|(start, _)| {
        let state = state(chain, start);
        let rotation = state.base_from_tool().rotation().to_rotation_matrix().into_inner().transpose();
        let columns: Vec<_> = state.tool_columns().collect();
        let jacobian: Vec<_> = (0..6).flat_map(|row| columns.iter().map(move |column| column[row])).collect();
        state.tool_point().iter().chain(rotation.iter()).copied().chain(jacobian).collect::<Vec<_>>()
    });
    Peer { tasks: BTreeMap::new(), check: check.collect() }
}

/// Computes the arm with products of nalgebra's dual quaternions, and its Jacobian from the products before and after each joint.
fn products(inputs: &Inputs) -> Peer<'_> {
    const ALPHA: [f64; 6] = [0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2];
    const A: [f64; 6] = [0.0, 0.0, 0.4318, 0.019, 0.0, 0.0];
    const D: [f64; 6] = [0.0, 0.0, 0.125, 0.432, 0.0, 0.0];
    let still = |translation: Vector3<f64>, rotation: UnitQuaternion<f64>| {
        Dual::from_parts(Translation3::from(translation), rotation)
    };
    let fixed: [Dual<f64>; 6] = std::array::from_fn(|i| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), ALPHA[i]);
        still(Vector3::zeros(), turn) * still(Vector3::new(A[i], 0.0, D[i]), UnitQuaternion::identity())
    });
    let turn = move |angle: f64| {
        let (sin, cos) = (0.5 * angle).sin_cos();
        still(Vector3::zeros(), UnitQuaternion::new_unchecked(Quaternion::new(cos, 0.0, 0.0, sin)))
    };
    let numbers = |q: &nalgebra::DualQuaternion<f64>| {
        [q.real.w, q.real.i, q.real.j, q.real.k, q.dual.w, q.dual.i, q.dual.j, q.dual.k]
    };
    let pose = move |theta: &[f64; 6]| {
        fixed.iter().zip(theta).fold(Dual::identity(), |pose, (fixed, angle)| pose * (fixed * turn(*angle)))
    };
    let jacobian = move |theta: &[f64; 6]| {
        let mut before = [Dual::identity(); 6];
        let mut end = Dual::identity();
        for ((before, fixed), angle) in before.iter_mut().zip(&fixed).zip(theta) {
            end *= fixed;
            *before = end;
            end *= turn(*angle);
        }
        let half_z = nalgebra::DualQuaternion::from_real(Quaternion::new(0.0, 0.0, 0.0, 0.5));
        before.map(|before| {
            numbers(&(before.dual_quaternion() * half_z * (before.inverse() * end).into_inner()))
        })
    };
    let mut tasks = BTreeMap::<_, Task>::new();
    let poses = move |slice: Range<usize>| {
        for (start, _) in &inputs[slice] {
            black_box(pose(black_box(start)));
        }
    };
    let jacobians = move |slice: Range<usize>| {
        for (start, _) in &inputs[slice] {
            black_box(jacobian(black_box(start)));
        }
    };
    tasks.insert("kinematics", Box::new(poses));
    tasks.insert("pose_jacobian", Box::new(jacobians));
    let check = inputs.iter().flat_map(|(start, _)| {
        let columns = jacobian(start);
        [
            numbers(pose(start).dual_quaternion()),
            columns[0],
            columns[1],
            columns[2],
            columns[3],
            columns[4],
            columns[5],
        ]
        .concat()
    });
    Peer { tasks, check: check.collect() }
}
