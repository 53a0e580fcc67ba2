//! The escape from a singularity at which a law stands still, although the joints could reduce the error.
//!
//! Let `e` be the law's error, and `J` its Jacobian. In some configurations, the joints cannot move the tool in the direction of `e`:
//! `Jᵀ e` is 0. There, a law that feeds back the error stands still, and nearby it moves very slowly. Such a configuration is a
//! critical point of `½|e|²`:
//!
//! - At a saddle, motion in the direction of the most negative curvature reduces the error, both forward and backward. An example is
//!   an arm with a folded elbow and a goal farther out. The reduction is of second order, so the law's feedback does not find this
//!   direction.
//! - At a minimum, no configuration nearby is nearer to the goal.

use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{ArmState, Arms};
use dq_kinematics::control::Controller;
use dq_limits::PositionLimits;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// The least speed of an escape [rad/s, prismatic: m/s]: the norm of all joint velocities.
pub const ESCAPE_SPEED: f64 = 0.3;

/// The least downward curvature of `½|e|²` [per rad²] in the direction of an escape, as a fraction of `|e|²`. The threshold is
/// relative, because near the goal the curvature may be small: it is proportional to `|e|²` if two joints must move to reduce the
/// error, as at a singular wrist.
const LEAST_CURVATURE: f64 = 1e-3;

/// Half the distance between the two configurations at which `Jᵀ e` is computed for a curvature \[rad, prismatic: m\].
const STEP: f64 = 1e-5;

/// Number of times that a matrix is squared in the search for its largest eigenvalue. The 2²⁰th power of the matrix separates
/// eigenvalues that differ by 1e-5 of their size.
const SQUARINGS: usize = 20;

/// The result of the search for an escape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FoundEscape {
    /// An escape that the arm can take.
    Open,
    /// The arm cannot take the escape: the position limits of this joint (counted from 0) block it both forward and backward.
    Barred(usize),
    /// There is no escape: no configuration nearby is nearer to the goal.
    None,
}

/// The direction of the escape in joint space, of unit length.
#[derive(Serialize, Deserialize)]
pub struct EscapeDirection(DVector<f64>);

impl EscapeDirection {
    /// Raises the component of `theta_dot` [rad/s, prismatic: m/s] in this direction to the least speed of an escape.
    pub fn lead(&self, theta_dot: &mut [f64]) {
        let missing = (ESCAPE_SPEED - self.along(theta_dot)).max(0.0);
        theta_dot.iter_mut().zip(&self.0).for_each(|(speed, part)| *speed += missing * part);
    }

    /// Returns the component of `values`, one number per joint, in this direction.
    pub fn along(&self, values: &[f64]) -> f64 {
        self.0.iter().zip(values).map(|(part, value)| part * value).sum()
    }

    /// Returns the first joint that the escape would move noticeably toward a position limit nearby; `None` if there is no such
    /// joint.
    fn bar(&self, theta: &[f64], limits: &PositionLimits) -> Option<usize> {
        let mut joints = self.0.iter().zip(theta).enumerate();
        joints.find_map(|(joint, (part, angle))| {
            (part.abs() > 0.1 && limits.is_near_towards(joint, *angle, *part)).then_some(joint)
        })
    }
}

/// How far the motion of the joints can reduce the law's error.
#[derive(Clone, Copy, Debug)]
pub struct Freedom {
    /// The size `|e|` of the error that the law feeds back.
    pub error: f64,
    /// The fraction of the error that the joints can reduce, `|Jᵀ e| / |e|`.
    pub part: f64,
    /// The component of `Jᵀ e` in the direction of the last escape, divided by `|e|`. It says how fast `|e|` falls if the joints move
    /// in this direction [per rad, prismatic: per m].
    pub fall: f64,
}

/// Finds escapes. It owns the buffers for this computation.
pub struct Escape {
    /// The direction of the last escape that was found.
    pub direction: EscapeDirection,
    /// The arms at a trial configuration.
    trial: Arms,
    curvature: Curvature,
    descent: Vec<f64>,
}

impl Escape {
    /// Creates the finder. `trial` are the arms whose kinematics the finder computes at trial configurations.
    pub fn new(trial: Arms) -> Self {
        let joints = trial.joint_count();
        let direction = EscapeDirection(DVector::zeros(joints));
        Self { direction, trial, curvature: Curvature::new(joints), descent: vec![0.0; joints] }
    }

    /// Sets the tool offset.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.trial.set_tool_offset(tool_offset);
    }

    /// Returns how far the motion of the joints of `arm` can reduce the law's error.
    pub fn freedom(&mut self, arm: &ArmState, controller: &Controller, goal: &UnitDualQuaternion) -> Freedom {
        let error = controller.steepest_descent(arm, goal, &mut self.descent);
        let descent = self.descent.iter().map(|slope| slope * slope).sum::<f64>().sqrt();
        // Without an error, nothing restricts the joints.
        let part = if error > 0.0 { descent / error } else { 1.0 };
        Freedom { error, part, fall: self.direction.along(&self.descent) / error }
    }

    /// Searches for an escape at the joint positions `theta` \[rad, prismatic: m\], and stores its direction in `direction`.
    pub fn find(
        &mut self,
        controller: &Controller,
        goal: &UnitDualQuaternion,
        theta: &[f64],
        limits: &PositionLimits,
    ) -> FoundEscape {
        let Self { direction, trial, curvature, descent } = self;
        let curvature = curvature.steepest_bend(trial, controller, goal, theta, &mut direction.0);
        trial.evaluate(theta);
        let error = controller.steepest_descent(trial.state(), goal, descent);
        // A NaN curvature counts as no escape.
        let is_open = curvature > 0.0 && curvature >= LEAST_CURVATURE * error * error;
        if !is_open {
            return FoundEscape::None;
        }
        // The curvature is the same forward and backward along the direction. The slope of the error, however small, decides
        // between the two.
        let slope = direction.along(descent);
        let largest = direction.0[direction.0.icamax()];
        if slope < 0.0 || (slope == 0.0 && largest < 0.0) {
            direction.0.neg_mut();
        }
        if direction.bar(theta, limits).is_some() {
            direction.0.neg_mut();
        }
        direction.bar(theta, limits).map_or(FoundEscape::Open, FoundEscape::Barred)
    }
}

