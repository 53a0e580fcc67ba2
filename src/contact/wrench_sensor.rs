//! Converts the sensor's messages to the wrench that the environment exerts on the tool, in the tool frame.

use crate::{Compliance, Identification, Load, TooFewDirections, wrench_in};
use dq_algebra::{UnitDualQuaternion, stack};
use dq_kinematics::arm::bounds::{self, NumberError};
use dq_link::Arbiter;
use nalgebra::Vector6;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The largest force or torque that a message may contain \[N, N m\].
const LARGEST: f64 = 1e12;

/// The longest interval between two wrenches in the low-pass filter and in the running mean \[s\]. There, a longer interval counts as
/// this long.
const LONGEST_INTERVAL: f64 = 0.1;

/// The time constant of the running mean \[s\]. [`WrenchSensor::tare`] sets the bias of the sensor to this mean.
const MEAN: f64 = 0.3;

/// A sensor is frozen if it has repeated one nonzero wrench bit for bit for more than this time \[s\], although the tool has moved by
/// more than [`MOVED`].
const UNCHANGED: f64 = 0.5;
/// The distance that the tool must move before a sensor with an unchanged wrench counts as frozen \[m\].
const MOVED: f64 = 2e-3;

/// A wrench as received.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WrenchReading<'a> {
    /// Force \[N\].
    pub force: [f64; 3],
    /// Torque about the origin of the sensor's frame \[N m\].
    pub torque: [f64; 3],
    /// The name of the frame in which the pose `sensor` is given: the base frame or the tool frame. An empty name stands for the tool
    /// frame.
    pub frame_id: &'a str,
    /// The pose of the sensor's own frame, relative to the frame named by `frame_id`.
    pub sensor: UnitDualQuaternion,
    /// The number of the publisher.
    pub source: u32,
    /// The age of the wrench by its stamp; `None` if the stamp is zero or ahead of this host's clock.
    pub stamp_age: Option<Duration>,
}

impl<'a> WrenchReading<'a> {
    /// Returns the reading of a sensor whose frame has this pose in the frame `frame_id`.
    #[must_use]
    pub fn in_frame(self, frame_id: &'a str, sensor: UnitDualQuaternion) -> Self {
        Self { frame_id, sensor, ..self }
    }
}

/// The wrench sensor of one tool. It converts, compensates and filters the received wrenches. All wrenches in this type are in the
/// tool frame, torque first \[N m, N\].
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct WrenchSensor {
    pub(crate) sources: Arbiter,
    /// When the last wrench was measured.
    measured_at: Option<Duration>,
    /// The last wrench, as measured.
    measured: Vector6<f64>,
    /// The last wrench, less the weight of the load and the bias of the sensor.
    latest: Vector6<f64>,
    /// The low-pass-filtered [`latest`](Self::latest).
    filtered: Vector6<f64>,
    /// The running mean of the wrenches, less the weight of the load. It still contains the bias.
    mean: Vector6<f64>,
    bias: Vector6<f64>,
    /// For how long the sensor has repeated its last wrench \[s\], and how far the tool has moved since \[m\].
    unchanged: (f64, f64),
    identification: Option<Identification>,
}

impl WrenchSensor {
    /// Takes a wrench that was received at `now`. Returns false if the wrench is ignored because another publisher is in use.
    /// `base_from_tool` is the pose of the tool frame, and `in_tool` says whether the reading's `frame_id` is the tool frame;
    /// otherwise it is the base frame.
    ///
    /// # Errors
    /// [`NumberError`] for a number that is not finite or is too large. The last valid wrench remains.
    pub fn hear(
        &mut self,
        reading: &WrenchReading,
        (base_from_tool, in_tool): (&UnitDualQuaternion, bool),
        compliance: &Compliance,
        now: Duration,
    ) -> Result<bool, NumberError> {
        bounds::check(|| "force".to_owned(), &reading.force, LARGEST, "N")?;
        bounds::check(|| "torque".to_owned(), &reading.torque, LARGEST, "N m")?;
        if !self.sources.hear(reading.source, now, compliance.wrench_timeout) {
            return Ok(false);
        }
        let tool_from_sensor =
            if in_tool { reading.sensor } else { base_from_tool.inverse() * reading.sensor };
        let sign = if compliance.reversed { -1.0 } else { 1.0 };
        let given = sign * stack(reading.torque.into(), reading.force.into());
        let measured = wrench_in(&tool_from_sensor, &given);
        let time = now.saturating_sub(reading.stamp_age.unwrap_or_default());
        let interval =
            self.measured_at.map_or(f64::INFINITY, |before| time.saturating_sub(before).as_secs_f64());
        let repeats = measured == self.measured && measured != Vector6::zeros();
        self.unchanged = if repeats { (self.unchanged.0 + interval, self.unchanged.1) } else { (0.0, 0.0) };
        (self.measured_at, self.measured) = (Some(time), measured);
        let rotation = base_from_tool.rotation();
        let load = Load { mass: compliance.tool_mass, center: compliance.tool_center.into() };
        let unbiased = measured - load.weight(&rotation, &compliance.gravity());
        self.latest = unbiased - self.bias;
        // The first wrench has an infinite interval, so that the filtered wrench and the mean start at it.
        let interval = if interval.is_finite() { interval.min(LONGEST_INTERVAL) } else { f64::INFINITY };
        let share = |time: f64| -(-interval / time).exp_m1();
        self.filtered += share(compliance.filter_time()) * (self.latest - self.filtered);
        self.mean += share(MEAN) * (unbiased - self.mean);
        if let Some(identification) = &mut self.identification {
            identification.add(&measured, &(rotation.inverse() * compliance.gravity()));
        }
        Ok(true)
    }

    /// Notes that the tool has moved by `distance` \[m\].
    pub fn note_motion(&mut self, distance: f64) {
        self.unchanged.1 += distance;
    }

    /// Returns when the last wrench was measured; `None` before the first.
    pub fn measured_at(&self) -> Option<Duration> {
        self.measured_at
    }

    /// Returns whether the last wrench is too old at `now`, or there is none.
    pub fn is_stale(&self, now: Duration, compliance: &Compliance) -> bool {
        self.measured_at.is_none_or(|time| now.saturating_sub(time) > compliance.wrench_timeout)
    }

    /// Returns whether the sensor has repeated one nonzero wrench for 0.5 s, although the tool has moved.
    pub fn is_frozen(&self) -> bool {
        self.unchanged.0 > UNCHANGED && self.unchanged.1 > MOVED
    }

    /// Returns the last wrench, less the weight of the load and the bias of the sensor.
    pub fn latest(&self) -> &Vector6<f64> {
        &self.latest
    }

    /// Returns the low-pass-filtered wrench, less the weight of the load and the bias of the sensor.
    pub fn filtered(&self) -> &Vector6<f64> {
        &self.filtered
    }

    /// Sets the bias of the sensor to the mean of the recent wrenches without the weight, so that the present wrench counts as no
    /// contact. The running mean has a time constant of 0.3 s.
    pub fn tare(&mut self) {
        let change = self.mean - self.bias;
        self.bias = self.mean;
        self.latest -= change;
        self.filtered -= change;
    }

    /// Begins to collect wrenches for the identification of the load.
    pub fn begin_identification(&mut self) {
        self.identification = Some(Identification::default());
    }

    /// Ends the identification, and returns the load that was found.
    ///
    /// # Errors
    /// [`TooFewDirections`] if the tool was not turned about two axes, or if the identification was not begun.
    pub fn end_identification(&mut self) -> Result<Load, TooFewDirections> {
        self.identification.take().ok_or(TooFewDirections)?.load()
    }
}
