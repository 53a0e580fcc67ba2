//! Checks that an arm keeps clear of its scene.

use dq_kinematics::arm::Chain;
use dq_limits::Violation;
use dq_space::space::{Placed, Scene};
use std::sync::Arc;

/// How far the overlap of two parts may exceed their smallest overlap so far \[m\]. The servo keeps an overlap from growing, but it
/// predicts the distance of the next cycle only approximately.
const CLOSED_TOLERANCE: f64 = 1e-3;

/// Checks the distances between an arm and its scene, and finds collisions. A gap is the signed distance between two parts of the
/// scene, such as a link and a keep-out. It is negative if they overlap.
#[derive(Clone, Debug)]
pub struct Gaps {
    scene: Arc<Scene>,
    placed: Placed,
    /// For each pair of parts, the largest gap so far \[m\], but at most 0. It is negative if the pair has always overlapped. `None`
    /// before the first check.
    closed: Option<Vec<f64>>,
}

impl Gaps {
    /// Creates the check for an arm whose positions are not known yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self { placed: Placed::of(&scene), closed: None, scene }
    }

    /// Checks the arms `chains` with their joints at `theta` \[rad, prismatic: m\], arm after arm. A pair of parts may overlap only
    /// if it has overlapped in every check so far, and the overlap must not grow. Returns the smallest gap \[m\], or infinity if
    /// there are no pairs.
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
