//! A node, which creates publishers, subscriptions, services and clients.

use super::client::{Client, Connection, find_server};
use super::endpoint_names::{EndpointNames, Origin};
use super::endpoints::{self, Domain, Endpoints, Plan};
use super::error::RosError;
use super::graph::{self, GraphTopic, NameWatch};
use super::log::{Logger, Logging};
use super::names::NodeName;
use super::resolver::Resolver;
use super::services::Service;
use super::topics::{OwnTopic, Publisher, Subscription};
use crate::dds::raw_subscription::{self, RawSubscription};
use dq_messages::messages::{Message, ServiceType};
use dq_messages::{Direction, NodeContract, ParameterEvent, ReliabilityKind, TopicContract};
use ros2_client::{Context, NodeOptions, ServiceMapping};
use rustdds::{QosPolicies, RTPSEntity};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;
use tokio::task::JoinSet;

/// A ROS 2 node. The node's services end when the node is dropped.
pub struct Node {
    names: Resolver,
    log: Logger,
    tasks: JoinSet<()>,
    /// The clients that this node has created, by service name.
    clients: HashMap<String, Arc<Connection>>,
    endpoints: Arc<Endpoints>,
    parameter_events: Arc<Publisher<ParameterEvent>>,
}

impl Node {
    pub(super) fn new(
        context: &Context,
        domain: Domain,
        names: Resolver,
        logging: Logging,
    ) -> Result<Self, RosError> {
        let name = names.node().clone();
        let error = RosError::create(format!("the node {}", name.fully_qualified()));
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = match ros2_client::NodeName::new(name.namespace(), name.name()) {
            Ok(name) => context.new_node(name, options).map_err(|why| error(&why))?,
            Err(why) => return Err(error(&why)),
        };
        let endpoints = Arc::new(Endpoints::new(node, domain));
        let logging = Logging { level: names.log_level().unwrap_or(logging.level), ..logging };
        let log = Logger::new(&names.logger(), logging);
        // As in rclcpp, every node has this publisher. It must be the first endpoint. ros2-client has just created a latched
        // publisher on the same topic, and if rosbag2 found only the latched one, it would subscribe to latched messages.
        let (topic, qos) = ("/parameter_events".to_owned(), endpoints::of_parameter_events());
        let plan = Plan { name: topic, message: ParameterEvent::TYPE.to_owned(), qos, log: log.clone() };
        let parameter_events = Arc::new(Publisher::new(&endpoints, &plan)?);
        let (tasks, clients) = (JoinSet::new(), HashMap::new());
        let mut node = Self { names, log, tasks, clients, endpoints, parameter_events };
        if logging.rosout {
            let rosout = node.publisher_with("/rosout", endpoints::of_rosout())?;
            node.log = node.log.clone().with_rosout(move |line| rosout.publish(line));
        }
        Ok(node)
    }

    /// Returns the node's name.
    pub fn name(&self) -> &NodeName {
        self.names.node()
    }

    /// Returns the data that the nodes of this participant share.
    pub(super) fn domain(&self) -> &Domain {
        &self.endpoints.domain
    }

    /// Returns the publisher of the changes of the node's parameters.
    pub(super) fn parameter_events(&self) -> Arc<Publisher<ParameterEvent>> {
        self.parameter_events.clone()
    }

    /// Returns the node's log.
    pub fn log(&self) -> &Logger {
        &self.log
    }

    /// Creates a publisher on a topic of the contract.
    ///
    /// # Errors
    /// [`RosError`] if the contract lacks the topic, if a name is invalid, or if DDS refuses.
    pub fn publisher<M: Message>(
        &mut self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<Publisher<M>, RosError> {
        self.publisher_as(contract.topic::<M>(topic, Direction::Out)?, topic)
    }

    /// Creates a publisher on `topic` with the type and QoS of `entry`, even if `entry` describes a subscription. So a program can
    /// publish to a node whose contract contains `entry`.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn publisher_as<M: Message>(
        &mut self,
        entry: &TopicContract,
        topic: &str,
    ) -> Result<Publisher<M>, RosError> {
        let entry = TopicContract { direction: Direction::Out, ..entry.clone() };
        self.publisher_with(topic, endpoints::of(&entry))
    }

    /// Creates a publisher on a topic of the contract, for messages that soon become obsolete: see [`Publisher::publish_in_time`].
    /// ros2-client does not announce this publisher as an endpoint of the node.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn publisher_in_time<M: Message>(
        &mut self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<Publisher<M>, RosError> {
        let qos = endpoints::of(contract.topic::<M>(topic, Direction::Out)?);
        Publisher::in_time(&self.endpoints, &self.plan::<M>(topic, qos)?)
    }

