//! The load that hangs on the sensor, and its identification.

use nalgebra::{Matrix4, Matrix6, UnitQuaternion, Vector3, Vector4, Vector6};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The mass is known if the directions of gravity in the tool frame spread by at least this fraction of gravity about two axes.
const SPREAD: f64 = 0.2;

/// The load on the sensor: the tool and everything else that hangs on it.
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
        stacked(&self.center.cross(&force), &force)
    }
}

/// Returns the six numbers of a wrench or twist, angular part first.
pub fn stacked(angular: &Vector3<f64>, linear: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
}

/// The sums of a least-squares fit to wrenches in several orientations of the tool. The fit finds the load and the constant bias of
/// the sensor: `f = m g + f₀` and `τ = (m c) × g + τ₀`, with gravity `g` in the tool frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Identification {
    count: f64,
    /// The sums of the directions of gravity, and of their products.
    directions: Vector3<f64>,
    products: nalgebra::Matrix3<f64>,
    force: (Matrix4<f64>, Vector4<f64>),
    torque: (Matrix6<f64>, Vector6<f64>),
}

impl Identification {
    /// Adds a `wrench` in the tool frame, torque first \[N m, N\], with `gravity` in the tool frame \[m/s²\].
    pub fn add(&mut self, wrench: &Vector6<f64>, gravity: &Vector3<f64>) {
        let (torque, force) = (wrench.fixed_rows::<3>(0), wrench.fixed_rows::<3>(3));
        let direction = gravity.normalize();
        self.count += 1.0;
        self.directions += direction;
        self.products += direction * direction.transpose();
        let turned = -gravity.cross_matrix();
        for axis in 0..3 {
            let mut of_force = Vector4::zeros();
            (of_force[0], of_force[1 + axis]) = (gravity[axis], 1.0);
            self.force.0 += of_force * of_force.transpose();
            self.force.1 += of_force * force[axis];
            let mut of_torque = Vector6::zeros();
            of_torque.fixed_rows_mut::<3>(0).copy_from(&turned.row(axis).transpose());
            of_torque[3 + axis] = 1.0;
            self.torque.0 += of_torque * of_torque.transpose();
            self.torque.1 += of_torque * torque[axis];
        }
    }

    /// Returns the load that fits best.
    ///
    /// # Errors
    /// [`TooFewDirections`] if the tool was not turned about two axes.
    pub fn load(&self) -> Result<Load, TooFewDirections> {
        let mean = self.directions / self.count;
        let spread = self.products / self.count - mean * mean.transpose();
        let mut spreads = spread.symmetric_eigenvalues();
        spreads.as_mut_slice().sort_by(f64::total_cmp);
        // This comparison also rejects NaN.
        if !(spreads[1] >= SPREAD * SPREAD / 2.0) {
            return Err(TooFewDirections);
        }
        let force = self.force.0.try_inverse().ok_or(TooFewDirections)? * self.force.1;
        let torque = self.torque.0.try_inverse().ok_or(TooFewDirections)? * self.torque.1;
        let moment = torque.fixed_rows::<3>(0).into_owned();
        let mass = force[0];
        Ok(Load { mass, center: if mass.abs() > 1e-6 { moment / mass } else { Vector3::zeros() } })
    }
}
