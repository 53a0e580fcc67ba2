//! A domain that nobody else on this host is in, for those who must not meet others.
//!
//! DDS partitions would serve as well, but RustDDS 0.15.1 knows none. This goes when `QosPolicyBuilder` has them.

use super::ports;
use std::net::{Ipv4Addr, UdpSocket};

/// The ports 2 to 9 of a domain are nobody's by RTPS 2.5, section 9.6.2.4: this one is held by who has the domain for itself.
const CLAIM: u16 = 2;

/// A domain on this host without any other participant when it was found. It is left to whoever has this, until it is dropped.
#[derive(Debug)]
pub struct OwnDomain {
    id: u16,
    _claim: UdpSocket,
}

impl OwnDomain {
    /// The ports of the domains up to this one lie below those that Linux gives to anybody (from 32768 on). People begin to count
    /// at 0, so the search begins here.
    pub(crate) const HIGHEST: u16 = 100;

    /// Finds one other than `common`, which others may join at any time; none where each domain has somebody.
    pub(crate) fn find(common: u16) -> Option<Self> {
        (1..=Self::HIGHEST).rev().filter(|id| *id != common).find_map(Self::claim)
    }

    /// The domain.
    pub fn id(&self) -> u16 {
        self.id
    }

    /// Takes the domain if it is free: any participant, of whatever vendor, has sockets on its ports.
    fn claim(id: u16) -> Option<Self> {
        let first = ports::first(id);
        let claim = UdpSocket::bind((Ipv4Addr::LOCALHOST, first + CLAIM)).ok()?;
        // Ports that are shared are refused too to who does not ask to share them.
        let free = |port: u16| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, first + port)).is_ok();
        (0..ports::OF_A_DOMAIN).filter(|port| *port != CLAIM).all(free).then_some(Self { id, _claim: claim })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_is_left_to_who_found_it_and_to_who_is_in_it() {
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
