//! Chooses the network interfaces of a participant.
//!
//! RustDDS 0.15.1 sends each multicast packet on every interface, and acknowledges to every address of a peer. So the
//! number of packets grows with the number of interfaces, and a host with container networks has many interfaces. Delete the default
//! choice when RustDDS sends each packet once.

use super::announcement::GROUP;
use if_addrs::get_if_addrs;
use std::net::{IpAddr, Ipv4Addr, UdpSocket};
use std::path::Path;

/// The variable that names the interfaces.
pub(crate) const VARIABLE: &str = "DQ_SERVO_INTERFACES";

/// The value of [`VARIABLE`] with which a participant uses all interfaces.
const ALL: &str = "all";

/// A host with at most this many addresses, apart from loopback, uses all of them.
const FEW: usize = 4;

/// The largest number of interface names in a warning.
const LISTED: usize = 6;

/// The addresses that a participant uses.
#[derive(Debug, PartialEq)]
pub(crate) struct Choice {
    /// The addresses, including that of loopback; `None` if the participant uses all addresses of this host.
    pub addresses: Option<Vec<Ipv4Addr>>,
    /// A warning about interfaces that are left out or not found; `None` if there are no such interfaces.
    pub warning: Option<String>,
}

/// An address of this host.
#[derive(Clone, Debug, PartialEq)]
struct Address {
    interface: String,
    ip: Ipv4Addr,
}

impl Choice {
    /// Chooses among the present addresses of this host. If `named` is not empty, chooses the interfaces with these names or
    /// addresses. If `named` is empty and the host has at most [`FEW`] addresses, chooses all addresses. If the host has more,
    /// chooses the addresses of the hardware interfaces, and the address from which the host sends multicast.
    pub fn now(named: &[String]) -> Self {
        let all = addresses();
        if !named.is_empty() {
            return Self::named(&all, named);
        }
        let routed = route();
        Self::default_of(&all, |address| Some(address.ip) == routed || is_hardware(&address.interface, DEPTH))
    }

    fn named(all: &[Address], named: &[String]) -> Self {
        if named.iter().any(|name| name == ALL) {
            return Self { addresses: None, warning: None };
        }
        let is =
            |address: &Address, name: &String| address.interface == *name || address.ip.to_string() == *name;
        let missing = named.iter().filter(|name| all.iter().all(|address| !is(address, name)));
        let missing: Vec<_> = missing.map(|name| format!("{name:?}")).collect();
        let warning = (!missing.is_empty()).then(|| {
            let has = listed(all.iter());
            format!(
                "{VARIABLE}: no interface with an IPv4 address is {}: this host has {has}",
                missing.join(" or ")
            )
        });
        let of_names = |address: &&Address| named.iter().any(|name| is(address, name));
        Self { addresses: Some(with_loopback(all.iter().filter(of_names))), warning }
    }

    fn default_of(all: &[Address], is_preferred: impl Fn(&Address) -> bool) -> Self {
        let outside: Vec<_> = all.iter().filter(|address| !address.ip.is_loopback()).collect();
        let (used, left_out): (Vec<_>, Vec<_>) = outside.iter().partition(|address| is_preferred(address));
        if outside.len() <= FEW || used.is_empty() || left_out.is_empty() {
            return Self { addresses: None, warning: None };
        }
        let warning = format!(
            "this host has {} network interfaces: {} used, {} left out ({VARIABLE}={ALL}, or names separated by semicolons, chooses others)",
            outside.len(),
            listed(used.iter().copied()),
            listed(left_out.into_iter()),
        );
        Self { addresses: Some(with_loopback(used.into_iter())), warning: Some(warning) }
    }
}

/// Returns the loopback address, followed by these addresses. Participants on this host find each other on loopback.
fn with_loopback<'a>(addresses: impl Iterator<Item = &'a Address>) -> Vec<Ipv4Addr> {
    std::iter::once(Ipv4Addr::LOCALHOST).chain(addresses.map(|address| address.ip)).collect()
}

