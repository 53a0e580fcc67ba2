//! Plain CDR, the encoding of messages.

use super::WireError;
use super::messages::Message;
use byteorder::{BigEndian, LittleEndian};
use serde::de::DeserializeOwned;

/// The encapsulation header of plain CDR in little endian. Its last two bytes are options that nobody uses.
pub const CDR_LE: [u8; 4] = [0, 1, 0, 0];
/// The encapsulation header of plain CDR in big endian.
pub const CDR_BE: [u8; 4] = [0, 0, 0, 0];

/// Decodes a message from its bytes, including the encapsulation header of four bytes.
///
/// # Errors
/// [`WireError::Decode`] if the bytes are not a complete message of type `M` in plain CDR.
pub fn decode<M: Message>(cdr: &[u8]) -> Result<M, WireError> {
    let error = |why: String| WireError::Decode { message: M::TYPE, bytes: cdr.len(), why };
    let Some((header, payload)) = cdr.split_first_chunk() else {
        return Err(error("they do not begin like plain CDR".to_owned()));
    };
    decode_payload(*header, payload).map(|(message, _)| message).map_err(error)
}

/// Decodes the value at the beginning of `payload`, in the encoding that the encapsulation header `header` names. Returns the value
/// and the number of bytes that the value takes.
pub fn decode_payload<V: DeserializeOwned>(header: [u8; 4], payload: &[u8]) -> Result<(V, usize), String> {
    let decoded = match header {
        [0, 0, ..] => cdr_encoding::from_bytes::<V, BigEndian>(payload),
        [0, 1, ..] => cdr_encoding::from_bytes::<V, LittleEndian>(payload),
        _ => return Err("they do not begin like plain CDR".to_owned()),
    };
    decoded.map_err(|why| why.to_string())
}
