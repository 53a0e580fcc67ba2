//! The `dq_servo` program: see [`dq_servo::cli`].

fn main() -> std::process::ExitCode {
    dq_servo::cli::main(std::env::args_os().skip(1))
}
