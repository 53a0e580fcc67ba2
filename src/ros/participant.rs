//! One DDS participant: makes writers and readers, and announces whose they are.

use super::announcement::{Announced, Announcement, Kind};
use super::error::RosError;
use super::log::Logger;
use super::matches::Matches;
use super::names::NodeName;
use crate::wire::{InPlace, Reuse};
use rustdds::no_key::{DataWriterCdr, SimpleDataReaderCdr};
use rustdds::serialization::CdrDeserializeSeedDecoder;
use rustdds::{CDRDeserializerAdapter, CDRSerializerAdapter, DomainParticipant, QosPolicies, TopicKind};
use rustdds::{RTPSEntity, Timestamp, WriteOptions};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::Arc;

/// A topic as DDS knows it.
pub(super) struct DdsTopic<'a> {
    /// What ROS 2 calls it, for errors and warnings.
    pub ros_name: &'a str,
    pub name: String,
    pub type_name: String,
    pub qos: QosPolicies,
}

impl<'a> DdsTopic<'a> {
    /// Messages: `package/msg/Name` is `package::msg::dds_::Name_` in DDS, and topics have the prefix "rt".
    pub fn of_messages(ros_name: &'a str, message: &str, qos: QosPolicies) -> Self {
        let (package, message) = message.split_once("/msg/").unwrap_or(("", message));
        let type_name = format!("{package}::msg::dds_::{message}_");
        Self { ros_name, name: format!("rt{ros_name}"), type_name, qos }
    }

    /// What a service is asked.
    pub fn of_requests(ros_name: &'a str, service: &str, qos: QosPolicies) -> Self {
        let type_name = service_type(service, "Request");
        Self { ros_name, name: request_topic(ros_name), type_name, qos }
    }

    /// What a service answers.
    pub fn of_replies(ros_name: &'a str, service: &str, qos: QosPolicies) -> Self {
        let type_name = service_type(service, "Response");
        Self { ros_name, name: reply_topic(ros_name), type_name, qos }
    }
}

/// The DDS topic of the requests to the service with that fully qualified name.
pub(super) fn request_topic(service: &str) -> String {
    format!("rq{service}Request")
}

/// The DDS topic of its replies.
pub(super) fn reply_topic(service: &str) -> String {
    format!("rr{service}Reply")
}

fn service_type(service: &str, part: &str) -> String {
    let (package, service) = service.split_once("/srv/").unwrap_or(("", service));
    format!("{package}::srv::dds_::{service}_{part}_")
}

/// A participant. What is made from it holds it only weakly: it leaves the graph when this is dropped.
pub(super) struct Participant {
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    announcement: Arc<Announcement>,
    matches: Matches,
    // The last: the others are made from it.
    dds: DomainParticipant,
}

impl Participant {
    /// Announces its nodes from now on.
    pub fn new(dds: DomainParticipant, matches: Matches) -> Result<Self, RosError> {
        let error = RosError::create;
        let none = QosPolicies::qos_none();
        let publisher = dds.create_publisher(&none).map_err(|why| error("a publisher")(&why))?;
        let subscriber = dds.create_subscriber(&none).map_err(|why| error("a subscriber")(&why))?;
        let topic = Announcement::topic();
        let writer = write_to(&dds, &publisher, &topic)?;
        let announcement = Arc::new(Announcement::new(dds.guid(), writer));
        Ok(Self { publisher, subscriber, announcement, matches, dds })
    }

    /// The middleware's participant.
    pub fn dds(&self) -> &DomainParticipant {
        &self.dds
    }

    /// Whose endpoints are matched with whose.
    pub fn matches(&self) -> &Matches {
        &self.matches
    }

    /// What it says of its nodes.
    pub fn announcement(&self) -> &Arc<Announcement> {
        &self.announcement
    }

    /// A writer of the node.
    pub fn writer<M: Serialize>(&self, node: &NodeName, topic: &DdsTopic) -> Result<Writer<M>, RosError> {
        let inner: DataWriterCdr<M> = write_to(&self.dds, &self.publisher, topic)?;
        let announced = self.announcement.announce(node, Kind::Writer, inner.guid());
        Ok(Writer { inner, _announced: announced })
    }

