//! The robot that the page shows. Reading its parameters takes a while. Changes of parameters that arrive during the reading are
//! stored, and applied to the parameters that were read.

use super::robot::Robot;
use dq_messages::ParameterEvent;

/// The largest number of stored changes.
const MOST_CHANGES: usize = 1000;

/// The parameters that were read from the servo, with all changes since the start of the reading.
#[derive(Default)]
pub(super) struct KnownRobot {
    robot: Option<Robot>,
    /// The changes that have arrived since the latest reading began; `None` after a successful reading. They are applied to the
    /// parameters that the reading returns, which may be older than the changes.
    since: Option<Vec<ParameterEvent>>,
}

impl KnownRobot {
    /// Returns the robot; `None` until its parameters were read.
    pub fn robot(&self) -> Option<&Robot> {
        self.robot.as_ref()
    }

    /// Begins a reading of the parameters.
    pub fn begin(&mut self) {
        self.since = Some(Vec::new());
    }

    /// Applies a change that the servo announced.
    pub fn take(&mut self, event: ParameterEvent) {
        if let Some(robot) = &mut self.robot {
            robot.take(&event);
        }
        if let Some(since) = self.since.as_mut().filter(|since| since.len() < MOST_CHANGES) {
            since.push(event);
        }
    }

    /// Ends a reading: takes the result, and applies the changes that arrived during the reading.
    pub fn end(&mut self, mut read: Robot) -> &Robot {
        self.since.take().unwrap_or_default().iter().for_each(|event| read.take(event));
        self.robot.insert(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::tests::{changed, robot};
    use dq_params::Value;

    #[test]
    fn a_change_is_not_overwritten_by_what_was_read_before_it() {
        let mut known = KnownRobot::default();
        let threshold = |known: &KnownRobot| known.robot().map(Robot::damping_threshold);
        known.begin();
        known.take(changed("damping.threshold", Value::Double(0.1)));
        assert_eq!(threshold(&known), None);
        known.end(robot());
        assert_eq!(threshold(&known), Some(0.1), "a change of a robot that was not known yet");
        known.begin();
        known.take(changed("damping.threshold", Value::Double(0.2)));
        assert_eq!(threshold(&known), Some(0.2), "it is shown at once");
        known.end(robot());
        assert_eq!(threshold(&known), Some(0.2));
        known.begin();
        known.end(robot());
        let read = Some(robot().damping_threshold());
        assert_eq!(threshold(&known), read, "what changed before a reading is in what was read");
    }
}
