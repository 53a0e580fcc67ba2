//! Moves the tool of a UR5e with ideal joints along a circle, once in ten seconds.
use dq_algebra::UnitDualQuaternion;
use dq_config::ForArm;
use dq_core::servo::{Measured, Servo};
use dq_kinematics::arm::Chain;
use std::{error::Error, f64::consts::TAU, time::Duration};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let (mut servo, chain) = (Servo::for_arm("ur5e")?, Chain::for_arm("ur5e")?);
    let (mut angles, mut speeds) = ([0.0, -1.57, 1.57, -1.57, -1.57, 0.0], [0.0; 6]); // [rad], [rad/s]
    let (start, mut farthest) = (chain.forward_kinematics(&angles)?, 0.0_f64);
    for cycle in 0..10_000 {
        let (sin, cos) = (TAU * f64::from(cycle) / 5000.0).sin_cos();
        let point = start.translation() + 0.1 * nalgebra::Vector3::new(cos - 1.0, sin, 0.0); // [m]
        servo.set_goal(UnitDualQuaternion::from_parts(start.rotation(), point));
        let measured = Measured { positions: &angles, velocities: &speeds };
        if let Some(output) = servo.cycle(cycle * Duration::from_millis(2), &measured)? {
            speeds.copy_from_slice(output);
        }
        angles.iter_mut().zip(&speeds).for_each(|(angle, speed)| *angle += 0.002 * speed);
        farthest = if cycle < 5000 { 0.0 } else { farthest.max(servo.status().figures.position_error) };
    }
    println!("in its second turn the tool is {:.2} mm off at most", 1e3 * farthest);
    assert!(farthest < 1e-4);
    Ok(())
}
