//! Decodes messages into the memory of earlier ones, so that a steady stream of messages causes no allocations.

use super::messages::{
    Header, JointState, Pose, PoseStamped, Time, Twist, TwistStamped, Wrench, WrenchStamped,
};
use dq_common::text::{MOST, cut};
use serde::de::{DeserializeSeed, Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::cell::Cell;
use std::fmt;

/// A type with values that can be overwritten by decoded values, so that their heap memory is used again. The result equals that
/// of [`Deserialize`].
pub trait InPlace: Default {
    /// Replaces this value by the deserialized one.
    ///
    /// # Errors
    /// The deserializer's error. The value is then a mixture of the old and the new value.
    fn read_from<'de, D: Deserializer<'de>>(&mut self, deserializer: D) -> Result<(), D::Error>;
}

/// Decodes a message, and uses the heap memory of the message in the cell for it. Leaves a default message in the cell.
pub struct Reuse<'a, M>(pub &'a Cell<M>);

impl<M> Clone for Reuse<'_, M> {
    fn clone(&self) -> Self {
        Self(self.0)
    }
}

impl<'de, M: InPlace> DeserializeSeed<'de> for Reuse<'_, M> {
    type Value = M;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<M, D::Error> {
        let mut message = self.0.take();
        message.read_from(deserializer)?;
        Ok(message)
    }
}

/// Decodes a value into the memory of this earlier value with [`InPlace::read_from`].
struct Over<'a, T>(&'a mut T);

impl<'de, T: InPlace> DeserializeSeed<'de> for Over<'_, T> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        self.0.read_from(deserializer)
    }
}

/// Decodes the next part of a message.
fn next<'de, A: SeqAccess<'de>>(input: &mut A, part: &mut impl InPlace) -> Result<(), A::Error> {
    let read = input.next_element_seed(Over(part))?;
    read.ok_or_else(|| A::Error::custom("a message that ends too early"))
}

/// Implements [`InPlace`] for types without heap memory.
macro_rules! plain {
    ($($kind:ty),*) => {$(
        impl InPlace for $kind {
            fn read_from<'de, D: Deserializer<'de>>(&mut self, deserializer: D) -> Result<(), D::Error> {
                *self = Self::deserialize(deserializer)?;
                Ok(())
            }
        }
    )*};
}
plain!(f64, Time, Pose, Twist, Wrench);

/// Implements [`InPlace`] for messages, given their fields in order.
macro_rules! fields {
    ($($message:ident { $($field:ident),* })*) => {$(
        impl InPlace for $message {
            fn read_from<'de, D: Deserializer<'de>>(&mut self, deserializer: D) -> Result<(), D::Error> {
                const FIELDS: &[&str] = &[$(stringify!($field)),*];
                deserializer.deserialize_struct(stringify!($message), FIELDS, Over(self))
            }
        }

        impl<'de> Visitor<'de> for Over<'_, $message> {
            type Value = ();
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str(stringify!($message))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut input: A) -> Result<(), A::Error> {
                $(next(&mut input, &mut self.0.$field)?;)*
                Ok(())
            }
        }
    )*};
}
fields! {
    Header { stamp, frame_id }
    JointState { header, name, position, velocity, effort }
    PoseStamped { header, pose }
    TwistStamped { header, twist }
    WrenchStamped { header, wrench }
}

/// Shortens the text to the longest allowed length (see [`cut`]), because other nodes may send texts of any length.
impl InPlace for String {
    fn read_from<'de, D: Deserializer<'de>>(&mut self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_str(Over(self))
    }
}

impl Visitor<'_> for Over<'_, String> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a text")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        self.0.clear();
        self.0.push_str(&cut(text));
        Ok(())
    }
}

/// Rejects a list with more than [`MOST`] elements, because other nodes may send lists of any length.
impl<T: InPlace> InPlace for Vec<T> {
    fn read_from<'de, D: Deserializer<'de>>(&mut self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(Over(self))
    }
}

