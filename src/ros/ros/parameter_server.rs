//! Serves a node's parameters to clients of every vendor.

use super::error::RosError;
use super::node::Node;
use super::topics::Publisher;
use dq_common::text::cut;
use dq_messages::messages::Time;
use dq_messages::*;
use dq_params::{ParameterStore, Value};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A function that puts a complete set of parameters into force; the second argument lists the changes that led to this set. If the
/// function fails, the earlier parameters stay in force, and it returns the reason.
pub type Apply = dyn Fn(&ParameterStore, &[(String, Value)]) -> Result<(), String> + Send + Sync;

/// A node's parameters, served by the six `rcl_interfaces` services and the service that describes types. Every change is checked
/// as a whole before it is applied.
///
/// Like every ROS 2 node, the server announces changes on `/parameter_events`. Late joiners receive none of these announcements.
/// Therefore the server also publishes all parameters, together with the latest changes, on the latched topic `~/parameters`. It
/// does this at the start and after each change.
///
/// Nodes of rclcpp subscribe to `/parameter_events` to follow their own `use_sim_time`. This server does not, because such
/// subscriptions would match all nodes of a domain with each other without any use.
pub struct ParameterServer {
    current: Mutex<Current>,
    apply: Box<Apply>,
    events: Arc<Publisher<ParameterEvent>>,
    states: Publisher<ParameterEvent>,
    node: String,
}

/// The parameters in force.
struct Current {
    store: ParameterStore,
    /// The stamp of the announcement of these parameters.
    stamp: Time,
}

