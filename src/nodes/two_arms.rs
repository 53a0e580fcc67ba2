//! Checks that two arms do not share a joint or a controller.

use super::NodeError;
use dq_config::ServoParameters;
use dq_params::ParameterError;
use dq_ros::ros::names::NameError;
use dq_ros::ros::{Resolver, RosError};
use dq_wire::{ServoKind, command_topic};

/// Checks that the commands to the two arms go to different topics. If the joint states of both arms come on one topic, also checks
/// that the arms have no joint name in common. A servo for one arm always passes.
///
/// # Errors
/// [`NodeError`] for a common name of joints, or a common topic of commands.
pub(super) fn check(
    names: &Resolver,
    kind: ServoKind,
    parameters: &ServoParameters,
) -> Result<(), NodeError> {
    let (prefixes, [left, right]) = (kind.arms(), parameters.joints.as_slice()) else { return Ok(()) };
    let common = |topic: &str| -> Result<Option<String>, RosError> {
        let topics = prefixes.iter().map(|prefix| names.topic(&format!("{prefix}{topic}")));
        let topics = topics.collect::<Result<Vec<_>, _>>()?;
        Ok(topics.iter().all(|other| *other == topics[0]).then(|| topics[0].clone()))
    };
    if let Some(topic) = common("joint_states")?
        && let Some(joint) = left.names().iter().find(|joint| right.names().contains(joint))
    {
        let expected = format!(
            "other joints than the left arm's, which has {joint:?} on {topic} too: give right_joints or right_tool_frame, \
             or remap left/joint_states and right/joint_states to two topics"
        );
        let names = format!("{:?}", right.names());
        return Err(ParameterError::invalid("right_joints", names, expected).into());
    }
    match common(command_topic(parameters.settings.interface))? {
        None => Ok(()),
        Some(name) => {
            let (kind, why) =
                ("topic for both arms", "each arm needs a controller of its own, on its own topic");
            Err(RosError::from(NameError { name, kind, why }).into())
        }
    }
}
