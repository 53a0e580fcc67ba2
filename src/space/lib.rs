//! Where an arm is: its body among what it must keep out of or stay in, and the frames in which that is given.

pub mod frames;
pub mod space;
