//! `dq_servo` with your own law, which is that of the example `your_law`. Every subcommand knows this law.

#[allow(dead_code)]
mod your_law;

use dq_kinematics::control::register;
use std::process::ExitCode;

fn main() -> ExitCode {
    match register(&your_law::BoundaryLayer) {
        Ok(_) => dq_servo::cli::main(std::env::args_os().skip(1)),
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}
