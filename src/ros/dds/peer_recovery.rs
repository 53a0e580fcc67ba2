//! Detects participants that were lost but are still present.
//!
//! A participant is lost if it was not heard for the duration of its lease: 10 s for Cyclone, 20 s for Fast DDS, 50 s for RustDDS.
//! A participant that was killed is never heard again. But if a cable was unplugged or the computer was suspended, the participant
//! continues to announce itself, and RustDDS 0.15.1 ignores it forever. Cyclone and Fast DDS repeat one announcement, which RustDDS
//! ignores as a duplicate (`dds_cache.rs`, `add_change_internal`), so the participant stays unknown. RustDDS recognizes other
//! RustDDS participants again. But it does not match their endpoints with those endpoints of ours that existed before the loss
//! (`discovery.rs`, "Participant rediscovery").
//!
//! Therefore, while participants are lost, this module listens to the multicast group of announcements. Otherwise no socket is open.
//! Delete this module when RustDDS receives again from lost participants that are back. Then the servo in test `dds`
//! a_known_peer_that_returns_… no longer ends.

use super::announcement::{SENDER, listen};
use super::ended_threads::{NetworkEnd, end};
use super::ports;
use std::collections::HashMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::UdpSocket;

/// The largest number of lost participants for which this process listens. If there are more, some are forgotten.
const PARTICIPANTS: usize = 256;

/// The number of bytes to read of each RTPS message: only its header, which ends with the sender's GUID prefix.
const HEADER: usize = SENDER.end;

/// The pause after an error of the socket.
const PAUSE: Duration = Duration::from_secs(1);

/// The GUID prefix that a participant shares with its endpoints.
pub(crate) type Prefix = [u8; 12];

/// Converts a GUID prefix of RustDDS to a [`Prefix`]. The parameter is generic because the type in RustDDS is not public.
pub(crate) fn prefix(of: impl AsRef<[u8]>) -> Prefix {
    of.as_ref().first_chunk().copied().unwrap_or_default()
}

/// Writes a warning to the log of an endpoint's owner.
pub(crate) type Warn = Arc<dyn Fn(&str) + Send + Sync>;

/// A participant that was connected with our nodes.
pub(crate) struct Peer {
    /// The description of one of the participant's nodes.
    pub name: String,
    /// The topics on which this process has received messages from the participant.
    pub heard_on: Vec<String>,
    /// Writes a warning to the log of a node that was connected with the participant.
    pub warn: Warn,
}

/// The participants that are lost, that is, that were not heard for the duration of their lease.
pub(crate) struct Lost {
    domain: u16,
    on_loopback: bool,
    is_secured: bool,
    has_static_peers: bool,
    participants: HashMap<Prefix, Peer>,
    socket: Option<UdpSocket>,
}

impl Lost {
    /// Creates an empty list for this domain. `on_loopback` is true if the participant is restricted to loopback, and `is_secured` if
    /// the graph is secured. `has_static_peers` is true if the participant has peers whose announcements may be unicast.
    pub fn new(domain: u16, on_loopback: bool, is_secured: bool, has_static_peers: bool) -> Self {
        Self { domain, on_loopback, is_secured, has_static_peers, participants: HashMap::new(), socket: None }
    }

    /// Adds a participant that was not heard for the duration of its lease, and starts listening for its announcements. A process with
    /// static peers cannot detect the return of every participant, because this module does not receive unicast announcements. So such
    /// a process must be restarted at once ([`NetworkEnd::Lost`]) if it has received messages from the participant.
    pub fn add(&mut self, participant: Prefix, peer: Peer) {
        if self.has_static_peers && !peer.heard_on.is_empty() {
            return end(NetworkEnd::Lost(format!("{} on {}", peer.name, peer.heard_on.join(", "))));
        }
        if self.socket.is_none() {
            match listen(ports::first(self.domain)) {
                Ok(socket) => self.socket = Some(socket),
                Err(why) => (peer.warn)(&format!("whether {} comes back is not seen: {why}", peer.name)),
            }
        }
        if self.participants.len() >= PARTICIPANTS
            && let Some(some) = self.participants.keys().next().copied()
        {
            self.participants.remove(&some);
        }
        self.participants.insert(participant, peer);
    }

