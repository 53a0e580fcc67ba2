//! The servo, cycle by cycle: the caller passes the time of each cycle.

use super::arrays::{Numbers, array, slice, wrong};
use super::joints::JointGoal;
use super::law::Law;
use super::parameters::{PythonValue, changed, of_law, store, typed, values};
use super::pose::Pose;
use super::runs::python;
use super::time::{age, duration};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    self, Contended, Event, JointGoalReading, Load, Measured, Rejection, Sent, Settings, WrenchReading,
    joint_name,
};
use dq_kinematics::control::Controller;
use dq_params::{ParameterStore, Value};
use dq_search::{STARTS, Search};
use dq_wire::{ServoKind, ServoReport};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::time::Duration;

/// The servo with all safety rules. Time is simulated: your program advances it.
///
/// Parameters are those of the node, by their ROS names: `{"controller": "diffc", "limits.linear_speed": 0.2}`. If the argument
/// `right_base` is given, the servo moves two arms, and has the parameters of the node `dq_dual_servo`. Goals and `pose` are then poses
/// of the right tool relative to the left tool.
#[pyclass(module = "dq_servo")]
pub(super) struct Servo {
    servo: servo::Servo,
    store: ParameterStore,
    kind: ServoKind,
    /// The law in force if the user wrote it in Python. No parameter can name such a law.
    own: Option<Law>,
    search: Box<Search>,
    /// The names of all joints, arm after arm.
    joints: Vec<String>,
    /// The joint goal that takes effect in the next cycle.
    joint_goal: Option<Vec<Option<f64>>>,
    now: Duration,
}

/// Returns the reading of a wrench in the tool frame, measured `age` ago.
fn in_tool([x, y, z, torque @ ..]: [f64; 6], age: Duration) -> WrenchReading<'static> {
    let (force, sensor) = ([x, y, z], UnitDualQuaternion::identity());
    WrenchReading { force, torque, frame_id: "", sensor, source: 0, stamp_age: Some(age) }
}

#[pymethods]
impl Servo {
    #[new]
    #[pyo3(signature = (arm = None, parameters = None, *, law = None, right_base = None))]
    fn new(
        py: Python<'_>,
        arm: Option<&str>,
        parameters: Option<&Bound<'_, PyDict>>,
        law: Option<Law>,
        right_base: Option<&Pose>,
    ) -> PyResult<Self> {
        let kind = right_base.map_or(ServoKind::OneArm, |_| ServoKind::TwoArms);
        let mut given = values(parameters)?;
        given.extend(right_base.map(|base| ("right_base".to_owned(), Value::DoubleArray(base.numbers()))));
        let (listed, own): (Vec<_>, Vec<_>) = law.into_iter().partition(|law| law.own.is_none());
        given.extend(listed.iter().flat_map(of_law));
        let (store, own) = (store(py, kind, arm, given)?, own.into_iter().next());
        let parameters = typed(py, kind, &store)?.with(|settings| take_place(own.as_ref(), settings));
        let joints = kind.joint_names(&parameters.joints);
        let search = Box::new(Search::new(parameters.arms.clone()));
        let servo = parameters.build().map_err(wrong)?;
        Ok(Self { servo, store, kind, own, search, joints, joint_goal: None, now: Duration::ZERO })
    }

    /// Sets the goal, which takes effect in the next cycle. If the goal moves, call this method before each cycle.
    fn set_goal(&mut self, base_from_goal: &Pose) {
        self.joint_goal = None;
        self.servo.set_goal(base_from_goal.0);
    }

    /// Sets a joint goal, which takes effect in the next cycle. `positions` [rad, prismatic: m] is a dict with names of `joints`,
    /// or a list for all joints. A joint that the dict does not name keeps its previous joint goal. If it has no joint goal, it stays
    /// where it is.
    fn set_joint_goal(&mut self, positions: JointGoal<'_>) -> PyResult<()> {
        self.joint_goal = Some(positions.positions(&self.joints)?);
        Ok(())
    }

