//! The arm and the servo's parameters, which the page shows and which seldom change.

use super::arm_shape::Model;
use super::parameters::Entry;
use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{JointOrder, Limits};
use dq_kinematics::arm::{ArmError, Chain, bounds};
use dq_messages::{ParameterDescriptor, ParameterEvent, PoseNumbers};
use dq_params::{ParameterError, Value};
use dq_wire::{ServoKind, pose_numbers};
use serde_json::json;

/// The robot, as the parameters of its servo describe it.
pub(super) struct Robot {
    kind: ServoKind,
    values: Vec<(String, Value)>,
    entries: Vec<Entry>,
    typed: ServoParameters,
}

impl Robot {
    /// Creates the robot from all parameters of a servo of this kind.
    ///
    /// # Errors
    /// [`ParameterError`] if the parameters do not describe an arm.
    pub fn new(
        kind: ServoKind,
        values: Vec<(String, Value)>,
        descriptors: Vec<ParameterDescriptor>,
    ) -> Result<Self, ParameterError> {
        let typed = typed(kind, &values)?;
        let value_of = |name: &str| values.iter().find(|(known, _)| known == name).map(|(_, value)| value);
        let entry = |descriptor: ParameterDescriptor| {
            let value = value_of(&descriptor.name)?;
            Some(Entry::new(descriptor, value))
        };
        let entries = descriptors.into_iter().filter_map(entry).collect();
        Ok(Self { kind, entries, values, typed })
    }

    /// Returns the arms, in the base frame of the first arm.
    pub fn chains(&self) -> impl Iterator<Item = &Chain> {
        self.typed.arms.chains()
    }

    /// Returns the joints of each arm.
    pub fn joints(&self) -> &[JointOrder] {
        &self.typed.joints
    }

    /// Returns the names of all joints, arm after arm.
    pub fn joint_names(&self) -> Vec<String> {
        self.kind.joint_names(&self.typed.joints)
    }

    /// Returns the largest distance from the origin of the base frame that the arms can reach \[m\]. A prismatic joint without limits
    /// counts as fixed at 0.
    pub fn reach(&self) -> f64 {
        reach(self.chains(), &self.typed.settings.limits)
    }

    /// Returns the parameter with this name.
    pub fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name == name)
    }

    /// Applies the changes of parameters that the servo announced. Ignores values that are invalid in this version.
    pub fn take(&mut self, event: &ParameterEvent) {
        for changed in &event.changed_parameters {
            let Some(value) = changed.value.clone().into_value() else { continue };
            if let Some(entry) = self.entries.iter_mut().find(|entry| entry.name == changed.name) {
                entry.set(&value);
            }
            if let Some((_, known)) = self.values.iter_mut().find(|(name, _)| *name == changed.name) {
                *known = value;
            }
        }
        if let Ok(typed) = typed(self.kind, &self.values) {
            self.typed = typed;
        }
    }

    /// Returns the values of the parameters.
    pub fn values(&self) -> &[(String, Value)] {
        &self.values
    }

    /// Returns the model of the robot description `text`; `None` if `text` is empty, or if the servo has no robot description.
    pub fn model(&self, text: &str) -> Option<Model> {
        let named = |wanted: &str| self.values.iter().find(|(name, _)| name == wanted);
        let value = |wanted: &str| match named(wanted) {
            Some((_, Value::String(value))) => value.clone(),
            _ => String::new(),
        };
        let frames = ["base_frame", "tool_frame"].map(value);
        let file = Some(value("robot_file")).filter(|file| !file.is_empty()).map(Into::into);
        let chain = self.chains().next()?.clone();
        let is_described = !text.is_empty() && !value("robot_description").is_empty();
        is_described.then(|| Model { text: text.to_owned(), frames, chain, file })
    }

    /// Returns the velocity limits of the joints [rad/s, prismatic: m/s].
    pub fn joint_velocity_limits(&self) -> &[f64] {
        &self.typed.settings.limits.joint_velocity
    }

    /// Returns the singular value below which the inverse of the Jacobian is damped.
    pub fn damping_threshold(&self) -> f64 {
        self.typed.settings.controller.damping.threshold
    }

    /// Returns the JSON message that shows the arm and the parameters.
    pub fn frame(&self) -> String {
        let settings = &self.typed.settings;
        let bound = |bounds: &[f64]| {
            bounds
                .iter()
                .map(|bound| (bound.abs() < bounds::JOINT_ANGLE).then_some(*bound))
                .collect::<Vec<_>>()
        };
        json!({ "robot": {
            "joints": self.joint_names(),
            "base_frame": self.typed.goal_frame,
            "units": units(self.chains()),
            "reach": self.reach(),
            "joint_velocity": self.joint_velocity_limits(),
            "joint_lower": bound(&settings.limits.position.lower),
            "joint_upper": bound(&settings.limits.position.upper),
            "tolerance": [settings.goal_tolerance.linear, settings.goal_tolerance.angular],
            "damping_threshold": self.damping_threshold(),
            "parameters": self.entries,
        }})
        .to_string()
    }
}

/// Returns the largest distance from the origin of the base frame that arms with these limits can reach \[m\].
pub(super) fn reach<'a>(arms: impl IntoIterator<Item = &'a Chain>, limits: &Limits) -> f64 {
    let known = |limit: f64| if limit.abs() < bounds::JOINT_ANGLE { limit } else { 0.0 };
    let ranges = limits.position.ranges();
    let ranges: Vec<_> = ranges.map(|(lower, upper)| (known(lower), known(upper))).collect();
    let (mut rest, mut reach) = (ranges.as_slice(), 0.0);
    for arm in arms {
        let (own, others) = rest.split_at(arm.joint_count().min(rest.len()));
        reach = f64::max(reach, arm.base_point().norm() + arm.reach(own.iter().copied()));
        rest = others;
    }
    reach
}

