//! RTPS packets of ours, beside those that RustDDS sends.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

/// Sends packets to where others listen. In a secured graph there are none: nobody there believes a plain packet.
pub(crate) struct OwnDatagrams(UdpSocket);

impl OwnDatagrams {
    /// From a participant that may be on loopback alone.
    ///
    /// # Errors
    /// Where the operating system gives no UDP socket.
    pub fn new(on_loopback: bool) -> std::io::Result<Self> {
        let interface = if on_loopback { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
        let socket = UdpSocket::bind((interface, 0))?;
        socket.set_nonblocking(true)?;
        Ok(Self(socket))
    }

    /// Sends the packet in one datagram, which the kernel divides where the network wants it shorter.
    pub fn send(&self, packet: &[u8], addresses: &[SocketAddr]) {
        for address in addresses {
            // A packet that does not leave is one that the network lost.
            let _ = self.0.send_to(packet, address);
        }
    }
}

/// Which of a remote endpoint's locators are of UDP over IPv4.
pub(super) fn addresses<L>(locators: Vec<L>) -> impl Iterator<Item = SocketAddr>
where
    SocketAddr: From<L>,
{
    locators.into_iter().map(SocketAddr::from).filter(SocketAddr::is_ipv4)
}
