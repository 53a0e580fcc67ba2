//! The UDP ports of DDS (RTPS 2.5, section 9.6.2.4).

/// The number of ports per domain.
pub(crate) const OF_A_DOMAIN: u16 = 250;

/// Returns the first port of a domain, to which participants announce themselves by multicast.
pub(crate) const fn first(domain: u16) -> u16 {
    7400 + OF_A_DOMAIN * domain
}
