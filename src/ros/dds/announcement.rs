//! The announcements by which participants make themselves known to a multicast group (RTPS 2.5, sections 8.5.3 and 9.6.2). This
//! module does not use RustDDS.

use rustix::net::{AddressFamily, SocketFlags, SocketType, bind, socket_with, sockopt};
use std::net::{Ipv4Addr, SocketAddrV4};
use tokio::net::UdpSocket;

/// The address of the multicast group.
pub(crate) const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);

/// The position of the sender's GUID prefix in a message \[bytes\]. Protocol, version and vendor precede the prefix.
/// The submessages follow it.
pub(super) const SENDER: std::ops::Range<usize> = 8..20;

/// Opens a socket that receives the packets sent to this port of the multicast group. Other sockets may use the port too. If any
/// socket of this host has joined the group, as a participant's socket does, a multicast packet reaches all sockets on the port.
///
/// # Errors
/// The operating system's error if it creates no socket.
pub(super) fn listen(port: u16) -> std::io::Result<UdpSocket> {
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::INET, SocketType::DGRAM, flags, None)?;
    sockopt::set_socket_reuseaddr(&socket, true)?;
    bind(&socket, &SocketAddrV4::new(GROUP, port))?;
    UdpSocket::from_std(socket.into())
}

/// The kind of a submessage with data.
const DATA: u8 = 0x15;
/// The flag of a submessage that has a payload.
const PAYLOAD: u8 = 0x04;

/// The flag of a submessage that is in little endian.
const LITTLE_ENDIAN: u8 = 0x01;

/// The id of the entity that writes announcements.
const ANNOUNCER: [u8; 4] = [0, 1, 0, 0xc2];

/// The ids of the parameters with multicast addresses: for discovery, and for data.
const MULTICAST: [u16; 2] = [0x33, 0x48];
/// The id of a parameter that receivers ignore.
const IGNORED: u16 = 0;
/// The id that ends the parameters.
const END: u16 = 1;

/// Removes the multicast addresses from `message`, an RTPS message with an announcement. Returns false if `message` is not an
/// announcement.
pub(super) fn without_multicast(message: &mut [u8]) -> bool {
    let mut at = SENDER.end;
    // A submessage has a kind, flags and the length of what follows.
    while let Some([kind, flags, low, high]) = four(message, at) {
        let length = usize::from(number([low, high], flags & LITTLE_ENDIAN != 0));
        // DATA continues with extra flags, the distance from the next field to the payload, the reader and the writer.
        let is_announcement =
            kind == DATA && flags & PAYLOAD != 0 && four(message, at + 12) == Some(ANNOUNCER);
        if let Some([_, _, low, high]) = four(message, at + 4).filter(|_| is_announcement) {
            let payload = at + 8 + usize::from(number([low, high], flags & LITTLE_ENDIAN != 0));
            ignore_multicast(message, payload);
            return true;
        }
        // A length of zero means that the submessage extends to the end of the message.
        if length == 0 {
            return false;
        }
        at += 4 + length;
    }
    false
}

/// Marks the parameters with multicast addresses as ignored. `payload` is the payload's position in `message`; the payload begins
/// with the bytes that name its encoding.
fn ignore_multicast(message: &mut [u8], payload: usize) {
    let Some([_, encoding, ..]) = four(message, payload) else { return };
    let (is_little_endian, mut at) = (encoding & 1 != 0, payload + 4);
    while let Some([a, b, c, d]) = four(message, at) {
        let (parameter, length) = (number([a, b], is_little_endian), number([c, d], is_little_endian));
        if parameter == END {
            return;
        }
        if MULTICAST.contains(&parameter) {
            message[at..at + 2].copy_from_slice(&IGNORED.to_le_bytes());
        }
        at += 4 + usize::from(length);
    }
}

fn four(message: &[u8], at: usize) -> Option<[u8; 4]> {
    message.get(at..)?.first_chunk().copied()
}

fn number(bytes: [u8; 2], is_little_endian: bool) -> u16 {
    if is_little_endian { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HEADER: &str = "5254505302040112011202030405060708090a0b";
    const INFO_TS: &str = "0901080000000000 00000000";

    /// Returns a DATA submessage of the announcer. The submessage has both multicast addresses, and a unicast address for discovery
    /// (0x32).
    fn announcement(multicast: [&str; 2]) -> Vec<u8> {
        let locator = "1800 01000000 f21c0000 000000000000000000000000 efff0001";
        let parameters =
            ["3200", multicast[0], multicast[1]].map(|parameter| format!("{parameter}{locator}"));
        let data = format!(
            "15057000 00001000 00000000 000100c2 0000000001000000 00030000 {} 01000000",
            parameters.concat()
        );
        hex::decode([HEADER, INFO_TS, &data].concat().replace(' ', "")).unwrap()
    }

    #[test]
    fn an_announcement_keeps_all_but_its_multicast_addresses() {
        let mut message = announcement(["3300", "4800"]);
        assert!(without_multicast(&mut message));
        assert_eq!(message, announcement(["0000", "0000"]));
    }

    #[test]
    fn other_messages_are_unchanged() {
        for (at, byte) in [(32, 0x07), (32 + 12, 1), (33, 0x09)] {
            let mut message = announcement(["3300", "4800"]);
            message[at] = byte;
            let before = message.clone();
            assert!(!without_multicast(&mut message));
            assert_eq!(message, before);
        }
    }

    proptest! {
        #[test]
        fn cut_and_random_messages_do_no_harm(mut bytes in proptest::collection::vec(any::<u8>(), 0..200), cut in 0_usize..160) {
            without_multicast(&mut bytes);
            let mut message = announcement(["3300", "4800"]);
            message.truncate(cut);
            without_multicast(&mut message);
            let mut end = announcement(["3300", "4800"]);
            end.truncate(36 + cut % 40);
            end.extend(bytes);
            without_multicast(&mut end);
        }
    }
}
