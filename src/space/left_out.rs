//! Which pairs cannot be kept apart, and are left out of a scene.

use super::scene::{Against, Meeting, Why};
use super::{Body, KeepOut, Placed, Scene};
use crate::arm::Chain;
use std::f64::consts::PI;

/// So many configurations are looked at to find pairs that always touch.
const SAMPLES: u32 = 200;

/// Of the body itself, what touches in this part of them or more has nothing to do with how the arm moves (as MoveIt's setup assistant takes it).
const MOSTLY: f64 = 0.95;

impl Scene {
    /// For these arms, whose joints move within these ranges \[rad, prismatic: m\], arm after arm. Pairs that always touch are left out.
    /// More than [`MOST_CAPSULES`] and [`MOST_KEEP_OUTS`] are not taken.
    pub fn new(body: Body, keep_outs: Vec<KeepOut>, chains: &[Chain], ranges: &[(f64, f64)]) -> Self {
        let mut scene = Self::of_all(body, keep_outs, chains, ranges);
        scene.leave_out(chains, ranges);
        scene
    }

    /// Leaves out what cannot be kept apart.
    fn leave_out(&mut self, chains: &[Chain], ranges: &[(f64, f64)]) {
        let mut touching = vec![0_u32; self.meetings.len()];
        let mut placed = Placed::of(self);
        for number in 0..SAMPLES {
            placed.place(self, chains, &sample(number, ranges));
            for (count, meeting) in touching.iter_mut().zip(&self.meetings) {
                *count += u32::from(placed.gap(self, meeting).distance <= 0.0);
            }
        }
        let why = |meeting: &Meeting, touching: u32| {
            let moving = meeting.levers.iter().filter(|lever| **lever > 0.0).count();
            let part = f64::from(touching) / f64::from(SAMPLES);
            match meeting.against {
                Against::Capsule(_) if moving == 0 => Some(Why::Fixed),
                Against::Capsule(_) if moving == 1 => Some(Why::Neighbours),
                Against::Capsule(_) if part >= MOSTLY => Some(Why::Touch),
                Against::KeepOut(_) if moving == 0 => Some(Why::Fixed),
                Against::KeepOut(_) if part >= 1.0 => Some(Why::Touch),
                _ => None,
            }
        };
        let (mut kept, mut left_out) = (Vec::new(), Vec::new());
        for (meeting, touching) in std::mem::take(&mut self.meetings).into_iter().zip(touching) {
            match why(&meeting, touching) {
                None => kept.push(meeting),
                Some(why) => left_out.push((self.named(&meeting), why)),
            }
        }
        (self.meetings, self.left_out) = (kept, left_out);
    }
}

/// The joint positions of that number, spread evenly over these ranges (Roberts 2018).
fn sample(number: u32, ranges: &[(f64, f64)]) -> Vec<f64> {
    let root = (0..64).fold(1.5_f64, |g, _| (1.0 + g).powf(1.0 / (ranges.len() as f64 + 1.0)));
    let mut step = 1.0;
    let place = |(lower, upper): &(f64, f64)| {
        step /= root;
        let (lower, upper) = (lower.max(-PI), upper.min(PI));
        lower + (0.5 + f64::from(number) * step).fract() * (upper - lower)
    };
    ranges.iter().map(place).collect()
}
