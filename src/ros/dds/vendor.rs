//! Identifies a DDS implementation by the vendor number at the start of its GUIDs (RTPS 2.5, section 9.3.1).

use rustdds::GUID;

/// The vendor number of eProsima Fast DDS.
pub(super) const FAST_DDS: [u8; 2] = [0x01, 0x0f];

/// The vendor number of Eclipse Cyclone DDS.
const CYCLONE: [u8; 2] = [0x01, 0x10];

/// Returns whether `endpoint` belongs to Eclipse Cyclone DDS.
pub(crate) fn is_cyclone(endpoint: GUID) -> bool {
    endpoint.to_bytes()[..2] == CYCLONE
}
