//! The functions of the reference work's appendix A in order, with the names that they have here.

use dq_algebra::*;
use nalgebra::Vector3;
use std::{error::Error, f64::consts::FRAC_PI_2};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // `quat` and `decq`: a quarter turn about z, and its angle and axis.
    let turn = quaternion_from_angle_axis(FRAC_PI_2, &Vector3::z_axis());
    println!("quat: {turn:.4}\ndecq: {:.4} rad", angle_axis(&turn).0);
    // `unitdq`: the same turn, then 0.3 m along x (eq. 13). `R82dual`: the same pose from its eight numbers.
    let pose =
        UnitDualQuaternion::from_translation_angle_axis(0.3 * Vector3::x(), FRAC_PI_2, &Vector3::z_axis());
    assert_eq!(&DualQuaternion::from_vector8(&pose.to_vector8()), pose.as_dual_quaternion());
    println!("unitdq: {:.4?}", pose.to_vector8().as_slice());
    // `dqmult` and `cdualq`: the composition of two poses, and the inverse.
    let twice = pose * pose;
    println!("dqmult: {:.4?}\ncdualq: {:.4?}", twice.translation(), twice.inverse().translation());
    // `dHp` and `dHn`: the same product as a matrix of the left factor and of the right one (eq. 9–11).
    let (plus, minus) =
        (dual_hamilton_plus(pose.as_dual_quaternion()), dual_hamilton_minus(pose.as_dual_quaternion()));
    assert!((plus * pose.to_vector8() - twice.to_vector8()).amax() < 1e-15);
    assert!((minus * pose.to_vector8() - twice.to_vector8()).amax() < 1e-15);
    // `logdq` and `explogdq`: half the rotation vector and half the translation (eq. 32), and back. `R62dual`: the six numbers as a
    // pure dual quaternion.
    let log = twice.half_log();
    assert!((UnitDualQuaternion::half_exp(&log).to_vector8() - twice.to_vector8()).amax() < 1e-15);
    println!("logdq: {:.4?}", DualQuaternion::from_vector6(&log).to_vector8().as_slice());
    // The appendix does not have the logarithm of SE(3), the screw that leads to the pose.
    println!("screw: {:.4?}", twice.screw_log().as_slice());
    Ok(())
}
