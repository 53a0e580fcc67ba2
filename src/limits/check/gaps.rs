//! Whether an arm has kept out of what it must.

use crate::Violation;
use dq_kinematics::arm::Chain;
use dq_space::space::{Placed, Scene};
use std::sync::Arc;

/// A gap that is closed may close by so much more \[m\]: what is closed can only grow from cycle to cycle as well as it can be foreseen.
const CLOSED_TOLERANCE: f64 = 1e-3;

/// Follows where an arm is, and finds what it has run into.
#[derive(Clone, Debug)]
pub struct Gaps {
    scene: Arc<Scene>,
    placed: Placed,
    /// How far each pair was in each other when that was first seen, or since \[m\]; 0 for those that are apart.
    closed: Option<Vec<f64>>,
}

impl Gaps {
    /// For an arm of which nothing is known yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self { placed: Placed::of(&scene), closed: None, scene }
    }

    /// Checks an arm with its joints at `theta` \[rad, prismatic: m\], arm after arm: no pair may be in each other, but one that was found
    /// so may stay so and come apart. Returns the least gap \[m\]; infinite without pairs.
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
            // What is no number is too small.
            let is_open = gap >= *worst - tolerance;
            if !is_open {
                return Err(Violation::Gap { pair: scene.pair(pair), gap });
            }
            *worst = worst.max(gap.min(0.0));
        }
        Ok(least)
    }
}
