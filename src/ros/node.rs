//! A node: makes publishers, subscriptions, services and clients under its names.

use super::client::{Client, Connection};
use super::discovery::{self, GraphTopic};
use super::endpoint::Plan;
use super::error::RosError;
use super::graph::EndpointNames;
use super::log::{Logger, Logging, rosout_qos};
use super::names::{NodeName, Resolver};
use super::namesakes::NameWatch;
use super::origin::Origin;
use super::participant::Participant;
use super::qos;
use super::raw::{self, RawSubscription};
use super::reader::Reader;
use super::service;
use super::topic::{DdsTopic, reply_topic};
use super::topics::{OwnTopic, Publisher, Shared, Subscription};
use crate::dds::large_replies::ReplyRoom;
use crate::dds::payload_padding::Padded;
use crate::wire::messages::{Message, ServiceType};
use crate::wire::{Direction, NodeContract, ReliabilityKind, TopicContract};
use rustdds::{QosPolicies, RTPSEntity};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;
use tokio::sync::watch;
use tokio::task::JoinHandle;

/// A ROS 2 node. Its services end when it is dropped.
pub struct Node {
    names: Resolver,
    log: Logger,
    tasks: Vec<JoinHandle<()>>,
    /// Of the services that were called.
    clients: HashMap<String, Arc<Connection>>,
    participant: Arc<Participant>,
}

impl Node {
    pub(super) fn new(
        participant: Arc<Participant>,
        names: Resolver,
        logging: Logging,
    ) -> Result<Self, RosError> {
        participant.announcement().add(names.node());
        let logging = Logging { level: names.log_level().unwrap_or(logging.level), ..logging };
        let log = Logger::new(&names.logger(), logging);
        let mut node = Self { names, log, tasks: Vec::new(), clients: HashMap::new(), participant };
        if logging.rosout {
            let rosout = node.publisher_with("/rosout", rosout_qos())?;
            node.log = node.log.clone().with_rosout(rosout);
        }
        Ok(node)
    }

    /// The node's name.
    pub fn name(&self) -> &NodeName {
        self.names.node()
    }

    #[cfg(test)]
    pub(super) fn participant(&self) -> &Participant {
        &self.participant
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
        let entry = TopicContract { direction: Direction::Out, ..entry.clone() };
        self.publisher_with(topic, qos::of(&entry))
    }

    /// A publisher on `topic` with this QoS.
    pub(super) fn publisher_with<M: Message>(
        &mut self,
        topic: &str,
        qos: QosPolicies,
    ) -> Result<Publisher<M>, RosError> {
        let name = self.names.topic(topic)?;
        let plan = self.plan(DdsTopic::of_messages(&name, M::TYPE, qos)).logged(&self.log);
        let writer = self.participant.writer::<Padded<Shared<M>>>(plan)?;
        Ok(Publisher::new(writer, name, self.participant.matches().clone()))
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

    /// A subscription to a topic of the contract that is reliable until a publisher offers best effort only, and best effort from then
    /// on: that hears both.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn adapting_subscription<M: Message>(
        &mut self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<Subscription<M>, RosError> {
        let entry = contract.topic::<M>(topic, Direction::In)?.clone();
        let (name, reader) = self.reader::<M>(topic, qos::of(&entry))?;
        let (log, participant, ours) = (self.log.clone(), Arc::downgrade(&self.participant), reader.guid());
        let entry = TopicContract { reliability: ReliabilityKind::BestEffort, ..entry };
        let plan = self.plan(DdsTopic::of_messages(&name, M::TYPE, qos::of(&entry))).logged(&log);
        let (place, reader) = watch::channel(Arc::new(reader));
        let matches = self.participant.matches().clone();
        let subscription = Subscription::new(reader, name.clone(), matches.clone());
        matches.adapt(ours);
        self.run(async move {
            let publisher = matches.best_effort_publisher(ours).await;
            let Some(participant) = participant.upgrade() else { return };
            match participant.reader(plan) {
                Ok(reader) => {
                    let old = place.borrow().clone();
                    place.send_replace(Arc::new(reader.after(&old)));
                    matches.forget_ours(ours);
                    log.info(&format!(
                        "{name}: {publisher} publishes BEST_EFFORT only, so that is subscribed to"
                    ));
                }
                Err(why) => log.error(&format!("{name}: {publisher} publishes BEST_EFFORT only: {why}")),
            }
        });
        Ok(subscription)
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
        let entry = TopicContract { direction: Direction::In, ..entry.clone() };
        self.subscription_with(topic, qos::of(&entry))
    }

    /// A topic of the contract on which the node publishes, to which it may subscribe later.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn own_topic<M: Message>(
        &self,
        contract: &NodeContract,
        topic: &str,
    ) -> Result<OwnTopic<M>, RosError> {
        let entry = contract.topic::<M>(topic, Direction::Out)?.clone();
        let name = self.names.topic(topic)?;
        let qos = qos::of(&TopicContract { direction: Direction::In, ..entry });
        let plan = self.plan(DdsTopic::of_messages(&name, M::TYPE, qos)).logged(&self.log);
        Ok(OwnTopic::new(Arc::downgrade(&self.participant), plan, name))
    }

