//! Chains in which a joint drives several links, such as the mimic joints of palletizers and linkages.

use super::link::ChainEnd;
use super::pair::{Motions, ZEROS, twice, two};
use super::{ArmError, Chain, JointKind};
use nalgebra::Vector3;
use wide::f64x2;

/// How a link moves relative to the previous link: linearly with the position of its driver, `ratio · θ + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// The joint that drives the link, counted from 0.
    pub driver: usize,
    /// The link's speed divided by the driver's speed.
    pub ratio: f64,
    /// The link's position when the driver is at 0 \[rad, prismatic: m\].
    pub offset: f64,
}

impl Coupling {
    /// Returns the coupling of a link that moves with its own joint.
    pub fn own(joint: usize) -> Self {
        Self { driver: joint, ratio: 1.0, offset: 0.0 }
    }

    /// Returns the link's position when the driver is at `position` \[rad, prismatic: m\].
    pub fn at(&self, position: f64) -> f64 {
        self.ratio * position + self.offset
    }
}

/// The joints of a chain with mimic joints.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Drivers {
    /// The kind of each driver.
    pub kinds: Vec<JointKind>,
    /// The coupling of each link, base first.
    pub couplings: Vec<Coupling>,
}

impl Drivers {
    /// Yields the positions of the links in pairs, for the joint positions `theta`.
    pub fn positions(&self, theta: &[f64]) -> impl Iterator<Item = f64x2> {
        let at = |coupling: &Coupling| coupling.at(theta[coupling.driver]);
        self.couplings.chunks(2).map(move |both| two(&[at(&both[0]), both.get(1).map_or(0.0, at)]))
    }
}

impl Chain {
    /// Returns the chain with joints of these `kinds`, which drive all links: `θ = C θ_a + c`. `couplings` has a row of C and c for
    /// each link, base first. The chain then has one joint per driver, and the Jacobian `J C`.
    ///
    /// # Errors
    /// [`ArmError::OnePerJoint`] if the number of couplings differs from the number of links, or a driver is missing.
    pub fn driven_by(mut self, kinds: Vec<JointKind>, couplings: Vec<Coupling>) -> Result<Self, ArmError> {
        let check = |what, expected, got, is_valid| match is_valid {
            true => Ok(()),
            false => Err(ArmError::OnePerJoint { what, expected, got }),
        };
        let (links, got) = (self.link_count(), couplings.len());
        check("couplings", links, got, links == got)?;
        let needed = couplings.iter().map(|coupling| coupling.driver + 1).max().unwrap_or(0);
        check("drivers", needed, kinds.len(), needed <= kinds.len())?;
        let is_own = couplings.iter().enumerate().all(|(link, coupling)| *coupling == Coupling::own(link));
        self.drivers = (!is_own).then_some(Drivers { kinds, couplings });
        Ok(self)
    }

    /// Yields the coupling and the kind of each link, base first.
    pub fn couplings(&self) -> impl Iterator<Item = (Coupling, JointKind)> + Clone + '_ {
        let of = |link| self.drivers.as_ref().map_or(Coupling::own(link), |drivers| drivers.couplings[link]);
        self.link_kinds.iter().enumerate().map(move |(link, kind)| (of(link), *kind))
    }

    /// Yields the range of each link if the joints are within these `ranges`; (0, 0) for a joint without a range.
    pub(super) fn link_ranges(
        &self,
        ranges: impl Iterator<Item = (f64, f64)> + Clone,
    ) -> impl Iterator<Item = (f64, f64)> + Clone {
        self.couplings().map(move |(coupling, _)| {
            let (lower, upper) = ranges.clone().nth(coupling.driver).unwrap_or_default();
            let (one, other) = (coupling.at(lower), coupling.at(upper));
            (one.min(other), one.max(other))
        })
    }
    /// Sets `motions` to the motion that each joint gives to the point of the tool that is at the base's origin: the sum over the
    /// links that the joint drives. Returns the last link.
    pub(super) fn evaluate_driven(
        &self,
        drivers: &Drivers,
        theta: &[f64],
        motions: &mut [Motions],
    ) -> ChainEnd {
        motions.fill((ZEROS, ZEROS));
        let mut couplings = self.couplings();
        self.pass_pairs(drivers.positions(theta), |ends| {
            for (end, (Coupling { driver, ratio, .. }, kind)) in ends.iter().zip(couplings.by_ref()) {
                let (axis, point) = (end.z_axis(), end.point());
                let (angular, linear) = match kind {
                    JointKind::Revolute => (axis, point.cross(&axis)),
                    JointKind::Prismatic => (Vector3::zeros(), axis),
                };
                let ratios = f64x2::new(if driver % 2 == 0 { [ratio, 0.0] } else { [0.0, ratio] });
                let sums = &mut motions[driver / 2];
                sums.0 += twice(&angular) * ratios;
                sums.1 += twice(&linear) * ratios;
            }
        })
    }
}