impl ParameterServer {
    /// Serves `store` on `node` until the node is dropped. The values in `store` are already in force; `apply` applies accepted
    /// changes.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn start(
        node: &mut Node,
        contract: &NodeContract,
        store: ParameterStore,
        apply: Box<Apply>,
    ) -> Result<Arc<Self>, RosError> {
        let server = Arc::new(Self {
            current: Mutex::new(Current { store, stamp: Time::now() }),
            apply,
            events: node.parameter_events(),
            states: node.publisher(contract, "~/parameters")?,
            node: node.name().fully_qualified(),
        });
        server.announce_start();
        let at = |server: &Arc<Self>| Arc::clone(server);
        let this = at(&server);
        node.serve::<ListParameters>("~/list_parameters", move |request| list(&this.lock().store, &request))?;
        let this = at(&server);
        node.serve::<GetParameters>("~/get_parameters", move |request| this.get(&request))?;
        let this = at(&server);
        node.serve::<GetParameterTypes>("~/get_parameter_types", move |request| this.types(&request))?;
        let this = at(&server);
        node.serve::<DescribeParameters>("~/describe_parameters", move |request| this.describe(&request))?;
        let this = at(&server);
        node.serve::<SetParameters>("~/set_parameters", move |request| Results {
            results: this.set_each(request.parameters),
        })?;
        let this = at(&server);
        node.serve::<SetParametersAtomically>("~/set_parameters_atomically", move |request| AtomicResult {
            result: this.set(request.parameters),
        })?;
        node.serve::<GetTypeDescription>("~/get_type_description", |request| describe(&request))?;
        Ok(server)
    }

    /// Sets each parameter independently. If there are too many results for a reply, sets none and returns no results.
    fn set_each(&self, parameters: Vec<Parameter>) -> Vec<SetParametersResult> {
        if parameters.len() > MOST_AT_ONCE {
            return Vec::new();
        }
        let mut suggestions = SUGGESTIONS;
        within_room(parameters.into_iter().map(|parameter| {
            if self.lock().store.declaration(&parameter.name).is_none() {
                if suggestions == 0 {
                    let reason = format!("unknown parameter {:?}", cut(&parameter.name));
                    return SetParametersResult { successful: false, reason };
                }
                suggestions -= 1;
            }
            self.set(vec![parameter])
        }))
    }

    fn set(&self, parameters: Vec<Parameter>) -> SetParametersResult {
        match self.try_set(parameters) {
            Ok(()) => SetParametersResult { successful: true, reason: String::new() },
            Err(reason) => SetParametersResult { successful: false, reason: cut(&reason).into_owned() },
        }
    }

    /// Makes all changes, or none of them if one is refused. No other request reads or changes the parameters during the call.
    fn try_set(&self, parameters: Vec<Parameter>) -> Result<(), String> {
        let mut current = self.lock();
        let mut changes = parameters.into_iter().map(change).collect::<Result<Vec<_>, _>>()?;
        let store = current.store.with(&changes).map_err(|why| why.to_string())?;
        changes.retain(|(name, _)| store.declaration(name).is_some_and(|declared| !declared.read_only));
        // Readers of `~/parameters` take a message without changes for the start of a node.
        if changes.is_empty() {
            return Ok(());
        }
        let stamp = current.next_stamp();
        (self.apply)(&store, &changes)?;
        let changed_parameters: Vec<_> = changes.iter().filter_map(|(name, _)| wire(&store, name)).collect();
        *current = Current { store, stamp };
        let event = ParameterEvent { changed_parameters, ..self.event(&current) };
        let state = ParameterEvent { new_parameters: current.all(), ..event.clone() };
        self.events.publish(event);
        self.states.publish(state);
        Ok(())
    }

    /// Announces the initial parameters.
    fn announce_start(&self) {
        let current = self.lock();
        let event = ParameterEvent { new_parameters: current.all(), ..self.event(&current) };
        self.events.publish(event.clone());
        self.states.publish(event);
    }

    fn event(&self, current: &Current) -> ParameterEvent {
        ParameterEvent { stamp: current.stamp.clone(), node: self.node.clone(), ..ParameterEvent::default() }
    }

    /// Returns one value for each name. The value is unset if the name is not declared.
    fn get(&self, request: &Names) -> Values {
        let Current { store, .. } = &*self.lock();
        let value = |name: &String| store.get(name).map(ParameterValue::from).unwrap_or_default();
        Values { values: request.names.iter().map(value).collect() }
    }

    fn types(&self, request: &Names) -> Types {
        let Current { store, .. } = &*self.lock();
        Types { types: request.names.iter().map(|name| store.get(name).map_or(0, kind_of)).collect() }
    }

    fn describe(&self, request: &Names) -> Descriptors {
        let Current { store, .. } = &*self.lock();
        let descriptor = |name: &String| match store.declaration(name) {
            Some(declared) => ParameterDescriptor::from(declared),
            None => ParameterDescriptor { name: name.clone(), ..ParameterDescriptor::default() },
        };
        Descriptors { descriptors: request.names.iter().map(descriptor).collect() }
    }

    fn lock(&self) -> MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Current {
    fn all(&self) -> Vec<Parameter> {
        self.store.iter().map(|(declared, value)| parameter(declared.name, value)).collect()
    }

    /// Returns the stamp for the next set of parameters. This is the current time, if it is later than the previous stamp. Otherwise
    /// it is 1 ns after the previous stamp. So each set of parameters has its own stamp.
    fn next_stamp(&self) -> Time {
        let now = Time::now();
        if now.nanoseconds() > self.stamp.nanoseconds() { now } else { self.stamp.plus_a_nanosecond() }
    }
}

/// The largest number of parameters that one request can set.
const MOST_AT_ONCE: usize = 2000;

/// The largest number of unknown names per request for which a similar name is suggested. Searching for similar names takes longer
/// than the rest of the request.
const SUGGESTIONS: usize = 16;

/// The largest total length of the reasons in one reply \[bytes\]. Clients on Cyclone hang if a reply is longer than 64 kB.
const REASONS: usize = 32_000;

/// Limits the total length of the reasons to [`REASONS`], so that the results fit into a reply. Replaces each reason that would
/// exceed the limit by "…".
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

