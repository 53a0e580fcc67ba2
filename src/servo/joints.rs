//! Joint states matched by name.

use super::Rejection;
use crate::arm::bounds;
use crate::text::cut;
use std::ops::Range;
use std::time::Duration;

/// The arm's joint names, in the arm's order.
#[derive(Clone, Debug, PartialEq)]
pub struct JointOrder {
    names: Vec<String>,
}

impl JointOrder {
    /// From the joint names, base first.
    pub fn new(names: Vec<String>) -> Self {
        Self { names }
    }

    /// The names, base first.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Writes the positions \[rad\] of the arm's joints to `into`, matched by name; other joints are ignored.
    ///
    /// # Errors
    /// A [`Rejection`] where a joint is missing, a number is not finite or beyond [`bounds`], or the lists do not fit; `into` is then unchanged.
    pub fn positions(&self, names: &[String], positions: &[f64], into: &mut [f64]) -> Result<(), Rejection> {
        if names.len() != positions.len() {
            return Err(Rejection::WrongLength { names: names.len(), positions: positions.len() });
        }
        self.names.iter().try_for_each(|joint| self.find(joint, names, positions).map(drop))?;
        for (joint, slot) in self.names.iter().zip(into) {
            *slot = self.find(joint, names, positions)?;
        }
        Ok(())
    }

    fn find(&self, joint: &str, names: &[String], positions: &[f64]) -> Result<f64, Rejection> {
        let found =
            names.iter().zip(positions).find(|(name, _)| *name == joint).map(|(_, position)| *position);
        match found {
            Some(position) if position.abs() <= bounds::JOINT_ANGLE => Ok(position),
            Some(value) if value.is_finite() => Err(Rejection::OutOfRange {
                field: format!("position of {joint:?}"),
                value,
                bound: bounds::JOINT_ANGLE,
                unit: "rad",
            }),
            Some(value) => Err(Rejection::NonFinite { field: format!("position of {joint:?}"), value }),
            None => {
                let names = names.iter().take(8).map(|name| cut(name).into_owned()).collect();
                Err(Rejection::MissingJoint { joint: joint.to_owned(), names })
            }
        }
    }
}

/// The joint positions of all arms as last heard.
pub(super) struct HeardJoints {
    arms: Vec<HeardArm>,
    positions: Vec<f64>,
    expected: Vec<f64>,
}

struct HeardArm {
    order: JointOrder,
    range: Range<usize>,
    received: Option<Duration>,
}

impl HeardJoints {
    /// Nothing heard yet of these arms.
    pub fn new(orders: Vec<JointOrder>) -> Self {
        let mut count = 0;
        let arms = orders.into_iter().map(|order| {
            let range = count..count + order.names().len();
            count = range.end;
            HeardArm { order, range, received: None }
        });
        Self { arms: arms.collect(), positions: vec![0.0; count], expected: vec![0.0; count] }
    }

    /// Takes the joint state of one arm. The arm is one of those that this was made for.
    pub fn take(
        &mut self,
        arm: usize,
        names: &[String],
        positions: &[f64],
        now: Duration,
    ) -> Result<(), Rejection> {
        let arm = &mut self.arms[arm];
        arm.order.positions(names, positions, &mut self.positions[arm.range.clone()])?;
        self.expected[arm.range.clone()].copy_from_slice(&self.positions[arm.range.clone()]);
        arm.received = Some(now);
        Ok(())
    }

    /// The positions \[rad\], arm after arm.
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// Where the joints should be by now \[rad\]: as last heard, moved on by the commands since.
    pub fn expected(&self) -> &[f64] {
        &self.expected
    }

    /// Moves on what is expected by a cycle of `period` \[s\] at `command` [rad/s].
    pub fn move_on(&mut self, command: &[f64], period: f64) {
        self.expected.iter_mut().zip(command).for_each(|(position, speed)| *position += speed * period);
    }

    /// How many joints each arm has.
    pub fn counts(&self) -> Vec<usize> {
        self.arms.iter().map(|arm| arm.range.len()).collect()
    }

    /// When the arm that has been silent longest was last heard; none where one was never heard.
    pub fn received(&self) -> Option<Duration> {
        self.arms.iter().map(|arm| arm.received).min().flatten()
    }
}
