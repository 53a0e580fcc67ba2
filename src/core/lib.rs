//! The servo in fake time: from what it hears to a command, cycle by cycle; what judges it; and the kinematic plant. It does no I/O and reads no clock.

pub mod check;
pub mod plant;
pub mod servo;
