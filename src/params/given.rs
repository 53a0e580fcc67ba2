//! The values with which a node starts.

use super::{ParameterError, ParameterStore, Value, shares_namespace};

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
    /// does not, as ROS 2 ignores it, unless it is in a namespace of our parameters: no other node's is.
    pub by_name: bool,
}

impl ParameterStore {
    /// Takes the values with which `node` (fully qualified) starts, later ones over earlier ones, and returns what to warn of.
    ///
    /// # Errors
    /// What [`override_initial`](Self::override_initial) says of a value.
    pub fn take(&mut self, node: &str, given: Vec<Given>) -> Result<Vec<String>, ParameterError> {
        let mut ignored = Ignored::default();
        for Given { name, value, source, by_name } in given {
            match self.override_initial(&name, value) {
                Err(ParameterError::Unknown { nearest, .. })
                    if !by_name && !shares_namespace(&name, self.known()) =>
                {
                    ignored.add(source, name, nearest);
                }
                other => other?,
            }
        }
        Ok(ignored.warnings(node))
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
