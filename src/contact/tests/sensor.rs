//! Tests of the wrench sensor: frames, weight, bias, identification, and unusable messages.

use super::defaults;
use crate::{Compliance, Load, TooFewDirections, WrenchReading, WrenchSensor};
use dq_algebra::{UnitDualQuaternion, stack};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

const LOAD: Load = Load { mass: 2.0, center: Vector3::new(0.01, -0.02, 0.08) };

fn reading(force: [f64; 3], torque: [f64; 3]) -> WrenchReading<'static> {
    WrenchReading {
        force,
        torque,
        frame_id: "",
        sensor: UnitDualQuaternion::identity(),
        source: 1,
        stamp_age: Some(Duration::ZERO),
    }
}

fn loaded() -> Compliance {
    Compliance { tool_mass: LOAD.mass, tool_center: LOAD.center.into(), ..defaults() }
}

fn turned(angles: [f64; 3]) -> UnitDualQuaternion {
    let [roll, pitch, yaw] = angles;
    UnitDualQuaternion::from_parts(
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        Vector3::new(0.3, 0.1, 0.5),
    )
}

/// Returns the reading of a sensor without noise that carries [`LOAD`] at this pose and has this bias.
fn measured(pose: &UnitDualQuaternion, bias: &Vector6<f64>) -> WrenchReading<'static> {
    let gravity = pose.rotation().inverse() * Vector3::new(0.0, 0.0, -9.80665);
    let force = LOAD.mass * gravity;
    let wrench = stack(LOAD.center.cross(&force), force) + bias;
    let half = |first: usize| wrench.fixed_rows::<3>(first).into_owned().into();
    reading(half(3), half(0))
}

/// Sends one reading to the sensor repeatedly, until the filters have settled.
fn hear(
    sensor: &mut WrenchSensor,
    reading: &WrenchReading,
    pose: &UnitDualQuaternion,
    compliance: &Compliance,
    from: u64,
) {
    for step in 0..600 {
        let now = Duration::from_millis(8 * (from + step));
        sensor.hear(reading, (pose, true), compliance, now).unwrap();
    }
}

#[test]
fn the_weight_is_taken_away_in_every_orientation() {
    let (compliance, bias) = (loaded(), Vector6::new(0.1, -0.2, 0.05, 3.0, -2.0, 1.0));
    let mut sensor = WrenchSensor::default();
    let first = turned([0.0; 3]);
    hear(&mut sensor, &measured(&first, &bias), &first, &compliance, 0);
    assert!(sensor.filtered().norm() > 3.0);
    sensor.tare();
    for (step, roll) in [-2.5, -1.0, 0.0, 0.7, 3.0].into_iter().enumerate() {
        for pitch in [-1.2, 0.3, 1.4] {
            let pose = turned([roll, pitch, 0.4]);
            sensor
                .hear(
                    &measured(&pose, &bias),
                    (&pose, true),
                    &compliance,
                    Duration::from_secs(100 + step as u64),
                )
                .unwrap();
            assert!(sensor.latest().norm() < 1e-3, "{roll} {pitch}: {}", sensor.latest());
        }
    }
}

#[test]
fn the_load_is_identified_from_a_turned_tool_and_not_from_one_that_stands() {
    let (compliance, bias) = (defaults(), Vector6::new(0.1, -0.2, 0.05, 3.0, -2.0, 1.0));
    let identify = |angles: &dyn Fn(f64) -> [f64; 3]| {
        let mut sensor = WrenchSensor::default();
        sensor.begin_identification();
        for step in 0..200_u32 {
            let pose = turned(angles(f64::from(step) / 200.0));
            let now = Duration::from_millis(8 * u64::from(step));
            sensor.hear(&measured(&pose, &bias), (&pose, true), &compliance, now).unwrap();
        }
        sensor.end_identification()
    };
    let found = identify(&|s| [0.8 * (12.0 * s).sin(), 0.8 * (7.0 * s).cos(), 0.0]).unwrap();
    assert!((found.mass - LOAD.mass).abs() < 1e-6 && (found.center - LOAD.center).norm() < 1e-6, "{found}");
    assert_eq!(identify(&|_| [0.3, 0.2, 0.1]), Err(TooFewDirections));
    assert_eq!(identify(&|s| [0.0, 0.0, 6.0 * s]), Err(TooFewDirections), "turned about gravity");
    assert_eq!(identify(&|s| [FRAC_PI_2 * s, 0.0, 0.0]), Err(TooFewDirections), "turned about one axis");
    assert_eq!(WrenchSensor::default().end_identification(), Err(TooFewDirections));
}

