//! The parameters of a node and their values.

use super::{
    Declaration, Declarer, ParameterError, ParameterOverride, Parameters, Value, nearest, shares_namespace,
};
use dq_common::text::cut;

/// The declared parameters with their values, in the order of declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterStore {
    parameters: Vec<(Declaration, Value)>,
    also_known: Vec<&'static str>,
}

/// The largest number of unknown names that a warning lists. The parameter file of a whole robot may contain many more.
const LISTED: usize = 4;

impl ParameterStore {
    /// Creates a store in which all parameters have their defaults. The store ignores values for the names `also_known`: one file
    /// may have the values of several nodes, and each node takes only its own values.
    pub fn new(declarations: Vec<Declaration>, also_known: Vec<&'static str>) -> Self {
        let with_default = |declared: Declaration| (declared.clone(), declared.default);
        Self { parameters: declarations.into_iter().map(with_default).collect(), also_known }
    }

    /// Creates a store in which the parameters of `P` have their defaults.
    ///
    /// # Errors
    /// [`ParameterError`] if the defaults contradict each other.
    pub fn of<P: Parameters>() -> Result<Self, ParameterError> {
        let mut declarer = Declarer::new([]);
        P::declare(&mut declarer)?;
        Ok(Self::new(declarer.into_declarations(), Vec::new()))
    }

    /// Reads the values into a struct of parameters.
    ///
    /// # Errors
    /// [`ParameterError`] if values contradict each other.
    pub fn read<P: Parameters>(&self) -> Result<P, ParameterError> {
        P::declare(&mut Declarer::new(self.values()))
    }

    /// Sets a value before the node starts. Only this method can set a read-only parameter. Ignores the names `also_known` that were
    /// given to [`new`](Self::new), and names that ROS 2 itself gives to every node, such as `qos_overrides.…`.
    ///
    /// # Errors
    /// [`ParameterError`] if the value does not fit or the name is unknown. ROS 2 itself ignores unknown names, and so hides typing
    /// errors.
    pub fn override_initial(&mut self, name: &str, value: Value) -> Result<(), ParameterError> {
        let ignored = self.also_known.contains(&name)
            || name.starts_with("qos_overrides.")
            || name == "start_type_description_service";
        if ignored && self.get(name).is_none() {
            return Ok(());
        }
        let (declared, slot) = self.slot(name)?;
        *slot = declared.check(value)?;
        Ok(())
    }

    /// Sets the values with which the node with the full name `node` starts. Later values override earlier values. Returns the
    /// warnings to print, one line per source.
    ///
    /// # Errors
    /// The first error of [`override_initial`](Self::override_initial).
    pub fn take(&mut self, node: &str, given: Vec<ParameterOverride>) -> Result<Vec<String>, ParameterError> {
        let mut ignored: Vec<(String, Vec<String>)> = Vec::new();
        for ParameterOverride { name, value, source, by_name } in given {
            match self.override_initial(&name, value) {
                Err(ParameterError::Unknown { nearest, .. })
                    if !by_name && !shares_namespace(&name, self.known()) =>
                {
                    let hint = nearest.map(|near| format!(" (did you mean {near:?}?)")).unwrap_or_default();
                    let text = format!("{name:?}{hint}");
                    match ignored.iter_mut().find(|(file, _)| *file == source) {
                        Some((_, names)) => names.push(text),
                        None => ignored.push((source, vec![text])),
                    }
                }
                other => other?,
            }
        }
        let warning = |(source, names): (String, Vec<String>)| {
            let more = names.len().saturating_sub(LISTED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let listed = names[..names.len().min(LISTED)].join(", ");
            format!("{source}: {node} has no parameter {listed}{more}: ignored")
        };
        Ok(ignored.into_iter().map(warning).collect())
    }

    /// Returns a copy of the store with all `changes`. A change may set a read-only parameter to its present value. So a node accepts
    /// the file that `ros2 param dump` wrote for it.
    ///
    /// # Errors
    /// The first [`ParameterError`] among the changes.
    pub fn with(&self, changes: &[(String, Value)]) -> Result<Self, ParameterError> {
        let mut candidate = self.clone();
        for (name, value) in changes {
            let (declared, slot) = candidate.slot(name)?;
            let value = declared.check(value.clone());
            if declared.read_only && !value.as_ref().is_ok_and(|value| value == slot) {
                return Err(ParameterError::ReadOnly(declared.name));
            }
            *slot = value?;
        }
        Ok(candidate)
    }

    /// Returns the value of a parameter; `None` if no parameter has this name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.iter().find(|(declared, _)| declared.name == name).map(|(_, value)| value)
    }

    /// Returns the declaration of a parameter; `None` if no parameter has this name.
    pub fn declaration(&self, name: &str) -> Option<&Declaration> {
        self.iter().find(|(declared, _)| declared.name == name).map(|(declared, _)| declared)
    }

    /// Yields the name and the value of each parameter.
    pub fn values(&self) -> impl Iterator<Item = (String, Value)> {
        self.iter().map(|(declared, value)| (declared.name.to_owned(), value.clone()))
    }

    /// Yields all declarations with their values, in the order of declaration.
    pub fn iter(&self) -> impl Iterator<Item = (&Declaration, &Value)> {
        self.parameters.iter().map(|(declared, value)| (declared, value))
    }

    /// Yields the names of this node's parameters, and the names `also_known` of other nodes.
    fn known(&self) -> impl Iterator<Item = &'static str> {
        self.parameters.iter().map(|(declared, _)| declared.name).chain(self.also_known.iter().copied())
    }

    fn slot(&mut self, name: &str) -> Result<(&Declaration, &mut Value), ParameterError> {
        match self.parameters.iter().position(|(declared, _)| declared.name == name) {
            Some(place) => {
                let (declared, value) = &mut self.parameters[place];
                Ok((declared, value))
            }
            None => Err(ParameterError::Unknown {
                name: cut(name).into_owned(),
                nearest: nearest(name, self.known()),
            }),
        }
    }
}
