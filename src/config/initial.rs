//! A node's parameters at its start: the built-in arm, or the one that is described, and what else is given.

use super::BUILTIN_FILE;
use crate::params::{ParameterError, ParameterStore, Value, parameters_for};

/// A value that somebody gives a parameter before the node starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// The parameter.
    pub name: String,
    /// Its value.
    pub value: Value,
    /// The file or the argument that gives it.
    pub source: String,
    /// Whether it is for this node by name: then the parameter must exist. What is given to every node is ignored where it
    /// does not, as ROS 2 ignores it.
    pub by_name: bool,
}

impl ParameterStore {
    /// Takes the values with which `node` (fully qualified) starts, later ones over earlier ones, and returns what to warn of.
    ///
    /// Where nothing describes an arm, the built-in one serves. Once `joints` or any `arm.*` is given nothing of it is left:
    /// half of one arm and half of another would move, and wrongly.
    ///
    /// # Errors
    /// [`ParameterError::Missing`], and what [`override_initial`](Self::override_initial) says of a value.
    pub fn start_with(&mut self, node: &str, given: Vec<Given>) -> Result<Vec<String>, ParameterError> {
        let mut builtin = parameters_for(BUILTIN_FILE, "msg_config/puma560.yaml", node)?;
        if given.iter().any(|value| value.name == "joints" || value.name.starts_with("arm.")) {
            self.check_arm_is_whole(&given)?;
            builtin.retain(|(name, _)| !self.describes_arm(name));
        }
        for (name, value) in builtin {
            self.override_initial(&name, value)?;
        }
        let mut ignored = Ignored::default();
        let mut warnings = Vec::new();
        for Given { name, value, source, by_name } in given {
            // Launch files of a simulation give it to every node.
            if name == "use_sim_time" && value == Value::Bool(true) {
                warnings.push(format!("{source}: use_sim_time: {node} keeps to the system's clocks"));
                continue;
            }
            match self.override_initial(&name, value) {
                Err(ParameterError::Unknown { nearest, .. }) if !by_name => {
                    ignored.add(source, name, nearest)
                }
                other => other?,
            }
        }
        warnings.extend(ignored.warnings(node));
        Ok(warnings)
    }

    fn describes_arm(&self, name: &str) -> bool {
        name.starts_with("arm.") || self.declaration(name).is_some_and(|declared| declared.of_every_arm)
    }

    fn check_arm_is_whole(&self, given: &[Given]) -> Result<(), ParameterError> {
        let missing: Vec<_> = self
            .iter()
            .filter(|(declared, _)| declared.of_every_arm)
            .map(|(declared, _)| declared.name)
            .filter(|name| given.iter().all(|value| value.name != *name))
            .collect();
        match missing.is_empty() {
            true => Ok(()),
            false => Err(ParameterError::Missing {
                what: "an arm",
                missing,
                why: "once `joints` or any `arm.*` is given, nothing of the built-in arm is used",
            }),
        }
    }
}

/// Values for parameters that the node does not have, by where they come from.
#[derive(Default)]
struct Ignored(Vec<(String, Vec<String>)>);

/// So many names of a source are listed; a file may serve a whole robot.
const LISTED: usize = 4;

impl Ignored {
    fn add(&mut self, source: String, name: String, nearest: Option<&str>) {
        let hint = nearest.map(|near| format!(" (did you mean {near:?}?)")).unwrap_or_default();
        let text = format!("{name:?}{hint}");
        match self.0.iter_mut().find(|(file, _)| *file == source) {
            Some((_, names)) => names.push(text),
            None => self.0.push((source, vec![text])),
        }
    }

    /// One line a source.
    fn warnings(self, node: &str) -> Vec<String> {
        let line = |(source, names): (String, Vec<String>)| {
            let listed = names[..names.len().min(LISTED)].join(", ");
            let more = names.len().saturating_sub(LISTED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            format!("{source}: {node} has no parameter {listed}{more}: ignored")
        };
        self.0.into_iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{NodeParameters, PlantParameters, ServoParameters};

    fn given(yaml: &[(&str, &str)]) -> Vec<Given> {
        let value = |(name, yaml): &(&str, &str)| Given {
            name: (*name).to_owned(),
            value: Value::from_yaml(yaml).unwrap(),
            source: "arm.yaml".to_owned(),
            by_name: false,
        };
        yaml.iter().map(value).collect()
    }

    const ARM: [(&str, &str); 8] = [
        ("joints", "[a, b]"),
        ("arm.convention", "standard_dh"),
        ("arm.alpha", "[0, 1.5]"),
        ("arm.a", "[0.5, 0.5]"),
        ("arm.d", "[0, 0]"),
        ("limits.joint_velocity", "[1, 1]"),
        ("limits.joint_acceleration", "[9, 9]"),
        ("initial_positions", "[0, 0]"),
    ];

    #[test]
    fn an_arm_is_whole_or_refused_with_what_is_missing() {
        let start = |values: &[(&str, &str)]| {
            let mut store = ServoParameters::store();
            store.start_with("/dq_servo", given(values)).map(|warnings| (store, warnings))
        };
        let (store, warnings) = start(&ARM).unwrap();
        assert_eq!(warnings, [""; 0]);
        assert_eq!(ServoParameters::from_store(&store).unwrap().joints[0].names(), ["a", "b"]);
        for i in 0..7 {
            let mut values = ARM.to_vec();
            let (missing, _) = values.remove(i);
            let message = start(&values).unwrap_err().to_string();
            assert!(message.contains(missing) && !message.contains('\n'), "{message}");
        }
        let message = start(&ARM[..1]).unwrap_err().to_string();
        assert!(
            message.contains("arm.convention, arm.alpha, arm.a, arm.d, limits.joint_velocity"),
            "{message}"
        );
        let mut plant = PlantParameters::store();
        let message = plant.start_with("/puma560", given(&ARM[..7])).unwrap_err().to_string();
        assert!(message.contains("initial_positions") && !message.contains("limits"), "{message}");
    }

    #[test]
    fn without_an_arm_the_built_in_one_serves() {
        let mut store = ServoParameters::store();
        store.start_with("/x", given(&[("limits.joint_velocity", "[1, 1, 1, 1, 1, 1]")])).unwrap();
        let parameters = ServoParameters::from_store(&store).unwrap();
        assert_eq!(parameters.settings.limits.joint_velocity, [1.0; 6]);
    }

    #[test]
    fn simulated_time_is_a_warning_and_not_the_end() {
        let mut store = ServoParameters::store();
        let warnings = store.start_with("/dq_servo", given(&[("use_sim_time", "true")])).unwrap();
        assert_eq!(warnings, ["arm.yaml: use_sim_time: /dq_servo keeps to the system's clocks"]);
        assert_eq!(store.get("use_sim_time"), Some(&Value::Bool(false)));
    }

    #[test]
    fn what_every_node_is_given_is_ignored_with_one_warning_where_it_fits_none() {
        let mut values = given(&[("diffc.gian", "5"), ("nope", "1"), ("command_timeout", "1")]);
        let warnings = ServoParameters::store().start_with("/dq_servo", values.clone()).unwrap();
        let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
        for part in ["arm.yaml", "/dq_servo", "did you mean \"diffc.gain\"?", "\"nope\""] {
            assert!(warning.contains(part), "{warning}");
        }
        assert!(!warning.contains("command_timeout"), "one of another of our nodes");
        values[1].by_name = true;
        let refused = ServoParameters::store().start_with("/dq_servo", values).unwrap_err();
        assert!(refused.to_string().contains("\"nope\""));
    }
}
