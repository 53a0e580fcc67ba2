//! How far joints went beside how far they were commanded to go.

use serde::{Deserialize, Serialize};

/// The square of a commanded distance \[rad²\] that is none.
const NOTHING: f64 = 1e-12;

/// Motions beside what was commanded, summed up.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Comparison {
    /// The sum of the products of both \[rad²\].
    pub product: f64,
    /// The sum of the squares of what was commanded \[rad²\].
    pub square: f64,
}

impl Comparison {
    /// Adds a joint that has `moved` where it was commanded to go as far as `asked` \[rad\].
    pub fn add(&mut self, asked: f64, moved: f64) {
        (self.product, self.square) = (self.product + asked * moved, self.square + asked * asked);
    }

    /// Lets what is in it count less by the factor `keep`.
    pub fn fade(&mut self, keep: f64) {
        (self.product, self.square) = (keep * self.product, keep * self.square);
    }

    /// The part of their commanded distance that the joints have gone together: all of it if none was commanded.
    pub fn factor(&self) -> f64 {
        if self.square > NOTHING { self.product / self.square } else { 1.0 }
    }
}

impl FromIterator<(f64, f64)> for Comparison {
    /// Of how far each joint was commanded to go, and how far it has moved \[rad\].
    fn from_iter<I: IntoIterator<Item = (f64, f64)>>(joints: I) -> Self {
        let mut all = Self::default();
        joints.into_iter().for_each(|(asked, moved)| all.add(asked, moved));
        all
    }
}
