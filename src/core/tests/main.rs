//! The algebra, the arm and the laws against the reference work and against themselves.

mod algebra;
mod arm;
mod arms;
mod control;
mod cooperative;
mod described;
mod described_limits;
mod fewer_joints;
mod frames;
mod laws;
mod odd_arms;
mod opinion;
mod plain;
mod posture;
mod reference;
mod rig;
mod search;
mod second_order;
mod servo;
mod setup;
mod step;
mod tasks;
mod tolerance;
