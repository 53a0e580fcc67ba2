//! Two UR5e side by side move one tool relative to the other, as if both held one object. For every law, the two are one arm.

use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{Measured, State};
use nalgebra::{Isometry3, Vector3};
use std::error::Error;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(2);

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let left_base_from_right_base = Isometry3::translation(0.0, 0.8, 0.0).into();
    let mut servo = ServoParameters::for_two_arms("ur5e", &left_base_from_right_base)?.build()?;
    // Six angles of the left arm, and then six angles of the right one [rad].
    let mut angles = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0].repeat(2);
    let mut speeds = vec![0.0; 12];
    for cycle in 1..5000 {
        let measured = Measured { positions: &angles, velocities: &speeds };
        if let Some(output) = servo.cycle(cycle * PERIOD, &measured)? {
            speeds.copy_from_slice(output);
        }
        angles.iter_mut().zip(&speeds).for_each(|(angle, speed)| *angle += PERIOD.as_secs_f64() * speed);
        let left_from_right = servo.pose().ok_or("no joint state yet")?;
        if cycle == 1 {
            // The right tool moves 0.2 m nearer to the left one.
            let point = 0.75 * left_from_right.translation();
            servo.set_goal(UnitDualQuaternion::from_parts(left_from_right.rotation(), point));
        } else if servo.status().state == State::Settled {
            let seen: Vector3<f64> = left_from_right.translation();
            println!("after {:?} the tools are {:.3} m apart", cycle * PERIOD, seen.norm());
            return Ok(());
        }
    }
    Err(format!("the tools have not arrived: {}", servo.status().state).into())
}
