//! A domain that nobody else on this host is in, for those who must not meet others.
//!
//! DDS partitions would serve as well, but RustDDS knows none.

use super::environment::Environment;
use super::error::RosError;
use super::ports;
use std::net::{Ipv4Addr, UdpSocket};

/// The ports 2 to 9 of a domain are nobody's by RTPS 2.5, section 9.6.2.4: this one is held by who has the domain for itself.
const CLAIM: u16 = 2;

/// The ports of the domains up to this one lie below those that Linux gives to anybody (from 32768 on). People begin to count
/// at 0, so the search begins here.
const HIGHEST: u16 = 100;

/// A domain on this host without any other participant when it was found. It is left to whoever has this, until it is dropped.
#[derive(Debug)]
pub struct OwnDomain {
    id: u16,
    _claim: UdpSocket,
}

impl OwnDomain {
    /// Finds one; never the domain of `environment`, which others may join at any time.
    ///
    /// # Errors
    /// [`RosError::NoNetwork`], and [`RosError::NoFreeDomain`] where each domain has somebody.
    pub fn find(environment: &Environment) -> Result<Self, RosError> {
        environment.clone().this_host_only().check_network()?;
        let mut others = (1..=HIGHEST).rev().filter(|id| *id != environment.domain_id);
        others.find_map(Self::claim).ok_or(RosError::NoFreeDomain { highest: HIGHEST })
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
    use crate::ros::Reach;

    #[test]
    fn a_domain_is_left_to_who_found_it_and_to_who_is_in_it() {
        let environment = Environment { domain_id: 0, reach: Reach::Subnet, enclave: None };
        let [one, two] = [OwnDomain::find(&environment).unwrap(), OwnDomain::find(&environment).unwrap()];
        assert_ne!(one.id(), two.id());
        let id = one.id();
        assert!(OwnDomain::claim(id).is_none(), "held by one");
        drop(one);
        assert_ne!(OwnDomain::find(&Environment { domain_id: id, ..environment.clone() }).unwrap().id(), id);
        // The unicast port of a second participant.
        let _participant = UdpSocket::bind((Ipv4Addr::LOCALHOST, ports::first(id) + 12)).unwrap();
        assert_ne!(OwnDomain::find(&environment).unwrap().id(), id);
    }
}