    /// Creates a publisher on `topic` with this QoS.
    pub(super) fn publisher_with<M: Message>(
        &mut self,
        topic: &str,
        qos: QosPolicies,
    ) -> Result<Publisher<M>, RosError> {
        Publisher::new(&self.endpoints, &self.plan::<M>(topic, qos)?)
    }

    /// Creates a subscription to a topic of the contract.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn subscription<M: Message>(
        &mut self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<Subscription<M>, RosError> {
        self.subscription_as(contract.topic::<M>(topic, Direction::In)?, topic)
    }

    /// Creates a subscription to a topic of the contract. The subscription starts as reliable. Once a best-effort publisher
    /// appears, the subscription becomes best effort too. Then it receives from both kinds of publishers.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn adapting_subscription<M: Message>(
        &mut self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<Subscription<M>, RosError> {
        let entry = contract.topic::<M>(topic, Direction::In)?.clone();
        let plan = self.plan::<M>(topic, endpoints::of(&entry))?;
        let (subscription, replacement) = Subscription::replaceable(&self.endpoints, &plan)?;
        let entry = TopicContract { reliability: ReliabilityKind::BestEffort, ..entry };
        let plan = Plan { qos: endpoints::of(&entry), ..plan };
        let (endpoints, matches) = (Arc::downgrade(&self.endpoints), self.domain().matches.clone());
        let ours = subscription.guid();
        matches.adapt(ours);
        self.run(async move {
            let publisher = matches.best_effort_publisher(ours).await;
            let Some(endpoints) = endpoints.upgrade() else { return };
            let Plan { name, log, .. } = &plan;
            match replacement.take_place(&endpoints, &plan) {
                Ok(()) => {
                    matches.forget_ours(ours);
                    log.info(&format!(
                        "{name}: {publisher} publishes BEST_EFFORT only, so this node subscribes BEST_EFFORT"
                    ));
                }
                Err(why) => log.error(&format!("{name}: {publisher} publishes BEST_EFFORT only: {why}")),
            }
        });
        Ok(subscription)
    }