impl<'de, T: InPlace> Visitor<'de> for Over<'_, Vec<T>> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a list of {MOST} elements at most")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut input: A) -> Result<(), A::Error> {
        let mut count = 0;
        for old in self.0.iter_mut() {
            if input.next_element_seed(Over(old))?.is_none() {
                break;
            }
            count += 1;
        }
        self.0.truncate(count);
        let mut new = T::default();
        while input.next_element_seed(Over(&mut new))?.is_some() {
            if self.0.len() == MOST {
                return Err(A::Error::custom(format!("a list of more than {MOST} elements")));
            }
            self.0.push(std::mem::take(&mut new));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_common::text::LONGEST;
    use proptest::prelude::*;
    use rustdds::RepresentationIdentifier;
    use rustdds::serialization::{
        deserialize_from_cdr_with_decoder_and_rep_id, deserialize_from_cdr_with_rep_id, to_writer_with_rep_id,
    };

    const CDR: RepresentationIdentifier = RepresentationIdentifier::CDR_LE;

    fn bytes(message: &JointState) -> Vec<u8> {
        let mut bytes = Vec::new();
        to_writer_with_rep_id(&mut bytes, message, CDR).unwrap();
        bytes
    }

    /// Returns the message in `bytes`, decoded into the message `old`; `None` if the bytes are not a message.
    fn over(old: JointState, bytes: &[u8]) -> Option<JointState> {
        let place = Cell::new(old);
        deserialize_from_cdr_with_decoder_and_rep_id(bytes, CDR, Reuse(&place)).ok().map(|(it, _)| it)
    }

    fn state(joints: usize, name: &str) -> JointState {
        let header = Header { stamp: Time { sec: 3, nanosec: 7 }, frame_id: name.to_owned() };
        let (position, velocity) = (vec![0.5; joints], vec![-0.25; joints / 2]);
        JointState { header, name: vec![name.to_owned(); joints], position, velocity, effort: Vec::new() }
    }

    proptest! {
        /// For any earlier message and any bytes, decoding into the earlier message gives the same result as decoding into a new
        /// message.
        #[test]
        fn nothing_of_the_old_message_is_left(
            (old, new, text) in (0_usize..9, 0_usize..9, "(a|ä){0,200}"),
            cut_off in 0_usize..400,
            flip in any::<proptest::sample::Index>(),
        ) {
            let old = state(old, "old");
            let whole = bytes(&state(new, &text));
            prop_assert_eq!(over(old.clone(), &whole), decoded(&whole));
            prop_assert!(over(old.clone(), &whole).unwrap().header.frame_id.len() <= LONGEST);
            let part = &whole[..cut_off.min(whole.len())];
            prop_assert_eq!(over(old.clone(), part), decoded(part));
            let mut damaged = whole.clone();
            damaged[flip.index(whole.len())] ^= 0x15;
            prop_assert_eq!(over(old, &damaged), decoded(&damaged));
        }
    }

    fn decoded(bytes: &[u8]) -> Option<JointState> {
        deserialize_from_cdr_with_rep_id(bytes, CDR).ok().map(|(it, _)| it)
    }

    #[test]
    fn a_list_that_is_too_long_is_still_refused() {
        let long = JointState { effort: vec![0.0; MOST + 1], ..JointState::default() };
        assert_eq!(over(state(6, "old"), &bytes(&long)), None);
        let longest = JointState { effort: vec![0.0; MOST], ..JointState::default() };
        assert_eq!(over(state(6, "old"), &bytes(&longest)), Some(longest));
    }

    #[test]
    fn a_message_as_large_as_the_one_before_takes_no_memory() {
        let (place, encoded) = (Cell::new(JointState::default()), bytes(&state(6, "shoulder_pan_joint")));
        let decode = || {
            place.set(deserialize_from_cdr_with_decoder_and_rep_id(&encoded, CDR, Reuse(&place)).unwrap().0);
        };
        decode();
        assert_eq!(allocation_counter::measure(decode).count_total, 0);
    }
}