#[test]
fn a_wrench_is_moved_to_the_tool_frame_from_the_sensor_and_from_the_base() {
    let (tool, sensor_in_tool) = (
        turned([0.3, -0.4, 1.0]),
        UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(0.1, 0.0, 0.0)),
    );
    // 10 N along z of a sensor that sits 0.1 m ahead: a torque about y.
    let in_tool = reading([0.0, 0.0, 10.0], [0.0; 3]).in_frame("", sensor_in_tool);
    let in_base = in_tool.in_frame("base", tool * sensor_in_tool);
    for (reading, is_in_tool) in [(in_tool, true), (in_base, false)] {
        let mut sensor = WrenchSensor::default();
        sensor.hear(&reading, (&tool, is_in_tool), &defaults(), Duration::from_secs(1)).unwrap();
        let expected = Vector6::new(0.0, -1.0, 0.0, 0.0, 0.0, 10.0);
        assert!((sensor.latest() - expected).norm() < 1e-12, "{}", sensor.latest());
    }
    let reversed = Compliance { reversed: true, ..defaults() };
    let mut sensor = WrenchSensor::default();
    sensor.hear(&in_tool, (&tool, true), &reversed, Duration::from_secs(1)).unwrap();
    assert!((sensor.latest()[5] + 10.0).abs() < 1e-12);
}

#[test]
fn unusable_wrenches_are_refused_and_silence_a_second_publisher_and_repetition_are_noticed() {
    let (compliance, pose) = (defaults(), turned([0.0; 3]));
    let mut sensor = WrenchSensor::default();
    assert!(sensor.is_stale(Duration::ZERO, &compliance));
    for wrong in [f64::NAN, f64::INFINITY, 1e300] {
        assert!(
            sensor
                .hear(&reading([wrong, 0.0, 0.0], [0.0; 3]), (&pose, true), &compliance, Duration::ZERO)
                .is_err()
        );
        assert!(
            sensor
                .hear(&reading([0.0; 3], [0.0, wrong, 0.0]), (&pose, true), &compliance, Duration::ZERO)
                .is_err()
        );
    }
    assert!(sensor.is_stale(Duration::ZERO, &compliance), "a refused wrench is none");
    let good = reading([0.0, 0.0, 1.0], [0.0; 3]);
    assert_eq!(sensor.hear(&good, (&pose, true), &compliance, Duration::ZERO), Ok(true));
    let other = WrenchReading { source: 2, ..good };
    assert_eq!(sensor.hear(&other, (&pose, true), &compliance, Duration::from_millis(10)), Ok(false));
    assert!(!sensor.is_stale(Duration::from_millis(100), &compliance));
    assert!(sensor.is_stale(Duration::from_millis(101), &compliance));
    let old = WrenchReading { stamp_age: Some(Duration::from_millis(150)), ..good };
    sensor.hear(&old, (&pose, true), &compliance, Duration::from_millis(200)).unwrap();
    assert!(sensor.is_stale(Duration::from_millis(200), &compliance), "an old stamp");
    hear(&mut sensor, &good, &pose, &compliance, 100);
    assert!(!sensor.is_frozen(), "the tool stands");
    sensor.note_motion(0.01);
    assert!(sensor.is_frozen());
    hear(&mut sensor, &reading([0.0, 0.0, 1.001], [0.0; 3]), &pose, &compliance, 800);
    assert!(!sensor.is_frozen());
}
