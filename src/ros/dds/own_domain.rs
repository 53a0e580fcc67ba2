//! Finds a domain that nobody else on this host uses.
//!
//! DDS partitions would separate participants too, but RustDDS 0.15.1 has no partitions. Delete this module when `QosPolicyBuilder`
//! has partitions.

use super::ports;
use std::net::{Ipv4Addr, UdpSocket};

/// The port that the owner of a domain binds, counted from the domain's first port. RTPS 2.5, section 9.6.2.4, leaves the ports 2
/// to 9 of a domain unused.
const CLAIM: u16 = 2;

/// A domain on this host that had no participant when it was found. Other `OwnDomain`s avoid the domain until this value is
/// dropped.
#[derive(Debug)]
pub struct OwnDomain {
    id: u16,
    _claim: UdpSocket,
}

impl OwnDomain {
    /// The highest domain that is tried. The search begins here and goes down, because users prefer low domains. The ports of all
    /// domains up to this one are below the ephemeral ports of Linux (from 32768 on).
    pub(crate) const HIGHEST: u16 = 100;

    /// Finds a free domain other than `common`, which others may join at any time. Returns `None` if every domain is in use.
    pub(crate) fn find(common: u16) -> Option<Self> {
        (1..=Self::HIGHEST).rev().filter(|id| *id != common).find_map(Self::claim)
    }

    /// Returns the domain's number.
    pub fn id(&self) -> u16 {
        self.id
    }

    /// Claims the domain `id` if nobody on this host uses it. A domain is in use if a socket is bound to one of its ports, because the
    /// participants of every vendor bind these ports.
    fn claim(id: u16) -> Option<Self> {
        let first = ports::first(id);
        let claim = UdpSocket::bind((Ipv4Addr::LOCALHOST, first + CLAIM)).ok()?;
        // Binding without address reuse fails even if the other sockets share their ports.
        let free = |port: u16| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, first + port)).is_ok();
        (0..ports::OF_A_DOMAIN).filter(|port| *port != CLAIM).all(free).then_some(Self { id, _claim: claim })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_is_left_to_the_process_that_found_it_and_to_those_in_it() {
        let [one, two] = [0; 2].map(|common| OwnDomain::find(common).unwrap());
        assert_ne!(one.id(), two.id());
        let id = one.id();
        assert!(OwnDomain::claim(id).is_none(), "held by one");
        drop(one);
        assert_ne!(OwnDomain::find(id).unwrap().id(), id);
        // The unicast port of a second participant.
        let _participant = UdpSocket::bind((Ipv4Addr::LOCALHOST, ports::first(id) + 12)).unwrap();
        assert_ne!(OwnDomain::find(0).unwrap().id(), id);
    }
}
