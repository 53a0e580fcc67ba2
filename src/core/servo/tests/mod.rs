//! Unit tests of private modules.

mod consent;
mod explanation;
