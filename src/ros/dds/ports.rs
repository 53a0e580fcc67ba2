//! The UDP ports of DDS (RTPS 2.5, section 9.6.2.4).

/// The number of ports per domain.
pub(crate) const OF_A_DOMAIN: u16 = 250;

/// Returns the port on which a participant receives announcements by unicast. `number` is the participant's number on its host,
/// counted from 0.
pub(crate) const fn of_participant(domain: u16, number: u16) -> u16 {
    first(domain).saturating_add(10 + 2 * number)
}

/// Returns the port of a domain to which participants multicast data.
pub(crate) const fn first_of_data(domain: u16) -> u16 {
    first(domain).saturating_add(1)
}

/// Returns the first port of a domain, to which participants announce themselves by multicast.
pub(crate) const fn first(domain: u16) -> u16 {
    7400 + OF_A_DOMAIN * domain
}
