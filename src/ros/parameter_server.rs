//! A node's parameters, served to every vendor's clients.

use super::error::RosError;
use super::node::Node;
use super::topics::Publisher;
use crate::params::{ParameterError, ParameterStore, Value};
use crate::text::cut;
use crate::wire::messages::Time;
use crate::wire::*;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Takes a whole set of parameters into force, or says why not.
pub type Apply = dyn Fn(&ParameterStore) -> Result<(), ParameterError> + Send + Sync;

/// A node's parameters behind the six `rcl_interfaces` services. Every change is checked as a whole before it takes effect.
pub struct ParameterServer {
    store: Mutex<ParameterStore>,
    apply: Box<Apply>,
    events: Publisher<ParameterEvent>,
    node: String,
}

impl ParameterServer {
    /// Serves `store` on `node` until the node is dropped; `apply` takes accepted changes into force.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn start(node: &mut Node, store: ParameterStore, apply: Box<Apply>) -> Result<(), RosError> {
        let events = node.parameter_events()?;
        let server =
            Arc::new(Self { store: Mutex::new(store), apply, events, node: node.name().fully_qualified() });
        server.announce();
        let at = |server: &Arc<Self>| Arc::clone(server);
        let this = at(&server);
        node.serve::<ListParameters>("~/list_parameters", move |request| this.list(&request))?;
        let this = at(&server);
        node.serve::<GetParameters>("~/get_parameters", move |request| this.get(&request))?;
        let this = at(&server);
        node.serve::<GetParameterTypes>("~/get_parameter_types", move |request| this.types(&request))?;
        let this = at(&server);
        node.serve::<DescribeParameters>("~/describe_parameters", move |request| this.describe(&request))?;
        let this = at(&server);
        node.serve::<SetParameters>("~/set_parameters", move |request| Results {
            results: within_room(request.parameters.into_iter().map(|parameter| this.set(vec![parameter]))),
        })?;
        node.serve::<SetParametersAtomically>("~/set_parameters_atomically", move |request| AtomicResult {
            result: server.set(request.parameters),
        })
    }

    fn set(&self, parameters: Vec<Parameter>) -> SetParametersResult {
        match self.try_set(parameters) {
            Ok(()) => SetParametersResult { successful: true, reason: String::new() },
            Err(reason) => SetParametersResult { successful: false, reason: cut(&reason).into_owned() },
        }
    }

    /// All of the changes or none. Nobody else changes the store meanwhile.
    fn try_set(&self, parameters: Vec<Parameter>) -> Result<(), String> {
        let mut store = self.lock();
        let changes = parameters.into_iter().map(change).collect::<Result<Vec<_>, _>>()?;
        let candidate = store.with(&changes).map_err(|why| why.to_string())?;
        (self.apply)(&candidate).map_err(|why| why.to_string())?;
        let changed = changes.iter().filter_map(|(name, _)| wire(&candidate, name)).collect();
        *store = candidate;
        self.events.publish(ParameterEvent { changed_parameters: changed, ..self.event() });
        Ok(())
    }

    /// Announces what the node starts with.
    fn announce(&self) {
        let all = self.lock().iter().map(|(declared, value)| parameter(declared.name, value)).collect();
        self.events.publish(ParameterEvent { new_parameters: all, ..self.event() });
    }

    fn event(&self) -> ParameterEvent {
        ParameterEvent { stamp: Time::now(), node: self.node.clone(), ..ParameterEvent::default() }
    }

    /// Names below the prefixes, to the depth asked for, as rclcpp lists them.
    fn list(&self, request: &ListRequest) -> ListResponse {
        let depth = usize::try_from(request.depth).unwrap_or(usize::MAX);
        let deep_enough = |rest: &str| depth == 0 || rest.matches('.').count() < depth;
        let wanted = |name: &str| {
            let below = |prefix: &String| match name.strip_prefix(prefix.as_str()) {
                Some("") => true,
                Some(rest) => rest.strip_prefix('.').is_some_and(deep_enough),
                None => false,
            };
            if request.prefixes.is_empty() { deep_enough(name) } else { request.prefixes.iter().any(below) }
        };
        let store = self.lock();
        let names: Vec<_> =
            store.iter().map(|(declared, _)| declared.name).filter(|name| wanted(name)).collect();
        let prefixes: BTreeSet<_> = names.iter().filter_map(|name| Some(name.rsplit_once('.')?.0)).collect();
        let owned = |name: &str| name.to_owned();
        ListResponse {
            result: ListResult {
                prefixes: prefixes.into_iter().map(owned).collect(),
                names: names.into_iter().map(owned).collect(),
            },
        }
    }

    /// A name that is not declared has a value that is not set.
    fn get(&self, request: &Names) -> Values {
        let store = self.lock();
        let value = |name: &String| store.get(name).map(ParameterValue::from).unwrap_or_default();
        Values { values: request.names.iter().map(value).collect() }
    }

    fn types(&self, request: &Names) -> Types {
        let store = self.lock();
        Types { types: request.names.iter().map(|name| store.get(name).map_or(0, kind_of)).collect() }
    }

    fn describe(&self, request: &Names) -> Descriptors {
        let store = self.lock();
        let descriptor = |name: &String| match store.declaration(name) {
            Some(declared) => ParameterDescriptor::from(declared),
            None => ParameterDescriptor { name: name.clone(), ..ParameterDescriptor::default() },
        };
        Descriptors { descriptors: request.names.iter().map(descriptor).collect() }
    }

    fn lock(&self) -> MutexGuard<'_, ParameterStore> {
        self.store.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// All reasons in one reply together are no longer than this [bytes]: Cyclone's clients hang at a reply of more than 64 kB.
const REASONS: usize = 32_000;

/// The results, with "…" for the reasons that find no room any more.
fn within_room(results: impl Iterator<Item = SetParametersResult>) -> Vec<SetParametersResult> {
    let mut room = REASONS;
    results
        .map(|result| match room.checked_sub(result.reason.len()) {
            Some(left) => {
                room = left;
                result
            }
            None => SetParametersResult { reason: "…".to_owned(), ..result },
        })
        .collect()
}

fn change(parameter: Parameter) -> Result<(String, Value), String> {
    match parameter.value.into_value() {
        Some(value) => Ok((parameter.name, value)),
        None => Err(format!("parameter {:?} cannot be deleted", parameter.name)),
    }
}

fn parameter(name: &str, value: &Value) -> Parameter {
    Parameter { name: name.to_owned(), value: value.into() }
}

fn wire(store: &ParameterStore, name: &str) -> Option<Parameter> {
    store.get(name).map(|value| parameter(name, value))
}
