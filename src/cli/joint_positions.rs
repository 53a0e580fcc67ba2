//! Joint positions on the command line.

use super::watch::StampedGoal;
use dq_messages::messages::{Header, JointState, Time};
use std::str::FromStr;

/// Positions of joints \[rad, prismatic: m\]: of all joints in their order, or of some joints by name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct JointPositions {
    /// The names of the joints; empty for all joints.
    names: Vec<String>,
    positions: Vec<f64>,
}

impl JointPositions {
    /// Returns the message for the joint goal with these positions and this stamp.
    pub fn goal(&self, stamp: Time) -> StampedGoal<JointState> {
        let header = Header { stamp: stamp.clone(), ..Header::default() };
        let (name, position) = (self.names.clone(), self.positions.clone());
        (JointState { header, name, position, ..JointState::default() }, stamp)
    }
}

impl FromStr for JointPositions {
    type Err = String;

    /// Reads `0,-1.57,1.57` or `joint2=-1.57,joint3=1.57`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (mut names, mut positions) = (Vec::new(), Vec::new());
        for part in text.split(',') {
            let number = match part.rsplit_once('=') {
                Some((name, number)) => {
                    names.push(name.trim().to_owned());
                    number
                }
                None => part,
            };
            positions.push(number.trim().parse().map_err(|_| format!("{number:?} is not a number"))?);
        }
        match names.len() {
            0 => {}
            count if count == positions.len() => {}
            _ => return Err("expected all joints in their order, or each one by its name".to_owned()),
        }
        Ok(Self { names, positions })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<(Vec<String>, Vec<f64>), String> {
        text.parse().map(|JointPositions { names, positions }| (names, positions))
    }

    #[test]
    fn joints_are_in_their_order_or_by_name() {
        assert_eq!(read("-1.5,0, 2e-1"), Ok((vec![], vec![-1.5, 0.0, 0.2])));
        let names = ["joint2", "left/joint3"].map(str::to_owned).to_vec();
        assert_eq!(read("joint2=-1,left/joint3=0.5"), Ok((names, vec![-1.0, 0.5])));
        assert_eq!(read("1,,2"), Err("\"\" is not a number".to_owned()));
        assert_eq!(read("joint2=fast"), Err("\"fast\" is not a number".to_owned()));
        let mixed = "expected all joints in their order, or each one by its name".to_owned();
        assert_eq!(read("1,joint2=0.5"), Err(mixed));
    }
}
