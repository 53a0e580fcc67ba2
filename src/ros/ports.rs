//! The UDP ports of DDS (RTPS 2.5, section 9.6.2.4).

/// How many each domain has.
pub(super) const OF_A_DOMAIN: u16 = 250;

/// The first one of a domain, to which participants announce themselves by multicast.
pub(super) const fn first(domain: u16) -> u16 {
    7400 + OF_A_DOMAIN * domain
}

/// Where a participant of a domain is sent what concerns discovery.
pub(super) const fn discovery(domain: u16, participant: u16) -> u16 {
    first(domain) + 10 + 2 * participant
}