    /// Creates a subscription to `topic` with the type and QoS of `entry`, even if `entry` describes a publisher. So a program can
    /// receive from a node whose contract contains `entry`.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn subscription_as<M: Message>(
        &mut self,
        entry: &TopicContract,
        topic: &str,
    ) -> Result<Subscription<M>, RosError> {
        let entry = TopicContract { direction: Direction::In, ..entry.clone() };
        self.subscription_with(topic, endpoints::of(&entry))
    }

    /// Returns an [`OwnTopic`] for a topic to which the node subscribes. With it, the caller can create a publisher on the topic
    /// later.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn own_input<M: Message>(
        &self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<OwnTopic<M>, RosError> {
        let qos = endpoints::of_publisher_to_input(contract.topic::<M>(topic, Direction::In)?);
        Ok(OwnTopic::new(Arc::downgrade(&self.endpoints), self.plan::<M>(topic, qos)?))
    }

    /// Returns an [`OwnTopic`] for a topic on which the node publishes. With it, the caller can subscribe to the topic later.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn own_topic<M: Message>(
        &self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<OwnTopic<M>, RosError> {
        let entry = contract.topic::<M>(topic, Direction::Out)?.clone();
        let qos = endpoints::of(&TopicContract { direction: Direction::In, ..entry });
        Ok(OwnTopic::new(Arc::downgrade(&self.endpoints), self.plan::<M>(topic, qos)?))
    }

    /// Creates a subscription to `topic` with this QoS.
    pub(super) fn subscription_with<M: Message>(
        &mut self,
        topic: &str,
        qos: QosPolicies,
    ) -> Result<Subscription<M>, RosError> {
        Subscription::new(&self.endpoints, &self.plan::<M>(topic, qos)?)
    }

    /// Returns the topics of all other participants by their fully qualified names.
    pub fn graph(&self) -> BTreeMap<String, GraphTopic> {
        graph::topics(&self.domain().dds)
    }

    /// Returns the map from endpoints in the domain to the names of their nodes.
    pub fn endpoint_names(&self) -> &EndpointNames {
        &self.domain().names
    }

    /// Returns the services of other participants by their fully qualified names.
    pub fn services(&self) -> BTreeSet<String> {
        graph::services(&self.domain().dds)
    }

    /// Watches for other nodes with the fully qualified name `name`. `name` may be the name of this node.
    pub fn watch_name(&self, name: &str) -> NameWatch {
        let (participant, own) = (self.domain().dds.guid(), self.name().fully_qualified());
        NameWatch::new(self.domain().matches.clone(), participant, name, own == name)
    }

    /// Waits up to 50 ms for a change among the other participants.
    pub async fn graph_change(&self) {
        self.domain().matches.change().await;
    }

    /// Creates a subscription to the topic with this fully qualified name and this type.
    ///
    /// # Errors
    /// [`RosError::Create`].
    pub fn raw_subscription(
        &mut self,
        name: &str,
        message: &str,
        reliable: bool,
        transient_local: bool,
    ) -> Result<RawSubscription, RosError> {
        let qos = move |samples| raw_subscription::qos(reliable, transient_local, samples);
        let (name, message) = (name.to_owned(), message.to_owned());
        let plan = Plan { name, message, qos: qos(None), log: self.log.clone() };
        let (endpoints, wider) = (Arc::downgrade(&self.endpoints), plan.clone());
        // RustDDS obeys the largest of a topic's descriptions, so a further description raises the number of stored samples.
        let keep = move |samples| {
            let more = Plan { qos: qos(Some(samples)), ..wider.clone() };
            let _ = endpoints.upgrade().map(|endpoints| endpoints.topic(&more));
        };
        self.endpoints.raw_subscription(&plan, keep)
    }

    /// Serves `service` with `handler` until the node is dropped.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn serve<S: ServiceType>(
        &mut self,
        service: &str,
        mut handler: impl FnMut(S::Request) -> S::Response + Send + 'static,
    ) -> Result<(), RosError> {
        self.serve_later::<S, _>(service, move |request| std::future::ready(handler(request)))
    }

    /// Serves `service` with an asynchronous `handler` until the node is dropped. The node calls the handler in the order of the
    /// requests. An answer does not wait for earlier answers.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn serve_later<S: ServiceType, F: Future<Output = S::Response> + Send + 'static>(
        &mut self,
        service: &str,
        mut handler: impl FnMut(S::Request) -> F + Send + 'static,
    ) -> Result<(), RosError> {
        self.serve_timed::<S, F>(service, move |request, _| handler(request))
    }

    /// Serves `service` as [`serve_later`](Self::serve_later) does. `handler` also gets the sender and the time of the request.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn serve_timed<S: ServiceType, F: Future<Output = S::Response> + Send + 'static>(
        &mut self,
        service: &str,
        handler: impl FnMut(S::Request, &Origin) -> F + Send + 'static,
    ) -> Result<(), RosError> {
        let name = self.names.service(service)?;
        let (requests, replies) = self.endpoints.server::<S>(&name)?;
        let (matches, log) = (self.domain().matches.clone(), self.log.clone());
        let service = Service { name, requests, replies, matches, log };
        self.run(service.serve::<S, F>(handler));
        Ok(())
    }

    /// Waits for a server of `service`, and creates a client of the service.
    ///
    /// # Errors
    /// [`RosError`]; [`RosError::Service`] if no server appears within `patience`.
    pub async fn client<S: ServiceType>(
        &mut self,
        service: &str,
        patience: std::time::Duration,
    ) -> Result<Client<S>, RosError> {
        let name = self.names.service(service)?;
        let server = find_server(&self.domain().dds, &name, patience).await?;
        let connection = self.connection::<S>(&name, server.mapping)?;
        Client::connect(connection, name, server, &self.domain().matches, patience).await
    }

    /// Returns this node's client of a service. Creates the client if there is none for `mapping` yet.
    fn connection<S: ServiceType>(
        &mut self,
        name: &str,
        mapping: ServiceMapping,
    ) -> Result<Arc<Connection>, RosError> {
        if let Some(kept) = self.clients.get(name).filter(|kept| kept.speaks(mapping)) {
            return Ok(kept.clone());
        }
        let connection = Connection::new(self.endpoints.client::<S>(name, mapping)?, mapping);
        self.clients.insert(name.to_owned(), connection.clone());
        Ok(connection)
    }

    /// Returns the description of an endpoint to create on this node: its full topic name, message type, QoS and log.
    fn plan<M: Message>(&self, topic: &str, qos: QosPolicies) -> Result<Plan, RosError> {
        let (name, message) = (self.names.topic(topic)?, M::TYPE.to_owned());
        Ok(Plan { name, message, qos, log: self.log.clone() })
    }

    /// Runs `task` until the node is dropped.
    pub fn run(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        self.tasks.spawn(task);
    }
}