    /// A subscription to `topic` with this QoS.
    pub(super) fn subscription_with<M: Message>(
        &mut self,
        topic: &str,
        qos: QosPolicies,
    ) -> Result<Subscription<M>, RosError> {
        let (name, reader) = self.reader(topic, qos)?;
        let (_, reader) = watch::channel(Arc::new(reader));
        Ok(Subscription::new(reader, name, self.participant.matches().clone()))
    }

    /// A reader of `topic`, and the topic's full name.
    fn reader<M: Message>(&self, topic: &str, qos: QosPolicies) -> Result<(String, Reader<M>), RosError> {
        let name = self.names.topic(topic)?;
        let plan = self.plan(DdsTopic::of_messages(&name, M::TYPE, qos)).logged(&self.log);
        let reader = self.participant.reader(plan)?;
        Ok((name, reader))
    }

    /// The topics of all other participants, by their fully qualified names.
    pub fn graph(&self) -> BTreeMap<String, GraphTopic> {
        discovery::topics(self.participant.dds())
    }

    /// Which node each endpoint in the domain belongs to.
    pub fn endpoint_names(&self) -> &EndpointNames {
        self.participant.names()
    }

    /// The services that other participants serve, by their fully qualified names.
    pub fn services(&self) -> BTreeSet<String> {
        discovery::services(self.participant.dds())
    }

    /// Looks out for other nodes called `name` (fully qualified), which may be this one's name.
    pub fn watch_name(&self, name: &str) -> NameWatch {
        let (participant, own) = (self.participant.dds().guid(), self.name().fully_qualified());
        NameWatch::new(self.participant.matches().clone(), participant, name, own == name)
    }

    /// Waits for a change among the other participants, or 50 ms for what has no event.
    pub async fn graph_change(&self) {
        self.participant.matches().change().await;
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
        let dds_topic = DdsTopic::of_messages(name, message, raw::qos(reliable, transient_local, None));
        let reader = self.participant.reader(self.plan(dds_topic).logged(&self.log))?;
        let (participant, name) = (Arc::downgrade(&self.participant), name.to_owned());
        let message = message.to_owned();
        // RustDDS keeps as many samples of a topic as any of its descriptions says.
        let keep = move |samples| {
            let qos = raw::qos(reliable, transient_local, Some(samples));
            let more = DdsTopic::of_messages(&name, &message, qos);
            let _ = participant.upgrade().map(|participant| participant.describe(&more));
        };
        Ok(RawSubscription::new(reader, keep))
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
        self.serve_later::<S, _>(service, move |request, _| std::future::ready(handler(request)))
    }

    /// Serves `service` by a `handler` that takes its time, until the node is dropped. It is called in the order of the requests; none
    /// waits for the answer to another.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn serve_later<S: ServiceType, F: Future<Output = S::Response> + Send + 'static>(
        &mut self,
        service: &str,
        handler: impl FnMut(S::Request, &Origin) -> F + Send + 'static,
    ) -> Result<(), RosError> {
        let name = self.names.service(service)?;
        let (requests, replies) = self.service_topics::<S>(&name);
        let requests = self.participant.reader(requests)?;
        let replies = self.participant.writer(replies)?;
        let matches = self.participant.matches().clone();
        let room =
            ReplyRoom::new(Arc::downgrade(self.participant.dds()), matches.clone(), reply_topic(&name));
        let (room, log) = ((room, matches), self.log.clone());
        self.tasks.push(tokio::spawn(service::serve::<S, F>(requests, replies, name, room, handler, log)));
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
        let server = super::client::find_server(self.participant.dds(), &name, patience).await?;
        let connection = self.connection::<S>(&name, server.is_cyclone)?;
        Client::connect(connection, name, server, self.participant.matches(), patience).await
    }

    /// The endpoints of this node's clients of a service.
    fn connection<S: ServiceType>(
        &mut self,
        name: &str,
        is_cyclone: bool,
    ) -> Result<Arc<Connection>, RosError> {
        let kept = self.clients.get(name).filter(|kept| kept.is_cyclone == is_cyclone);
        if let Some(kept) = kept {
            return Ok(kept.clone());
        }
        let (requests, replies) = self.service_topics::<S>(name);
        let requests = self.participant.writer(requests)?;
        let replies = self.participant.reader(replies)?;
        let connection = Connection::new(requests, replies, is_cyclone);
        self.clients.insert(name.to_owned(), connection.clone());
        Ok(connection)
    }

    /// An endpoint of this node.
    fn plan(&self, topic: DdsTopic) -> Plan {
        Plan::of(self.names.node(), topic)
    }

    /// This node's endpoints of the requests to a service and of its replies.
    fn service_topics<S: ServiceType>(&self, name: &str) -> (Plan, Plan) {
        let requests = DdsTopic::of_requests(name, S::TYPE, service::qos());
        (self.plan(requests), self.plan(DdsTopic::of_replies(name, S::TYPE, service::qos())))
    }

    /// Runs `task` until the node is dropped.
    pub fn run(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        self.tasks.push(tokio::spawn(task));
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
        self.participant.announcement().remove(self.names.node());
    }
}
