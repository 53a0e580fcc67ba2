//! A node: makes publishers, subscriptions, services and clients under its names.

use super::client::{Client, Connection};
use super::discovery::{self, GraphTopic};
use super::error::RosError;
use super::graph::EndpointNames;
use super::log::{LogLevel, Logger};
use super::matches::Matches;
use super::names::{NodeName, Resolver};
use super::namesakes::NameWatch;
use super::qos;
use super::raw::{self, RawSubscription};
use super::service::{self, ReplyReaders};
use super::topics::{Publisher, Subscription};
use crate::wire::messages::{Message, ServiceType};
use crate::wire::{Direction, DurabilityKind, NodeContract, ReliabilityKind, TopicContract};
use ros2_client::{Context, Name, NodeOptions, ServiceMapping, ServiceTypeName};
use rustdds::{QosPolicies, RTPSEntity, TopicKind};
use std::any::Any;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;
use tokio::task::JoinHandle;

/// A ROS 2 node. Its services end when it is dropped.
pub struct Node {
    inner: ros2_client::Node,
    context: Context,
    matches: Matches,
    names: Resolver,
    log: Logger,
    tasks: Vec<JoinHandle<()>>,
    /// A `Connection<S>` for each service that was called.
    clients: HashMap<String, Arc<dyn Any + Send + Sync>>,
}

impl Node {
    pub(super) fn new(
        context: Context,
        matches: Matches,
        names: Resolver,
        level: LogLevel,
    ) -> Result<Self, RosError> {
        let name = names.node().clone();
        let error = RosError::create(format!("the node {}", name.fully_qualified()));
        let wire_name = ros2_client::NodeName::new(name.namespace(), name.name());
        let options = NodeOptions::new().enable_rosout(true).start_parameter_services(false);
        let inner = match wire_name {
            Ok(wire_name) => context.new_node(wire_name, options).map_err(|why| error(&why))?,
            Err(why) => return Err(error(&why)),
        };
        let log = Logger::with_rosout(&log_name(&name), level, inner.logging_handle());
        let mut node =
            Self { inner, context, matches, names, log, tasks: Vec::new(), clients: HashMap::new() };
        node.follow_names()?;
        Ok(node)
    }

    /// The node's name.
    pub fn name(&self) -> &NodeName {
        self.names.node()
    }

    /// The node's log.
    pub fn log(&self) -> &Logger {
        &self.log
    }

    /// A publisher on a topic of the contract.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn publisher<M: Message>(
        &mut self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<Publisher<M>, RosError> {
        let entry = contract.topic::<M>(topic, Direction::Out)?.clone();
        self.publisher_as(&entry, topic)
    }

