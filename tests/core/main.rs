//! The algebra, the arm and the laws against the reference work and against themselves.

mod algebra;
mod arm;
mod bench;
mod control;
mod cooperative;
mod laws;
mod plain;
mod reference;
mod servo;
mod step;
mod tolerance;
