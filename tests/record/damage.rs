//! Damages to bytes.

use proptest::prelude::*;
use proptest::sample::Index;

/// A single damage.
#[derive(Clone, Debug)]
pub enum Damage {
    Byte(Index, u8),
    /// Replaces a number, most likely a length or an offset.
    Number(Index, u64),
    Cut(Index),
    Insert(Index, Vec<u8>),
    Repeat(Index, Index),
}

/// Returns a random damage.
pub fn damage() -> impl Strategy<Value = Damage> {
    let number = prop_oneof![any::<u64>(), 0..64u64, (0..64u32).prop_map(|shift| (1u64 << shift) - 1)];
    prop_oneof![
        6 => (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Damage::Byte(at, byte)),
        6 => (any::<Index>(), number).prop_map(|(at, number)| Damage::Number(at, number)),
        1 => any::<Index>().prop_map(Damage::Cut),
        1 => (any::<Index>(), prop::collection::vec(any::<u8>(), 1..40)).prop_map(|(at, it)| Damage::Insert(at, it)),
        1 => (any::<Index>(), any::<Index>()).prop_map(|(from, to)| Damage::Repeat(from, to)),
    ]
}

/// Applies the damage.
pub fn apply(damage: &Damage, bytes: &mut Vec<u8>) {
    // Half of the damages affect the beginning, where headers, schemas and SQLite's first page are.
    let at = |index: &Index, length: usize| match index.index(2) {
        0 => index.index(length),
        _ => index.index(length.min(2000)),
    };
    let length = bytes.len().max(1);
    match damage {
        Damage::Byte(index, byte) => {
            bytes.iter_mut().skip(at(index, length)).take(1).for_each(|it| *it = *byte)
        }
        Damage::Number(index, number) => {
            bytes
                .iter_mut()
                .skip(at(index, length))
                .zip(number.to_le_bytes())
                .for_each(|(it, byte)| *it = byte);
        }
        Damage::Cut(index) => bytes.truncate(at(index, length)),
        Damage::Insert(index, more) => {
            let tail = bytes.split_off(at(index, length).min(bytes.len()));
            bytes.extend(more);
            bytes.extend(tail);
        }
        Damage::Repeat(from, to) => {
            let (from, to) = (from.index(length), to.index(length));
            let piece = bytes[from.min(to)..from.max(to).min(bytes.len())].to_vec();
            bytes.extend(piece.into_iter().take(50_000));
        }
    }
}
