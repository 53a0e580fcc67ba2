//! The `dq_servo` program.
fn main() {}
