//! Messages of any type as the bytes that they are, which RustDDS 0.15.1 has no reader for.

use crate::wire::{CDR_BE, CDR_LE};
use serde::de::{SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// A message in plain CDR with its encapsulation header of four bytes.
#[derive(Clone, Debug)]
pub(crate) struct RawCdr(pub Vec<u8>);

impl RawCdr {
    /// The header and the payload.
    pub fn parts(&self) -> Option<([u8; 4], &[u8])> {
        self.0.split_first_chunk().map(|(header, payload)| (*header, payload))
    }
}

/// Little endian: RustDDS writes that header, and here comes the payload.
impl Serialize for RawCdr {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let payload = self.0.get(CDR_LE.len()..).unwrap_or_default();
        // A tuple of bytes is just the bytes in CDR: no length, no alignment.
        let mut tuple = serializer.serialize_tuple(payload.len())?;
        payload.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for RawCdr {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Bytes(Vec<u8>);
        impl<'de> Visitor<'de> for Bytes {
            type Value = RawCdr;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("bytes")
            }
            fn visit_seq<A: SeqAccess<'de>>(mut self, mut input: A) -> Result<RawCdr, A::Error> {
                // The payload ends where the input does, which CDR reports as an error.
                while let Ok(Some(byte)) = input.next_element() {
                    self.0.push(byte);
                }
                Ok(RawCdr(self.0))
            }
        }
        // RustDDS takes the header off and shows the byte order only in the type of its deserializer; a reader with a decoder of our
        // own, which would see the header, cannot be made through its API.
        let big_endian = std::any::type_name::<D>().contains("BigEndian");
        let header = if big_endian { CDR_BE } else { CDR_LE };
        deserializer.deserialize_tuple(usize::MAX, Bytes(header.to_vec()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustdds::RepresentationIdentifier;
    use rustdds::serialization::deserialize_from_cdr_with_rep_id;

    #[test]
    fn a_payload_keeps_every_byte_and_its_byte_order() {
        let body: Vec<u8> = (0..=255).collect();
        for (encoding, header) in
            [(RepresentationIdentifier::CDR_LE, CDR_LE), (RepresentationIdentifier::CDR_BE, CDR_BE)]
        {
            let (payload, _) = deserialize_from_cdr_with_rep_id::<RawCdr>(&body, encoding).unwrap();
            assert_eq!(payload.0, [&header[..], &body].concat());
        }
    }
}
