//! An arm from a robot description. The description's values replace parameters that the user has not set.

use super::described_limits::{Dynamics, GivenLimits, speed};
use super::described_text::{GivenText, decoded, text};
use dq_core::servo::{JOINT_SPEEDS, RAMP_TIME, STOP_TIME};
use dq_description::{
    DescribedArm, DescribedJoint, Description, DescriptionError, Guess, JointLimits, Motion, guess_frames,
    oddity,
};
use dq_description::{FittedBody, fitted};
use dq_kinematics::arm::{Chain, bounds};
use dq_params::{ParameterError, ParameterOverride, Value};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// The values that a node takes from a robot description.
pub(super) struct Described {
    /// The whole text of the description.
    pub text: String,
    /// Where the description comes from: `robot_description`, or the name of the file.
    source: String,
    /// The path of the file, if the description comes from a file.
    file: Option<PathBuf>,
    /// A warning about an irregularity in the text of the description, such as bytes that are not UTF-8. `None` if there is no
    /// irregularity.
    odd: Option<String>,
    /// The arm between the two frames.
    pub arm: DescribedArm,
    /// The names of the base frame and of the tool frame.
    frames: [String; 2],
    /// Other links that could be the tool frame; `None` if both frames were given.
    alternatives: Option<Vec<String>>,
    /// The right one of two different arms; `None` for a single arm, or if both arms are alike.
    pub right: Option<Box<Self>>,
}

impl Described {
    /// Reads the robot description among the `given` values; `None` if there is none. For `two_arms`, also reads the right arm if
    /// parameters name its frames or its description.
    ///
    /// # Errors
    /// [`ParameterError::Missing`] if frames are given without a description, [`ParameterError::File`] if the description has no
    /// arm, and [`ParameterError::Invalid`] if both arms have a joint in common.
    pub fn find(given: &[ParameterOverride], two_arms: bool) -> Result<Option<Self>, ParameterError> {
        let Some(given_text) = GivenText::find(given, ["robot_description", "robot_file"])? else {
            return match is_awaited(given) {
                false => Ok(None),
                true => Err(ParameterError::Missing {
                    what: "the arm between base_frame and tool_frame",
                    missing: vec!["robot_description or robot_file"],
                    why: "only a servo node waits for a description on a topic; otherwise give joints and arm.*",
                }),
            };
        };
        let mut left = Self::read(given_text, ["base_frame", "tool_frame"].map(|name| text(given, name)))?;
        if two_arms {
            left.right = left.find_right(given)?.map(Box::new);
        }
        Ok(Some(left))
    }

    /// Reads the right arm: from a description of its own or, if there is none, from this description. Returns `None` if no
    /// parameter is about the right arm.
    fn find_right(&self, given: &[ParameterOverride]) -> Result<Option<Self>, ParameterError> {
        let frames = ["right_base_frame", "right_tool_frame"].map(|name| text(given, name));
        if let Some(own) = GivenText::find(given, ["right_robot_description", "right_robot_file"])? {
            return Self::read(own, frames).map(Some);
        }
        let [base, Some(tool)] = frames else {
            return match frames[0] {
                None => Ok(None),
                Some(base) => Err(ParameterError::invalid(
                    "right_base_frame",
                    format!("{base:?}"),
                    "right_tool_frame, right_robot_description or right_robot_file with it",
                )),
            };
        };
        let [left_base, left_tool] = &self.frames;
        if let Some(base) = base.filter(|base| base != left_base) {
            let expected = format!(
                "base_frame ({left_base:?}), because the robot has one description: give a base_frame from which both arms hang"
            );
            return Err(ParameterError::invalid("right_base_frame", format!("{base:?}"), expected));
        }
        let same =
            GivenText { bytes: self.text.as_bytes().into(), source: &self.source, file: self.file.clone() };
        let right = Self::read(same, [Some(left_base), Some(tool)])?;
        match self.arm.moving().find(|joint| right.arm.moving().any(|other| other.name == joint.name)) {
            None => Ok(Some(Self { odd: None, ..right })),
            Some(_) if left_tool == tool => Err(ParameterError::invalid(
                "right_tool_frame",
                format!("{tool:?}"),
                "the tool frame of the other arm: this one is tool_frame",
            )),
            Some(DescribedJoint { name, .. }) => Err(ParameterError::invalid(
                "right_tool_frame",
                format!("{tool:?}"),
                format!("arms without a common joint: {name:?} moves both, so give a base_frame beyond it"),
            )),
        }
    }

