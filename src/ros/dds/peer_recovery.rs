//! Participants that were lost, and are there all the same.
//!
//! A participant that was not heard for the time of its lease is lost: Cyclone gives 10 s, Fast DDS 20 s, RustDDS 50 s. It may have
//! been killed, and is never heard again. Or a cable was out, or its computer asleep: then it goes on to announce itself, and RustDDS
//! 0.15.1 has lost it for good. Cyclone and Fast DDS repeat one announcement, which is nothing new to it (`dds_cache.rs`,
//! `add_change_internal`), so the participant stays unknown. One of RustDDS it knows again, but matches none of its endpoints with
//! those of ours that were there before (`discovery.rs`, "Participant rediscovery").
//!
//! So the group to which all announce themselves is listened to from the first loss on. Where nobody was lost, no socket is open. This goes
//! when who was lost and is back is heard again: when test `dds` who_was_heard_and_comes_back_… has nothing to end.

use super::ended_threads::deaf_to;
use super::ports;
use rustix::net::{AddressFamily, SocketFlags, SocketType, bind, socket_with, sockopt};
use std::collections::HashMap;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::sync::Arc;
use std::time::Duration;
use tokio::net::UdpSocket;

/// Lost participants that are listened for; of more, some are forgotten.
const PARTICIPANTS: usize = 256;

/// The group to which participants announce themselves (RTPS 2.5, section 9.6.2.4.1).
const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);

/// A message begins with protocol, version, vendor, and the beginning of its sender's GUIDs. Nothing after that is read.
const HEADER: usize = 20;
const SENDER: std::ops::Range<usize> = 8..HEADER;

/// How long after a socket that fails there is another attempt.
const PAUSE: Duration = Duration::from_secs(1);

/// The beginning that the GUIDs of a participant and of all its endpoints share.
pub(crate) type Prefix = [u8; 12];

/// RustDDS's own type of it has no public name.
pub(crate) fn prefix(of: impl AsRef<[u8]>) -> Prefix {
    of.as_ref().first_chunk().copied().unwrap_or_default()
}

/// Where an endpoint's owner is warned.
pub(crate) type Warn = Arc<dyn Fn(&str) + Send + Sync>;

/// What a participant was to the nodes of this one.
pub(crate) struct Peer {
    /// One of its nodes, in words.
    pub name: String,
    /// The topics on which it was heard.
    pub heard_on: Vec<String>,
    /// Of a node that was connected with it.
    pub warn: Warn,
}

/// Who was lost.
pub(crate) struct Lost {
    listen_on: SocketAddrV4,
    on_loopback: bool,
    is_secured: bool,
    participants: HashMap<Prefix, Peer>,
    socket: Option<UdpSocket>,
}

impl Lost {
    /// Nobody yet, in that domain, which may be heard on loopback alone, and whose graph may be secured.
    pub fn new(domain: u16, on_loopback: bool, is_secured: bool) -> Self {
        let listen_on = SocketAddrV4::new(GROUP, ports::first(domain));
        Self { listen_on, on_loopback, is_secured, participants: HashMap::new(), socket: None }
    }

    /// One more was not heard for the time of its lease. Begins to listen.
    pub fn add(&mut self, participant: Prefix, peer: Peer) {
        if self.socket.is_none() {
            // What comes to a group that any socket of this computer has joined comes to all that are bound to it.
            match listen(self.listen_on) {
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

    /// That participant is there; who it is, where it was lost.
    pub fn remove(&mut self, participant: Prefix) -> Option<Peer> {
        let peer = self.participants.remove(&participant);
        if self.participants.is_empty() {
            // What nobody reads would still be there, and old, when the next one is lost.
            self.socket = None;
        }
        peer
    }

    /// Waits until one of them is heard.
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

    /// Ends the process, which has lost the peer for good, where it has heard it; who only heard this process finds out by itself. In a
    /// secured graph it is only warned of: announcements are not authenticated, and anybody could end the process by one.
    pub fn is_back(&self, Peer { name, heard_on, warn }: Peer) {
        match heard_on.is_empty() || self.is_secured {
            true => warn(&format!(
                "{name} was not heard for longer than its lease and is there again, but hears nothing of this node before one of the two \
                 is started anew"
            )),
            false => deaf_to(format!("{name} on {}", heard_on.join(", "))),
        }
    }

    fn reaches(&self, from: SocketAddr) -> bool {
        !self.on_loopback || from.ip().is_loopback()
    }
}

/// A socket on a port that others have too.
fn listen(address: SocketAddrV4) -> std::io::Result<UdpSocket> {
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::INET, SocketType::DGRAM, flags, None)?;
    sockopt::set_socket_reuseaddr(&socket, true)?;
    bind(&socket, &address)?;
    UdpSocket::from_std(socket.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::outside;
    use rustdds::DomainParticipantBuilder;

    fn header(protocol: &[u8; 4], sender: u8) -> Vec<u8> {
        [protocol.as_slice(), &[2, 4, 1, 0x10], &[sender; 12], b"submessages"].concat()
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn who_was_lost_is_heard_by_its_announcement_and_nobody_else_is() {
        if outside("dds::peer_recovery::tests::who_was_lost_is_heard_by_its_announcement_and_nobody_else_is")
        {
            return;
        }
        // A participant is in the group.
        let _ours =
            DomainParticipantBuilder::new(7).with_only_networks([Ipv4Addr::LOCALHOST]).build().unwrap();
        let mut lost = Lost::new(7, true, false);
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
}
