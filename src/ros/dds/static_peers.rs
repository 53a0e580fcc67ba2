//! Sends the multicast packets of a participant also to the hosts in `ROS_STATIC_PEERS`, which multicast may not reach.
//!
//! RustDDS 0.15.1 announces a participant by multicast, and by unicast only to this host. If a remote participant announces a
//! multicast address, RustDDS also sends it data and descriptions of endpoints by multicast. So this module receives the multicast
//! packets of our participant, and sends them on to the hosts:
//!
//! - It sends the announcement to each port that a participant may have on such a host. First it removes the multicast addresses
//!   from the announcement (`announcement`), so that participants there answer by unicast.
//! - It sends all other packets to the known participants on these hosts.
//!
//! Delete this module when `DomainParticipantBuilder` takes peers and the `dds` test an_arm_behind_a_router_… passes without the
//! module.

use super::announcement::{self, SENDER};
use super::own_datagrams::{OwnDatagrams, addresses};
use super::peer_recovery::Prefix;
use super::ports;
use futures::future::join_all;
use rustdds::DomainParticipant;
use std::collections::BTreeSet;
use std::net::{IpAddr, SocketAddr};
use std::sync::Weak;
use std::time::Duration;
use tokio::net::{UdpSocket, lookup_host};
use tokio::time::{Instant, MissedTickBehavior, interval};

/// The number of participants on one host that announcements can reach. Each participant has a port of its own.
const PARTICIPANTS: u16 = 32;

/// The time between two announcements of the participant.
const ANNOUNCEMENTS: Duration = Duration::from_secs(3);

/// The interval at which the module checks whether RustDDS has discovered further participants. Also the timeout for looking up the
/// addresses of a host.
const LOOK: Duration = Duration::from_millis(500);

/// The interval at which the module looks up the addresses of the hosts.
const LOOK_UP: Duration = Duration::from_secs(30);

/// How long to wait for the announcement of our own participant before a warning. RustDDS announces the participant every 10 s.
const PATIENCE: Duration = Duration::from_secs(15);

/// The length of the largest message \[bytes\].
const LARGEST: usize = 65_536;

/// The hosts in `ROS_STATIC_PEERS`, and the sockets for the packets that this module sends on to these hosts.
pub(crate) struct StaticPeers {
    names: Vec<String>,
    domain: u16,
    /// Receives the multicast packets that describe participants and their endpoints.
    discovery: UdpSocket,
    /// Receives the multicast packets with data.
    data: UdpSocket,
    datagrams: OwnDatagrams,
}

/// The addresses of the peers: their hosts and participants.
#[derive(Default)]
struct Peers {
    hosts: BTreeSet<IpAddr>,
    /// The addresses on which participants on these hosts receive data.
    participants: BTreeSet<SocketAddr>,
    /// The latest announcement of our participant.
    announcement: Option<Vec<u8>>,
}

impl StaticPeers {
    /// Begins to receive the multicast packets of this domain. Create the participant afterwards, so that its first announcement is
    /// received. `names` are addresses or names of hosts.
    ///
    /// # Errors
    /// The operating system's error if it creates no socket.
    pub fn listen(domain: u16, names: Vec<String>) -> std::io::Result<Self> {
        let [discovery, data] =
            [ports::first(domain), ports::first_of_data(domain)].map(announcement::listen);
        Ok(Self { names, domain, discovery: discovery?, data: data?, datagrams: OwnDatagrams::new(false)? })
    }