    /// Reads the arm between two frames. Guesses a frame that is not given.
    fn read(
        GivenText { bytes, source, file }: GivenText,
        named: [Option<&str>; 2],
    ) -> Result<Self, ParameterError> {
        let (text, odd) = decoded(bytes);
        let Guess { base, tool, alternatives } =
            guess_frames(&text, named).map_err(|why| error(source, &why))?;
        let arm = read(&text, source, &base, &tool)?.arm;
        let (frames, alternatives) = ([base, tool], named.contains(&None).then_some(alternatives));
        let odd = odd.or_else(|| oddity(&text)).map(|odd| format!("{source}: {odd}"));
        Ok(Self { source: source.to_owned(), file, text, odd, arm, frames, alternatives, right: None })
    }

    /// Yields the single arm, or both arms.
    fn arms(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.right.as_deref())
    }

    /// Yields the joints of all arms.
    fn moving(&self) -> impl Iterator<Item = &DescribedJoint> {
        self.arms().flat_map(|one| one.arm.moving())
    }

    /// Returns the number of joints of each arm.
    pub fn joint_counts(&self) -> Vec<usize> {
        self.arms().map(|one| one.arm.moving().count()).collect()
    }

    /// Returns the messages about guessed frames, and about irregularities in the texts.
    pub fn messages(&self) -> Vec<String> {
        let guesses = self.arms().zip(["", "right_"]).filter_map(|(one, prefix)| one.guess(prefix));
        guesses.chain(self.arms().filter_map(|one| one.odd.clone())).collect()
    }

    /// Returns a message about the guessed frames; `None` if no frame was guessed. The parameters that name the frames begin with
    /// `prefix`.
    fn guess(&self, prefix: &str) -> Option<String> {
        /// Largest number of alternatives in the message.
        const LISTED: usize = 4;
        let alternatives = self.alternatives.as_ref()?;
        let ([base, tool], source, count) = (&self.frames, &self.source, self.arm.moving().count());
        let mut others =
            alternatives.iter().take(LISTED).map(|link| format!("{link:?}")).collect::<Vec<_>>().join(", ");
        if alternatives.len() > LISTED {
            others += ", ...";
        }
        let others = if others.is_empty() { others } else { format!(" (also near its end: {others})") };
        Some(format!(
            "the arm of {source} is taken to be the {count} joints from base_frame {base:?} to tool_frame {tool:?}{others}: others by -p {prefix}base_frame:=..., -p {prefix}tool_frame:=..."
        ))
    }

    /// Returns the values that the description provides for parameters that the user has not set. The start positions and the limits
    /// on acceleration, deceleration and jerk depend on other limits. For these other limits, the values that the user has set
    /// (`given`) take precedence over the description.
    pub fn defaults(&self, given: &GivenLimits) -> Vec<(String, Value)> {
        let limits: Vec<_> = self.moving().map(|joint| joint.limits).collect();
        let described: Option<Vec<f64>> = limits.iter().map(speed).collect();
        let start = |(joint, limits): (usize, &JointLimits)| given.of(joint, limits).start();
        let [base, tool] = self.frames.clone();
        let right = self.right.iter().flat_map(|right| {
            let [base, tool] = right.frames.clone();
            [
                ("right_base_frame", Value::String(base)),
                ("right_tool_frame", Value::String(tool)),
                ("right_joints", Value::StringArray(right.names())),
            ]
        });
        let mut values = vec![
            ("base_frame", Value::String(base)),
            ("tool_frame", Value::String(tool)),
            ("joints", Value::StringArray(self.names())),
            ("initial_positions", Value::DoubleArray(limits.iter().enumerate().map(start).collect())),
        ];
        values.extend(right);
        if let Some(velocity) = given.velocity.clone().or(described) {
            let of = |((joint, limits), velocity): ((usize, &JointLimits), &f64)| {
                Dynamics::of(&given.of(joint, limits), *velocity)
            };
            let dynamics: Vec<_> = limits.iter().enumerate().zip(&velocity).map(of).collect();
            let each = |of: fn(&Dynamics) -> f64| Value::DoubleArray(dynamics.iter().map(of).collect());
            // The velocity comes first. If it is invalid, the error names the velocity, and not the limits that are computed from
            // it.
            values.push(("limits.joint_velocity", Value::DoubleArray(velocity)));
            values.push(("limits.joint_acceleration", each(|one| one.acceleration)));
            if limits.iter().any(|limits| limits.deceleration.is_some()) {
                values.push(("limits.joint_deceleration", each(|one| one.deceleration)));
            }
            if limits.iter().any(|limits| limits.jerk.is_some()) {
                values.push(("limits.jerk", each(|one| one.jerk)));
            }
        }
        if limits.iter().any(|limits| limits.range().is_some()) {
            // The servo accepts no position beyond this range, so the range does not restrict the joint.
            let free = (-bounds::JOINT_ANGLE, bounds::JOINT_ANGLE);
            let (lower, upper) = limits.iter().map(|limits| limits.range().unwrap_or(free)).unzip();
            values.push(("limits.joint_position_lower", Value::DoubleArray(lower)));
            values.push(("limits.joint_position_upper", Value::DoubleArray(upper)));
        }
        values.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// Returns a warning if the limits in the description stop a joint more slowly than a servo requires.
    pub fn slow_stop(&self, given: &GivenLimits) -> Option<String> {
        let is_less =
            |described: Option<f64>, taken: f64| described.is_some_and(|described| described < taken);
        let mut slow = self.moving().enumerate().filter(|(joint, DescribedJoint { limits, .. })| {
            let in_force = given.of(*joint, limits);
            let taken = speed(&in_force).map(|velocity| Dynamics::of(&in_force, velocity));
            taken.is_some_and(|taken| {
                // A deceleration that the user has set is checked later, when it is put into the parameter store.
                let is_given = given.deceleration.is_some();
                is_less(limits.deceleration.filter(|_| !is_given), taken.deceleration)
                    || is_less(limits.jerk, taken.jerk)
            })
        });
        let name = &slow.next()?.1.name;
        Some(format!(
            "{}: the deceleration or the jerk of joint {name:?} does not stop it in time: it gets the least values that do, {STOP_TIME} s to stop and {RAMP_TIME} s to reach the deceleration",
            self.source
        ))
    }

    /// Returns a warning if limits in the description seem to be in degrees, not in radians.
    pub fn degrees(&self, given: &GivenLimits) -> Option<String> {
        /// Usual position limits of joints in degrees. In radians they would be more than two turns.
        const POSITIONS: RangeInclusive<f64> = 15.0..=1e3;
        /// Usual speed limits of joints in degrees per second. In radians per second they would be faster than any arm.
        const SPEEDS: RangeInclusive<f64> = 30.0..=1e3;
        let turning = self.moving().filter(|joint| joint.motion != Motion::Prismatic);
        turning.into_iter().find_map(|DescribedJoint { name, limits, .. }| {
            let range = limits.range().filter(|(lower, upper)| {
                !given.has_range() && [lower, upper].iter().any(|limit| POSITIONS.contains(&limit.abs()))
            });
            let speed = limits.velocity.filter(|speed| given.velocity.is_none() && SPEEDS.contains(speed));
            let range = range.map(|(lower, upper)| format!("{lower} to {upper} rad"));
            let speed = speed.map(|speed| format!("{speed} rad/s"));
            let both: Vec<_> = range.into_iter().chain(speed).collect();
            let (source, limits) = (&self.source, both.join(" and "));
            (!both.is_empty()).then(|| {
                format!(
                    "{source}: the limits of joint {name:?} are {limits}: are these degrees? URDF has radians"
                )
            })
        })
    }

    /// Returns the arm's body from the shapes of its links.
    ///
    /// # Errors
    /// [`ParameterError::File`] if the shapes cannot be read.
    pub fn body(&self) -> Result<FittedBody, ParameterError> {
        fitted(&self.text, &self.frames, self.file.as_deref()).map_err(|why| error(&self.source, &why))
    }

    /// Checks that each joint has valid limits, in the description or among the `given` limits.
    ///
    /// # Errors
    /// [`ParameterError::File`] with the first joint that has no valid limits.
    pub fn check_limits(&self, given: &GivenLimits) -> Result<(), ParameterError> {
        let why = |joint: &DescribedJoint| {
            let JointLimits { lower, upper, velocity, .. } = joint.limits;
            match (velocity, lower, upper) {
                (None, ..) if given.velocity.is_none() => {
                    Some("has no velocity limit: give limits.joint_velocity".to_owned())
                }
                (Some(limit), ..) if given.velocity.is_none() && speed(&joint.limits).is_none() => {
                    let most = JOINT_SPEEDS.end();
                    Some(format!(
                        "has the velocity limit {limit}: expected more than 0, {most} at most, or give limits.joint_velocity"
                    ))
                }
                (_, Some(lower), Some(upper)) if !given.has_range() && joint.limits.range().is_none() => {
                    Some(format!(
                        "has the position limits {lower} and {upper} (0 where none is given): expected a range, or give \
                         limits.joint_position_lower and limits.joint_position_upper"
                    ))
                }
                _ => None,
            }
        };
        match self.moving().find_map(|joint| Some((&joint.name, why(joint)?))) {
            None => Ok(()),
            Some((name, why)) => {
                Err(ParameterError::File { file: self.source.clone(), why: format!("joint {name:?} {why}") })
            }
        }
    }

    fn names(&self) -> Vec<String> {
        names(&self.arm)
    }
}

