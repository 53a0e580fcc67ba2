//! A node's parameters and their values.

use super::{Declaration, ParameterError, Value, nearest};

/// Declared parameters with their values, in the order of declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterStore {
    parameters: Vec<(Declaration, Value)>,
    also_known: Vec<&'static str>,
}

impl ParameterStore {
    /// All parameters at their defaults. Overrides for the names `also_known` are passed over: one file serves several
    /// nodes, and each takes its own.
    pub fn new(declarations: Vec<Declaration>, also_known: Vec<&'static str>) -> Self {
        let parameters =
            declarations.into_iter().map(|declared| (declared.clone(), declared.default)).collect();
        Self { parameters, also_known }
    }

    /// Sets a value before the node starts, which for read-only parameters is the only time.
    ///
    /// # Errors
    /// [`ParameterError`]; ROS 2 itself passes over unknown names, and hides typing errors so.
    pub fn override_initial(&mut self, name: &str, value: Value) -> Result<(), ParameterError> {
        let ignored = self.also_known.contains(&name)
            || name.starts_with("qos_overrides.")
            || name == "start_type_description_service";
        if ignored && self.get(name).is_none() {
            return Ok(());
        }
        let slot = self.slot(name)?;
        slot.1 = slot.0.check(value)?;
        Ok(())
    }

    /// A copy with all of `changes` made.
    ///
    /// # Errors
    /// The first [`ParameterError`] among them.
    pub fn with(&self, changes: &[(String, Value)]) -> Result<Self, ParameterError> {
        let mut candidate = self.clone();
        for (name, value) in changes {
            let slot = candidate.slot(name)?;
            if slot.0.read_only {
                return Err(ParameterError::ReadOnly(slot.0.name));
            }
            slot.1 = slot.0.check(value.clone())?;
        }
        Ok(candidate)
    }

    /// A parameter's value.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.parameters.iter().find(|(declared, _)| declared.name == name).map(|(_, value)| value)
    }

    /// A parameter's declaration.
    pub fn declaration(&self, name: &str) -> Option<&Declaration> {
        self.parameters.iter().find(|(declared, _)| declared.name == name).map(|(declared, _)| declared)
    }

    /// All declarations with their values, in the order of declaration.
    pub fn iter(&self) -> impl Iterator<Item = (&Declaration, &Value)> {
        self.parameters.iter().map(|(declared, value)| (declared, value))
    }

    /// A double. These four getters fail on a name that was not declared with the type asked for, which the tests of the
    /// typed parameters rule out.
    pub(crate) fn double(&self, name: &'static str) -> Result<f64, ParameterError> {
        if let Some(Value::Double(value)) = self.get(name) { Ok(*value) } else { Err(undeclared(name)) }
    }

    pub(crate) fn integer(&self, name: &'static str) -> Result<i64, ParameterError> {
        if let Some(Value::Integer(value)) = self.get(name) { Ok(*value) } else { Err(undeclared(name)) }
    }

    pub(crate) fn string(&self, name: &'static str) -> Result<&str, ParameterError> {
        if let Some(Value::String(value)) = self.get(name) { Ok(value) } else { Err(undeclared(name)) }
    }

    pub(crate) fn strings(&self, name: &'static str) -> Result<&[String], ParameterError> {
        if let Some(Value::StringArray(value)) = self.get(name) { Ok(value) } else { Err(undeclared(name)) }
    }

    /// A double array that must have `count` elements.
    pub(crate) fn doubles(&self, name: &'static str, count: usize) -> Result<&[f64], ParameterError> {
        match self.get(name) {
            Some(Value::DoubleArray(value)) if value.len() == count => Ok(value),
            Some(Value::DoubleArray(value)) => Err(ParameterError::Invalid {
                name,
                value: format!("a list of {}", value.len()),
                expected: format!("{count} numbers"),
            }),
            _ => Err(undeclared(name)),
        }
    }

    fn slot(&mut self, name: &str) -> Result<&mut (Declaration, Value), ParameterError> {
        let nearest = nearest(name, self.parameters.iter().map(|(declared, _)| declared.name));
        self.parameters
            .iter_mut()
            .find(|(declared, _)| declared.name == name)
            .ok_or_else(|| ParameterError::Unknown { name: name.to_owned(), nearest })
    }
}

