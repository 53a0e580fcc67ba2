//! The reference work repeated, and the comparison of the laws.

pub mod compare;
pub mod paper;
