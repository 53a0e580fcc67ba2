//! A closed loop: a law, an arm, a task and a plant.

use super::CompareError;
use super::arm::{Arm, Task};
use super::conditions::{PERIOD, Plant, Sensor};
use dq_common::named;
use dq_config::ServoParameters;
use dq_core::servo::{Arms, Event, JointReading, Reconfiguration, Servo, Settings, State};
use dq_kinematics::control::{Controller, LawMemory, SignMemory};
use dq_metrics::{Figures, GoalError, MotionMeter, Tolerance};
use dq_search::{STARTS, Search};
use std::time::Duration;

/// The time after which a loop that has not settled counts as failed.
pub const HORIZON: Duration = Duration::from_secs(10);
/// A loop ends as settled once its errors have stayed below 2 % of their initial values for this time.
const DWELL: Duration = Duration::from_millis(500);
/// The length of the last part of a loop. If the loop fails, its behavior in this part decides how the failure is classified.
const LAST: Duration = Duration::from_secs(1);
/// Joint speeds below this [rad/s] count as standing.
const STANDING: f64 = 1e-2;
/// If the law commands a joint speed above this [rad/s], the motion counts as diverged.
const DIVERGED: f64 = 1e4;

named! {
    /// How a loop ended.
    #[derive(Default, PartialOrd, Ord)]
    "outcome" Outcome {
        /// At the end of the loop, the errors were below 2 % of their initial values, or within the goal tolerances.
        #[default]
        Settled = "settled",
        /// The arm was still getting nearer to the goal at the end.
        Slow = "slow",
        /// The arm moved but did not get nearer to the goal.
        Oscillating = "oscillating",
        /// The arm stood away from the goal in a singular configuration.
        Singular = "singular",
        /// The arm stood away from the goal, neither in a singular configuration nor at a position limit.
        Stuck = "stuck",
        /// A position limit stopped the arm.
        JointLimit = "joint_limit",
        /// The motion diverged, with unbounded speeds.
        Diverged = "diverged",
    }
}

/// The outcome of a loop, and the metrics of its motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Result {
    /// The outcome.
    pub outcome: Outcome,
    /// The metrics of the motion.
    pub figures: Figures,
}

impl Result {
    /// Returns the settling time \[s\]; `None` if the loop has not settled.
    pub fn settled(&self) -> Option<f64> {
        (self.outcome == Outcome::Settled).then(|| self.figures.settling_time()).flatten()
    }
}

/// A law without the servo, and its state.
struct BareLaw {
    arms: Arms,
    controller: Controller,
    memory: LawMemory,
    /// The command of the previous cycle [rad/s].
    last: Vec<f64>,
    sign: SignMemory,
    hysteresis: f64,
}

/// Computes the commands from the joint states.
enum Driver {
    /// The law alone.
    Law(Box<BareLaw>),
    /// The servo with every safety rule.
    Servo { servo: Box<Servo>, search: Box<Search>, names: Vec<String>, age: Duration },
}

/// A closed loop that can be run.
pub struct ClosedLoop<'a> {
    /// The arm.
    pub arm: &'a Arm,
    /// The law with its gains.
    pub controller: Controller,
    /// The imperfections of the joint states.
    pub plant: Plant,
    /// Whether the servo, with its limits and all rules, drives the arm. Otherwise the law alone drives it.
    pub limits: bool,
}

