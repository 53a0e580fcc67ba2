//! Sends replies that are longer than one network packet to clients that identify replies by inline QoS: those of Fast DDS and
//! RustDDS.
//!
//! RustDDS 0.15.1 divides long replies into fragments, and writes a superfluous byte before the inline QoS of each fragment
//! (`data_frag.rs`: `write_value(&self.inline_qos)` writes the tag of the `Option` too). No vendor can read such a fragment; the
//! debug build of RustDDS panics.
//!
//! Therefore this module sends such a reply without RustDDS, as one well-formed DATA submessage in one UDP datagram, which the
//! kernel divides. The submessage names the service's reply writer as its writer, and has the writer's next sequence number. Then
//! RustDDS writes another reply with the same sequence number, which no client accepts (`to_nobody`). The client has received the
//! large reply by then, and treats the second reply as a repetition. Other clients receive only the second reply, so their
//! sequence of numbers has no gap.
//!
//! RustDDS retransmits only what it has written, so the datagram is sent several times. A client that receives none of the copies
//! has no reply and asks again. Replies to the clients of Cyclone do not need this: they carry the request's identity in the
//! payload, and the fragments that RustDDS writes without inline QoS are well-formed. Delete this module when test `stock`
//! replies_of_any_length_… passes with every reply written by RustDDS.

use super::matches::Matches;
use super::own_datagrams::{OwnDatagrams, addresses};
use rustdds::no_key::DataWriterCdr;
use rustdds::{
    DomainParticipant, GUID, RTPSEntity, SampleIdentity, SequenceNumber, Timestamp, WriteOptionsBuilder,
};
use serde::Serialize;
use std::net::SocketAddr;
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::sync::Mutex;

/// How long to wait until the reader of a client is matched.
pub(crate) const TO_BE_MATCHED: Duration = Duration::from_millis(500);

/// The length of a reply \[bytes\] that fits into one Ethernet packet. RustDDS uses 1452 bytes for RTPS. The
/// sample may take 1372 of them, and begins with a header of 4 bytes.
pub(crate) const ONE_PACKET: usize = 1368;

/// The length of a reply \[bytes\] that fits into one UDP datagram.
const ONE_DATAGRAM: usize = 64_000;

/// The number of copies of a large reply. A further copy is sent for each `MORE_FOR` bytes. With 1 % packet loss, fewer than one
/// reply in 10⁴ is lost.
const COPIES: usize = 4;
const MORE_FOR: usize = 10_000;

/// The time between two copies of a large reply. In this time, the socket buffers of the two hosts can empty.
const BETWEEN: Duration = Duration::from_millis(20);

/// The recipient of a reply.
pub(crate) struct Addressee {
    /// An endpoint of the client.
    pub client: GUID,
    /// The identity of the request, which the inline QoS of the reply repeats; `None` if the payload of the reply has this identity
    /// (clients of Cyclone).
    pub request: Option<SampleIdentity>,
}

/// Writes the replies of one service, which are bytes in CDR.
pub(crate) struct ReplyWriter<R: Serialize + AsRef<[u8]>> {
    /// The writer, and the sequence number of its latest sample. This module counts the samples itself, because nobody else uses the
    /// writer. RustDDS numbers the samples from 1.
    writer: Mutex<(DataWriterCdr<R>, SequenceNumber)>,
    /// The name of the reply topic.
    topic: String,
    participant: Weak<DomainParticipant>,
    matches: Matches,
    /// Sends the large replies; `None` in a secured graph, or if the socket could not be opened.
    datagrams: Option<Arc<OwnDatagrams>>,
}

impl<R: Serialize + AsRef<[u8]>> ReplyWriter<R> {
    /// Creates the writer of replies from `writer`, which must not have written anything yet.
    pub fn new(
        writer: DataWriterCdr<R>,
        topic: String,
        participant: &Arc<DomainParticipant>,
        matches: Matches,
        datagrams: Option<Arc<OwnDatagrams>>,
    ) -> Self {
        let writer = Mutex::new((writer, SequenceNumber::new(0)));
        Self { writer, topic, participant: Arc::downgrade(participant), matches, datagrams }
    }

    /// Returns the largest length of a reply that can reach a client \[bytes\].
    pub fn room(&self) -> usize {
        if self.datagrams.is_some() { ONE_DATAGRAM } else { ONE_PACKET }
    }

    /// Waits until the client's reader is matched, up to [`TO_BE_MATCHED`], and sends `reply`. The length of `reply` must be at most
    /// [`room`](Self::room). If this module sends `reply` in packets of its own, RustDDS writes `to_nobody` in place of `reply`. No
    /// client accepts the reply `to_nobody`.
    ///
    /// # Errors
    /// The reason why the reply could not be sent.
    pub async fn send(&self, to: Addressee, reply: R, to_nobody: R) -> Result<(), String> {
        // A small reply is sent even if the reader is not matched yet.
        let matched = tokio::time::timeout(TO_BE_MATCHED, self.matched(to.client)).await;
        let mut writer = self.writer.lock().await;
        let (writer, written) = &mut *writer;
        let (sample, names) = match (to.request, &self.datagrams) {
            (Some(request), Some(datagrams)) if reply.as_ref().len() > ONE_PACKET => {
                let addresses = matched.ok().flatten().filter(|addresses| !addresses.is_empty());
                let addresses = addresses.ok_or("the client has no known address")?;
                let number = written.plus_1();
                let packet = packet(writer.guid(), number, to.client, request, reply.as_ref());
                for _ in 0..COPIES + reply.as_ref().len() / MORE_FOR {
                    datagrams.send(&packet, &addresses);
                    tokio::time::sleep(BETWEEN).await;
                }
                (to_nobody, Some(SampleIdentity { writer_guid: GUID::GUID_UNKNOWN, ..request }))
            }
            (request, _) => (reply, request),
        };
        let options = WriteOptionsBuilder::new().source_timestamp(Timestamp::now());
        let options = options.related_sample_identity_opt(names).build();
        let sent = writer.async_write_with_options(sample, options).await;
        *written = sent.map_err(|why| why.to_string())?.sequence_number;
        Ok(())
    }

