//! The servo in fake time.

use super::arrays::{Numbers, array, slice, wrong};
use super::chain::Chain;
use super::law::Law;
use super::pose::Pose;
use dq_servo::config::{ForArm, ServoParameters};
use dq_servo::control::Controller;
use dq_servo::servo::{self, Interface, Measured, Settings};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::time::Duration;

/// The servo: once a cycle it takes where the joints are, and gives what is to be sent to the robot.
#[pyclass(module = "dq_servo")]
pub(super) struct Servo {
    servo: servo::Servo,
    law: Option<Law>,
    joints: Vec<String>,
}

/// A time in seconds, which is none where it is below 0 or no number.
fn duration(seconds: f64, what: &str) -> PyResult<Duration> {
    let wrong = |why| wrong(format!("{what} is {seconds} s: {why}"));
    Duration::try_from_secs_f64(seconds).map_err(wrong)
}

#[pymethods]
impl Servo {
    #[new]
    #[pyo3(signature = (arm, *, law = None, period = 0.002, interface = "velocity"))]
    fn new(arm: &str, law: Option<Law>, period: f64, interface: &str) -> PyResult<Self> {
        Self::of(ServoParameters::for_arm(arm).map_err(wrong)?, law, period, interface)
    }

    #[staticmethod]
    #[pyo3(signature = (text, base_frame, tool_frame, *, law = None, period = 0.002, interface = "velocity"))]
    fn from_urdf(
        text: &str,
        base_frame: &str,
        tool_frame: &str,
        law: Option<Law>,
        period: f64,
        interface: &str,
    ) -> PyResult<Self> {
        let parameters = ServoParameters::from_urdf(text, base_frame, tool_frame).map_err(wrong)?;
        Self::of(parameters, law, period, interface)
    }

    #[staticmethod]
    #[pyo3(signature = (chain, velocity, acceleration, *, law = None, period = 0.002, interface = "velocity"))]
    fn from_chain(
        chain: &Chain,
        velocity: Numbers<'_>,
        acceleration: Numbers<'_>,
        law: Option<Law>,
        period: f64,
        interface: &str,
    ) -> PyResult<Self> {
        let (velocity, acceleration) = (slice(&velocity), slice(&acceleration));
        let parameters = ServoParameters::for_chain(chain.0.clone(), &velocity, &acceleration);
        Self::of(parameters.map_err(wrong)?, law, period, interface)
    }

    fn set_goal(&mut self, base_from_goal: &Pose) {
        self.servo.set_goal(base_from_goal.0);
    }

    #[pyo3(signature = (now, positions, velocities = None))]
    fn cycle<'py>(
        &mut self,
        py: Python<'py>,
        now: f64,
        positions: Numbers<'py>,
        velocities: Option<Numbers<'py>>,
    ) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let (now, positions) = (duration(now, "now")?, slice(&positions));
        let velocities = velocities.as_ref().map(slice).unwrap_or_default();
        let measured = Measured { positions: &positions, velocities: &velocities };
        let output = self.servo.cycle(now, &measured).map_err(wrong)?;
        self.law.as_ref().map_or(Ok(()), Law::check)?;
        Ok(output.map(|output| array(py, output)))
    }

    fn stop(&mut self) {
        self.servo.stop();
    }

    fn pause(&mut self, paused: bool) {
        self.servo.pause(paused);
    }

    #[pyo3(signature = (*, law = None, linear_speed = None, angular_speed = None, joint_velocity = None, joint_acceleration = None,
                        goal_tolerance = None))]
    fn configure(
        &mut self,
        law: Option<Law>,
        linear_speed: Option<f64>,
        angular_speed: Option<f64>,
        joint_velocity: Option<Vec<f64>>,
        joint_acceleration: Option<Vec<f64>>,
        goal_tolerance: Option<(f64, f64)>,
    ) -> PyResult<()> {
        let mut settings = self.servo.settings().clone();
        let limits = &mut settings.limits;
        limits.linear_speed = linear_speed.unwrap_or(limits.linear_speed);
        limits.angular_speed = angular_speed.unwrap_or(limits.angular_speed);
        joint_velocity.into_iter().for_each(|velocity| limits.joint_velocity = velocity);
        if let Some(acceleration) = joint_acceleration {
            limits.joint_deceleration.clone_from(&acceleration);
            limits.joint_acceleration = acceleration;
        }
        if let Some((linear, angular)) = goal_tolerance {
            (settings.goal_tolerance.linear, settings.goal_tolerance.angular) = (linear, angular);
        }
        law.iter().for_each(|law| law.take_place(&mut settings));
        self.servo.configure(settings).map_err(wrong)?;
        self.law = law.or(self.law.take());
        Ok(())
    }

    #[getter]
    fn joints(&self) -> Vec<String> {
        self.joints.clone()
    }

    #[getter]
    fn state(&self) -> &'static str {
        self.servo.status().state.name()
    }

    #[getter]
    fn pose(&self) -> Option<Pose> {
        self.servo.pose().map(Pose)
    }

    #[getter]
    fn command<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.servo.command())
    }

    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let figures = PyDict::new(py);
        for (name, value) in self.servo.status().figures.named() {
            figures.set_item(name, value)?;
        }
        Ok(figures)
    }

    fn __repr__(&self) -> String {
        format!("<dq_servo.Servo of {} joints: {}>", self.joints.len(), self.state())
    }
}

impl Servo {
    fn of(parameters: ServoParameters, law: Option<Law>, period: f64, interface: &str) -> PyResult<Self> {
        let interface: Interface = interface.parse().map_err(wrong)?;
        let joints = parameters.joints.iter().flat_map(|arm| arm.names().to_vec()).collect();
        let parameters = parameters.with_period(duration(period, "period")?).with(|settings| {
            settings.interface = interface;
            law.iter().for_each(|law| law.take_place(settings));
        });
        Ok(Self { servo: parameters.build().map_err(wrong)?, law, joints })
    }
}

impl Law {
    /// Puts the law into force, with its gains and its aim, and the damping that there is.
    fn take_place(&self, settings: &mut Settings) {
        let damping = settings.controller.damping;
        settings.controller = Controller { damping, ..self.controller };
    }
}