/// Lists the names below the requested prefixes, to the requested depth, as rclcpp does.
///
/// If the request names no prefix, this function returns no prefixes either. The prefixes would only repeat the beginnings of the
/// names, and the response would not fit into a packet. If the response is still too long, `ListParameters::too_long` later
/// replaces names by prefixes.
fn list(store: &ParameterStore, request: &ListRequest) -> ListResponse {
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
    let names: Vec<_> = store.iter().map(|(declared, _)| declared.name).filter(|name| wanted(name)).collect();
    let of_names = names.iter().filter(|_| !request.prefixes.is_empty());
    let prefixes: BTreeSet<_> = of_names.filter_map(|name| Some(name.rsplit_once('.')?.0)).collect();
    let owned = |name: &str| name.to_owned();
    ListResponse {
        result: ListResult {
            prefixes: prefixes.into_iter().map(owned).collect(),
            names: names.into_iter().map(owned).collect(),
        },
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::{node, outside};
    use crate::dds::large_replies::ONE_PACKET;
    use crate::ros::ParameterClient;
    use crate::ros::endpoints::tests::plant;
    use crate::ros::services::{CYCLONE_HEADER, encode};
    use dq_config::{NodeParameters, PlantParameters, ServoParameters, nodes};
    use dq_messages::messages::ServiceType;
    use std::time::Duration;

    const PATIENCE: Duration = Duration::from_secs(10);

    /// In a secured graph, a reply of more than one packet does not reach the client. The full list of the servo's parameters does
    /// not fit into one packet. So the reply has the prefix `contact` in place of the names of the contact parameters.
    #[test]
    fn the_list_of_every_node_fits_into_one_packet() {
        for (node, declarations) in nodes().unwrap() {
            let store = ParameterStore::new(declarations, Vec::new());
            let size = |response: &ListResponse| encode(&[0; CYCLONE_HEADER], response).unwrap().0.len();
            let whole = list(&store, &ListRequest::default());
            let bytes = size(&whole);
            let sent = match bytes > ONE_PACKET {
                true => ListParameters::too_long(whole.clone(), bytes, ONE_PACKET).unwrap(),
                false => whole.clone(),
            };
            assert!(size(&sent) <= ONE_PACKET, "{node}: {} bytes", size(&sent));
            let expected: &[&str] = if node == ServoParameters::NODE_NAME { &["contact"] } else { &[] };
            assert_eq!(sent.result.prefixes, expected, "{node}");
            let rest = ListRequest { prefixes: sent.result.prefixes, ..ListRequest::default() };
            let rest = if rest.prefixes.is_empty() { Vec::new() } else { list(&store, &rest).result.names };
            let all: BTreeSet<_> = sent.result.names.into_iter().chain(rest).collect();
            assert_eq!(all, whole.result.names.into_iter().collect(), "{node}: a client finds every name");
            let limits = ListRequest { prefixes: vec!["limits".to_owned()], ..ListRequest::default() };
            let ListResult { names, prefixes } = list(&store, &limits).result;
            assert!(names.is_empty() || prefixes == ["limits"], "{node}: {prefixes:?}");
        }
    }

    /// On `~/parameters`, an event without changes means that the node has started. So a request that changes nothing must not
    /// publish such an event: a plot would begin again.
    #[tokio::test(flavor = "multi_thread")]
    async fn a_request_that_changes_nothing_is_not_announced() {
        if outside("ros::parameter_server::tests::a_request_that_changes_nothing_is_not_announced") {
            return;
        }
        let ((_one, mut server), (_other, mut user)) = (node("puma560"), node("user"));
        let contract = plant();
        let (store, _) = PlantParameters::start("/puma560", Vec::new()).unwrap();
        ParameterServer::start(&mut server, &contract, store, Box::new(|_, _| Ok(()))).unwrap();
        let entry = contract.topic::<ParameterEvent>("~/parameters", Direction::Out).unwrap();
        let states = user.subscription_as::<ParameterEvent>(entry, "/puma560/parameters").unwrap();
        assert!(states.next().await.changed_parameters.is_empty(), "the start");
        let mut client = ParameterClient::new(&mut user, "/puma560", PATIENCE);
        assert_eq!(client.set_all(&[]).await.unwrap(), Ok(()));
        let change = [("state_latency".to_owned(), Value::Double(0.01))];
        assert_eq!(client.set_all(&change).await.unwrap(), Ok(()));
        let next = tokio::time::timeout(PATIENCE, states.next()).await.unwrap();
        assert_eq!(next.changed_parameters.len(), 1, "{:?}", next.stamp);
    }

    /// `ros2 param get` and `set` can request several names in one call. GetParameters.srv promises one value per name, in order. The
    /// server must not search for a similar name for each unknown name: for 5000 names, that took two seconds per request.
    #[tokio::test(flavor = "multi_thread")]
    async fn thousands_of_unknown_names_are_answered_and_delay_no_other_client() {
        if outside(
            "ros::parameter_server::tests::thousands_of_unknown_names_are_answered_and_delay_no_other_client",
        ) {
            return;
        }
        let ((_one, mut server), (_other, mut user)) = (node("puma560"), node("user"));
        let (store, _) = PlantParameters::start("/puma560", Vec::new()).unwrap();
        ParameterServer::start(&mut server, &plant(), store, Box::new(|_, _| Ok(()))).unwrap();
        let set = user.client::<SetParameters>("/puma560/set_parameters", PATIENCE).await.unwrap();
        let began = std::time::Instant::now();
        for count in [2000, 2000, 2000, 5000, 5000, 2000, 2000, 2000] {
            let name = |i| format!("state_latencies_of_a_robot_{i}");
            let parameters = (0..count).map(|i| parameter(&name(i), &Value::Double(0.5))).collect();
            let results = set.call(Changes { parameters }).await.unwrap().results;
            assert_eq!(results.len(), if count > MOST_AT_ONCE { 0 } else { count });
            assert!(results.iter().all(|result| !result.successful), "{results:?}");
        }
        assert!(began.elapsed() < std::time::Duration::from_secs(8), "{:?}", began.elapsed());
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn several_names_in_one_call_have_an_answer_each() {
        if outside("ros::parameter_server::tests::several_names_in_one_call_have_an_answer_each") {
            return;
        }
        let ((_one, mut server), (_other, mut user)) = (node("puma560"), node("user"));
        let (store, _) = PlantParameters::start("/puma560", Vec::new()).unwrap();
        ParameterServer::start(&mut server, &plant(), store, Box::new(|_, _| Ok(()))).unwrap();
        let names = ["state_latency", "nothing", "frame_prefix", "state_rate"].map(str::to_owned).to_vec();

        let set = user.client::<SetParameters>("/puma560/set_parameters", PATIENCE).await.unwrap();
        let parameters = names.iter().map(|name| parameter(name, &Value::Double(0.5))).collect();
        let results = set.call(Changes { parameters }).await.unwrap().results;
        let successful: Vec<_> = results.iter().map(|result| result.successful).collect();
        assert_eq!(successful, [true, false, false, true]);
        assert!(results[1].reason.contains("unknown parameter \"nothing\""), "{results:?}");
        assert!(results[2].reason.contains("frame_prefix"), "{results:?}");

        let get = user.client::<GetParameters>("/puma560/get_parameters", PATIENCE).await.unwrap();
        let values = get.call(Names { names: names.clone() }).await.unwrap().values;
        let values: Vec<_> = values.into_iter().map(ParameterValue::into_value).collect();
        let half = Some(Value::Double(0.5));
        assert_eq!(values, [half.clone(), None, Some(Value::String(String::new())), half]);

        let atomic = "/puma560/set_parameters_atomically";
        let atomic = user.client::<SetParametersAtomically>(atomic, PATIENCE).await.unwrap();
        let parameters = names.iter().map(|name| parameter(name, &Value::Double(0.25))).collect();
        assert!(!atomic.call(Changes { parameters }).await.unwrap().result.successful);
        let values = get.call(Names { names: names[..1].to_vec() }).await.unwrap().values;
        assert_eq!(values[0].double_value, 0.5, "nothing of it was set");
    }
}