impl ClosedLoop<'_> {
    /// Runs the task `number` until the loop has settled, or for [`HORIZON`].
    ///
    /// # Errors
    /// [`CompareError`] if the task does not fit the arm. This does not happen in practice.
    pub fn run(&self, task: &Task, number: u32) -> std::result::Result<Result, CompareError> {
        Ok(self.run_for(task, number, HORIZON, |_| ())?.0)
    }

    /// Runs the task for at most `horizon`. Calls `see` with the joint positions \[rad\] of each cycle. Returns the result, and the
    /// servo's final state in words.
    pub(super) fn run_for(
        &self,
        task: &Task,
        number: u32,
        horizon: Duration,
        mut see: impl FnMut(&[f64]),
    ) -> std::result::Result<(Result, String), CompareError> {
        let mut theta = task.start.clone();
        let mut command = vec![0.0; theta.len()];
        let mut sensor = Sensor::new(self.plant, &task.start, number);
        let mut driver = self.driver(task)?;
        let mut watch = Watch::new(self.arm, task, horizon);
        let mut now = Duration::ZERO;
        while now <= horizon && !watch.is_over(now) && !driver.is_over() {
            see(&theta);
            driver.drive(task, sensor.see(&theta), now, &mut command)?;
            let evaluated = driver.arm().filter(|_| self.plant.is_exact());
            if !watch.see(evaluated, &theta, &command, now) {
                return Ok((watch.result(Outcome::Diverged), driver.words()));
            }
            for (angle, speed) in theta.iter_mut().zip(&command) {
                *angle += PERIOD.as_secs_f64() * speed;
            }
            now += PERIOD;
        }
        Ok((watch.judge(driver.held_by_a_limit(), &command), driver.words()))
    }

    fn driver(&self, task: &Task) -> std::result::Result<Driver, CompareError> {
        let parameters = &self.arm.parameters;
        if !self.limits {
            let mut arm = parameters.arms.clone();
            arm.evaluate(&task.start);
            let sign = SignMemory::nearest(&task.base_from_goal, &arm.pose());
            let hysteresis = parameters.settings.hysteresis;
            let (memory, last) = (LawMemory::default(), vec![0.0; task.start.len()]);
            let law = BareLaw { arms: arm, controller: self.controller, memory, last, sign, hysteresis };
            return Ok(Driver::Law(Box::new(law)));
        }
        let settings = Settings { controller: self.controller, ..parameters.settings.clone() };
        let names = parameters.joints[0].names().to_vec();
        let mut servo = Box::new(ServoParameters { settings, period: PERIOD, ..parameters.clone() }.build()?);
        let (t, r) = (task.base_from_goal.translation(), task.base_from_goal.rotation());
        servo.take_goal(t.into(), [r.i, r.j, r.k, r.w], "", Duration::ZERO)?;
        // A joint state is stamped when it is measured. So its age is the latency of the plant.
        let age = PERIOD * self.plant.latency as u32;
        let search = Box::new(Search::new(parameters.arms.clone()));
        Ok(Driver::Servo { servo, search, names, age })
    }
}

impl Driver {
    /// Computes the command for the measured joint positions `seen` \[rad\].
    fn drive(
        &mut self,
        goal: &Task,
        seen: &[f64],
        now: Duration,
        command: &mut [f64],
    ) -> std::result::Result<(), CompareError> {
        match self {
            Self::Law(law) => {
                law.arms.evaluate(seen);
                let goal = law.sign.apply(&goal.base_from_goal, &law.arms.pose(), law.hysteresis);
                let arm = law.arms.state();
                let last = (&*law.last, PERIOD.as_secs_f64());
                law.memory.joint_velocity(&law.controller, arm, &goal, last, command);
                law.last.copy_from_slice(command);
            }
            Self::Servo { servo, search, names, age } => {
                servo.begin(now);
                if servo.ask(search) {
                    search.run(STARTS, || true);
                    servo.take(Event::Found(search.found()))?;
                }
                let reading = JointReading {
                    names,
                    positions: seen,
                    velocities: &[],
                    source: 0,
                    stamp_age: Some(*age),
                };
                servo.take_joint_state(0, &reading, now)?;
                command.copy_from_slice(servo.step(now));
            }
        }
        Ok(())
    }

    /// Returns the arm at its latest measured joint positions; `None` before the first measurement.
    fn arm(&self) -> Option<&Arms> {
        match self {
            Self::Law(law) => Some(&law.arms),
            Self::Servo { servo, .. } => servo.arms(),
        }
    }

    /// Returns whether the arm will not move any more, because the servo's motion has stalled and the servo waits for another goal.
    fn is_over(&self) -> bool {
        match self {
            Self::Law(_) => false,
            Self::Servo { servo, .. } => {
                let searches = matches!(servo.status().reconfiguration, Reconfiguration::Searching(_));
                servo.status().state == State::Stalled && servo.at_rest() && !searches
            }
        }
    }

    /// Describes the servo's final state in words: the reason of a stall or the state, then the result of the search for another
    /// configuration.
    fn words(&self) -> String {
        match self {
            Self::Law(_) => String::new(),
            Self::Servo { servo, .. } => {
                let status = servo.status();
                let stall = status.stall.map_or(status.state.name(), |stall| stall.name());
                match status.reconfiguration {
                    Reconfiguration::Unknown => stall.to_owned(),
                    known => format!("{stall}, {}", known.name()),
                }
            }
        }
    }

