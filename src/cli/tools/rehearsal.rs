//! Simulates the motions of the demo before the arm makes them.

use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{Interface, Measured, State};
use dq_kinematics::control::Law;
use std::time::Duration;

/// The longest duration of a motion in the demo.
const PATIENCE: Duration = Duration::from_secs(20);

/// The goals to try. Each number is a fraction of the joints' path from the start to the farthest goal. The rehearsal uses the
/// first goal that one law reaches and from which another law returns.
const PARTS: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];

/// Returns the law for the way back.
pub(super) fn return_law(there: Law) -> Law {
    if there == Law::Diffc { Law::Logc } else { Law::Diffc }
}

/// Returns joint positions [rad, prismatic: m] near `from` for the demo: in simulation, the arm reaches the tool pose of these
/// positions under the servo's law, and returns to the tool pose of `from` under [`return_law`]. Tries the [`PARTS`] in turn, and
/// returns the farthest positions if the arm fails with all of them.
pub(super) fn nearby(parameters: &ServoParameters, from: &[f64]) -> crate::cli::Result<Vec<f64>> {
    let chain = parameters.arms.chain();
    let beside = parameters.settings.limits.position.beside(from, chain.kinds());
    let start = chain.forward_kinematics(from)?;
    let law = parameters.settings.controller.law;
    for part in PARTS {
        let aside: Vec<_> =
            from.iter().zip(&beside).map(|(from, beside)| from + part * (beside - from)).collect();
        let goal = chain.forward_kinematics(&aside)?;
        let there = end(parameters, law, from, goal)?;
        if let Some(there) = there
            && end(parameters, return_law(law), &there, start)?.is_some()
        {
            return Ok(aside);
        }
    }
    Ok(beside)
}

/// Simulates an ideal arm under `law`. Returns the joint positions at which the arm settles at `goal`; `None` if the arm stalls or
/// does not settle within [`PATIENCE`].
fn end(
    parameters: &ServoParameters,
    law: Law,
    from: &[f64],
    goal: UnitDualQuaternion,
) -> crate::cli::Result<Option<Vec<f64>>> {
    let (period, mut positions) = (parameters.period, from.to_vec());
    let mut servo = parameters
        .clone()
        .with(|settings| (settings.controller.law, settings.interface) = (law, Interface::Velocity))
        .build()?;
    servo.set_goal(goal);
    let mut speeds = vec![0.0; positions.len()];
    let mut now = Duration::ZERO;
    while now < PATIENCE {
        now += period;
        let measured = Measured { positions: &positions, velocities: &speeds };
        if let Some(output) = servo.cycle(now, &measured)? {
            speeds.copy_from_slice(output);
        }
        positions.iter_mut().zip(&speeds).for_each(|(angle, speed)| *angle += period.as_secs_f64() * speed);
        match servo.status().state {
            State::Settled => return Ok(Some(positions)),
            State::Stalled => return Ok(None),
            _ => {}
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_config::ForArm;

    #[test]
    fn every_built_in_arm_goes_there_and_back() {
        for arm in ["ur5e", "panda", "iiwa14", "xarm6"] {
            let parameters = ServoParameters::for_arm(arm).unwrap();
            let chain = parameters.arms.chain();
            let ranges = parameters.settings.limits.position.ranges();
            // Two joints are at a tenth of a degree from a limit.
            let from: Vec<_> = ranges
                .enumerate()
                .map(|(joint, (lower, upper))| match joint {
                    3 | 5 if upper.is_finite() => upper - 0.002 - parameters.settings.limits.position.margin,
                    _ => 0.5 * (lower + upper).clamp(-3.0, 3.0) + 0.4,
                })
                .collect();
            let aside = nearby(&parameters, &from).unwrap();
            assert_ne!(aside, from, "{arm}");
            let [start, goal] = [&from, &aside].map(|theta| chain.forward_kinematics(theta).unwrap());
            let there = end(&parameters, Law::Logc, &from, goal).unwrap();
            assert!(end(&parameters, Law::Diffc, &there.unwrap(), start).unwrap().is_some(), "{arm}");
        }
    }
}
