//! What a servo node for one arm and one for two have of their own: names, topics, parameters.

use super::contract::Contract;
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_core::servo::{Arms, JointOrder};
use dq_kinematics::control::{Aim, Controller};
use dq_messages::NodeContract;
use dq_params::{ParameterError, ParameterStore};
use serde::{Deserialize, Serialize};

/// The kind of a servo node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ServoKind {
    /// For one arm.
    OneArm,
    /// For two, of which one tool is controlled as seen from the other.
    TwoArms,
}

/// The names of a law in force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LawNames {
    /// That of the law, or of two arms' Jacobian map.
    pub law: &'static str,
    /// What of the pose is controlled; none where one arm's law controls all of it.
    pub aim: Option<&'static str>,
    /// The key under which the status has the aim.
    pub aim_key: &'static str,
}

impl std::fmt::Display for LawNames {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&law_and_aim(self.law, self.aim))
    }
}

/// A law, and what it controls where that is said.
pub(super) fn law_and_aim(law: &str, aim: Option<&str>) -> String {
    aim.map_or_else(|| law.to_owned(), |aim| format!("{law} {aim}"))
}

impl ServoKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::OneArm, Self::TwoArms];

    /// That of the servo for these arms.
    pub fn of(arms: &Arms) -> Self {
        if arms.chains().count() > 1 { Self::TwoArms } else { Self::OneArm }
    }

    /// The node's default name.
    pub fn node_name(self) -> &'static str {
        match self {
            Self::OneArm => ServoParameters::NODE_NAME,
            Self::TwoArms => DualParameters::NODE_NAME,
        }
    }

    /// The goal's topic.
    pub fn goal_topic(self) -> &'static str {
        match self {
            Self::OneArm => "goal_pose",
            Self::TwoArms => "relative_goal",
        }
    }

    /// Whether goals may be in any frame of TF: a relative goal has no frame but the tool that it is seen from.
    pub fn takes_frames(self) -> bool {
        self == Self::OneArm
    }

    /// A parameter by which the node is known: no other of ours has it.
    pub fn own_parameter(self) -> &'static str {
        match self {
            Self::OneArm => "gains.diffc",
            Self::TwoArms => "primitive",
        }
    }

    /// What stands before the topics of each arm.
    pub fn arms(self) -> &'static [&'static str] {
        match self {
            Self::OneArm => &[""],
            Self::TwoArms => &["left/", "right/"],
        }
    }

    /// The node's part of the wire contract.
    pub fn contract(self, contract: Contract) -> NodeContract {
        match self {
            Self::OneArm => contract.servo,
            Self::TwoArms => contract.dual,
        }
    }

    /// The parameters at their defaults.
    ///
    /// # Errors
    /// As [`NodeParameters::store`].
    pub fn store(self) -> Result<ParameterStore, ParameterError> {
        match self {
            Self::OneArm => ServoParameters::store(),
            Self::TwoArms => DualParameters::store(),
        }
    }

    /// The typed parameters of `store`.
    ///
    /// # Errors
    /// As [`NodeParameters::from_store`].
    pub fn from_store(self, store: &ParameterStore) -> Result<ServoParameters, ParameterError> {
        match self {
            Self::OneArm => ServoParameters::from_store(store),
            Self::TwoArms => DualParameters::from_store(store).map(|DualParameters(parameters)| parameters),
        }
    }

    /// The law in force as the status reports it.
    pub fn law(self, controller: &Controller) -> LawNames {
        let Controller { law, aim, .. } = controller;
        match self {
            Self::OneArm => {
                let task = (*aim != Aim::Pose).then(|| aim.name());
                LawNames { law: law.name(), aim: task, aim_key: "task" }
            }
            Self::TwoArms => {
                let primitive = Some(aim.relative_name());
                LawNames { law: law.map().name(), aim: primitive, aim_key: "primitive" }
            }
        }
    }

    /// The gains of the law in force, as a text.
    pub fn gains(self, controller: &Controller) -> String {
        match self {
            Self::OneArm => controller.describe_gains(),
            Self::TwoArms => format!("gain {}", controller.gain()),
        }
    }

    /// The joints of all arms in the servo's order, each with what stands before its arm's topics.
    pub fn joint_names(self, joints: &[JointOrder]) -> Vec<String> {
        let names = |(prefix, arm): (&&str, &JointOrder)| {
            arm.names().iter().map(|joint| format!("{prefix}{joint}")).collect::<Vec<_>>()
        };
        self.arms().iter().zip(joints).flat_map(names).collect()
    }
}
