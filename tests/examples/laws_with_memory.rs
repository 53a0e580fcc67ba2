//! Two laws that remember: an integral law and a sliding-mode law. They are compared with logc and diffc, task by task.

use dq_kinematics::control::{AngularLinear, ControlLaw, Law, PoseError, ToolMotion, register, six_numbers};
use dq_studies::compare::{Arm, ClosedLoop, End, PLANTS, Paired, settling_gain};
use nalgebra::{Vector3, Vector6};
use std::error::Error;

/// Integral law: `ξ = k X + k² ∫X dt/4` with the screw logarithm X. It removes the error that a constant drift of the joints leaves.
struct Integral;

impl ControlLaw for Integral {
    fn name(&self) -> &'static str {
        "integral"
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn memory_size(&self) -> usize {
        6
    }

    fn twist_with_memory(&self, motion: &ToolMotion, memory: &mut [f64]) -> AngularLinear {
        let ([k, _], x) = (motion.gains, Vector6::from(six_numbers(&motion.error.screw_log())));
        let sum = Vector6::from_column_slice(memory) + motion.period * x;
        memory.copy_from_slice(sum.as_slice());
        pair(k * x + 0.25 * k.powi(2) * sum)
    }
}

/// Sliding mode: the desired twist V moves to the surface `V = k X` with a bounded acceleration, `V̇ = 4 s/(|s| + 0.1)` for
/// `s = k X − V` (a boundary layer instead of a switch: Slotine & Li 1991, §7.2).
struct SlidingMode;

impl ControlLaw for SlidingMode {
    fn name(&self) -> &'static str {
        "sliding_mode"
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn memory_size(&self) -> usize {
        6
    }

    fn begin(&self, motion: &ToolMotion, memory: &mut [f64]) {
        memory.copy_from_slice(&six_numbers(&motion.twist));
    }

    fn twist_with_memory(&self, motion: &ToolMotion, memory: &mut [f64]) -> AngularLinear {
        let v = Vector6::from_column_slice(memory);
        let s = motion.gains[0] * Vector6::from(six_numbers(&motion.error.screw_log())) - v;
        let v = v + motion.period * 4.0 / (s.norm() + 0.1) * s;
        memory.copy_from_slice(v.as_slice());
        pair(v)
    }
}

fn pair(six: Vector6<f64>) -> AngularLinear {
    (Vector3::new(six[0], six[1], six[2]), Vector3::new(six[3], six[4], six[5]))
}

/// Runs `law` on the first `tasks` tasks of the arm, at the gain with which it settles as fast as logc.
fn ends(arm: &Arm, law: Law, tasks: u32) -> Result<Vec<End>, Box<dyn Error>> {
    let controller = arm.parameters.settings.controller.with_law(law, settling_gain(arm, law)?);
    let closed_loop = ClosedLoop { arm, controller, plant: PLANTS[0], limits: true };
    let run = |number| {
        let ended = closed_loop.run(&arm.task(1, number)?, number)?;
        let words = ended.outcome.name().to_owned();
        Ok(End { settled: ended.settled(), through_itself: false, words })
    };
    (0..tasks).map(run).collect()
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let arm = Arm::named("panda".as_ref())?;
    for law in [register(&Integral)?, register(&SlidingMode)?] {
        for other in [Law::Logc, Law::Diffc] {
            let pairs = ends(&arm, other, 100)?.into_iter().zip(ends(&arm, law, 100)?);
            let tasks = pairs.map(|(first, second)| [first, second]).collect();
            let paired = Paired { law: law.name().to_owned(), arm: arm.name.clone(), tasks };
            let names = [other.name().to_owned(), law.name().to_owned()];
            println!("{}", Paired::table(&[paired], &names).markdown());
        }
    }
    Ok(())
}