    /// Waits until a reader of the client is matched, and returns the addresses of the client's readers. Returns `None` if this
    /// participant ends.
    async fn matched(&self, client: GUID) -> Option<Vec<SocketAddr>> {
        loop {
            let readers = self.participant.upgrade()?.discovered_readers();
            let of_client = readers.into_iter().filter(|reader| {
                let guid = reader.reader_proxy.remote_reader_guid;
                *reader.subscription_topic_data.topic_name() == self.topic
                    && guid.prefix == client.prefix
                    && self.matches.has_remote(guid)
            });
            let found: Vec<_> =
                of_client.map(|reader| addresses(reader.reader_proxy.unicast_locator_list)).collect();
            if !found.is_empty() {
                return Some(found.into_iter().flatten().collect());
            }
            self.matches.change().await;
        }
    }
}

/// Returns the RTPS message with the reply (RTPS 2.5, section 9.4), little endian.
fn packet(
    writer: GUID,
    number: SequenceNumber,
    client: GUID,
    request: SampleIdentity,
    reply: &[u8],
) -> Vec<u8> {
    let (writer, client) = (writer.to_bytes(), client.to_bytes());
    let identity = [&request.writer_guid.to_bytes()[..], &words(request.sequence_number.into())].concat();
    // A time consists of seconds and a fraction in units of 2⁻³² s.
    let (number, time) = (words(number.into()), words(Timestamp::now().to_ticks().cast_signed()));
    let inline_qos: [&[u8]; 7] = [
        // The request, as the parameter of RTPS and as the parameter of Fast DDS before 2.13: number, length, value. Then the end
        // marker.
        &[0x83, 0x00, 24, 0],
        &identity,
        &[0x0f, 0x80, 24, 0],
        &identity,
        &[0x01, 0x00, 0, 0],
        // The payload follows: CDR, little endian.
        &[0, 1, 0, 0],
        reply,
    ];
    let inline_qos_and_payload = inline_qos.concat();
    // The length of all fields after the length.
    let length = u16::try_from(20 + inline_qos_and_payload.len()).unwrap_or_default().to_le_bytes();
    let fields: [&[u8]; 17] = [
        // Header: protocol, version 2.4, vendor (with which a GUID begins) and GUID prefix of the sender.
        b"RTPS",
        &[2, 4],
        &writer[..2],
        &writer[..12],
        // INFO_DST, the destination of the rest: kind, flags (little endian), length.
        &[0x0e, 0x01],
        &[12, 0],
        &client[..12],
        // INFO_TS: the time of writing.
        &[0x09, 0x01],
        &[8, 0],
        &time,
        // DATA: kind, flags (little endian, inline QoS, payload), length (zero if the submessage extends to the end of the
        // message), extra flags, offset of the inline QoS.
        &[0x15, 0x07],
        &length,
        &[0, 0, 16, 0],
        // The reader (all readers of the client), and the writer.
        &[0, 0, 0, 0],
        &writer[12..],
        &number,
        &inline_qos_and_payload,
    ];
    fields.concat()
}

/// Returns the number as its high word and its low word.
fn words(number: i64) -> [u8; 8] {
    // The low word of a little-endian number comes first.
    number.rotate_left(32).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dds::first_sample_request::tests::guid;

    #[test]
    fn the_packet_is_the_reply_as_its_writer_would_send_it() {
        let writer = guid([1, 0x12, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0, 0, 5, 3]);
        let client = guid([1, 0x0f, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0, 0, 9, 4]);
        let request = SampleIdentity { writer_guid: client, sequence_number: SequenceNumber::new(3) };
        let packet =
            hex::encode(packet(writer, SequenceNumber::new((1 << 32) + 7), client, request, b"reply..."));
        let (before, time_and_after) = packet.split_at(2 * (20 + 16 + 4));
        let header = "5254505302040112011202030405060708090a0b";
        let (info_dst, info_ts) = ("0e010c00010f02030405060708090a0b", "09010800");
        assert_eq!(before, [header, info_dst, info_ts].concat());
        let identity = "010f02030405060708090a0b000009040000000003000000";
        let data = ["15075c00", "00001000", "00000000", "00000503", "0100000007000000"].concat();
        let inline_qos = ["83001800", identity, "0f801800", identity, "01000000"].concat();
        assert_eq!(time_and_after[16..], [&data, &inline_qos, "00010000", &hex::encode("reply...")].concat());
    }
}
