//! Requests the first sample of a Fast DDS writer, so that this sample is not lost.
//!
//! `ros2 topic pub --once` publishes about a millisecond after the announcement of its writer, and leaves soon after. In RustDDS
//! 0.15.1 the announcement passes three queues before the reader knows the writer. A sample that arrives earlier is dropped, and so
//! is the HEARTBEAT that would announce it again. RustDDS then acknowledges that nothing is missing. Fast DDS sends its next
//! periodic HEARTBEAT three seconds later, when the publisher has left. So the goal in the sample is lost.
//!
//! Therefore this module requests sample 1 shortly after the reader knows the writer ([`MOMENT`]). A writer ignores the request if
//! it has not published yet, or if its first sample is older than the reader. If the sample also arrives without the request, it
//! arrives twice. The reader then returns it only once. Writers of other vendors need no request, because they answer the reader's
//! first acknowledgment at once.
//! Delete this module when test `stock` no_goal_of_a_publisher_that_leaves_at_once_is_lost passes without the module.

use super::own_datagrams::{OwnDatagrams, addresses};
use super::vendor::FAST_DDS;
use rustdds::policy::Reliability;
use rustdds::{DomainParticipant, GUID};
use std::net::SocketAddr;
use std::sync::{Arc, Weak};
use std::time::Duration;

/// The bits of an entity's kind (the last byte of its GUID) that are zero for entities that a user has created.
const BUILT_IN: u8 = 0xc0;

/// The time from the match to the request. Fast DDS answers only one request per sample. It ignores a request that arrives while
/// its timer still counts the sample as in flight. Even `ros2 topic pub --once` waits much longer than this time before it exits.
const MOMENT: Duration = Duration::from_millis(20);

/// Sends requests to writers of Fast DDS on behalf of the readers of one participant.
pub(crate) struct FirstSampleRequest {
    pub participant: Weak<DomainParticipant>,
    pub datagrams: Arc<OwnDatagrams>,
}

impl FirstSampleRequest {
    /// Requests the first sample of `writer`, which has just been matched with `reader`. Does nothing unless `writer` belongs to
    /// Fast DDS and is not a built-in writer.
    pub async fn send(&self, reader: GUID, writer: GUID) {
        if !is_users_of_fast_dds(writer) {
            return;
        }
        tokio::time::sleep(MOMENT).await;
        self.datagrams.send(&packet(reader, writer), &self.addresses(writer));
    }

    /// Returns the addresses of `writer`; an empty list if the writer is best effort.
    fn addresses(&self, writer: GUID) -> Vec<SocketAddr> {
        let Some(participant) = self.participant.upgrade() else { return Vec::new() };
        let writers = participant.discovered_writers();
        let known = writers.iter().find(|known| known.writer_proxy.remote_writer_guid == writer);
        let reliable = known.filter(|known| {
            let qos = known.publication_topic_data.qos();
            matches!(qos.reliability(), Some(Reliability::Reliable { .. }))
        });
        let locators = reliable.map(|known| known.writer_proxy.unicast_locator_list.clone());
        addresses(locators.unwrap_or_default()).collect()
    }
}

fn is_users_of_fast_dds(writer: GUID) -> bool {
    let bytes = writer.to_bytes();
    bytes[..2] == FAST_DDS && bytes[15] & BUILT_IN == 0
}

/// Returns the RTPS message with the request (RTPS 2.5, sections 9.4.4, 9.4.5.8, 9.4.5.3), little endian.
fn packet(reader: GUID, writer: GUID) -> Vec<u8> {
    let (reader, writer) = (reader.to_bytes(), writer.to_bytes());
    let fields: [&[u8]; 15] = [
        // Header: protocol, version 2.4, vendor (with which a GUID begins) and GUID prefix of the sender.
        b"RTPS",
        &[2, 4],
        &reader[..2],
        &reader[..12],
        // INFO_DST, the destination of the rest: kind, flags (little endian), length.
        &[0x0e, 0x01],
        &[12, 0],
        &writer[..12],
        // ACKNACK: kind, flags (little endian; final, so that only this sample is requested), length; reader, writer.
        &[0x06, 0x03],
        &[28, 0],
        &reader[12..],
        &writer[12..],
        // The first missing sample: the high and the low word of 1.
        &[0, 0, 0, 0, 1, 0, 0, 0],
        // The set of missing samples, from sample 1 on: one bit, which is set. If there were more bits, Fast DDS would declare
        // samples that do not exist yet irrelevant.
        &[1, 0, 0, 0],
        &[0, 0, 0, 0x80],
        // The count. Fast DDS accepts only rising counts. The first count must be at least 1 before Fast DDS 2.14.1, 2.10.4 and
        // 2.6.10, and at least 0 since then. RustDDS starts with 0. So Fast DDS ignores the next acknowledgment of RustDDS as a
        // repetition of this request, and takes the later ones.
        &[1, 0, 0, 0],
    ];
    fields.concat()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use rustdds::RepresentationIdentifier;
    use rustdds::serialization::deserialize_from_cdr_with_rep_id;

    /// Returns the GUID with these bytes.
    pub fn guid(bytes: [u8; 16]) -> GUID {
        deserialize_from_cdr_with_rep_id(&bytes, RepresentationIdentifier::CDR_LE).unwrap().0
    }

    fn endpoint(vendor: [u8; 2], entity: [u8; 4]) -> GUID {
        let [a, b] = vendor;
        let [c, d, e, f] = entity;
        guid([a, b, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, c, d, e, f])
    }

    #[test]
    fn the_packet_asks_for_sample_1_and_no_other() {
        let (reader, writer) = (endpoint([1, 0x12], [0, 0, 5, 4]), endpoint([1, 0x0f], [0, 0, 9, 3]));
        let header = "5254505302040112011202030405060708090a0b";
        let info_dst = "0e010c00010f02030405060708090a0b";
        let acknack = "06031c0000000504000009030000000001000000010000000000008001000000";
        assert_eq!(hex::encode(packet(reader, writer)), [header, info_dst, acknack].concat());
    }

    #[test]
    fn only_writers_that_users_of_fast_dds_made_are_asked() {
        assert!(is_users_of_fast_dds(endpoint([1, 0x0f], [0, 0, 9, 3])));
        assert!(!is_users_of_fast_dds(endpoint([1, 0x10], [0, 0, 9, 3])));
        assert!(!is_users_of_fast_dds(endpoint([1, 0x0f], [0, 0, 3, 0xc2])));
    }
}
