//! A servo and its arms in fake time.

use crate::reference::{dual_parameters, json, numbers, parameters};
use dq_servo::config::CycleParameters;
use dq_servo::dq::UnitDualQuaternion;
use dq_servo::plant::Plant;
use dq_servo::servo::{Invariants, OneArm, Servo, Settings, State, Task, TwoArms};
use std::time::Duration;

pub const PERIOD: Duration = Duration::from_millis(2);

/// A servo and its plants, with the invariants checked at every cycle.
pub struct Bench<T: Task> {
    pub servo: Servo<T>,
    pub plants: Vec<Plant>,
    pub names: Vec<String>,
    pub now: Duration,
    pub command: Vec<f64>,
    /// Whether joint states of each arm reach the servo.
    pub connected: Vec<bool>,
    /// Whether the plants follow commands.
    pub following: bool,
    /// Whether the plants' positions are checked against position limits too: no rule holds them where cycles come late.
    pub check_positions: bool,
    invariants: Invariants,
    /// The arms as they are, for what no limit may let their tools do.
    truth: T,
    cycles: u32,
}

impl Bench<OneArm> {
    /// The paper's arm at its start.
    pub fn new() -> Self {
        Self::with(|_| {})
    }

    pub fn with(change: impl FnOnce(&mut Settings<<OneArm as Task>::Controller>)) -> Self {
        let mut parameters = parameters();
        change(&mut parameters.settings);
        Self::start(parameters, &["theta_initial"])
    }

    pub fn goal(&mut self, theta: &str) {
        let pose = crate::reference::puma().forward_kinematics(&numbers(&json()[theta])).unwrap();
        self.goal_pose(&pose);
    }

    pub fn set_law(&mut self, law: dq_servo::control::Law) {
        self.change(|settings| settings.controller.law = law);
    }
}

impl Bench<TwoArms> {
    /// The paper's two arms: left β at theta_desired, right α at theta_initial.
    pub fn two_arms() -> Self {
        Self::start(dual_parameters(), &["theta_desired", "theta_initial"])
    }
}

impl<T: Task> Bench<T> {
    fn start(parameters: CycleParameters<T>, starts: &[&str]) -> Self {
        let CycleParameters { task, joints, goal_frame, settings, .. } = parameters;
        let plant = |start: &&str| Plant::new(numbers(&json()[start]), Duration::from_millis(100));
        let names = joints[0].names().to_vec();
        let command = vec![0.0; task.joint_count()];
        let mut invariants = Invariants::new(settings.limits.clone(), PERIOD);
        invariants.check(Duration::ZERO, &command, true).unwrap();
        Self {
            command,
            truth: task.clone(),
            invariants,
            cycles: 0,
            servo: Servo::new(task, joints, &goal_frame, settings, PERIOD).unwrap(),
            plants: starts.iter().map(plant).collect(),
            names,
            now: Duration::from_secs(1000),
            connected: vec![true; starts.len()],
            following: true,
            check_positions: true,
        }
    }

    pub fn goal_pose(&mut self, pose: &UnitDualQuaternion) {
        let (t, r) = (pose.translation(), pose.rotation());
        self.servo.take_goal(t.into(), [r.i, r.j, r.k, r.w], "", self.now).unwrap();
    }

    pub fn change(&mut self, change: impl FnOnce(&mut Settings<T::Controller>)) {
        let mut settings = self.servo.settings().clone();
        change(&mut settings);
        self.invariants.set_limits(settings.limits.clone());
        self.servo.configure(settings);
    }

    pub fn connect(&mut self, connected: bool) {
        self.connected.fill(connected);
    }

    /// One cycle of all, on time.
    pub fn cycle(&mut self) {
        self.cycle_late(0);
    }

    /// One cycle of all after `missed` in which the servo did not run, but its plants did.
    pub fn cycle_late(&mut self, missed: u32) {
        for _ in 0..missed {
            self.now += PERIOD;
            self.step_plants();
        }
        self.now += PERIOD;
        for (arm, plant) in self.plants.iter().enumerate().filter(|(arm, _)| self.connected[*arm]) {
            self.servo.take_joint_state(arm, &self.names, plant.positions(), self.now).unwrap();
        }
        let command = self.servo.step(self.now).unwrap().to_vec();
        // By count of cycles, not by the clock: what a late cycle may do is no more than another may.
        self.cycles += 1;
        let driving = matches!(self.state(), State::Tracking | State::Settled | State::JointLimit);
        self.invariants.check(PERIOD * self.cycles, &command, !driving).unwrap();
        self.truth.evaluate(&self.positions()).unwrap();
        self.invariants.check_tool(&self.truth.tool_speed(&command)).unwrap();
        for (plant, part) in self.plants.iter_mut().zip(command.chunks(self.names.len())) {
            plant.take_command(part, self.now).unwrap();
        }
        self.step_plants();
        self.command = command;
    }

    fn step_plants(&mut self) {
        for plant in self.plants.iter_mut().filter(|_| self.following) {
            plant.step(self.now, PERIOD);
        }
        if self.check_positions {
            let positions = self.positions();
            self.invariants.check_positions(&positions).unwrap();
        }
    }

    /// Where the joints are \[rad\], arm after arm.
    fn positions(&self) -> Vec<f64> {
        self.plants.iter().flat_map(Plant::positions).copied().collect()
    }

    pub fn run(&mut self, seconds: f64) {
        let end = self.now + Duration::from_secs_f64(seconds);
        while self.now < end {
            self.cycle();
        }
    }

    pub fn run_until(&mut self, state: State, seconds: f64) {
        let end = self.now + Duration::from_secs_f64(seconds);
        while self.servo.status().state != state {
            assert!(self.now < end, "{} instead of {state} after {seconds} s", self.servo.status().state);
            self.cycle();
        }
    }

    pub fn state(&self) -> State {
        self.servo.status().state
    }

    pub fn speed(&self) -> f64 {
        self.command.iter().fold(0.0, |max, speed| speed.abs().max(max))
    }
}
