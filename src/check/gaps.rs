//! Checks that an arm keeps clear of its scene.

use dq_kinematics::arm::Chain;
use dq_limits::Violation;
use dq_space::space::{Placed, Scene};
use std::sync::Arc;

/// The distance by which a gap that is already closed may close further \[m\]. The change of a gap from cycle to cycle can only be
/// predicted approximately.
const CLOSED_TOLERANCE: f64 = 1e-3;

/// Tracks the gaps of an arm, and finds collisions.
#[derive(Clone, Debug)]
pub struct Gaps {
    scene: Arc<Scene>,
    placed: Placed,
    /// For each pair of parts, the smallest overlap so far \[m\]; 0 for parts that have been apart.
    closed: Option<Vec<f64>>,
}

impl Gaps {
    /// Creates the check. The positions of the arm are not known yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self { placed: Placed::of(&scene), closed: None, scene }
    }

    /// Checks the arms `chains`. Their joints are at `theta` \[rad, prismatic: m\], arm after arm. No pair of parts may overlap,
    /// unless the pair has overlapped from the beginning. Returns the least gap \[m\]; infinity if there are no pairs.
    ///
    /// # Errors
    /// The first [`Violation`] found.
    pub fn check<'a>(
        &mut self,
        chains: impl IntoIterator<Item = &'a Chain>,
        theta: &[f64],
    ) -> Result<f64, Violation> {
        let Self { scene, placed, closed } = self;
        placed.place(scene, chains, theta);
        let gaps = (0..scene.pair_count()).map(|pair| placed.gap_of(scene, pair).distance);
        let closed = closed.get_or_insert_with(|| gaps.clone().map(|gap| gap.min(0.0)).collect());
        let mut least = f64::INFINITY;
        for (pair, (gap, worst)) in gaps.zip(closed).enumerate() {
            least = least.min(gap);
            let tolerance = if *worst < 0.0 { CLOSED_TOLERANCE } else { 0.0 };
            // NaN counts as too small.
            let is_open = gap >= *worst - tolerance;
            if !is_open {
                return Err(Violation::Gap { pair: scene.pair(pair), gap });
            }
            *worst = worst.max(gap.min(0.0));
        }
        Ok(least)
    }
}
