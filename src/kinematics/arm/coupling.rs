//! Chains in which a joint moves several links, such as the mimic joints of palletizers and linkages. The joint is the *driver* of
//! each of these links.

use super::link::ChainEnd;
use super::pair::{Motions, ZEROS, twice, two};
use super::{ArmError, Chain, JointKind};
use nalgebra::Vector3;
use wide::f64x2;

/// The relation between a link and its driver, the joint that moves the link. At the driver's position θ, the link's position relative
/// to the previous link is `ratio · θ + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// The index of the driver, counted from 0.
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

/// The joints that move the links of a chain with mimic joints. A joint may move several links.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Drivers {
    /// The kind of each joint.
    pub kinds: Vec<JointKind>,
    /// The coupling of each link to the joint that moves it, base first.
    pub couplings: Vec<Coupling>,
}

impl Drivers {
    /// Yields the positions of the links in pairs, if the joints are at `theta`. A missing second link has the position 0.
    pub fn positions(&self, theta: &[f64]) -> impl Iterator<Item = f64x2> {
        let at = |coupling: &Coupling| coupling.at(theta[coupling.driver]);
        self.couplings.chunks(2).map(move |both| two(&[at(&both[0]), both.get(1).map_or(0.0, at)]))
    }
}

impl Chain {
    /// Returns a chain with the links of this chain, but with other joints, of the given `kinds`. There may be fewer joints than
    /// links: entry i of `couplings` names the joint that moves link i, and says how far.
    ///
    /// If the joints are at `θ_a`, the links are at `θ = C θ_a + c`. The matrix C has the ratios of the couplings, the vector c the
    /// offsets. If this chain has the Jacobian J, the new chain has the Jacobian `J C`.
    ///
    /// # Errors
    /// [`ArmError::OnePerJoint`] if the number of couplings differs from the number of links, or a coupling names a joint that does
    /// not exist.
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

    /// Yields the range of each link's position if the joints stay within `ranges`. A joint without an entry in `ranges` counts as
    /// fixed at 0.
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

    /// Sets `motions` to the tool's motion per unit speed of each joint, summed over all links that the joint moves. The linear
    /// part is the velocity of that point of the tool's rigid body which is at the base's origin. Returns the frame of the last
    /// link.
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