    /// Runs one cycle at `now` [s]. Returns the command for the robot, or None if nothing has to be sent.
    ///
    /// `positions` and `velocities` are the joint state that arrived since the previous cycle, or None. For two arms,
    /// the joints of the left arm come first. `stamp` [s] is the time at which the joint state was measured, by the same clock as
    /// `now`; by default it is `now`. `wrench` is the force [N] and the torque [N m] on the tool, measured at the same time: six
    /// numbers in the tool frame. It is None if no wrench arrived since the previous cycle.
    #[pyo3(signature = (now, positions = None, velocities = None, *, stamp = None, wrench = None))]
    fn cycle<'py>(
        &mut self,
        py: Python<'py>,
        now: f64,
        positions: Option<Numbers<'py>>,
        velocities: Option<Numbers<'py>>,
        stamp: Option<f64>,
        wrench: Option<[f64; 6]>,
    ) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let age = stamp.map_or(Ok(Duration::ZERO), |stamp| age(now, stamp))?;
        self.now = duration(now, "now")?;
        self.servo.begin(self.now);
        self.look_round()?;
        let positions = positions.as_ref().map(slice);
        let velocities = velocities.as_ref().map(slice).unwrap_or_default();
        if let Some(joint) = velocities.iter().position(|speed| !speed.is_finite()) {
            let speed = velocities[joint];
            return Err(wrong(format!("velocities[{joint}] is {speed}: expected a finite number")));
        }
        let state = positions.map_or(Ok(()), |positions| {
            let measured = Measured { positions: &positions, velocities: &velocities };
            self.servo.take_measured(&measured, Some(age), self.now)
        });
        let felt = wrench.map_or(Ok(true), |wrench| self.servo.take_wrench(&in_tool(wrench, age), self.now));
        let goal = self.servo.take_set_goal(self.now).and(self.take_joint_goal());
        // Do not release Python's global lock (GIL) for these microseconds. Measured with the lock released: two threads with a servo
        // each were not faster, and next to a busy Python thread a cycle took up to 24 ms instead of 0.05 ms.
        self.servo.step(self.now);
        state.and(felt.map(drop)).and(goal).map_err(wrong)?;
        self.own.as_ref().map_or(Ok(()), Law::check)?;
        Ok(self.servo.output().map(|output| array(py, output)))
    }

    /// Decelerates and drops the goal, like `~/stop`.
    fn stop(&mut self) {
        self.servo.stop();
    }

    /// Pauses if `paused` is true, otherwise resumes, like `~/pause`.
    fn pause(&mut self, paused: bool) {
        self.servo.pause(paused);
    }

    /// Lets a stalled arm move to another configuration of its joints, from which it can reach the goal, like `~/reconfigure`. The
    /// servo must have found this configuration.
    fn reconfigure(&mut self) -> PyResult<()> {
        self.servo.reconfigure(Duration::ZERO).map_err(wrong)
    }

    /// Uses the present wrench as the zero of the wrench sensor, like `~/tare`. Nothing may touch the tool meanwhile.
    fn tare(&mut self) {
        self.servo.tare();
    }

    /// Begins to identify the mass and the center of mass of the load on the force sensor, like `~/identify_tool` with true.
    fn identify_tool(&mut self) {
        self.servo.identify_tool();
    }

    /// Ends the identification. Returns the load's mass [kg] and its center of mass in the tool frame [m].
    fn identified_tool<'py>(&mut self, py: Python<'py>) -> PyResult<(f64, Bound<'py, PyArray1<f64>>)> {
        let Load { mass, center } = self.servo.identified_tool().map_err(wrong)?;
        Ok((mass, array(py, center.as_slice())))
    }

    /// Changes parameters and, if one is given, the law, from the next cycle on. If anything is invalid, changes nothing.
    #[pyo3(signature = (parameters = None, *, law = None))]
    fn configure(
        &mut self,
        py: Python<'_>,
        parameters: Option<&Bound<'_, PyDict>>,
        law: Option<Law>,
    ) -> PyResult<()> {
        let mut changes = values(parameters)?;
        let own = match law {
            Some(law) if law.own.is_some() => Some(law),
            Some(law) => {
                changes.extend(of_law(&law));
                None
            }
            None => self.own.take_if(|_| changes.iter().all(|(name, _)| name != "controller")),
        };
        let store = changed(&self.store, &changes)?;
        let mut settings = typed(py, self.kind, &store)?.settings;
        take_place(own.as_ref(), &mut settings);
        self.servo.configure(settings).map_err(wrong)?;
        (self.store, self.own) = (store, own);
        Ok(())
    }

    /// The parameters with their values.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let parameters = PyDict::new(py);
        for (name, value) in self.store.values() {
            parameters.set_item(name, PythonValue::from(value))?;
        }
        Ok(parameters)
    }

    /// The names of the joints.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.joints.clone()
    }

    /// The name of the servo's state, such as `tracking` or `settled`.
    #[getter]
    fn state(&self) -> &'static str {
        self.servo.status().state.name()
    }

    /// The controlled pose at the last joint positions; None until `cycle` has received joint positions.
    #[getter]
    fn pose(&self) -> Option<Pose> {
        self.servo.pose().map(Pose)
    }

    /// The last commanded joint velocities [rad/s, prismatic: m/s], even if the servo sends positions.
    #[getter]
    fn command<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.servo.command())
    }

    /// The content of `~/status`: the state, its reason, who requested motion, what revoked the request, and the metrics of the motion.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let said = PyDict::new(py);
        said.set_item("state", self.state())?;
        for (name, value) in self.report().values() {
            said.set_item(name, python(py, &value)?)?;
        }
        Ok(said)
    }

    fn __repr__(&self) -> String {
        format!("<dq_servo.Servo of {} joints: {}>", self.joints.len(), self.state())
    }
}

