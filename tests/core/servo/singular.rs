//! Rule 8: singularities at which a law stands still are left, or named.

use crate::bench::Bench;
use crate::reference::puma;
use dq_servo::arm::ArmState;
use dq_servo::control::Law;
use dq_servo::dq::UnitDualQuaternion;
use dq_servo::plant::Plant;
use dq_servo::servo::{OneArm, State};
use nalgebra::{Unit, Vector3, Vector6};
use std::time::Duration;

const LAWS: [Law; 3] = [Law::Logc, Law::DoubleGeodesic, Law::Diffc];

fn state(theta: &[f64]) -> ArmState {
    let mut state = ArmState::new(&puma());
    puma().evaluate(theta, &mut state).unwrap();
    state
}

/// The angle of joint 3 between `from` and `to` at which the wrist is nearest to the shoulder (`sign` 1) or farthest from it (−1).
fn elbow(sign: f64, from: f64, to: f64) -> f64 {
    let length = |angle: f64| sign * state(&[0.7, 1.0, angle, 0.5, -0.7, 2.0]).tool_point().norm();
    let (mut low, mut high) = (from, to);
    for _ in 0..200 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if length(a) < length(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

fn folded() -> [f64; 6] {
    [0.7, 1.0, elbow(1.0, 0.5, 2.5), 0.5, -0.7, 2.0]
}

fn stretched() -> [f64; 6] {
    [0.7, 1.0, elbow(-1.0, -2.5, -0.5), 0.5, -0.7, 2.0]
}

/// What the joints cannot do at `theta`: a unit twist of the tool, at the tool and in the base frame's directions.
fn lost(theta: &[f64]) -> (f64, Vector6<f64>) {
    let state = state(theta);
    let svd = state.body_jacobian().svd(true, false);
    let (i, sigma) = svd.singular_values.argmin();
    let body: Vector6<f64> = svd.u.unwrap().column(i).into_owned();
    let rotation = state.base_from_tool().rotation();
    let part = |row: usize| rotation * Vector3::new(body[row], body[row + 1], body[row + 2]);
    let (angular, linear) = (part(0), part(3));
    (sigma, Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z))
}

/// The pose of the tool at `theta`, moved by `way` along the lost direction.
fn beside(theta: &[f64], way: f64) -> UnitDualQuaternion {
    let pose = state(theta).base_from_tool();
    let (_, twist) = lost(theta);
    let (angular, linear) = (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
    let turn = match Unit::try_new(angular, 1e-6) {
        Some(axis) => {
            UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), way * angular.norm(), &axis)
                .rotation()
        }
        None => nalgebra::UnitQuaternion::identity(),
    };
    UnitDualQuaternion::from_parts(turn * pose.rotation(), pose.translation() + way * linear)
}

fn bench(law: Law, theta: &[f64]) -> Bench<OneArm> {
    let mut bench = Bench::with(|settings| settings.controller.law = law);
    bench.plants[0] = Plant::new(theta.to_vec(), Duration::from_millis(100));
    bench.run(0.01);
    bench
}

#[test]
fn experiment() {
    let wrist = [0.7, 1.0, 2.3, 0.5, 0.0, 2.0];
    for (name, theta, way) in [
        ("folded +", folded(), 0.1),
        ("folded -", folded(), -0.1),
        ("stretched +", stretched(), 0.1),
        ("stretched -", stretched(), -0.1),
        ("wrist +", wrist, 0.4),
        ("wrist -", wrist, -0.4),
        ("wrist 0.02", wrist, 0.02),
        ("wrist 0.005", wrist, 0.005),
    ] {
        println!("{name}: sigma {:.2e} lost {:?}", lost(&theta).0, lost(&theta).1.as_slice());
        let goal = beside(&theta, way);
        for law in LAWS {
            for off in [0.0, 1e-4, 1e-3, 1e-2] {
                for gain in [1.0, 0.1] {
                    let mut start = theta;
                    if name.starts_with("wrist") {
                        start[4] += off
                    } else {
                        start[2] += off
                    };
                    let mut bench = bench(law, &start);
                    bench.change(|s| {
                        s.controller.diffc_gain *= gain;
                        s.controller.logc.linear *= gain;
                        s.controller.logc.angular *= gain;
                        s.controller.double_geodesic.linear *= gain;
                        s.controller.double_geodesic.angular *= gain;
                    });
                    bench.goal_pose(&goal);
                    let from = bench.now;
                    while bench.state() == State::Tracking || bench.now - from < Duration::from_secs_f64(0.1)
                    {
                        bench.cycle();
                        if bench.now - from > Duration::from_secs(120) {
                            break;
                        }
                    }
                    let f = bench.servo.status().figures;
                    println!(
                        "  {law} off {off} gain {gain}: {} after {:.2} s, {:.2e} m {:.2e} rad, peak {:.2} path {:.3} {:?}",
                        bench.state(),
                        (bench.now - from).as_secs_f64(),
                        f.position_error,
                        f.rotation_error,
                        f.peak_joint_speed,
                        f.path_length,
                        bench.servo.status().stall
                    );
                }
            }
        }
    }
}
