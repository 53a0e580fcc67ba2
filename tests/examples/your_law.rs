//! Drives a Panda with your own control law and all safety rules of the servo. The law is registered. After that its name can be
//! used like those of the built-in laws.

use dq_config::{ForArm, ServoParameters};
use dq_core::servo::{Measured, State};
use dq_kinematics::arm::Chain;
use dq_kinematics::control::{AngularLinear, ControlLaw, PoseError, register};
use std::error::Error;
use std::time::Duration;

/// Slides along the logarithm at a speed that does not vanish with the distance: `ξ = k X/√(|X|² + ε²)`, ε = 0.1.
pub(crate) struct BoundaryLayer;

impl ControlLaw for BoundaryLayer {
    fn name(&self) -> &'static str {
        "boundary_layer"
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn twist_gains(&self, gains: [f64; 2], (angular, linear): &AngularLinear) -> [f64; 2] {
        let size = (angular.norm_squared() + linear.norm_squared() + 0.1_f64.powi(2)).sqrt();
        gains.map(|gain| gain / size)
    }
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let law = register(&BoundaryLayer)?;
    let parameters = ServoParameters::for_arm("panda")?.with(|settings| {
        settings.controller = settings.controller.with_gains(law, [0.5, 0.5]);
    });
    let mut servo = parameters.build()?;
    let goal = Chain::for_arm("panda")?.forward_kinematics(&[0.3, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5])?;
    servo.set_goal(goal);
    let (mut angles, mut speeds) = ([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], [0.0; 7]); // [rad], [rad/s]
    for cycle in 1..10_000 {
        let measured = Measured { positions: &angles, velocities: &speeds };
        if let Some(output) = servo.cycle(cycle * Duration::from_millis(2), &measured)? {
            speeds.copy_from_slice(output);
        }
        angles.iter_mut().zip(&speeds).for_each(|(angle, speed)| *angle += 0.002 * speed);
        if servo.status().state == State::Settled {
            println!("{law} has settled after {} ms", 2 * cycle);
            return Ok(());
        }
    }
    Err(format!("{law} has not settled: {}", servo.status().state).into())
}