impl Servo {
    /// Searches for another configuration if the arm has stalled and the servo asks for a search.
    fn look_round(&mut self) -> PyResult<()> {
        if self.servo.ask(&mut self.search) {
            self.search.run(STARTS, || true);
            self.servo.take(Event::Found(self.search.found())).map_err(wrong)?;
        }
        Ok(())
    }

    fn take_joint_goal(&mut self) -> Result<(), Rejection> {
        let Some(positions) = self.joint_goal.take() else { return Ok(()) };
        let goal = JointGoalReading { positions: &positions, stamp: 0, sent: Sent::default() };
        self.servo.take_joint_goal(&goal, self.now)
    }

    fn report(&self) -> ServoReport<'_> {
        let (servo, status) = (&self.servo, self.servo.status());
        let (name, Settings { controller, scene, .. }) =
            (|number| joint_name(number, &self.joints), servo.settings());
        let publisher = |_: Contended, number| format!("publisher {number}");
        let reason = status.reason.map(|why| why.explain(name, publisher, |_| "the commands".to_owned()));
        let at_limit = status.joint_at_limit.and_then(|joint| self.joints.get(joint.checked_sub(1)?));
        ServoReport {
            law: self.kind.law(controller),
            joint_at_limit: at_limit.map(String::as_str),
            reason: reason.or_else(|| status.explain(&self.joints)),
            keep_outs: scene.as_ref().map(|scene| scene.keep_outs().len() + scene.keep_ins().len()),
            smallest_singular_value: servo.smallest_singular_value(),
            now: self.now,
            asker: None,
            status,
            heard: servo.pose().is_some(),
            rejections: servo.rejections(),
        }
    }
}

/// Puts the Python law `own`, if there is one, into the settings with its gains and its aim. Keeps the
/// damping of the settings.
fn take_place(own: Option<&Law>, settings: &mut Settings) {
    if let Some(law) = own {
        let damping = settings.controller.damping;
        settings.controller = Controller { damping, ..law.controller };
    }
}
