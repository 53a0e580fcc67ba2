//! Compares measured displacements with commanded ones.

use serde::{Deserialize, Serialize};

/// A sum of squared commanded displacements below this counts as zero \[rad², prismatic: m²\].
const NOTHING: f64 = 1e-12;

/// Sums over measured and commanded displacements.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Comparison {
    /// Sum of the products of measured and commanded displacement \[rad², prismatic: m²\].
    pub product: f64,
    /// Sum of the squares of the commanded displacements \[rad², prismatic: m²\].
    pub square: f64,
}

impl Comparison {
    /// Adds a joint that was commanded to move by `asked` and moved by `moved` \[rad, prismatic: m\].
    pub fn add(&mut self, asked: f64, moved: f64) {
        (self.product, self.square) = (self.product + asked * moved, self.square + asked * asked);
    }

    /// Multiplies the weight of all earlier displacements by `keep`.
    pub fn fade(&mut self, keep: f64) {
        (self.product, self.square) = (keep * self.product, keep * self.square);
    }

    /// Returns the fraction of the commanded displacement that all joints together have moved, by least squares; 1 if no motion was
    /// commanded.
    pub fn factor(&self) -> f64 {
        if self.square > NOTHING { self.product / self.square } else { 1.0 }
    }
}

impl FromIterator<(f64, f64)> for Comparison {
    /// Adds up the comparisons of joints. Each joint is given by its commanded and its measured displacement \[rad, prismatic: m\].
    fn from_iter<I: IntoIterator<Item = (f64, f64)>>(joints: I) -> Self {
        let mut all = Self::default();
        joints.into_iter().for_each(|(asked, moved)| all.add(asked, moved));
        all
    }
}