    /// Sends the multicast packets of `participant` to the hosts, forever.
    pub async fn serve(self, participant: Weak<DomainParticipant>, own: Prefix, warn: impl Fn(String)) {
        let (mut discovery, mut data) = (vec![0; LARGEST], vec![0; LARGEST]);
        let mut peers = Peers::default();
        let [mut announce, mut look, mut look_up] = [ANNOUNCEMENTS, LOOK, LOOK_UP].map(|period| {
            let mut timer = interval(period);
            timer.set_missed_tick_behavior(MissedTickBehavior::Delay);
            timer
        });
        let (mut warned, began) = (BTreeSet::new(), Instant::now());
        loop {
            tokio::select! {
                Ok(length) = self.discovery.recv(&mut discovery) => {
                    self.send_discovery(&mut discovery[..length], own, &mut peers);
                }
                Ok(length) = self.data.recv(&mut data) => {
                    if is_own(&data[..length], own) {
                        peers.participants.iter().for_each(|address| self.send(&data[..length], *address));
                    }
                }
                _ = look_up.tick() => peers.hosts.extend(self.hosts(&mut warned, &warn).await),
                _ = look.tick() => {
                    // When the participant has ended, keep the known addresses: the hosts must still get the participant's last
                    // messages.
                    participant.upgrade().iter().for_each(|participant| peers.look(participant));
                }
                _ = announce.tick() => {
                    self.announce(&peers);
                    if peers.announcement.is_none() && began.elapsed() > PATIENCE && warned.insert(String::new()) {
                        warn(WITHOUT_MULTICAST.to_owned());
                    }
                }
            }
        }
    }

    /// Sends a message that describes our participant or its endpoints.
    fn send_discovery(&self, message: &mut [u8], own: Prefix, peers: &mut Peers) {
        if !is_own(message, own) {
            return;
        }
        if announcement::without_multicast(message) {
            peers.announcement = Some(message.to_vec());
            return self.announce(peers);
        }
        for address in &peers.participants {
            // A participant receives discovery on the port before its data port, or on the data port itself.
            let before = SocketAddr::new(address.ip(), address.port().saturating_sub(1));
            [before, *address].iter().for_each(|address| self.send(message, *address));
        }
    }

    /// Sends our participant's announcement to each port that a participant may have on these hosts.
    fn announce(&self, peers: &Peers) {
        let Some(announcement) = &peers.announcement else { return };
        let ports = (0..PARTICIPANTS).map(|number| ports::of_participant(self.domain, number));
        let addresses =
            ports.flat_map(|port| peers.hosts.iter().map(move |host| SocketAddr::new(*host, port)));
        addresses.for_each(|address| self.send(announcement, address));
    }

    fn send(&self, message: &[u8], address: SocketAddr) {
        self.datagrams.send(message, &[address]);
    }

    /// Looks up the addresses of the hosts. Warns once of each host that is not found.
    async fn hosts(&self, warned: &mut BTreeSet<String>, warn: &impl Fn(String)) -> BTreeSet<IpAddr> {
        let found = join_all(self.names.iter().map(|name| tokio::time::timeout(LOOK, look_up(name)))).await;
        let mut hosts = BTreeSet::new();
        for (name, found) in self.names.iter().zip(found) {
            match found.unwrap_or_else(|slow| Err(slow.into())) {
                Ok(addresses) => hosts.extend(addresses),
                // The name may become known later.
                Err(why) if warned.insert(name.clone()) => {
                    warn(format!("ROS_STATIC_PEERS: {name:?} is not found, and is tried again: {why}"));
                }
                Err(_) => {}
            }
        }
        hosts
    }
}

/// The warning if no packet of our own participant is received.
const WITHOUT_MULTICAST: &str =
    "ROS_STATIC_PEERS has no effect: it needs a network interface with multicast, and this host has none";

impl Peers {
    /// Updates the addresses of the participants on these hosts from the readers that RustDDS has discovered.
    fn look(&mut self, participant: &DomainParticipant) {
        let readers = participant.discovered_readers().into_iter();
        let all = readers.flat_map(|reader| addresses(reader.reader_proxy.unicast_locator_list));
        self.participants = all.filter(|address| self.hosts.contains(&address.ip())).collect();
    }
}

fn is_own(message: &[u8], own: Prefix) -> bool {
    message.starts_with(b"RTPS") && message.get(SENDER) == Some(&own)
}

/// Returns the IPv4 addresses of a host.
async fn look_up(name: &str) -> std::io::Result<Vec<IpAddr>> {
    let addresses: Vec<_> =
        lookup_host((name, 0)).await?.map(|address| address.ip()).filter(IpAddr::is_ipv4).collect();
    if addresses.is_empty() { Err(std::io::Error::other("it has no IPv4 address")) } else { Ok(addresses) }
}