/// Returns whether the robot description is still missing: the `given` values name the frames of an arm, but do not describe the
/// arm. A servo node then waits for a description on a topic.
pub fn is_awaited(given: &[ParameterOverride]) -> bool {
    let is_given = |name: &str| text(given, name).is_some();
    (is_given("base_frame") || is_given("tool_frame"))
        && !is_given("robot_description")
        && !is_given("robot_file")
        && !given.iter().any(|value| value.name == "joints" || value.name.starts_with("arm."))
}

/// Reads a description. `source` is its name in errors.
pub(super) fn read(text: &str, source: &str, base: &str, tool: &str) -> Result<Description, ParameterError> {
    Description::read(text, base, tool).map_err(|why| error(source, &why))
}

/// Checks the joint names of a described arm, and returns the arm's kinematics. `name` is the parameter that has the joint names.
pub(super) fn chain(
    described: &Description,
    name: &'static str,
    joints: &[String],
) -> Result<Chain, ParameterError> {
    let names = names(&described.arm);
    if joints != names {
        let expected =
            format!("{names:?}, as the robot description has them between base_frame and tool_frame");
        return Err(ParameterError::invalid(name, format!("{joints:?}"), expected));
    }
    described.arm.chain().map_err(|why| error("robot_description", &why))
}

fn names(arm: &DescribedArm) -> Vec<String> {
    arm.moving().map(|joint| joint.name.clone()).collect()
}

fn error(source: &str, why: &DescriptionError) -> ParameterError {
    ParameterError::File { file: source.to_owned(), why: why.to_string() }
}
