//! Logs a warning only when it changes.

use dq_ros::ros::Logger;

/// The last logged warning; `None` if the last call of `warn` passed no warning.
#[derive(Default)]
pub(super) struct WarningOnChange(Option<String>);

impl WarningOnChange {
    /// Logs the warning `now` if it differs from the last one.
    pub fn warn(&mut self, log: &Logger, now: Option<String>) {
        if now != self.0 {
            now.iter().for_each(|warning| log.warn(warning));
            self.0 = now;
        }
    }
}
