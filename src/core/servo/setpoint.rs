//! Where an arm that takes positions is sent: the velocity command, integrated from where the arm was.

use super::PositionLimits;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};

/// The positions \[rad\] that an arm is sent, joint after joint; none before it is driven, and after it was elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Setpoint {
    positions: Vec<f64>,
    /// How fast the last cycle has moved them on [rad/s].
    speeds: Vec<f64>,
    kinds: Vec<JointKind>,
    phase: Phase,
}

/// What becomes of the positions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Phase {
    /// Nothing is sent: the controller holds what it was sent last.
    Released,
    /// They go on by the commands.
    Leading,
    /// The arm does not follow: as soon as it is to stand they are where it is, so that it does not leap when it is released.
    GivingWay,
    /// They are where the arm is, and are sent once more.
    Back,
}

impl Setpoint {
    /// None yet, for joints of these kinds.
    pub fn new(kinds: Vec<JointKind>) -> Self {
        let zeros = vec![0.0; kinds.len()];
        Self { positions: zeros.clone(), speeds: zeros, kinds, phase: Phase::Released }
    }

    /// The positions to send \[rad\], if there are any.
    pub fn get(&self) -> Option<&[f64]> {
        (self.phase != Phase::Released).then_some(self.positions.as_slice())
    }

    /// How fast the arm is sent on [rad/s]: where cycles were missed, more slowly than it is commanded.
    pub fn speeds(&self) -> &[f64] {
        &self.speeds
    }

    /// Nothing is sent any more: the controller holds what it was sent last.
    pub fn release(&mut self) {
        self.phase = Phase::Released;
        self.speeds.fill(0.0);
    }

    /// The arm does not follow.
    pub fn give_way(&mut self) {
        if self.phase == Phase::Leading {
            self.phase = Phase::GivingWay;
        }
    }

    /// Goes on with an arm that is driven: where it is `measured` \[rad\], unless there are positions.
    pub fn lead(&mut self, measured: &[f64]) {
        if self.phase == Phase::Released {
            self.positions.copy_from_slice(measured);
        }
        self.phase = Phase::Leading;
    }

    /// Goes back to an arm that is to stand, does not follow, and is `measured` \[rad\] elsewhere; after that nothing is sent any more.
    pub fn go_back(&mut self, measured: &[f64]) {
        match self.phase {
            Phase::GivingWay => {
                self.positions.copy_from_slice(measured);
                self.phase = Phase::Back;
            }
            Phase::Back => self.release(),
            Phase::Released | Phase::Leading => {}
        }
    }

    /// Moves on, if there are positions, by the `command` [rad/s] of a cycle of `period` \[s\], the first one after so many `cycles`: never
    /// for longer, so that no step is larger than the speed limits allow; and not past a position limit.
    pub fn advance(&mut self, command: &[f64], limits: &PositionLimits, period: f64, cycles: f64) {
        if self.phase == Phase::Released {
            return;
        }
        let bounds = limits.lower.iter().zip(&limits.upper);
        let slots = self.positions.iter_mut().zip(&mut self.speeds);
        for (((position, sent), speed), (lower, upper)) in slots.zip(command).zip(bounds) {
            let next = *position + period * speed;
            let next = next.max(lower.min(*position)).min(upper.max(*position));
            *sent = (next - *position) / (cycles * period);
            *position = next;
        }
    }

    /// The joint, counted from 1, that is farthest from where it was sent, how far \[rad, prismatic: m\] and its kind; the arm should be
    /// at `expected`.
    pub fn farthest(&self, expected: &[f64]) -> Option<(usize, f64, JointKind)> {
        let leads = self.get()?.iter().zip(expected).zip(&self.kinds);
        let leads = leads.map(|((sent, is), kind)| (kind.displacement(*is, *sent).abs(), *kind));
        let joints = leads.enumerate().map(|(joint, (lead, kind))| (joint + 1, lead, kind));
        joints.max_by(|(_, a, _), (_, b, _)| a.total_cmp(b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_where_the_arm_is_and_stays_within_position_limits() {
        let limits = PositionLimits { lower: vec![-1.0, 0.0], upper: vec![1.0, 5.0], margin: 0.1 };
        let mut setpoint = Setpoint::new(vec![JointKind::Revolute, JointKind::Prismatic]);
        assert_eq!((setpoint.get(), setpoint.farthest(&[0.0; 2])), (None, None));
        setpoint.lead(&[0.5, -2.0]);
        setpoint.lead(&[9.0, 9.0]);
        setpoint.advance(&[0.4, 1.0], &limits, 0.5, 1.0);
        assert_eq!(setpoint.get(), Some(&[0.7, -1.5][..]), "one found outside may come inside");
        setpoint.advance(&[2.0, -1.0], &limits, 0.5, 2.0);
        assert_eq!(setpoint.get(), Some(&[1.0, -1.5][..]), "but none goes on outward");
        assert!(
            (setpoint.speeds()[0] - 0.3).abs() < 1e-15 && setpoint.speeds()[1] == 0.0,
            "in the time of two cycles"
        );
        assert_eq!(setpoint.farthest(&[0.9, -1.0]), Some((2, 0.5, JointKind::Prismatic)));
        let turn = std::f64::consts::TAU;
        assert_eq!(
            setpoint.farthest(&[1.0 + turn, -1.5]).map(|(joint, ..)| joint),
            Some(2),
            "a turn is no way"
        );
        assert_eq!(
            setpoint.farthest(&[1.0, -1.5 + turn]),
            Some((2, turn, JointKind::Prismatic)),
            "but six metres are"
        );
        setpoint.give_way();
        setpoint.go_back(&[0.8, -1.5]);
        assert_eq!(setpoint.get(), Some(&[0.8, -1.5][..]), "where the arm is");
        setpoint.go_back(&[0.9, -1.5]);
        setpoint.advance(&[1.0, 1.0], &limits, 0.5, 1.0);
        assert_eq!((setpoint.get(), setpoint.speeds()), (None, &[0.0; 2][..]));
    }
}
