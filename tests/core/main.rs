//! The algebra, the arm and the laws against the reference work and against themselves.

mod algebra;
mod arm;
mod bench;
mod control;
mod cooperative;
mod laws;
mod reference;
mod servo;
mod tolerance;