/// Returns the names of some interfaces and the number of the others.
fn listed<'a>(addresses: impl Iterator<Item = &'a Address>) -> String {
    let names: Vec<_> = addresses.map(|address| address.interface.as_str()).collect();
    let more = names.len().saturating_sub(LISTED);
    let first = names[..names.len() - more].join(", ");
    if more > 0 { format!("{first} and {more} more") } else { first }
}

/// Returns the addresses of this host. RustDDS uses IPv4 only.
fn addresses() -> Vec<Address> {
    let all = get_if_addrs().unwrap_or_default().into_iter();
    let ipv4 = all.filter_map(|interface| match interface.ip() {
        IpAddr::V4(ip) => Some(Address { interface: interface.name, ip }),
        IpAddr::V6(_) => None,
    });
    ipv4.collect()
}

/// Returns the address from which this host sends multicast; `None` if the host has no route for multicast. Connecting a UDP socket
/// sends nothing.
fn route() -> Option<Ipv4Addr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    socket.connect((GROUP, 1)).ok()?;
    match socket.local_addr().ok()?.ip() {
        IpAddr::V4(ip) => Some(ip),
        IpAddr::V6(_) => None,
    }
}

/// The largest number of steps from an interface down to its hardware. A VLAN on a bond needs two: to the bond, then to the hardware.
const DEPTH: usize = 2;

/// Returns whether the interface is hardware, or is built on hardware in at most `depth` steps, as a VLAN or a bridge may be.
fn is_hardware(interface: &str, depth: usize) -> bool {
    let folder = Path::new("/sys/class/net").join(interface);
    let below = || folder.read_dir().into_iter().flatten().flatten();
    let below =
        || below().filter_map(|file| file.file_name().to_str()?.strip_prefix("lower_").map(str::to_owned));
    folder.join("device").exists() || depth > 0 && below().any(|lower| is_hardware(&lower, depth - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(count: u8) -> Vec<Address> {
        let other = |number| Address { interface: format!("br{number}"), ip: [172, 18, number, 1].into() };
        let lo = Address { interface: "lo".to_owned(), ip: Ipv4Addr::LOCALHOST };
        let eth0 = Address { interface: "eth0".to_owned(), ip: [10, 0, 0, 5].into() };
        [lo, eth0].into_iter().chain((1..count).map(other)).collect()
    }

    #[test]
    fn a_host_with_many_interfaces_uses_those_of_hardware_and_says_so() {
        let is_hardware = |address: &Address| address.interface == "eth0";
        let few = Choice::default_of(&host(4), is_hardware);
        assert_eq!(few, Choice { addresses: None, warning: None });
        let many = Choice::default_of(&host(12), is_hardware);
        assert_eq!(many.addresses.unwrap(), [Ipv4Addr::LOCALHOST, [10, 0, 0, 5].into()]);
        let warning = many.warning.unwrap();
        assert!(warning.contains("12 network interfaces: eth0 used, br1, br2"), "{warning}");
        assert!(warning.contains("and 5 more left out (DQ_SERVO_INTERFACES=all"), "{warning}");
        assert_eq!(Choice::default_of(&host(12), |_| false).addresses, None, "nothing tells them apart");
    }

    #[test]
    fn names_and_addresses_choose_interfaces() {
        let named = |names: &[&str]| {
            Choice::named(&host(6), &names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
        };
        let Choice { addresses, warning } = named(&["br2", "10.0.0.5"]);
        let expected = [Ipv4Addr::LOCALHOST, [10, 0, 0, 5].into(), [172, 18, 2, 1].into()];
        assert_eq!((addresses.unwrap(), warning), (expected.to_vec(), None));
        assert_eq!(named(&["all"]).addresses, None);
        let Choice { addresses, warning } = named(&["eth7"]);
        assert_eq!(addresses.unwrap(), [Ipv4Addr::LOCALHOST]);
        assert!(warning.unwrap().contains("is \"eth7\": this host has lo, eth0, br1"));
    }
}
