//! Which topics connect a servo node to its arms.

use super::{Contract, NodeContract};
use crate::arm::Chain;
use crate::control::{Aim, Damping, Feedback};
use crate::servo::{JointOrder, OneArm, Task, TwoArms};

/// How a task's node is wired.
pub trait Wiring: Task {
    /// The goal's topic.
    const GOAL: &'static str;

    /// Whether goals may be in any frame of TF: a relative goal has no frame but the tool that it is seen from.
    const TAKES_FRAMES: bool;

    /// A parameter by which the node is known: no other of ours has it.
    const OWN_PARAMETER: &'static str;

    /// What stands before the topics of each arm.
    const ARMS: &'static [&'static str];

    /// The node's part of the wire contract.
    fn contract(contract: Contract) -> NodeContract;

    /// The law in force as the status reports it: keys and values, the first of them `law`.
    fn law(controller: &Self::Controller) -> Vec<(&'static str, &'static str)>;

    /// The gains of the law in force, as a text.
    fn gains(controller: &Self::Controller) -> String;

    /// The damping of the law's inverse.
    fn damping(controller: &Self::Controller) -> Damping;

    /// The arms, in the base frame of the first.
    fn chains(&self) -> Vec<&Chain>;
}

/// The joints of all arms in the servo's order, each with what stands before its arm's topics.
pub fn joint_names<T: Wiring>(arms: &[JointOrder]) -> Vec<String> {
    let names = |(prefix, arm): (&&str, &JointOrder)| {
        arm.names().iter().map(|joint| format!("{prefix}{joint}")).collect::<Vec<_>>()
    };
    T::ARMS.iter().zip(arms).flat_map(names).collect()
}

impl Wiring for OneArm {
    const GOAL: &'static str = "goal_pose";
    const TAKES_FRAMES: bool = true;
    const OWN_PARAMETER: &'static str = "gains.diffc";
    const ARMS: &'static [&'static str] = &[""];

    fn contract(contract: Contract) -> NodeContract {
        contract.servo
    }

    fn law(controller: &Self::Controller) -> Vec<(&'static str, &'static str)> {
        let task = (controller.aim != Aim::Pose).then(|| ("task", controller.aim.name()));
        [("law", controller.law.name())].into_iter().chain(task).collect()
    }

    fn gains(controller: &Self::Controller) -> String {
        controller.describe_gains()
    }

    fn damping(controller: &Self::Controller) -> Damping {
        controller.damping
    }

    fn chains(&self) -> Vec<&Chain> {
        vec![self.chain()]
    }
}

impl Wiring for TwoArms {
    const GOAL: &'static str = "relative_goal";
    const TAKES_FRAMES: bool = false;
    const OWN_PARAMETER: &'static str = "primitive";
    const ARMS: &'static [&'static str] = &["left/", "right/"];

    fn contract(contract: Contract) -> NodeContract {
        contract.dual
    }

    fn law(controller: &Self::Controller) -> Vec<(&'static str, &'static str)> {
        vec![("law", controller.feedback.name()), ("primitive", controller.primitive.name())]
    }

    fn gains(controller: &Self::Controller) -> String {
        let gain = match controller.feedback {
            Feedback::Transpose => controller.transpose_gain,
            Feedback::DampedInverse => controller.inverse_gain,
        };
        format!("gain {gain}")
    }

    fn damping(controller: &Self::Controller) -> Damping {
        controller.damping
    }

    fn chains(&self) -> Vec<&Chain> {
        let (left, right) = TwoArms::chains(self);
        vec![left, right]
    }
}
