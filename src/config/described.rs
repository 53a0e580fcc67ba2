//! An arm from a robot description. The description's values replace parameters that the user has not set.

use dq_common::text::cut;
use dq_common::text_file;
use dq_core::servo::{JOINT_JERKS, JOINT_SPEEDS, RAMP_TIME, STOP_TIME};
use dq_description::{
    DescribedArm, DescribedJoint, Description, DescriptionError, Guess, JointLimits, LONGEST_DESCRIPTION,
    Motion, guess_frames, oddity,
};
use dq_description::{FittedBody, fitted};
use dq_kinematics::arm::{Chain, bounds};
use dq_params::{ParameterError, ParameterOverride, Value};
use std::borrow::Cow;
use std::io;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// The values that a node takes from a robot description.
pub(super) struct Described {
    /// The whole text of the description.
    pub text: String,
    /// Where the description comes from: `robot_description`, or the name of the file.
    source: String,
    /// The path of the file, if the description comes from a file.
    file: Option<PathBuf>,
    /// A message about an irregularity in the description that did not prevent reading.
    pub odd: Option<String>,
    /// The arm between the two frames.
    pub arm: DescribedArm,
    /// The names of the base frame and of the tool frame.
    frames: [String; 2],
    /// Other links that could be the tool frame; `None` if both frames were given.
    alternatives: Option<Vec<String>>,
}

/// The time from rest to the velocity limit \[s\]. It determines the acceleration limit of joints for which the description has no
/// such limit.
const TIME_TO_FULL_SPEED: f64 = 0.5;

impl Described {
    /// Reads the robot description among the `given` values; `None` if there is none.
    ///
    /// # Errors
    /// [`ParameterError::Missing`] if frames are given without a description, [`ParameterError::File`] if the description has no
    /// arm.
    pub fn find(given: &[ParameterOverride]) -> Result<Option<Self>, ParameterError> {
        let (text, source, file) = match (
            self::text(given, "robot_description"),
            self::text(given, "robot_file"),
        ) {
            (Some(text), _) if !text.contains('<') => return Err(no_description(text)),
            (Some(text), _) => (Cow::Borrowed(text.as_bytes()), "robot_description", None),
            (None, Some(file)) => (Cow::Owned(read_file(file)?), file, Some(PathBuf::from(file))),
            (None, None) if is_awaited(given) => {
                return Err(ParameterError::Missing {
                    what: "the arm between base_frame and tool_frame",
                    missing: vec!["robot_description or robot_file"],
                    why: "only a servo node waits for a description on a topic; otherwise give joints and arm.*",
                });
            }
            (None, None) => return Ok(None),
        };
        let (text, odd) = decoded(text);
        let named = ["base_frame", "tool_frame"].map(|name| self::text(given, name));
        let Guess { base, tool, alternatives } =
            guess_frames(&text, named).map_err(|why| error(source, &why))?;
        let arm = read(&text, source, &base, &tool)?.arm;
        let (frames, alternatives) = ([base, tool], named.contains(&None).then_some(alternatives));
        let odd = odd.or_else(|| oddity(&text)).map(|odd| format!("{source}: {odd}"));
        Ok(Some(Self { source: source.to_owned(), file, text, odd, arm, frames, alternatives }))
    }

