//! Runs the examples of the library.

#[path = "../examples/circle.rs"]
mod circle;
#[path = "../examples/dual_quaternions.rs"]
mod dual_quaternions;
#[path = "../examples/laws_with_memory.rs"]
mod laws_with_memory;
#[path = "../examples/two_arms.rs"]
mod two_arms;
#[path = "../examples/your_law.rs"]
mod your_law;

#[test]
fn circle() {
    circle::main().unwrap();
}

#[test]
fn dual_quaternions() {
    dual_quaternions::main().unwrap();
}

#[test]
fn laws_with_memory() {
    laws_with_memory::main().unwrap();
}

#[test]
fn two_arms() {
    two_arms::main().unwrap();
}

#[test]
fn your_law() {
    your_law::main().unwrap();
}