    /// A publisher on `topic` with the type and QoS of `entry`, whichever direction that has: for those who talk to a node.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn publisher_as<M: Message>(
        &mut self,
        entry: &TopicContract,
        topic: &str,
    ) -> Result<Publisher<M>, RosError> {
        let name = self.names.topic(topic)?;
        let entry = TopicContract { direction: Direction::Out, ..entry.clone() };
        let dds_topic = self.dds_topic::<M>(&name, &qos::of(&entry))?;
        let inner = self
            .inner
            .create_publisher(&dds_topic, None)
            .map_err(|why| RosError::create(name.as_str())(&why))?;
        self.matches.register(inner.guid(), &name, &self.log);
        Ok(Publisher::new(inner, name, self.matches.clone()))
    }

    /// A subscription to a topic of the contract.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn subscription<M: Message>(
        &mut self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<Subscription<M>, RosError> {
        let entry = contract.topic::<M>(topic, Direction::In)?.clone();
        self.subscription_as(&entry, topic)
    }

    /// A subscription to `topic` with the type and QoS of `entry`, whichever direction that has.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn subscription_as<M: Message>(
        &mut self,
        entry: &TopicContract,
        topic: &str,
    ) -> Result<Subscription<M>, RosError> {
        let name = self.names.topic(topic)?;
        let entry = TopicContract { direction: Direction::In, ..entry.clone() };
        let dds_topic = self.dds_topic::<M>(&name, &qos::of(&entry))?;
        let inner = self
            .inner
            .create_subscription(&dds_topic, None)
            .map_err(|why| RosError::create(name.as_str())(&why))?;
        self.matches.register(inner.guid(), &name, &self.log);
        Ok(Subscription::new(inner, name, self.matches.clone()))
    }

    /// The topics of all other participants, by their fully qualified names.
    pub fn graph(&self) -> BTreeMap<String, GraphTopic> {
        discovery::topics(&self.context.domain_participant())
    }

    /// Which node each endpoint in the domain belongs to.
    pub fn endpoint_names(&self) -> &EndpointNames {
        self.matches.names()
    }

    /// Follows the names until the node is dropped.
    fn follow_names(&mut self) -> Result<(), RosError> {
        const TOPIC: &str = "ros_discovery_info";
        let topic = self.context.domain_participant().create_topic(
            TOPIC.to_owned(),
            "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_".to_owned(),
            &raw::qos(true, true, None),
            TopicKind::NoKey,
        );
        let topic = topic.map_err(|why| RosError::create(TOPIC)(&why))?;
        let announcements =
            self.inner.create_subscription(&topic, None).map_err(|why| RosError::create(TOPIC)(&why))?;
        self.matches.register(announcements.guid(), TOPIC, &self.log);
        self.tasks.push(tokio::spawn(self.matches.names().clone().follow(announcements)));
        Ok(())
    }

    /// The services that other participants serve, by their fully qualified names.
    pub fn services(&self) -> BTreeSet<String> {
        discovery::services(&self.context.domain_participant())
    }

    /// Looks out for other nodes called `name` (fully qualified), which may be this one's name.
    pub fn watch_name(&self, name: &str) -> NameWatch {
        let (participant, own) = (self.context.domain_participant().guid(), self.name().fully_qualified());
        NameWatch::new(self.matches.clone(), participant, name, own == name)
    }

    /// Waits for a change among the other participants, or 50 ms for what has no event.
    pub async fn graph_change(&self) {
        self.matches.change().await;
    }

    /// A subscription to the topic with that fully qualified name and type, whatever it is.
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
        let dds_topic = self.dds_topic_of(name, message, &raw::qos(reliable, transient_local, None))?;
        let inner =
            self.inner.create_subscription(&dds_topic, None).map_err(|why| RosError::create(name)(&why))?;
        self.matches.register(inner.guid(), name, &self.log);
        let (node, name, message) = (self.context.clone(), name.to_owned(), message.to_owned());
        // RustDDS keeps as many samples of a topic as any of its descriptions says.
        let keep = move |samples| {
            drop(dds_topic_of(&node, &name, &message, &raw::qos(reliable, transient_local, Some(samples))));
        };
        Ok(RawSubscription::new(inner, keep))
    }

    /// Serves `service` by `handler` until the node is dropped.
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

    /// Serves `service` by a `handler` that takes its time, until the node is dropped. Requests wait for each other.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn serve_later<S: ServiceType, F: Future<Output = S::Response> + Send + 'static>(
        &mut self,
        service: &str,
        handler: impl FnMut(S::Request) -> F + Send + 'static,
    ) -> Result<(), RosError> {
        let name = self.names.service(service)?;
        let server = self
            .inner
            .create_server(
                ServiceMapping::Enhanced,
                &wire_name(&name)?,
                &service_type::<S>(),
                service::qos(),
                service::qos(),
            )
            .map_err(|why| RosError::create(name.as_str())(&why))?;
        let readers = ReplyReaders::new(self.context.domain_participant(), self.matches.clone(), &name);
        self.tasks.push(tokio::spawn(service::serve::<S, F>(
            server,
            name,
            readers,
            handler,
            self.log.clone(),
        )));
        Ok(())
    }

    /// A client of `service`, once a server is there.
    ///
    /// # Errors
    /// [`RosError`], [`RosError::Service`] where none comes within `patience`.
    pub async fn client<S: ServiceType>(
        &mut self,
        service: &str,
        patience: std::time::Duration,
    ) -> Result<Client<S>, RosError> {
        let name = self.names.service(service)?;
        let participant = self.context.domain_participant();
        let server = super::client::find_server(&participant, &name, patience).await?;
        let connection = self.connection::<S>(&name, server.mapping)?;
        Client::connect(connection, name, server, &self.matches, patience).await
    }

    /// The endpoints of this node's clients of a service.
    fn connection<S: ServiceType>(
        &mut self,
        name: &str,
        mapping: ServiceMapping,
    ) -> Result<Arc<Connection<S>>, RosError> {
        let kept = self.clients.get(name).cloned().and_then(|kept| kept.downcast::<Connection<S>>().ok());
        // Another vendor's server speaks otherwise.
        if let Some(kept) = kept.filter(|kept| kept.mapping == mapping) {
            return Ok(kept);
        }
        let inner = self
            .inner
            .create_client(mapping, &wire_name(name)?, &service_type::<S>(), service::qos(), service::qos())
            .map_err(|why| RosError::create(name)(&why))?;
        let connection = Connection::new(inner, mapping);
        self.clients.insert(name.to_owned(), connection.clone());
        Ok(connection)
    }

    /// Announces changes of parameters. Late joiners that ask for it get all that was announced, so that a bag begun later
    /// has the node's parameters too.
    pub(super) fn parameter_events<M: Message>(&mut self) -> Result<Publisher<M>, RosError> {
        let entry = TopicContract {
            direction: Direction::Out,
            message: M::TYPE.to_owned(),
            reliability: ReliabilityKind::Reliable,
            durability: DurabilityKind::TransientLocal,
            depth: 1000,
            rate: "on change".to_owned(),
        };
        self.publisher_as(&entry, "/parameter_events")
    }

    fn dds_topic<M: Message>(&self, name: &str, qos: &QosPolicies) -> Result<rustdds::Topic, RosError> {
        self.dds_topic_of(name, M::TYPE, qos)
    }

    fn dds_topic_of(&self, name: &str, message: &str, qos: &QosPolicies) -> Result<rustdds::Topic, RosError> {
        dds_topic_of(&self.context, name, message, qos)
    }
}

fn dds_topic_of(
    context: &Context,
    name: &str,
    message: &str,
    qos: &QosPolicies,
) -> Result<rustdds::Topic, RosError> {
    // "package/msg/Name" is "package::msg::dds_::Name_" in DDS, and topics have the prefix "rt".
    let (package, message) = message.split_once("/msg/").unwrap_or(("", message));
    let type_name = format!("{package}::msg::dds_::{message}_");
    context
        .domain_participant()
        .create_topic(format!("rt{name}"), type_name, qos, TopicKind::NoKey)
        .map_err(|why| RosError::create(name)(&why))
}

impl Drop for Node {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}

/// A logger is named as its node, with dots: `/left/dq_servo` logs as `left.dq_servo`.
fn log_name(node: &NodeName) -> String {
    node.fully_qualified().trim_start_matches('/').replace('/', ".")
}

fn wire_name(name: &str) -> Result<Name, RosError> {
    Name::parse(name).map_err(|why| RosError::create(name)(&why))
}

fn service_type<S: ServiceType>() -> ServiceTypeName {
    let (package, service) = S::TYPE.split_once("/srv/").unwrap_or(("", S::TYPE));
    ServiceTypeName::new(package, service)
}
