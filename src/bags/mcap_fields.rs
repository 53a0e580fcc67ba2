//! Reads the fields of MCAP records with checked lengths. The parser of the crate `mcap` allocates as much memory as a length field
//! states, before it checks that the record has this many bytes.

/// A channel record.
#[derive(Debug, PartialEq)]
pub(super) struct ChannelRecord<'a> {
    pub id: u16,
    pub schema: u16,
    pub topic: &'a str,
    pub encoding: &'a str,
}

/// Returns the id and the name of a schema record.
pub(super) fn schema(data: &[u8]) -> Option<(u16, &str)> {
    let (id, rest) = number(data)?;
    Some((id, text(rest)?.0))
}

/// Parses a channel record, without its metadata.
pub(super) fn channel(data: &[u8]) -> Option<ChannelRecord<'_>> {
    let (id, rest) = number(data)?;
    let (schema, rest) = number(rest)?;
    let (topic, rest) = text(rest)?;
    let (encoding, _) = text(rest)?;
    Some(ChannelRecord { id, schema, topic, encoding })
}

/// Returns the channel, the log time \[ns\] and the payload of a message record. Ignores its sequence number and publish time.
pub(super) fn message(data: &[u8]) -> Option<(u16, u64, &[u8])> {
    let (channel, rest) = number(data)?;
    let (_sequence, rest) = rest.split_first_chunk::<4>()?;
    let (log_time, rest) = rest.split_first_chunk()?;
    let (_publish_time, payload) = rest.split_first_chunk::<8>()?;
    Some((channel, u64::from_le_bytes(*log_time), payload))
}

/// Returns the unpacked size that a chunk record states; `None` if the stated packed length is wrong.
pub(super) fn chunk_size(data: &[u8]) -> Option<u64> {
    let (_times, rest) = data.split_first_chunk::<16>()?;
    let (size, rest) = rest.split_first_chunk()?;
    let (_checksum, rest) = rest.split_first_chunk::<4>()?;
    let (_compression, rest) = text(rest)?;
    let (length, packed) = rest.split_first_chunk()?;
    (u64::from_le_bytes(*length) == packed.len() as u64).then_some(u64::from_le_bytes(*size))
}

/// Returns the number of messages that a statistics record states.
pub(super) fn message_count(data: &[u8]) -> Option<u64> {
    data.first_chunk().map(|count| u64::from_le_bytes(*count))
}

fn number(data: &[u8]) -> Option<(u16, &[u8])> {
    let (number, rest) = data.split_first_chunk()?;
    Some((u16::from_le_bytes(*number), rest))
}

fn text(data: &[u8]) -> Option<(&str, &[u8])> {
    let (length, rest) = data.split_first_chunk()?;
    let (text, rest) = rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
    Some((std::str::from_utf8(text).ok()?, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_beyond_the_record_is_rejected() {
        let record = [&[7, 0, 3, 0, 2, 0, 0, 0][..], b"/x", &[3, 0, 0, 0], b"cdr", &[0; 4]].concat();
        let expected = ChannelRecord { id: 7, schema: 3, topic: "/x", encoding: "cdr" };
        assert_eq!(channel(&record), Some(expected));
        assert!((0..17).all(|length| channel(&record[..length]).is_none()));
        let mut huge = record;
        huge[7] = 0xb6;
        assert_eq!(channel(&huge), None);
    }
}
