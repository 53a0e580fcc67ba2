//! Pads messages to a multiple of four bytes.
//!
//! RTPS pads every sample to four bytes. RustDDS 0.15.1 writes this padding after an encrypted payload, where the receiver (also
//! RustDDS) expects the signature. So a secured message whose length is not a multiple of four never arrives. Zeros before
//! encryption avoid this. Without encryption these zeros equal the padding of RTPS. Delete this module when test `security`
//! the_secured_demo_moves_… passes without the module.

use rustdds::RepresentationIdentifier;
use rustdds::serialization::to_writer_with_rep_id;
use serde::ser::{Error, SerializeTuple};
use serde::{Deserialize, Serialize, Serializer};

/// The unit to which RTPS pads \[bytes\].
const WORD: usize = 4;

/// A message, followed by zeros that make its length in CDR a multiple of four.
#[derive(Clone, Deserialize)]
#[serde(transparent)]
pub(crate) struct Padded<M>(pub M);

impl<M: Serialize> Serialize for Padded<M> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut length = Length(0);
        to_writer_with_rep_id(&mut length, &self.0, RepresentationIdentifier::CDR_LE)
            .map_err(S::Error::custom)?;
        let padding = length.0.next_multiple_of(WORD) - length.0;
        // In CDR a tuple is encoded as its elements only.
        let mut tuple = serializer.serialize_tuple(1 + padding)?;
        tuple.serialize_element(&self.0)?;
        (0..padding).try_for_each(|_| tuple.serialize_element(&0u8))?;
        tuple.end()
    }
}

/// Counts the written bytes.
struct Length(usize);

impl std::io::Write for Length {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_messages::messages::StringMessage;

    #[test]
    fn zeros_follow_the_message_up_to_four_bytes() {
        for length in 0..9 {
            let message = StringMessage { data: "x".repeat(length) };
            let (mut plain, mut padded) = (Vec::new(), Vec::new());
            to_writer_with_rep_id(&mut plain, &message, RepresentationIdentifier::CDR_LE).unwrap();
            to_writer_with_rep_id(&mut padded, &Padded(message), RepresentationIdentifier::CDR_LE).unwrap();
            plain.resize(plain.len().next_multiple_of(4), 0);
            assert_eq!(padded, plain);
        }
    }
}
