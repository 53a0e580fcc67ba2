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

    /// Each parameter's name and value.
    pub fn values(&self) -> impl Iterator<Item = (String, Value)> {
        self.iter().map(|(declared, value)| (declared.name.to_owned(), value.clone()))
    }

    /// All declarations with their values, in the order of declaration.
    pub fn iter(&self) -> impl Iterator<Item = (&Declaration, &Value)> {
        self.parameters.iter().map(|(declared, value)| (declared, value))
    }

    /// The names of all parameters that this node or another one of the program has.
    pub(super) fn known(&self) -> impl Iterator<Item = &'static str> {
        self.parameters.iter().map(|(declared, _)| declared.name).chain(self.also_known.iter().copied())
    }

    fn slot(&mut self, name: &str) -> Result<&mut (Declaration, Value), ParameterError> {
        let nearest = nearest(name, self.known());
        self.parameters
            .iter_mut()
            .find(|(declared, _)| declared.name == name)
            .ok_or_else(|| ParameterError::Unknown { name: name.to_owned(), nearest })
    }
}
