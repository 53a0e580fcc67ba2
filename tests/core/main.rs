//! The algebra, the arm and the laws against the reference work and against themselves.

mod algebra;
mod arm;
mod control;
mod reference;
mod servo;
mod tolerance;
