//! An arm that a robot description gives: what it says takes the place of parameters that nobody gives.

use crate::arm::{Chain, DescribedArm, Description, DescriptionError, LONGEST_DESCRIPTION, bounds};
use crate::params::{Given, List, ParameterError, Value};
use std::io::Read;

/// What a robot description gives a node.
pub(super) struct Described {
    /// The whole text.
    pub text: String,
    /// The arm that it has between the frames.
    pub arm: DescribedArm,
}

/// An arm whose description names no accelerations gets what takes its joints to their velocity limits in this time \[s\].
const TIME_TO_FULL_SPEED: f64 = 0.5;

impl Described {
    /// What is described to a node that is given these values; none where no description is among them.
    ///
    /// # Errors
    /// [`ParameterError::Missing`] where the description, or a frame, is not among them; [`ParameterError::File`] for a description that
    /// gives no arm.
    pub fn find(given: &[Given]) -> Result<Option<Self>, ParameterError> {
        let (text, source) = match (text(given, "robot_description"), text(given, "robot_file")) {
            (Some(text), _) => (text.to_owned(), "robot_description"),
            (None, Some(file)) => (open(file)?, file),
            (None, None) if is_awaited(given) => {
                return Err(ParameterError::Missing {
                    what: "the arm between base_frame and tool_frame",
                    missing: vec!["robot_description or robot_file"],
                    why: "a servo node waits for it to come by topic, nothing else does; or give joints and arm.*",
                });
            }
            (None, None) => return Ok(None),
        };
        let frames = [text_or_missing(given, "base_frame")?, text_or_missing(given, "tool_frame")?];
        let arm = read(&text, source, frames[0], frames[1])?.arm;
        Ok(Some(Self { text, arm }))
    }

    /// Values for parameters that nobody gives; `velocity` are the velocity limits, if somebody gives those.
    pub fn defaults(&self, velocity: Option<&[f64]>) -> Vec<(String, Value)> {
        let limits: Vec<_> = self.arm.moving().map(|joint| joint.limits).collect();
        let described: Option<Vec<f64>> = limits.iter().map(|limits| limits.velocity).collect();
        let velocity = velocity.map(<[f64]>::to_vec).or(described);
        let mut values = vec![
            ("joints", Value::StringArray(self.names())),
            ("initial_positions", Value::DoubleArray(self.arm.moving().map(|joint| joint.start()).collect())),
        ];
        if let Some(velocity) = velocity {
            let acceleration = limits.iter().zip(&velocity);
            let acceleration =
                acceleration.map(|(of, velocity)| of.acceleration.unwrap_or(velocity / TIME_TO_FULL_SPEED));
            values.push(("limits.joint_acceleration", Value::DoubleArray(acceleration.collect())));
            values.push(("limits.joint_velocity", Value::DoubleArray(velocity)));
        }
        if limits.iter().any(|limits| limits.lower.is_some()) {
            // Beyond this no position is taken: it is no limit.
            let free = bounds::JOINT_ANGLE;
            let lower = limits.iter().map(|limits| limits.lower.unwrap_or(-free)).collect();
            let upper = limits.iter().map(|limits| limits.upper.unwrap_or(free)).collect();
            values.push(("limits.joint_position_lower", Value::DoubleArray(lower)));
            values.push(("limits.joint_position_upper", Value::DoubleArray(upper)));
        }
        values.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// That each joint has a velocity limit.
    ///
    /// # Errors
    /// [`ParameterError::File`] with the joint that has none.
    pub fn check_velocities(&self) -> Result<(), ParameterError> {
        match self.arm.moving().find(|joint| joint.limits.velocity.is_none()) {
            None => Ok(()),
            Some(joint) => Err(ParameterError::File {
                file: "robot_description".to_owned(),
                why: format!("joint {:?} has no velocity limit: give limits.joint_velocity", joint.name),
            }),
        }
    }

    fn names(&self) -> Vec<String> {
        names(&self.arm)
    }
}

/// Whether these values name the frames of an arm and nothing that describes it.
pub fn is_awaited(given: &[Given]) -> bool {
    let is_given = |name: &str| text(given, name).is_some();
    (is_given("base_frame") || is_given("tool_frame"))
        && !is_given("robot_description")
        && !is_given("robot_file")
        && !given.iter().any(|value| value.name == "joints" || value.name.starts_with("arm."))
}

/// Reads the description called `source` in errors.
pub(super) fn read(text: &str, source: &str, base: &str, tool: &str) -> Result<Description, ParameterError> {
    Description::read(text, base, tool).map_err(|why| error(source, &why))
}

/// The kinematics of a described arm, whose joints are to have these names.
pub(super) fn chain(described: &Description, joints: &List<String>) -> Result<Chain, ParameterError> {
    let names = names(&described.arm);
    if joints.items() != names {
        let expected =
            format!("{names:?}, as the robot description has them between base_frame and tool_frame");
        return Err(joints.invalid(format!("{:?}", joints.items()), expected));
    }
    described.arm.chain().map_err(|why| error("robot_description", &why))
}

fn names(arm: &DescribedArm) -> Vec<String> {
    arm.moving().map(|joint| joint.name.clone()).collect()
}

fn error(source: &str, why: &DescriptionError) -> ParameterError {
    ParameterError::File { file: source.to_owned(), why: why.to_string() }
}

/// The text of a file, of which no more is read than counts.
fn open(file: &str) -> Result<String, ParameterError> {
    let error = |why: std::io::Error| ParameterError::File { file: file.to_owned(), why: why.to_string() };
    let mut text = String::new();
    let opened = std::fs::File::open(file).map_err(error)?;
    opened.take(LONGEST_DESCRIPTION as u64 + 1).read_to_string(&mut text).map_err(error)?;
    Ok(text)
}

/// The text that the last of these values gives a parameter; none for an empty one, which is what it has by itself.
fn text<'a>(given: &'a [Given], name: &str) -> Option<&'a str> {
    let values = given.iter().rev().filter(|value| value.name == name);
    let mut texts =
        values.filter_map(|value| if let Value::String(text) = &value.value { Some(text) } else { None });
    texts.next().map(String::as_str).filter(|text| !text.is_empty())
}

fn text_or_missing<'a>(given: &'a [Given], name: &'static str) -> Result<&'a str, ParameterError> {
    text(given, name).ok_or(ParameterError::Missing {
        what: "the arm of a robot description",
        missing: vec![name],
        why: "it is what the robot has between the links base_frame and tool_frame",
    })
}
