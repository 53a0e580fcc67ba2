//! `dq_servo` with a law of one's own: the one on the page of [`dq_servo::control::register`].

use dq_servo::control::{AngularLinear, ControlLaw, PoseError, register};
use std::process::ExitCode;

/// Slides along the logarithm at a speed that fades in a boundary layer 0.1 wide about the goal only.
struct BoundaryLayer;

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

fn main() -> ExitCode {
    match register(&BoundaryLayer) {
        Ok(()) => dq_servo::cli::main(std::env::args_os().skip(1)),
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}
