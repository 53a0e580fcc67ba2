//! The load that hangs on the sensor, and its identification.

use dq_algebra::stack;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The load can be identified if the unit vector along gravity, in the tool frame, varies with at least this amplitude along two
/// axes.
const SPREAD: f64 = 0.2;

/// The load that the sensor carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Mass \[kg\].
    pub mass: f64,
    /// Center of mass, in the tool frame \[m\].
    pub center: Vector3<f64>,
}

/// The tool has not been turned enough to identify its load.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error(
    "the tool was not turned enough: turn it slowly by 30° or more about two horizontal axes, without contact, between the two calls"
)]
pub struct TooFewDirections;

impl std::fmt::Display for Load {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { mass, center } = self;
        let [x, y, z] = (*center).into();
        write!(
            f,
            "set contact.tool_mass to {mass:.4} kg and contact.tool_center to [{x:.4}, {y:.4}, {z:.4}] m, and then call ~/tare"
        )
    }
}

impl Load {
    /// Returns the wrench of the weight in the tool frame, torque first \[N m, N\], with `gravity` in the base frame \[m/s²\].
    pub fn weight(&self, base_from_tool: &UnitQuaternion<f64>, gravity: &Vector3<f64>) -> Vector6<f64> {
        let force = self.mass * (base_from_tool.inverse() * gravity);
        stack(self.center.cross(&force), force)
    }
}

/// The number of unknowns: the mass `m`, its moment `m c`, and a constant force `f₀` and torque `τ₀` of the sensor.
const UNKNOWNS: usize = 10;

/// The sums of a least-squares fit to wrenches in several orientations of the tool. The fit finds the load and the constant bias of
/// the sensor: `f = m g + f₀` and `τ = (m c) × g + τ₀`, with gravity `g` in the tool frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Identification {
    count: f64,
    /// The sum of the unit vectors `u` along gravity.
    directions: Vector3<f64>,
    /// The sum of the matrices `u uᵀ`.
    products: Matrix3<f64>,
    normal: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    right: SVector<f64, UNKNOWNS>,
}

impl Identification {
    /// Adds a `wrench` in the tool frame, torque first \[N m, N\], with `gravity` in the tool frame \[m/s²\].
    pub fn add(&mut self, wrench: &Vector6<f64>, gravity: &Vector3<f64>) {
        let direction = gravity.normalize();
        self.count += 1.0;
        self.directions += direction;
        self.products += direction * direction.transpose();
        // The torque is in the first three rows.
        let mut rows = SMatrix::<f64, 6, UNKNOWNS>::zeros();
        rows.fixed_view_mut::<3, 1>(3, 0).copy_from(gravity);
        rows.fixed_view_mut::<3, 3>(0, 1).copy_from(&-gravity.cross_matrix());
        rows.fixed_view_mut::<3, 3>(3, 4).fill_with_identity();
        rows.fixed_view_mut::<3, 3>(0, 7).fill_with_identity();
        self.normal += rows.tr_mul(&rows);
        self.right += rows.tr_mul(wrench);
    }

    /// Returns the load that fits best.
    ///
    /// # Errors
    /// [`TooFewDirections`] if the tool was not turned about two axes.
    pub fn load(&self) -> Result<Load, TooFewDirections> {
        let mean = self.directions / self.count;
        let mut spreads = (self.products / self.count - mean * mean.transpose()).symmetric_eigenvalues();
        spreads.as_mut_slice().sort_by(f64::total_cmp);
        // False for NaN, which results if there is no wrench or no gravity.
        let is_turned = spreads[1] >= SPREAD * SPREAD / 2.0;
        if !is_turned {
            return Err(TooFewDirections);
        }
        let solution = self.normal.try_inverse().ok_or(TooFewDirections)? * self.right;
        let (mass, moment) = (solution[0], solution.fixed_rows::<3>(1));
        Ok(Load { mass, center: if mass.abs() > 1e-6 { moment / mass } else { Vector3::zeros() } })
    }
}