/// The curvature of the error, and the buffers to compute it.
struct Curvature {
    /// `−∂²(½|e|²)/∂θ²`, one column per joint, from differences of `Jᵀ e`; not exactly symmetric.
    bend: DMatrix<f64>,
    power: DMatrix<f64>,
    square: DMatrix<f64>,
    positions: Vec<f64>,
    descent: [Vec<f64>; 2],
}

impl Curvature {
    /// Creates the buffers for this many joints.
    fn new(joints: usize) -> Self {
        let (zeros, square) = (vec![0.0; joints], DMatrix::zeros(joints, joints));
        let descent = [zeros.clone(), zeros.clone()];
        Self { bend: square.clone(), power: square.clone(), square, positions: zeros, descent }
    }

    /// Sets `direction` to the direction of the largest downward curvature of the error. Returns that curvature \[per rad²\].
    fn steepest_bend(
        &mut self,
        arms: &mut Arms,
        controller: &Controller,
        goal: &UnitDualQuaternion,
        theta: &[f64],
        direction: &mut DVector<f64>,
    ) -> f64 {
        self.positions.copy_from_slice(theta);
        for (joint, angle) in theta.iter().enumerate() {
            for (side, descent) in [STEP, -STEP].into_iter().zip(&mut self.descent) {
                self.positions[joint] = angle + side;
                arms.evaluate(&self.positions);
                controller.steepest_descent(arms.state(), goal, descent);
            }
            self.positions[joint] = *angle;
            let [after, before] = &self.descent;
            for ((bend, after), before) in self.bend.column_mut(joint).iter_mut().zip(after).zip(before) {
                *bend = (after - before) / (2.0 * STEP);
            }
        }
        self.largest_eigenvalue(direction)
    }

    /// Returns the largest eigenvalue of the symmetric part of the curvature. Sets `direction` to its eigenvector.
    ///
    /// The matrix is shifted so that no eigenvalue is negative. A high power of the shifted matrix is proportional to the product
    /// of the eigenvector with itself.
    fn largest_eigenvalue(&mut self, direction: &mut DVector<f64>) -> f64 {
        let shift = self.bend.norm();
        self.bend.transpose_to(&mut self.square);
        self.bend += &self.square;
        self.bend *= 0.5;
        self.power.copy_from(&self.bend);
        (0..self.power.nrows()).for_each(|joint| self.power[(joint, joint)] += shift);
        for _ in 0..SQUARINGS {
            for (column, mut square) in self.power.column_iter().zip(self.square.column_iter_mut()) {
                square.gemv(1.0, &self.power, &column, 0.0);
            }
            let scale = self.square.norm();
            if scale > 0.0 {
                self.power.copy_from(&self.square);
                self.power /= scale;
            } else {
                // The shifted matrix is zero: all eigenvalues are equal, and any direction is an eigenvector.
                self.power.fill_with_identity();
            }
        }
        direction.copy_from(&self.power.column(self.strongest_column()));
        direction.normalize_mut();
        let mut value = 0.0;
        for (column, part) in self.bend.column_iter().zip(&*direction) {
            value += part * column.dot(&*direction);
        }
        value
    }

    fn strongest_column(&self) -> usize {
        let diagonal = |joint: &usize| self.power[(*joint, *joint)];
        (0..self.power.nrows()).max_by(|a, b| diagonal(a).total_cmp(&diagonal(b))).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the largest eigenvalue of the matrix with these rows, and its eigenvector.
    fn largest(rows: &[f64]) -> (f64, Vec<f64>) {
        let count = rows.len().isqrt();
        let (mut curvature, mut direction) = (Curvature::new(count), DVector::zeros(count));
        curvature.bend = DMatrix::from_row_slice(count, count, rows);
        (curvature.largest_eigenvalue(&mut direction), direction.as_slice().to_vec())
    }

    #[test]
    fn the_largest_eigenvalue_is_found_also_if_all_are_negative_or_zero() {
        for (rows, value) in [
            (&[-2.5][..], -2.5),
            (&[0.0], 0.0),
            (&[2.5], 2.5),
            (&[0.0; 4], 0.0),
            (&[-3.0, 0.0, 0.0, -3.0], -3.0),
            (&[-3.0, 0.0, 0.0, -2.0], -2.0),
            (&[-3.0, 0.0, 0.0, 1.0], 1.0),
            // The squares of these numbers underflow to zero.
            (&[-1e-200], -1e-200),
            (&[-1e-200, 0.0, 0.0, -1e-200], -1e-200),
        ] {
            let (found, along) = largest(rows);
            assert!((found - value).abs() <= 1e-12 * value.abs(), "{rows:?}: {found}");
            for (row, part) in rows.chunks(along.len()).zip(&along) {
                let turned: f64 = row.iter().zip(&along).map(|(number, part)| number * part).sum();
                assert!((turned - value * part).abs() <= 1e-9 * value.abs(), "{rows:?}: {along:?}");
            }
            let length = along.iter().map(|part| part * part).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-12, "{rows:?}: {along:?}");
        }
    }
}