fn undeclared(name: &'static str) -> ParameterError {
    ParameterError::Unknown { name: name.to_owned(), nearest: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{BUILTIN_FILE, NodeParameters, ServoParameters};
    use crate::params::parameters_for;

    fn store() -> ParameterStore {
        let mut store = ServoParameters::store();
        for (name, value) in parameters_for(BUILTIN_FILE, "puma560.yaml", "/dq_servo").unwrap() {
            store.override_initial(&name, value).unwrap();
        }
        store
    }

    fn change(name: &str, yaml: &str) -> Vec<(String, Value)> {
        vec![(name.to_owned(), Value::from_yaml(yaml).unwrap())]
    }

    #[test]
    fn good_changes_are_taken() {
        let store = store();
        let changed = store.with(&change("controller", "diffc")).unwrap();
        assert_eq!(changed.get("controller"), Some(&Value::String("diffc".into())));
        assert_eq!(store.with(&change("diffc.gain", "10")).unwrap().double("diffc.gain"), Ok(10.0));
    }

    #[test]
    fn bad_changes_are_refused_with_a_reason() {
        let store = store();
        for (name, yaml, reason) in [
            ("controller", "pid", "one of diffc, diffc_inverse, logc"),
            ("controller", "3", "is a string"),
            ("diffc.gain", "-1.0", "to 10000"),
            ("diffc.gian", "1.0", "did you mean \"diffc.gain\""),
            ("update_rate", "100", "read-only"),
            ("limits.joint_velocity", "[1.0, -1.0]", "to 10000"),
            ("use_sim_time", "true", "nothing else"),
        ] {
            let message = store.with(&change(name, yaml)).unwrap_err().to_string();
            assert!(message.contains(reason) && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn lists_must_fit_the_joints() {
        assert!(store().with(&[("diffc.gain".to_owned(), Value::Double(f64::NAN))]).is_err());
        let store = store().with(&change("limits.joint_velocity", "[1.0, 1.0]")).unwrap();
        let message = ServoParameters::from_store(&store).unwrap_err().to_string();
        assert!(message.contains("limits.joint_velocity") && message.contains("6 numbers"), "{message}");
    }

    #[test]
    fn a_deceleration_stops_each_joint_within_a_second_or_is_refused() {
        let with = |changes: &[(&str, &str)]| {
            let changes: Vec<_> = changes.iter().flat_map(|(name, yaml)| change(name, yaml)).collect();
            ServoParameters::from_store(&store().with(&changes).unwrap()).map(|all| all.settings.limits)
        };
        let (velocity, deceleration) = ("limits.joint_velocity", "limits.joint_deceleration");
        assert_eq!(with(&[(deceleration, "[5, 5, 5, 5, 5, 5]")]).unwrap().joint_deceleration, [5.0; 6]);
        // The velocity limits are 5 rad/s.
        let slow = with(&[(deceleration, "[50, 50, 4.9, 50, 50, 50]")]).unwrap_err().to_string();
        let expected = "parameter \"limits.joint_deceleration\" cannot be 4.9: expected at least 5 rad/s^2, which stops joint 3 from its velocity limit in 1 s";
        assert_eq!(slow, expected);
        assert!(with(&[(deceleration, "[5, 5, 5, 5, 5, 5]"), (velocity, "[5, 5, 5, 5, 5, 5.1]")]).is_err());
        // Where none is given the accelerations are, and no less than what stops in a second.
        let limits = with(&[("limits.joint_acceleration", "[1e-6, 50, 50, 50, 50, 50]")]).unwrap();
        assert_eq!((limits.deceleration(0), limits.deceleration(1)), (5.0, 50.0));
    }

    #[test]
    fn a_change_is_all_or_nothing() {
        let store = store();
        let mut changes = change("diffc.gain", "10.0");
        changes.extend(change("controller", "pid"));
        assert!(store.with(&changes).is_err());
        assert_eq!(store.double("diffc.gain"), Ok(185.0));
    }
}
