//! A node's parameters and their values.

use super::{Declaration, Declarer, Given, ParameterError, Parameters, Value, nearest, shares_namespace};
use dq_common::text::cut;

/// Declared parameters with their values, in the order of declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterStore {
    parameters: Vec<(Declaration, Value)>,
    also_known: Vec<&'static str>,
}

/// How many names of a source are listed in a warning; a file may serve a whole robot.
const LISTED: usize = 4;

impl ParameterStore {
    /// All parameters at their defaults. Overrides for the names `also_known` are passed over: one file serves several
    /// nodes, and each takes its own.
    pub fn new(declarations: Vec<Declaration>, also_known: Vec<&'static str>) -> Self {
        let with_default = |declared: Declaration| (declared.clone(), declared.default);
        Self { parameters: declarations.into_iter().map(with_default).collect(), also_known }
    }

    /// The parameters of `P` at their defaults.
    ///
    /// # Errors
    /// [`ParameterError`] where the defaults do not fit each other.
    pub fn of<P: Parameters>() -> Result<Self, ParameterError> {
        let mut declarer = Declarer::new([]);
        P::declare(&mut declarer)?;
        Ok(Self::new(declarer.into_declarations(), Vec::new()))
    }

    /// The values, typed.
    ///
    /// # Errors
    /// [`ParameterError`] where values do not fit each other.
    pub fn read<P: Parameters>(&self) -> Result<P, ParameterError> {
        P::declare(&mut Declarer::new(self.values()))
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
        let (declared, slot) = self.slot(name)?;
        *slot = declared.check(value)?;
        Ok(())
    }

    /// Takes the values with which `node` (fully qualified) starts, later ones over earlier ones, and returns what to warn of, a line a
    /// source.
    ///
    /// # Errors
    /// What [`override_initial`](Self::override_initial) says of a value.
    pub fn take(&mut self, node: &str, given: Vec<Given>) -> Result<Vec<String>, ParameterError> {
        let mut ignored: Vec<(String, Vec<String>)> = Vec::new();
        for Given { name, value, source, by_name } in given {
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

    /// A copy with all of `changes` made.
    ///
    /// # Errors
    /// The first [`ParameterError`] among them.
    pub fn with(&self, changes: &[(String, Value)]) -> Result<Self, ParameterError> {
        let mut candidate = self.clone();
        for (name, value) in changes {
            let (declared, slot) = candidate.slot(name)?;
            if declared.read_only {
                return Err(ParameterError::ReadOnly(declared.name));
            }
            *slot = declared.check(value.clone())?;
        }
        Ok(candidate)
    }

    /// A parameter's value.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.iter().find(|(declared, _)| declared.name == name).map(|(_, value)| value)
    }

    /// A parameter's declaration.
    pub fn declaration(&self, name: &str) -> Option<&Declaration> {
        self.iter().find(|(declared, _)| declared.name == name).map(|(declared, _)| declared)
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