    fn held_by_a_limit(&self) -> bool {
        match self {
            Self::Law(_) => false,
            Self::Servo { servo, .. } => {
                servo.status().state == State::JointLimit || servo.status().joint_at_limit.is_some()
            }
        }
    }
}

/// Computes the metrics from the real joint positions of the arm, not from the delayed and noisy joint states.
struct Watch {
    arms: Arms,
    /// The latest real joint positions \[rad\].
    theta: Vec<f64>,
    goal: Task,
    horizon: Duration,
    tolerance: Tolerance,
    controller: Controller,
    threshold: f64,
    motion: Option<MotionMeter>,
    inside_since: Option<Duration>,
    /// The smallest error ([`size`](Self::size)) so far. Ignores the last second ([`LAST`]) before the horizon.
    least: f64,
    error: GoalError,
}

impl Watch {
    fn new(arm: &Arm, goal: &Task, horizon: Duration) -> Self {
        let settings = &arm.parameters.settings;
        let mut arms = arm.parameters.arms.clone();
        arms.evaluate(&goal.start);
        let error = GoalError::of(settings.controller.aim, arms.state(), &goal.base_from_goal);
        Self {
            arms,
            theta: goal.start.clone(),
            goal: goal.clone(),
            horizon,
            tolerance: settings.goal_tolerance,
            controller: settings.controller,
            threshold: settings.controller.damping.threshold,
            motion: None,
            inside_since: None,
            least: f64::INFINITY,
            error,
        }
    }

    /// Updates the metrics with the joint positions and the command of one cycle. Returns false if a commanded joint speed shows that
    /// the motion diverges. `evaluated` is the arm at `theta`, or `None` if its kinematics are not computed yet.
    fn see(&mut self, evaluated: Option<&Arms>, theta: &[f64], command: &[f64], now: Duration) -> bool {
        if !command.iter().all(|speed| speed.abs() < DIVERGED) {
            return false;
        }
        self.theta.copy_from_slice(theta);
        let arm = match evaluated {
            Some(arm) => arm,
            None => {
                self.arms.evaluate(theta);
                &self.arms
            }
        };
        let (pose, goal) = (arm.pose(), self.goal.base_from_goal);
        let (point, goal_point) = (pose.translation(), goal.translation());
        // The servo may follow the goal with the other sign of its quaternion.
        let nearer = if goal.real().dot(&pose.real()) < 0.0 { -goal } else { goal };
        self.error = GoalError::of(self.controller.aim, arm.state(), &nearer);
        let begin = || MotionMeter::begin(now, point, goal_point, &self.error, &self.tolerance);
        let motion = self.motion.get_or_insert_with(begin);
        motion.update(now, point, &self.error, command);
        let settled = motion.figures().settling_time();
        self.inside_since = settled.map(Duration::from_secs_f64);
        if now + LAST <= self.horizon {
            self.least = self.least.min(self.size());
        }
        true
    }

    /// Returns the sum of the distance and the angle to the goal, each divided by its tolerance.
    fn size(&self) -> f64 {
        self.error.position / self.tolerance.linear + self.error.rotation / self.tolerance.angular
    }

    fn is_over(&self, now: Duration) -> bool {
        self.inside_since.is_some_and(|since| now.saturating_sub(since) >= DWELL)
    }

    fn result(&self, outcome: Outcome) -> Result {
        let figures = self.motion.as_ref().map(MotionMeter::figures).unwrap_or_default();
        Result { outcome, figures }
    }

    fn judge(&mut self, held: bool, command: &[f64]) -> Result {
        let standing = command.iter().all(|speed| speed.abs() < STANDING);
        self.arms.evaluate(&self.theta);
        let outcome = match () {
            () if self.inside_since.is_some() => Outcome::Settled,
            () if held => Outcome::JointLimit,
            // A slow motion ends with an error below all earlier errors. An oscillation ends with an error below some of them only.
            () if self.size() < 0.98 * self.least => Outcome::Slow,
            () if !standing => Outcome::Oscillating,
            () if self.controller.smallest_singular_value(self.arms.state()) < self.threshold => {
                Outcome::Singular
            }
            () => Outcome::Stuck,
        };
        self.result(outcome)
    }
}
