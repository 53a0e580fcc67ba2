//! Unit tests of private modules.

mod limits;
mod pace;
