//! The parameters of contact.

use dq_algebra::split;
use dq_limits::POSITIVE;
use dq_params::Parameters;
use nalgebra::{Vector3, Vector6};
use std::f64::consts::TAU;
use std::time::Duration;

/// The least damping, as a multiple of `k T`, with the stiffness `k` of the contact and the delay `T`. At a multiple of 2/π, a goal
/// without virtual mass would already oscillate forever.
const MARGIN: f64 = 1.5;

/// How the goal yields to the wrench at the tool. Lists of six numbers are for motion along x, y, z and about x, y, z of the
/// controlled tool at its goal.
#[derive(Clone, Copy, Debug, PartialEq, Parameters)]
#[parameters(prefix = "contact.")]
pub struct Compliance {
    /// stiffness along and about x, y, z of the tool; 0: free, .inf: the goal does not yield \[N/m, N m/rad\]
    #[parameter(default = [500.0, 500.0, 500.0, 30.0, 30.0, 30.0], range = 0.0..=f64::INFINITY)]
    pub stiffness: [f64; 6],
    /// damping along and about x, y, z of the tool; a value too small for stability is raised \[N s/m, N m s/rad\]
    #[parameter(default = [300.0, 300.0, 300.0, 8.0, 8.0, 8.0], range = 1e-3..=1e6)]
    pub damping: [f64; 6],
    /// virtual mass along, and inertia about, x, y, z of the tool \[kg, kg m²\]
    #[parameter(default = [5.0, 5.0, 5.0, 0.2, 0.2, 0.2], range = 1e-3..=1e3)]
    pub mass: [f64; 6],
    /// wrench to exert along and about x, y, z of the tool; fully reached only in directions with stiffness 0 \[N, N m\]
    #[parameter(range = -1e4..=1e4)]
    pub force_goal: [f64; 6],
    /// largest stiffness of a contact at which the arm must be stable: along an axis, and about an axis \[N/m, N m/rad\]
    #[parameter(default = [1e4, 100.0], range = 0.0..=1e6)]
    pub stiffest: [f64; 2],
    /// largest distance and angle by which the goal yields \[m, rad\]
    // Beyond 2.5 rad the logarithm changes too fast for a step.
    #[parameter(default = [0.1, 0.5], range = 0.0..=2.5)]
    pub largest_offset: [f64; 2],
    /// largest force and torque; beyond them the arm stops \[N, N m\]
    #[parameter(default = [50.0, 10.0], range = POSITIVE..=1e4)]
    pub largest_wrench: [f64; 2],
    /// force and torque to which the goal does not yield; it yields only to the part of a wrench beyond them \[N, N m\]
    #[parameter(default = [1.0, 0.1], range = 0.0..=1e3)]
    pub dead_band: [f64; 2],
    /// cutoff frequency of the wrench's low-pass \[Hz\]
    #[parameter(default = 20.0, range = 0.1..=1e3)]
    pub cutoff: f64,
    /// largest age of a wrench that the servo uses; the arm decelerates while the newest wrench is older \[s\]
    #[parameter(default = 0.1, range = 0.001..=10.0)]
    pub wrench_timeout: Duration,
    /// whether the sensor reports the wrench that the tool exerts, instead of the wrench that acts on the tool
    #[parameter()]
    pub reversed: bool,
    /// mass of the load that the sensor carries \[kg\]
    #[parameter(range = 0.0..=1e3)]
    pub tool_mass: f64,
    /// center of mass of the load that the sensor carries, in tool_frame \[m\]
    #[parameter(range = -10.0..=10.0)]
    pub tool_center: [f64; 3],
    /// gravity in the base frame \[m/s²\]
    #[parameter(default = [0.0, 0.0, -9.80665], range = -100.0..=100.0)]
    pub gravity: [f64; 3],
}

/// Puts the numbers for motion about x, y, z before those for motion along x, y, z, as in twists.
pub(crate) fn angular_first(numbers: &[f64; 6]) -> Vector6<f64> {
    let [x, y, z, about @ ..] = *numbers;
    Vector6::new(about[0], about[1], about[2], x, y, z)
}

/// Returns the norms of the force and of the torque of a wrench, which has its torque first.
pub fn sizes(wrench: &Vector6<f64>) -> [f64; 2] {
    let (torque, force) = split(wrench);
    [force.norm(), torque.norm()]
}

impl Compliance {
    /// Returns the least damping at which a contact with the stiffness [`stiffest`](Self::stiffest) is stable, if the tool yields
    /// `delay` \[s\] after the sensor's message. The first number is for motion along an axis \[N s/m\], the second for motion about an
    /// axis \[N m s/rad\].
    ///
    /// With stiffness `k` of the contact and delay `T`, the characteristic equation `m s² + d s + K + k exp(−s T) = 0` has a root
    /// `s = iω` only for `d = k sin(ωT)/ω ≤ k T`. So `d ≥ k T` is stable for every mass `m` and stiffness `K`.
    pub fn least_damping(&self, delay: f64) -> [f64; 2] {
        self.stiffest.map(|stiffness| MARGIN * stiffness * (delay + self.filter_time()))
    }

    /// Returns the time by which the low-pass delays the wrench \[s\].
    pub(crate) fn filter_time(&self) -> f64 {
        1.0 / (TAU * self.cutoff)
    }

    /// Returns gravity in the base frame \[m/s²\].
    pub(crate) fn gravity(&self) -> Vector3<f64> {
        self.gravity.into()
    }
}