    /// Removes `participant`, which is present again, from the lost participants. Returns the participant's description; `None` if the
    /// participant was not lost.
    pub fn remove(&mut self, participant: Prefix) -> Option<Peer> {
        let peer = self.participants.remove(&participant);
        if self.participants.is_empty() {
            // Close the socket: unread packets would be outdated when the next participant is lost.
            self.socket = None;
        }
        peer
    }

    /// Waits until one of the lost participants announces itself again, and returns its description.
    pub async fn heard(&mut self) -> Peer {
        let mut header = [0; HEADER];
        loop {
            let Some(socket) = &self.socket else { return std::future::pending().await };
            match socket.recv_from(&mut header).await {
                Ok((HEADER, from)) if header.starts_with(b"RTPS") && self.reaches(from) => {
                    if let Some(peer) = self.remove(prefix(&header[SENDER])) {
                        return peer;
                    }
                }
                Ok(_) => {}
                Err(_) => tokio::time::sleep(PAUSE).await,
            }
        }
    }

    /// Declares that this process must be restarted ([`NetworkEnd::Deaf`]), because the peer is present again, but RustDDS no longer
    /// receives from it. If this process has never received messages from the peer, only logs a warning. In a secured graph, also only
    /// logs a warning: announcements are not authenticated there, so anyone could end this process with a false announcement.
    pub fn is_back(&self, Peer { name, heard_on, warn }: Peer) {
        match heard_on.is_empty() || self.is_secured {
            true => warn(&format!(
                "{name} was not heard for longer than its lease and is there again, but hears nothing of this node before one of the two \
                 is restarted"
            )),
            false => end(NetworkEnd::Deaf(format!("{name} on {}", heard_on.join(", ")))),
        }
    }

    fn reaches(&self, from: SocketAddr) -> bool {
        !self.on_loopback || from.ip().is_loopback()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::outside;
    use crate::dds::announcement::GROUP;
    use crate::dds::ended_threads::NetworkWatch;
    use rustdds::DomainParticipantBuilder;
    use std::net::{Ipv4Addr, SocketAddrV4};

    fn header(protocol: &[u8; 4], sender: u8) -> Vec<u8> {
        [protocol.as_slice(), &[2, 4, 1, 0x10], &[sender; 12], b"submessages"].concat()
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn only_a_lost_peer_is_recognized_by_its_announcement() {
        if outside("dds::peer_recovery::tests::only_a_lost_peer_is_recognized_by_its_announcement") {
            return;
        }
        // This socket keeps a participant in the group.
        let _ours =
            DomainParticipantBuilder::new(7).with_only_networks([Ipv4Addr::LOCALHOST]).build().unwrap();
        let mut lost = Lost::new(7, true, false, false);
        let peer = |name: &str| Peer { name: name.to_owned(), heard_on: Vec::new(), warn: Arc::new(|_| {}) };
        assert!(lost.socket.is_none(), "nobody was lost");
        lost.add([1; 12], peer("killed"));
        lost.add([2; 12], peer("back"));
        lost.add([3; 12], peer("restarted"));
        assert!(lost.remove([3; 12]).is_some_and(|peer| peer.name == "restarted"));
        let other = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        for message in [header(b"RTPS", 9), header(b"RTPX", 2), b"RTPS".to_vec(), header(b"RTPS", 2)] {
            other.send_to(&message, SocketAddrV4::new(GROUP, ports::first(7))).await.unwrap();
        }
        let heard = tokio::time::timeout(Duration::from_secs(20), lost.heard()).await.expect("it is heard");
        assert_eq!(heard.name, "back");
        assert_eq!(lost.participants.len(), 1);
        assert!(lost.remove([1; 12]).is_some() && lost.socket.is_none());
    }

    #[tokio::test]
    async fn with_static_peers_the_process_ends_once_a_peer_that_it_received_from_is_lost() {
        if outside(
            "dds::peer_recovery::tests::with_static_peers_the_process_ends_once_a_peer_that_it_received_from_is_lost",
        ) {
            return;
        }
        let mut lost = Lost::new(7, false, false, true);
        let peer = |heard_on| Peer { name: "robot".to_owned(), heard_on, warn: Arc::new(|_| {}) };
        lost.add([1; 12], peer(Vec::new()));
        assert_eq!(NetworkWatch::default().check(), Ok(()));
        lost.add([2; 12], peer(vec!["/joint_states".to_owned()]));
        assert_eq!(
            NetworkWatch::default().check(),
            Err(NetworkEnd::Lost("robot on /joint_states".to_owned()))
        );
    }
}
