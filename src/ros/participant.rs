//! One DDS participant: makes writers and readers, and announces whose they are.

use super::announcement::{Announced, Announcement};
use super::endpoint::{Kind, Plan};
use super::error::RosError;
use super::graph::EndpointNames;
use super::reader::Reader;
use super::topic::DdsTopic;
use super::writer::Writer;
use crate::dds::matches::Matches;
use rustdds::no_key::DataWriterCdr;
use rustdds::{
    CDRDeserializerAdapter, CDRSerializerAdapter, DomainParticipant, GUID, QosPolicies, RTPSEntity, TopicKind,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// A participant. What is made from it holds it only weakly: it leaves the graph when this is dropped.
pub(super) struct Participant {
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    announcement: Arc<Announcement>,
    names: EndpointNames,
    matches: Matches,
    // The last: the others are made from it.
    dds: Arc<DomainParticipant>,
}

impl Participant {
    /// Announces its nodes from now on.
    pub fn new(dds: DomainParticipant) -> Result<Self, RosError> {
        let error = RosError::create;
        let none = QosPolicies::qos_none();
        let publisher = dds.create_publisher(&none).map_err(|why| error("a publisher")(&why))?;
        let subscriber = dds.create_subscriber(&none).map_err(|why| error("a subscriber")(&why))?;
        let writer = Writer::new(write_to(&dds, &publisher, &Announcement::topic())?, None);
        let announcement = Arc::new(Announcement::new(dds.guid(), writer));
        let (names, dds) = (EndpointNames::default(), Arc::new(dds));
        let matches = Matches::new(Arc::new(names.clone()));
        Ok(Self { publisher, subscriber, announcement, names, matches, dds })
    }

    /// The middleware's participant.
    pub fn dds(&self) -> &Arc<DomainParticipant> {
        &self.dds
    }

    /// Whose endpoints are matched with whose.
    pub fn matches(&self) -> &Matches {
        &self.matches
    }

    /// Which node each endpoint in the domain belongs to.
    pub fn names(&self) -> &EndpointNames {
        &self.names
    }

    /// What it says of its nodes.
    pub fn announcement(&self) -> &Arc<Announcement> {
        &self.announcement
    }

    /// A writer by that plan.
    pub fn writer<M: Serialize + Send + Sync + 'static>(&self, plan: Plan) -> Result<Writer<M>, RosError> {
        let inner = write_to(&self.dds, &self.publisher, &plan.topic)?;
        let announced = self.introduce(&plan, Kind::Writer, inner.guid());
        Ok(Writer::new(inner, announced))
    }

    /// A reader by that plan.
    pub fn reader<M: 'static + DeserializeOwned>(&self, plan: Plan) -> Result<Reader<M>, RosError> {
        let inner = self
            .subscriber
            .create_simple_datareader_no_key::<M, CDRDeserializerAdapter<M>>(
                &create(&self.dds, &plan.topic)?,
                None,
            )
            .map_err(|why| RosError::create(plan.topic.ros_name.as_str())(&why))?;
        let announced = self.introduce(&plan, Kind::Reader, inner.guid());
        Ok(Reader::new(inner, announced))
    }

    /// Makes known whose endpoint this is, and whose log is to hear of it.
    fn introduce(&self, plan: &Plan, kind: Kind, endpoint: GUID) -> Option<Announced> {
        if let Some(log) = &plan.log {
            self.matches.register(endpoint, &plan.topic.ros_name, log.warner());
        }
        Some(self.announcement.announce(plan.node.as_ref()?, kind, endpoint))
    }

    /// Makes DDS know the topic with this QoS too: of several descriptions of one topic the largest resource limits count.
    pub fn describe(&self, topic: &DdsTopic) -> Result<(), RosError> {
        create(&self.dds, topic).map(drop)
    }
}

fn create(dds: &DomainParticipant, topic: &DdsTopic) -> Result<rustdds::Topic, RosError> {
    dds.create_topic(topic.name.clone(), topic.type_name.clone(), &topic.qos, TopicKind::NoKey)
        .map_err(|why| RosError::create(topic.ros_name.as_str())(&why))
}

fn write_to<M: Serialize>(
    dds: &DomainParticipant,
    publisher: &rustdds::Publisher,
    topic: &DdsTopic,
) -> Result<DataWriterCdr<M>, RosError> {
    publisher
        .create_datawriter_no_key::<M, CDRSerializerAdapter<M>>(&create(dds, topic)?, None)
        .map_err(|why| RosError::create(topic.ros_name.as_str())(&why))
}
