//! The parameters of the servo for two arms.

use super::cycle::{self, CycleParameters, POSITIVE, live};
use super::{ArmParameters, NodeParameters};
use crate::control::{Cooperative, Feedback, Primitive};
use crate::dq::UnitDualQuaternion;
use crate::params::{Constraint, Declaration, ParameterError, ParameterStore, Value};
use crate::servo::{Goal, TwoArms};

/// The two-arm servo's parameters.
pub type DualParameters = CycleParameters<TwoArms>;

impl NodeParameters for DualParameters {
    const NODE_NAME: &'static str = "dq_dual_servo";

    fn declarations() -> Vec<Declaration> {
        let mut all = cycle::declarations();
        all.extend([
            Declaration::live(
                "controller",
                Value::String(Feedback::DampedInverse.name().to_owned()),
                Constraint::OneOf(Feedback::NAMES),
                "",
                "the form of the two-arm law: J^T K e (the paper) or J^+ K e",
            ),
            Declaration::live(
                "primitive",
                Value::String(Primitive::RelativePosition.name().to_owned()),
                Constraint::OneOf(Primitive::NAMES),
                "",
                "what of the right tool's pose, seen from the left tool, is controlled",
            ),
            live("transpose.gain", 10.0, POSITIVE, 1e4, "", "K of the transposed form"),
            live("damped_inverse.gain", 1.0, POSITIVE, 100.0, "1/s", "K of the inverse form"),
            Declaration::fixed(
                "right_base",
                Value::DoubleArray(vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
                Constraint::None,
                "",
                "the right arm's base in the left arm's base frame: x y z [m], then qx qy qz qw",
            ),
        ]);
        all
    }

    fn from_store(store: &ParameterStore) -> Result<Self, ParameterError> {
        let arm = ArmParameters::from_store(store)?;
        let right = arm.chain.clone().standing_at(&right_base(store)?);
        let task = TwoArms::new(arm.chain.clone(), right);
        // The plants' frames are told apart by the prefix that is their namespace.
        let goal_frame = format!("left/{}", arm.tool_frame);
        Self::new(store, &arm, 2, goal_frame, task, controller(store)?)
    }
}

fn controller(store: &ParameterStore) -> Result<Cooperative, ParameterError> {
    Ok(Cooperative {
        primitive: cycle::named(store, "primitive")?,
        feedback: cycle::named(store, "controller")?,
        transpose_gain: store.double("transpose.gain")?,
        inverse_gain: store.double("damped_inverse.gain")?,
        damping: cycle::damping(store)?,
    })
}

fn right_base(store: &ParameterStore) -> Result<UnitDualQuaternion, ParameterError> {
    let numbers = store.doubles("right_base", 7)?;
    let invalid = |expected: String| ParameterError::Invalid {
        name: "right_base",
        value: format!("{numbers:?}"),
        expected,
    };
    let [x, y, z, orientation @ ..] =
        <[f64; 7]>::try_from(numbers).map_err(|_| invalid("seven numbers".to_owned()))?;
    let pose = Goal::new([x, y, z], orientation, "", "").map_err(|why| invalid(format!("a pose: {why}")))?;
    Ok(*pose.base_from_goal())
}
