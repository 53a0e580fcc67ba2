//! RTPS packets that this program sends in addition to those of RustDDS.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

/// Sends packets to the addresses of other participants. Not used in a secured graph, where plain packets are ignored.
pub(crate) struct OwnDatagrams(UdpSocket);

impl OwnDatagrams {
    /// Opens the socket of a participant. `on_loopback` is true if the participant is restricted to loopback.
    ///
    /// # Errors
    /// The operating system's error if no UDP socket can be opened.
    pub fn new(on_loopback: bool) -> std::io::Result<Self> {
        let interface = if on_loopback { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
        let socket = UdpSocket::bind((interface, 0))?;
        socket.set_nonblocking(true)?;
        Ok(Self(socket))
    }

    /// Sends the packet in one datagram, which the kernel divides if necessary.
    pub fn send(&self, packet: &[u8], addresses: &[SocketAddr]) {
        for address in addresses {
            // A packet that cannot be sent is treated like one that the network lost.
            let _ = self.0.send_to(packet, address);
        }
    }
}

/// Returns the UDP addresses over IPv4 that are among these locators of a remote endpoint.
pub(super) fn addresses<L>(locators: Vec<L>) -> impl Iterator<Item = SocketAddr>
where
    SocketAddr: From<L>,
{
    locators.into_iter().map(SocketAddr::from).filter(SocketAddr::is_ipv4)
}
