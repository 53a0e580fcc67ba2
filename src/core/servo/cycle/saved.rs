//! Saves and restores the state of a servo. A restored servo computes the same commands, bit for bit, as the saved one.
//!
//! The state is everything that the next cycle needs from earlier cycles. It does not include settings, kinematics, counts of
//! rejections, or buffers that each cycle overwrites before it reads them.

use super::output::SavedOutput;
use super::{Clock, Servo};
use crate::servo::consent::MotionRequests;
use crate::servo::explanation::Explanation;
use crate::servo::mode::Mode;
use crate::servo::stream::GoalStream;
use dq_algebra::UnitDualQuaternion;
use dq_contact::ContactState;
use dq_kinematics::control::LawMemory;
use dq_link::Link;
use dq_metrics::Figures;
use dq_search::EscapeDirection;
use nalgebra::Vector6;
use serde::{Deserialize, Deserializer, Serialize};
use std::time::Duration;

/// The saved state, as [`Servo::restore`] reads it.
type Saved = (
    (u64, Option<Duration>, Clock, u64),
    (MotionRequests, Mode, Option<UnitDualQuaternion>, GoalStream, Explanation),
    (EscapeDirection, LawMemory, ContactState, Vec<f64>, SavedOutput, Link),
    (f64, Figures, Vector6<f64>),
);

impl Servo {
    /// Returns the servo's state for [`restore`](Self::restore). The encoded state of one arm has about 60 kB, mostly past
    /// commands.
    pub fn saved(&self) -> impl Serialize + use<'_> {
        (
            (self.configurations, self.configured, &self.clock, self.motions.count),
            (&self.requests, &self.mode, &self.set, &self.stream, &self.explanation),
            (
                &self.escape.direction,
                &self.law_memory,
                &self.contact,
                &self.joint_line.positions,
                self.output.saved(),
                &self.robot.link,
            ),
            (self.status.sign, self.status.figures, self.status.pose_error),
        )
    }

    /// Restores the state of a servo that was [`saved`](Self::saved) with the same arms, names, settings and period.
    ///
    /// # Errors
    /// The error of the deserializer. The servo is unchanged then.
    pub fn restore<'de, D: Deserializer<'de>>(&mut self, saved: D) -> Result<(), D::Error> {
        let (counts, asked, known, reported) = Saved::deserialize(saved)?;
        (self.configurations, self.configured, self.clock, self.motions.count) = counts;
        (self.requests, self.mode, self.set, self.stream, self.explanation) = asked;
        let (direction, memory, contact, elsewhere, output, link) = known;
        (self.escape.direction, self.law_memory, self.contact) = (direction, memory, contact);
        (self.joint_line.positions, self.robot.link) = (elsewhere, link);
        self.output.restore(output);
        (self.status.sign, self.status.figures, self.status.pose_error) = reported;
        self.robot.arms.evaluate(self.robot.link.measured());
        self.robot.predicted.evaluate(self.robot.link.predicted());
        Ok(())
    }
}
