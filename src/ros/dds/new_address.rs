//! Detects that this host has an address that the process's participant does not use.
//!
//! RustDDS 0.15.1 uses only the network interfaces that had an address when the participant was created. So a process that was
//! started before the network meets nobody. Delete this module when participants use new addresses, that is, when test `dds`
//! a_servo_started_before_the_network_… passes without the module.

use super::ended_threads::note_new_address;
use std::collections::BTreeSet;
use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;

/// The interval at which the addresses of this host are checked.
const INTERVAL: Duration = Duration::from_secs(1);

/// The addresses that a participant uses.
pub(crate) struct UsedAddresses(BTreeSet<Ipv4Addr>);

impl UsedAddresses {
    /// Returns the present addresses of this host. Call this function before creating the participant: an address that appears
    /// between the two calls then counts as new.
    pub fn now() -> Self {
        Self(addresses().unwrap_or_default())
    }

    /// Waits until this host has an address that the participant does not use, and notes the address. Never returns if the
    /// operating system does not list addresses.
    pub async fn watch(self, warn: impl Fn(String)) {
        loop {
            tokio::time::sleep(INTERVAL).await;
            let new = addresses().and_then(|addresses| addresses.difference(&self.0).next().copied());
            if let Some(new) = new {
                warn(format!(
                    "this host has the new address {new}: nodes that are reached by it are not met before this program is started again"
                ));
                return note_new_address(new);
            }
        }
    }
}

/// Returns this host's addresses other than loopback. RustDDS uses IPv4 only.
fn addresses() -> Option<BTreeSet<Ipv4Addr>> {
    let interfaces = if_addrs::get_if_addrs().ok()?;
    let addresses =
        interfaces.into_iter().filter(|interface| !interface.is_loopback()).map(|interface| interface.ip());
    let ipv4 = addresses.filter_map(|address| match address {
        IpAddr::V4(address) => Some(address),
        IpAddr::V6(_) => None,
    });
    Some(ipv4.collect())
}
