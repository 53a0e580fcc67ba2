//! When recorded commands were made.

use crate::wire::CycleLabel;
use std::time::Duration;

/// The clock of one servo's commands: that of its cycle, or where they do not say what they were made from, the recorder's.
#[derive(Default)]
pub(super) struct CommandClock {
    is_cycle: bool,
    last: Option<Duration>,
}

impl CommandClock {
    /// The time since the servo's command before \[s\], by the label of one that was recorded at `time` \[s\]; none for the first one,
    /// and for those of others, as a guard's, which do not say where the servo's do.
    pub fn since_last(&mut self, time: f64, label: Option<&CycleLabel>) -> Option<f64> {
        let now = match label {
            Some(label) => label.now,
            None if self.is_cycle => return None,
            None => Duration::from_secs_f64(time.max(0.0)),
        };
        let same_clock = std::mem::replace(&mut self.is_cycle, label.is_some()) == label.is_some();
        let before = self.last.replace(now).filter(|_| same_clock)?;
        Some(now.saturating_sub(before).as_secs_f64())
    }
}
