//! The product of gain and error.

use crate::control::control_law::{ControlLaw, LawGains, Map};
use crate::control::{AngularLinear, PoseError};

/// A law that feeds back an error with two gains.
pub struct Proportional<E> {
    /// The law's name.
    pub name: &'static str,
    /// Its error.
    pub error: E,
    /// Its map.
    pub map: Map,
}

impl<E: Fn(&PoseError) -> AngularLinear + Sync> ControlLaw for Proportional<E> {
    fn name(&self) -> &'static str {
        self.name
    }

    #[inline(always)]
    fn error(&self, error: &PoseError) -> AngularLinear {
        (self.error)(error)
    }

    fn map(&self) -> Map {
        self.map
    }

    /// Returns the default gains. A transposed Jacobian reduces the error by its squared singular values, and needs higher gains.
    fn gains(&self) -> LawGains {
        match self.map {
            Map::Transpose => LawGains::twist(50.0, 1e4),
            Map::DampedInverse => LawGains::twist(1.0, 100.0),
        }
    }
}