    /// A reader of the node.
    pub fn reader<M: 'static + DeserializeOwned>(
        &self,
        node: &NodeName,
        topic: &DdsTopic,
    ) -> Result<Reader<M>, RosError> {
        let inner = self.unannounced_reader(topic)?;
        let announced = self.announcement.announce(node, Kind::Reader, inner.guid());
        Ok(Reader { inner, _announced: announced })
    }

    /// A reader of a subscription of the node: what QoS keeps from it is logged to `log`.
    pub fn subscribed_reader<M: 'static + DeserializeOwned>(
        &self,
        node: &NodeName,
        topic: &DdsTopic,
        log: &Logger,
    ) -> Result<Reader<M>, RosError> {
        let reader = self.reader(node, topic)?;
        self.matches.register(reader.guid(), topic.ros_name, log);
        Ok(reader)
    }

    /// A reader of no node's.
    pub fn unannounced_reader<M: 'static + DeserializeOwned>(
        &self,
        topic: &DdsTopic,
    ) -> Result<SimpleDataReaderCdr<M>, RosError> {
        let dds_topic = create(&self.dds, topic)?;
        self.subscriber
            .create_simple_datareader_no_key::<M, CDRDeserializerAdapter<M>>(&dds_topic, None)
            .map_err(|why| RosError::create(topic.ros_name)(&why))
    }

    /// Makes DDS know the topic with this QoS too: of several descriptions of one topic the largest resource limits count.
    pub fn describe(&self, topic: &DdsTopic) -> Result<(), RosError> {
        create(&self.dds, topic).map(drop)
    }
}

fn create(dds: &DomainParticipant, topic: &DdsTopic) -> Result<rustdds::Topic, RosError> {
    dds.create_topic(topic.name.clone(), topic.type_name.clone(), &topic.qos, TopicKind::NoKey)
        .map_err(|why| RosError::create(topic.ros_name)(&why))
}

fn write_to<M: Serialize>(
    dds: &DomainParticipant,
    publisher: &rustdds::Publisher,
    topic: &DdsTopic,
) -> Result<DataWriterCdr<M>, RosError> {
    let dds_topic = create(dds, topic)?;
    publisher
        .create_datawriter_no_key::<M, CDRSerializerAdapter<M>>(&dds_topic, None)
        .map_err(|why| RosError::create(topic.ros_name)(&why))
}

/// Writes messages of one type, and is its node's until it is dropped.
pub(super) struct Writer<M: Serialize> {
    inner: DataWriterCdr<M>,
    _announced: Announced,
}

impl<M: Serialize> Writer<M> {
    /// Its identity in DDS.
    pub fn guid(&self) -> rustdds::GUID {
        self.inner.guid()
    }

    /// Queues a message; whether there was room.
    pub fn write(&self, message: M) -> bool {
        self.inner.write(message, Some(Timestamp::now())).is_ok()
    }

    /// Queues a message, and waits for room; the sample's identity, or why there is none.
    pub async fn write_with(
        &self,
        message: M,
        options: WriteOptions,
    ) -> Result<rustdds::SampleIdentity, String> {
        self.inner.async_write_with_options(message, options).await.map_err(|why| why.to_string())
    }
}

/// A message as it came, with what DDS says of it.
pub(super) type Sample<M> = rustdds::no_key::DeserializedCacheChange<M>;

/// Reads messages of one type, and is its node's until it is dropped.
pub(super) struct Reader<M: 'static + DeserializeOwned> {
    inner: SimpleDataReaderCdr<M>,
    _announced: Announced,
}

impl<M: 'static + DeserializeOwned> Reader<M> {
    /// Its identity in DDS.
    pub fn guid(&self) -> rustdds::GUID {
        self.inner.guid()
    }

    /// The next message, if one has come; or why it could not be decoded.
    ///
    /// RustDDS's notifications are left where they are: they are for those who wait by a poll of their own. To drain them is an
    /// allocation and a system call each time, and once they fill their queue RustDDS adds none.
    pub fn take(&self) -> Result<Option<Sample<M>>, String> {
        self.inner.try_take_one().map_err(|why| why.to_string())
    }

    /// The same, decoded over the message in `place`.
    pub fn take_over(&self, place: &Cell<M>) -> Result<Option<Sample<M>>, String>
    where
        M: InPlace,
    {
        // No topic of ROS 2 has a key.
        let decoder = CdrDeserializeSeedDecoder::new(Reuse(place), PhantomData::<()>);
        self.inner.try_take_one_with(decoder).map_err(|why| why.to_string())
    }

    /// Waits for the next message that can be decoded.
    pub async fn next(&self) -> Sample<M> {
        next(&self.inner).await
    }
}

/// Waits for the next message that can be decoded.
pub(super) async fn next<M: 'static + DeserializeOwned>(reader: &SimpleDataReaderCdr<M>) -> Sample<M> {
    use futures::StreamExt;
    let mut samples = std::pin::pin!(reader.as_async_stream());
    loop {
        match samples.next().await {
            Some(Ok(sample)) => return sample,
            Some(Err(_)) => {}
            // It does not end; if it did, nothing would come any more.
            None => std::future::pending().await,
        }
    }
}