    /// Returns a message about the guessed frames; `None` if no frame was guessed.
    pub fn guess(&self) -> Option<String> {
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
            "the arm of {source} is taken to be the {count} joints from base_frame {base:?} to tool_frame {tool:?}{others}: others by -p base_frame:=..., -p tool_frame:=..."
        ))
    }

    /// Returns values for parameters that the user has not set. Limits that the user has set take precedence over the limits in
    /// the description.
    pub fn defaults(&self, given: &GivenLimits) -> Vec<(String, Value)> {
        let limits: Vec<_> = self.arm.moving().map(|joint| joint.limits).collect();
        let described: Option<Vec<f64>> = limits.iter().map(speed).collect();
        let start = |(joint, limits): (usize, &JointLimits)| given.of(joint, limits).start();
        let [base, tool] = self.frames.clone();
        let mut values = vec![
            ("base_frame", Value::String(base)),
            ("tool_frame", Value::String(tool)),
            ("joints", Value::StringArray(self.names())),
            ("initial_positions", Value::DoubleArray(limits.iter().enumerate().map(start).collect())),
        ];
        if let Some(velocity) = given.velocity.clone().or(described) {
            let of = |((joint, limits), velocity): ((usize, &JointLimits), &f64)| {
                Dynamics::of(&given.of(joint, limits), *velocity)
            };
            let dynamics: Vec<_> = limits.iter().enumerate().zip(&velocity).map(of).collect();
            let each = |of: fn(&Dynamics) -> f64| Value::DoubleArray(dynamics.iter().map(of).collect());
            // The velocity comes first. So an invalid velocity is reported itself, and not the invalid limits that result from it.
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
        let mut slow = self.arm.moving().enumerate().filter(|(joint, DescribedJoint { limits, .. })| {
            let in_force = given.of(*joint, limits);
            let taken = speed(&in_force).map(|velocity| Dynamics::of(&in_force, velocity));
            taken.is_some_and(|taken| {
                // A deceleration that the user has set is checked when the store takes it.
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

    /// Returns a warning if limits in the description seem to be in degrees.
    pub fn degrees(&self, given: &GivenLimits) -> Option<String> {
        /// Usual position limits of joints in degrees. In radians they would be more than two turns.
        const POSITIONS: RangeInclusive<f64> = 15.0..=1e3;
        /// Usual speed limits of joints in degrees per second. In radians per second they would be faster than any arm.
        const SPEEDS: RangeInclusive<f64> = 30.0..=1e3;
        let turning = self.arm.moving().filter(|joint| joint.motion != Motion::Prismatic);
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
        match self.arm.moving().find_map(|joint| Some((&joint.name, why(joint)?))) {
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

fn read_file(file: &str) -> Result<Vec<u8>, ParameterError> {
    let error = |why: io::Error| ParameterError::File { file: file.to_owned(), why: why.to_string() };
    text_file::bytes(Path::new(file), LONGEST_DESCRIPTION as u64).map_err(error)
}

/// Returns the text of `bytes`. If they are not UTF-8, reads them as Latin-1, in which every byte is a character, and also returns
/// a message.
fn decoded(bytes: Cow<[u8]>) -> (String, Option<String>) {
    match str::from_utf8(&bytes) {
        Ok(text) => (text.to_owned(), None),
        Err(why) => {
            let line = 1 + bytes[..why.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
            let text = bytes.iter().copied().map(char::from).collect();
            (text, Some(format!("line {line} is not UTF-8: the description is read as Latin-1")))
        }
    }
}

/// Returns the error for the text of a `robot_description` that has no XML element.
fn no_description(text: &str) -> ParameterError {
    let why = match text.contains('/') || text.contains(".urdf") {
        true => "is a path, not a URDF: give a file as robot_file",
        false => "is not a URDF",
    };
    let why = format!("{:?} {why}", cut(text.trim()));
    ParameterError::File { file: "robot_description".to_owned(), why }
}

/// The limits of a joint on acceleration, deceleration and jerk.
struct Dynamics {
    acceleration: f64,
    deceleration: f64,
    jerk: f64,
}

impl Dynamics {
    /// Computes the limits of a joint from the `limits` in its description and its speed limit `velocity`. As in URDF, a missing
    /// deceleration equals the acceleration, and a missing jerk is unlimited. Each limit is at least so large that the joint stops
    /// within [`STOP_TIME`].
    fn of(limits: &JointLimits, velocity: f64) -> Self {
        let given =
            |limit: Option<f64>, range: RangeInclusive<f64>| limit.filter(|limit| range.contains(limit));
        let most = *JOINT_SPEEDS.end();
        let acceleration = given(limits.acceleration, JOINT_SPEEDS);
        let acceleration = acceleration.unwrap_or(most.min(velocity / TIME_TO_FULL_SPEED));
        let deceleration = given(limits.deceleration, JOINT_SPEEDS).unwrap_or(acceleration);
        let deceleration = deceleration.max(velocity / STOP_TIME);
        let least = acceleration.max(deceleration) / RAMP_TIME;
        let jerk = given(limits.jerk, JOINT_JERKS).unwrap_or(*JOINT_JERKS.end()).max(least);
        Self { acceleration, deceleration, jerk }
    }
}

/// Returns the speed limit of a joint if it is valid.
fn speed(limits: &JointLimits) -> Option<f64> {
    limits.velocity.filter(|limit| JOINT_SPEEDS.contains(limit))
}

/// The joint limits that the user has set as parameters.
pub(super) struct GivenLimits {
    velocity: Option<Vec<f64>>,
    acceleration: Option<Vec<f64>>,
    deceleration: Option<Vec<f64>>,
    lower: Option<Vec<f64>>,
    upper: Option<Vec<f64>>,
}

impl GivenLimits {
    /// Collects the joint limits among these values.
    pub fn find(given: &[ParameterOverride]) -> Self {
        let list = |name: &str| {
            let last = given.iter().rev().find(|value| value.name == name)?;
            match last.value.clone().convert_like(&Value::DoubleArray(Vec::new())) {
                Ok(Value::DoubleArray(list)) => Some(list),
                // A value of another type is rejected when the store takes it.
                _ => Some(Vec::new()),
            }
        };
        Self {
            velocity: list("limits.joint_velocity"),
            acceleration: list("limits.joint_acceleration"),
            deceleration: list("limits.joint_deceleration"),
            lower: list("limits.joint_position_lower"),
            upper: list("limits.joint_position_upper"),
        }
    }

    fn has_range(&self) -> bool {
        self.lower.is_some() && self.upper.is_some()
    }

    /// Returns the limits in force of the joint with the index `joint`. `limits` are its limits in the description.
    fn of(&self, joint: usize, limits: &JointLimits) -> JointLimits {
        let given = |list: &Option<Vec<f64>>| list.as_ref().and_then(|list| list.get(joint).copied());
        let (lower, upper) = limits.range().unzip();
        JointLimits {
            lower: given(&self.lower).or(lower),
            upper: given(&self.upper).or(upper),
            velocity: given(&self.velocity).or(limits.velocity),
            acceleration: given(&self.acceleration).or(limits.acceleration),
            deceleration: given(&self.deceleration).or(limits.deceleration),
            ..*limits
        }
    }
}

/// Returns whether these values name the frames of an arm but do not describe the arm.
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

/// Returns the kinematics of a described arm, after a check of its joint names.
pub(super) fn chain(described: &Description, joints: &[String]) -> Result<Chain, ParameterError> {
    let names = names(&described.arm);
    if joints != names {
        let expected =
            format!("{names:?}, as the robot description has them between base_frame and tool_frame");
        return Err(ParameterError::invalid("joints", format!("{joints:?}"), expected));
    }
    described.arm.chain().map_err(|why| error("robot_description", &why))
}

fn names(arm: &DescribedArm) -> Vec<String> {
    arm.moving().map(|joint| joint.name.clone()).collect()
}

fn error(source: &str, why: &DescriptionError) -> ParameterError {
    ParameterError::File { file: source.to_owned(), why: why.to_string() }
}

/// Returns the last of the `given` values with the name `name`. `None` if its text is empty, which is the default.
fn text<'a>(given: &'a [ParameterOverride], name: &str) -> Option<&'a str> {
    let values = given.iter().rev().filter(|value| value.name == name);
    let mut texts =
        values.filter_map(|value| if let Value::String(text) = &value.value { Some(text) } else { None });
    texts.next().map(String::as_str).filter(|text| !text.is_empty())
}
