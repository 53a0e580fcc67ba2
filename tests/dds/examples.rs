//! Runs the example that controls a simulated arm over DDS.

use crate::host::Host;

#[path = "../examples/drive_over_dds.rs"]
mod drive_over_dds;

/// Tells this program, when started again, that it is in a network namespace.
const INSIDE: &str = "DQ_SERVO_INSIDE";

#[test]
fn drive_over_dds() {
    if std::env::var_os(INSIDE).is_some() {
        return drive_over_dds::main().unwrap();
    }
    let program = std::env::current_exe().unwrap();
    Host::new().shell(&format!("{INSIDE}=1 '{}' --exact examples::drive_over_dds", program.display()));
}
