//! Laws of the form gain times error.

use crate::control::control_law::{ControlLaw, LawGains, Map};
use crate::control::{AngularLinear, PoseError};

/// A law that feeds back an error, multiplied by an angular and a linear gain.
pub struct Proportional<E> {
    /// The law's name.
    pub name: &'static str,
    /// The error that the law feeds back.
    pub error: E,
    /// The map to joint velocities.
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

    /// Returns the default gains. The transpose scales the error by squared singular values, which needs higher gains.
    fn gains(&self) -> LawGains {
        match self.map {
            Map::Transpose => LawGains::twist(50.0, 1e4),
            Map::DampedInverse => LawGains::twist(1.0, 100.0),
        }
    }
}
