//! How long a reply may be.
//!
//! RustDDS 0.15.1 puts a byte too much before the inline QoS of a fragment (`data_frag.rs`, `write_value(&self.inline_qos)` writes the
//! `Option`'s tag too), so that no vendor can read it; its debug build panics. ros2-client gives every reply inline QoS, so clients get
//! what one datagram holds. RustDDS measures datagrams by the readers that are matched and by the addresses that these announce. This goes
//! when test `dds` a_description_that_fits_no_datagram_… gets descriptions.

use super::matches::Matches;
use rustdds::{DomainParticipant, GUID};
use std::net::{IpAddr, SocketAddr};
use std::sync::Weak;
use std::time::Duration;

/// Knows how long a reply may be to reach who asked \[bytes\].
pub(crate) struct ReplyRoom {
    participant: Weak<DomainParticipant>,
    matches: Matches,
    /// On which replies go out.
    topic: String,
}

/// How long a client's reader may take to be matched.
pub(crate) const TO_BE_MATCHED: Duration = Duration::from_millis(500);

/// A reply of this length \[bytes\] fits into one datagram on Ethernet: RustDDS takes 1452 for RTPS, of which the sample has 1372.
const ETHERNET: usize = 1360;

/// The same of a client that is on this host only.
const LOOPBACK: usize = 64_000;

impl ReplyRoom {
    /// Of the service that replies on that topic.
    pub fn new(participant: Weak<DomainParticipant>, matches: Matches, topic: String) -> Self {
        Self { participant, matches, topic }
    }

    /// Waits a moment until the reader of `client` is matched; how much can reach it.
    pub async fn of(&self, client: GUID) -> usize {
        let reader = tokio::time::timeout(TO_BE_MATCHED, self.matched(client)).await;
        match reader {
            Ok(Some(true)) => LOOPBACK,
            // Where it is not matched yet, and may be soon, a reply that is small is still tried.
            _ => ETHERNET,
        }
    }

    /// Waits until the client's reader is matched; whether all its addresses are loopback's. None where this participant ends.
    async fn matched(&self, client: GUID) -> Option<bool> {
        loop {
            let addresses = {
                let participant = self.participant.upgrade()?;
                let readers = participant.discovered_readers();
                let reader = readers
                    .iter()
                    .map(|reader| (reader, reader.reader_proxy.remote_reader_guid))
                    .find(|(reader, guid)| {
                        *reader.subscription_topic_data.topic_name() == self.topic
                            && guid.prefix == client.prefix
                            && self.matches.has_remote(*guid)
                    });
                reader.map(|(reader, _)| reader.reader_proxy.unicast_locator_list.clone())
            };
            if let Some(addresses) = addresses {
                let of_udp = addresses.iter().filter(|locator| locator.is_udp());
                let addresses: Vec<_> = of_udp.map(|locator| SocketAddr::from(*locator).ip()).collect();
                // One without any has those of its participant, which are not known here.
                return Some(!addresses.is_empty() && addresses.iter().all(IpAddr::is_loopback));
            }
            self.matches.change().await;
        }
    }
}