/// Returns the origins of base, links and tool \[m\], base first.
///
/// # Errors
/// [`ArmError::JointCount`] if `positions` does not have one number per joint.
pub(super) fn link_points(arm: &Chain, positions: &[f64]) -> Result<Vec<[f64; 3]>, ArmError> {
    let (links, tool) = (arm.link_poses(positions)?, arm.forward_kinematics(positions)?);
    let origins = links.iter().chain([&tool]).map(UnitDualQuaternion::translation);
    Ok([arm.base_point()].into_iter().chain(origins).map(Into::into).collect())
}

/// Returns the poses of the links in the base frame.
///
/// # Errors
/// [`ArmError::JointCount`] if `positions` does not have one number per joint.
pub(super) fn link_frames(arm: &Chain, positions: &[f64]) -> Result<Vec<PoseNumbers>, ArmError> {
    Ok(arm.link_poses(positions)?.iter().map(pose_numbers).collect())
}

/// Returns the units of the joint positions of all arms: rad or m.
pub(super) fn units<'a>(arms: impl IntoIterator<Item = &'a Chain>) -> Vec<&'static str> {
    arms.into_iter().flat_map(Chain::kinds).map(|kind| kind.unit()).collect()
}

/// Converts the values to typed parameters. Ignores parameters that this version does not know: the servo may be of another
/// version.
fn typed(kind: ServoKind, values: &[(String, Value)]) -> Result<ServoParameters, ParameterError> {
    let mut store = kind.store()?;
    for (name, value) in values {
        match store.override_initial(name, value.clone()) {
            Err(ParameterError::Unknown { .. }) => {}
            other => other?,
        }
    }
    kind.from_store(&store)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use dq_config::NodeParameters;

    pub fn robot() -> Robot {
        let (store, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
        let values = store.values().collect();
        let descriptors =
            ServoParameters::declarations().unwrap().iter().map(ParameterDescriptor::from).collect();
        Robot::new(ServoKind::OneArm, values, descriptors).unwrap()
    }

    pub fn changed(name: &str, value: Value) -> ParameterEvent {
        let changed = dq_messages::Parameter { name: name.to_owned(), value: (&value).into() };
        ParameterEvent { changed_parameters: vec![changed], ..ParameterEvent::default() }
    }

    fn shown(robot: &Robot) -> serde_json::Value {
        serde_json::from_str::<serde_json::Value>(&robot.frame()).unwrap()["robot"].clone()
    }

    fn parameter(robot: &serde_json::Value, name: &str) -> serde_json::Value {
        let all = robot["parameters"].as_array().unwrap();
        all.iter().find(|one| one["name"] == name).unwrap().clone()
    }

    #[test]
    fn the_page_gets_the_arm_and_what_the_descriptors_say() {
        let shown = shown(&robot());
        assert_eq!(shown["joints"].as_array().unwrap().len(), 6);
        assert_eq!(shown["joint_lower"][0], serde_json::Value::Null, "the built-in arm has no limits");
        let gain = parameter(&shown, "gains.diffc");
        assert_eq!((&gain["value"], &gain["min"], &gain["max"]), (&json!(185.0), &json!(1e-6), &json!(1e4)));
        let law = parameter(&shown, "controller");
        assert_eq!((&law["value"], law["choices"].as_array().unwrap().len()), (&json!("logc"), 12));
        assert_eq!(parameter(&shown, "update_rate")["read_only"], true);
        assert_eq!(
            parameter(&shown, "joints")["value"],
            serde_json::Value::Null,
            "lists of texts are not shown"
        );
        let gains = parameter(&shown, "gains.logc");
        assert_eq!((&gains["value"], &gains["max"]), (&json!([1.0, 1.0]), &json!(100.0)));
    }

    #[test]
    fn values_have_the_parameter_s_type_or_the_reason_why_not() {
        let robot = robot();
        let value = |name, sent| robot.entry(name).unwrap().value_from(&sent);
        assert_eq!(value("gains.diffc", json!(7)), Ok(Value::Double(7.0)));
        assert_eq!(value("gains.logc", json!([1, 2.5])), Ok(Value::DoubleArray(vec![1.0, 2.5])));
        assert_eq!(value("gains.logc", json!([1, "2"])), Err("gains.logc takes a double array".to_owned()));
        assert_eq!(value("controller", json!("logc")), Ok(Value::String("logc".to_owned())));
        assert_eq!(value("gains.diffc", json!("7")), Err("gains.diffc takes a double".to_owned()));
        assert_eq!(value("use_sim_time", json!(true)), Ok(Value::Bool(true)));
        assert_eq!(
            value("joints", json!(["a"])),
            Err("joints: the page cannot set a string array".to_owned())
        );
        assert!(robot.entry("nope").is_none());
    }

    #[test]
    fn announcements_of_the_servo_are_shown() {
        let mut robot = robot();
        robot.take(&changed("damping.threshold", Value::Double(0.1)));
        robot.take(&changed("nope", Value::Bool(true)));
        let shown = shown(&robot);
        assert_eq!(shown["damping_threshold"], 0.1);
        assert_eq!(parameter(&shown, "damping.threshold")["value"], 0.1);
    }
}
