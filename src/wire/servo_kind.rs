//! The differences between a servo for one arm and a servo for two arms: names, topics, parameters.

use super::contract::Contract;
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_core::servo::{Arms, JointOrder, Motion};
use dq_kinematics::control::{Aim, Controller};
use dq_messages::NodeContract;
use dq_params::{ParameterError, ParameterStore};
use serde::{Deserialize, Serialize};

/// The kind of a servo node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ServoKind {
    /// A servo for one arm.
    OneArm,
    /// A servo for two arms, which controls one tool relative to the other.
    TwoArms,
}

/// In the report of a motion to a joint goal, this name stands in place of the name of a law.
const JOINT_LINE: &str = "joint_line";

/// The name of the law in force, and of the part of the pose that it controls.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LawNames {
    /// The name of the law; for two arms, the name of the Jacobian map.
    pub law: &'static str,
    /// The name of the components of the pose that the law controls, such as `position`. `None` if the law controls the whole pose
    /// of one arm.
    pub aim: Option<&'static str>,
    /// The key of `aim` in the status message.
    pub aim_key: &'static str,
}

impl std::fmt::Display for LawNames {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&law_and_aim(self.law, self.aim))
    }
}

/// Joins the name of a law and the name of the components that the law controls, if there is one.
pub(super) fn law_and_aim(law: &str, aim: Option<&str>) -> String {
    aim.map_or_else(|| law.to_owned(), |aim| format!("{law} {aim}"))
}

impl ServoKind {
    /// Both kinds of servo.
    pub const ALL: [Self; 2] = [Self::OneArm, Self::TwoArms];

    /// Returns the kind of the servo for these arms.
    pub fn of(arms: &Arms) -> Self {
        if arms.chains().count() > 1 { Self::TwoArms } else { Self::OneArm }
    }

    /// Returns the node's default name.
    pub fn node_name(self) -> &'static str {
        match self {
            Self::OneArm => ServoParameters::NODE_NAME,
            Self::TwoArms => DualParameters::NODE_NAME,
        }
    }

    /// Returns the topic of goals.
    pub fn goal_topic(self) -> &'static str {
        match self {
            Self::OneArm => "goal_pose",
            Self::TwoArms => "relative_goal",
        }
    }

    /// Returns whether goals may be in any frame of TF. For two arms, a goal is always in the left tool's frame.
    pub fn takes_frames(self) -> bool {
        self == Self::OneArm
    }

    /// Returns a parameter by which the node can be recognized, because no other kind of node in this program has it.
    pub fn own_parameter(self) -> &'static str {
        match self {
            Self::OneArm => "gains.diffc",
            Self::TwoArms => "primitive",
        }
    }

    /// Returns for each arm the prefix of its topics: `left/` and `right/`, or an empty prefix for a single arm.
    pub fn arms(self) -> &'static [&'static str] {
        match self {
            Self::OneArm => &[""],
            Self::TwoArms => &["left/", "right/"],
        }
    }

    /// Returns the node's part of the wire contract.
    pub fn contract(self, contract: Contract) -> NodeContract {
        match self {
            Self::OneArm => contract.servo,
            Self::TwoArms => contract.dual,
        }
    }

    /// Returns the parameters at their defaults.
    ///
    /// # Errors
    /// The errors of [`NodeParameters::store`].
    pub fn store(self) -> Result<ParameterStore, ParameterError> {
        match self {
            Self::OneArm => ServoParameters::store(),
            Self::TwoArms => DualParameters::store(),
        }
    }

    /// Returns the typed parameters of `store`.
    ///
    /// # Errors
    /// The errors of [`NodeParameters::from_store`].
    pub fn from_store(self, store: &ParameterStore) -> Result<ServoParameters, ParameterError> {
        match self {
            Self::OneArm => ServoParameters::from_store(store),
            Self::TwoArms => DualParameters::from_store(store).map(|DualParameters(parameters)| parameters),
        }
    }

    /// Returns the names of the present law, as the status reports them.
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

    /// Returns the gains of the present law, as text.
    pub fn gains(self, controller: &Controller) -> String {
        match self {
            Self::OneArm => controller.describe_gains(),
            Self::TwoArms => format!("gain {}", controller.gain()),
        }
    }

    /// Returns the names of the law and the gains of `motion`, for its report. A motion to a joint goal has no law and no gains.
    /// For such a motion, the name of the law is `joint_line`.
    pub fn law_of(self, motion: &Motion) -> (LawNames, String) {
        if motion.by_joints {
            return (LawNames { law: JOINT_LINE, ..LawNames::default() }, String::new());
        }
        (self.law(&motion.controller), self.gains(&motion.controller))
    }

    /// Returns the joints of all arms in the servo's order, each with the prefix of its arm.
    pub fn joint_names(self, joints: &[JointOrder]) -> Vec<String> {
        let names = |(prefix, arm): (&&str, &JointOrder)| {
            arm.names().iter().map(|joint| format!("{prefix}{joint}")).collect::<Vec<_>>()
        };
        self.arms().iter().zip(joints).flat_map(names).collect()
    }
}
