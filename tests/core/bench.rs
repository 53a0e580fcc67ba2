//! A servo and its arms in fake time.

use crate::reference::{dual_parameters, json, numbers, parameters};
use dq_servo::config::CycleParameters;
use dq_servo::dq::UnitDualQuaternion;
use dq_servo::plant::Plant;
use dq_servo::servo::{OneArm, Servo, Settings, State, Task, TwoArms};
use std::time::Duration;

pub const PERIOD: Duration = Duration::from_millis(2);

/// A servo and its plants, with every command checked against the limits.
pub struct Bench<T: Task> {
    pub servo: Servo<T>,
    pub plants: Vec<Plant>,
    pub names: Vec<String>,
    pub now: Duration,
    pub command: Vec<f64>,
    /// Whether joint states of each arm reach the servo.
    pub connected: Vec<bool>,
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
        Self {
            command: vec![0.0; task.joint_count()],
            servo: Servo::new(task, joints, &goal_frame, settings, PERIOD).unwrap(),
            plants: starts.iter().map(plant).collect(),
            names,
            now: Duration::from_secs(1000),
            connected: vec![true; starts.len()],
        }
    }

    pub fn goal_pose(&mut self, pose: &UnitDualQuaternion) {
        let (t, r) = (pose.translation(), pose.rotation());
        self.servo.take_goal(t.into(), [r.i, r.j, r.k, r.w], "", self.now).unwrap();
    }

    pub fn change(&mut self, change: impl FnOnce(&mut Settings<T::Controller>)) {
        let mut settings = self.servo.settings().clone();
        change(&mut settings);
        self.servo.configure(settings);
    }

    pub fn connect(&mut self, connected: bool) {
        self.connected.fill(connected);
    }

    /// One cycle of all; the command is checked against velocity and acceleration limits.
    pub fn cycle(&mut self) {
        self.now += PERIOD;
        for (arm, plant) in self.plants.iter().enumerate().filter(|(arm, _)| self.connected[*arm]) {
            self.servo.take_joint_state(arm, &self.names, plant.positions(), self.now).unwrap();
        }
        let command = self.servo.step(self.now).unwrap().to_vec();
        let limits = &self.servo.settings().limits;
        let limits = limits.joint_velocity.iter().zip(&limits.joint_acceleration);
        for ((new, old), (velocity, acceleration)) in command.iter().zip(&self.command).zip(limits) {
            let step = (new - old).abs();
            assert!(new.is_finite());
            assert!(step <= acceleration * PERIOD.as_secs_f64() * (1.0 + 1e-9), "step {step}");
            // After a limit was lowered the command comes down to it at the acceleration limit.
            assert!(new.abs() <= velocity.max(old.abs()) * (1.0 + 1e-9), "speed {new}");
        }
        for (plant, part) in self.plants.iter_mut().zip(command.chunks(self.names.len())) {
            plant.take_command(part, self.now).unwrap();
            plant.step(self.now, PERIOD);
        }
        self.command = command;
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
