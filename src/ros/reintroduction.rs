//! Introduces participants again that were lost and are heard again.
//!
//! Cyclone and Fast DDS repeat one announcement of themselves. RustDDS 0.15.1 keeps it after it has lost the participant, so a
//! repetition is nothing new to it (`dds_cache.rs`, `add_change_internal`), and the participant stays unknown.
//!
//! So the announcements of those who were lost are listened to here, and sent once more to our own participant, under a number that
//! they have not had.

use super::ports;
use super::rejoin::{Lost, prefix};
use rustdds::DomainParticipant;
use rustix::net::{AddressFamily, SocketFlags, SocketType, bind, socket_with, sockopt};
use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;
use tokio::net::UdpSocket;

/// A header is protocol, version, vendor and GUID prefix of the sender; submessages follow.
const HEADER: usize = 20;
const SENDER: std::ops::Range<usize> = 8..HEADER;

/// The writer of announcements of participants.
const ANNOUNCER: [u8; 4] = [0, 1, 0, 0xc2];

/// The largest datagram.
const LARGEST: usize = 65_536;

/// Listens beside a participant.
pub(super) struct Reintroduction {
    socket: UdpSocket,
    participant: SocketAddrV4,
    lost: Lost,
}

impl Reintroduction {
    /// Beside `participant`, which has lost these.
    ///
    /// # Errors
    /// Where the operating system gives no socket.
    pub fn new(participant: &DomainParticipant, lost: Lost) -> std::io::Result<Self> {
        let domain = participant.domain_id();
        let own = ports::discovery(domain, participant.participant_id());
        // What comes to a group that any socket of this computer has joined comes to all that are bound to its port.
        let socket = listen(SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, ports::first(domain)))?;
        Ok(Self { socket, participant: SocketAddrV4::new(Ipv4Addr::LOCALHOST, own), lost })
    }

    /// Listens for ever.
    pub async fn follow(self) {
        let mut buffer = vec![0; LARGEST];
        for number in 1.. {
            let introduction = self.next(&mut buffer, number).await;
            // What does not arrive is followed by the next one.
            let _ = self.socket.send_to(&introduction, self.participant).await;
        }
    }

    /// Waits for the next announcement of a lost participant.
    async fn next(&self, buffer: &mut [u8], number: u32) -> Vec<u8> {
        loop {
            let Ok(length) = self.socket.recv(buffer).await else {
                tokio::time::sleep(Duration::from_secs(1)).await;
                continue;
            };
            let message = &buffer[..length];
            let is_lost = message.get(SENDER).is_some_and(|sender| self.lost.contains(prefix(sender)));
            if is_lost && let Some(introduction) = renumbered(message, number) {
                return introduction;
            }
        }
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

/// The announcement of a participant with a number that begins with `number`; none where the message is none.
///
/// The sender is named by an INFO_SRC, not by the header: RustDDS would take the address that this comes from, which is ours, for the
/// participant's.
fn renumbered(message: &[u8], number: u32) -> Option<Vec<u8>> {
    let (header, submessages) = message.split_at_checked(HEADER)?;
    if !header.starts_with(b"RTPS") {
        return None;
    }
    let (at, is_little) = announcement_number(submessages)?;
    let mut submessages = submessages.to_vec();
    let number = if is_little { number.to_le_bytes() } else { number.to_be_bytes() };
    submessages.get_mut(at..at + number.len())?.copy_from_slice(&number);
    let info_src: [&[u8]; 5] = [&[0x0c, 0x01], &[20, 0], &[0; 4], &header[4..8], &header[SENDER]];
    Some([&header[..8], &[0; 12], &info_src.concat(), &submessages].concat())
}

/// Where the high word of the announcement's number is, and whether it is little endian (RTPS 2.5, section 9.4.5.4).
fn announcement_number(submessages: &[u8]) -> Option<(usize, bool)> {
    const DATA: u8 = 0x15;
    let mut at = 0;
    loop {
        let (&[kind, flags, low, high], body) = submessages.get(at..)?.split_first_chunk()?;
        let is_little = flags & 1 == 1;
        // Flags and an offset come first, and the reader for whom it is.
        if kind == DATA && body.get(8..12)? == ANNOUNCER {
            return Some((at + 4 + 12, is_little));
        }
        let length =
            if is_little { u16::from_le_bytes([low, high]) } else { u16::from_be_bytes([low, high]) };
        at += 4 + usize::from(length);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "52545053020501100110aabbccddeeff00112233";
    const INFO_TS: &str = "090108000102030405060708";

    fn bytes(parts: &[&str]) -> Vec<u8> {
        hex::decode(parts.concat()).unwrap()
    }

    #[test]
    fn an_announcement_comes_from_nowhere_with_its_sender_and_another_number() {
        let data = |number| format!("15051800000010000000000000 0100c2{number}00000000").replace(' ', "");
        let message = bytes(&[HEADER, INFO_TS, &data("0000000001000000")]);
        let from_nowhere = "5254505302050110000000000000000000000000";
        let info_src = "0c01140000000000020501100110aabbccddeeff00112233";
        let expected = bytes(&[from_nowhere, info_src, INFO_TS, &data("0200000001000000")]);
        assert_eq!(hex::encode(renumbered(&message, 2).unwrap()), hex::encode(expected));
        let message = bytes(&[HEADER, &data("0000000000000001").replacen("15051800", "15040018", 1)]);
        let renumbered = renumbered(&message, 2).unwrap();
        assert!(hex::encode(renumbered).contains("000100c20000000200000001"));
    }

    #[test]
    fn what_is_no_announcement_or_ends_early_is_left_alone() {
        let other = "15051800000010000000000000 0003c2000000000100000000000000".replace(' ', "");
        let whole = bytes(&[HEADER, INFO_TS, &other]);
        for length in 0..=whole.len() {
            assert_eq!(renumbered(&whole[..length], 2), None, "{length}");
        }
        let mut announcement = bytes(&[HEADER, INFO_TS, &other.replace("0003c2", "0100c2")]);
        assert!(renumbered(&announcement, 2).is_some());
        announcement[0] = b'X';
        assert_eq!(renumbered(&announcement, 2), None);
    }
}
