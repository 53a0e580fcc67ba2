//! A race: two simulated arms repeat the same motion, each under one law.

use super::ViewError;
use super::robot::{Robot, units};
use super::servo_monitor::ServoMonitor;
use dq_core::servo::State;
use dq_messages::messages::{Header, PoseStamped};
use dq_messages::{Direction, PoseNumbers};
use dq_params::Value;
use dq_ros::ros::{Logging, Node, Publisher, Resolver, RosError, Session};
use dq_wire::{Contract, MotionReport, Outcome, ServoKind};
use serde_json::json;
use std::time::{Duration, Instant};

/// A race that a browser requests: the motion that two simulated arms repeat, and the law of each arm.
#[derive(Clone, Debug)]
pub struct Race {
    /// The two laws.
    pub laws: [String; 2],
    /// The joint positions at which both arms start \[rad, prismatic: m\].
    pub start: Vec<f64>,
    /// The goal of both arms in the base frame.
    pub goal: PoseNumbers,
    /// The parameters of both servos, except that each servo gets its own law from `laws`.
    pub parameters: Vec<(String, Value)>,
}

/// Observes the two arms of a race. Each arm is in its own namespace.
pub struct RaceWatch {
    arms: Vec<RaceArm>,
    robot: Robot,
    begun: Option<Instant>,
}

/// One of the two arms of a race.
struct RaceArm {
    law: String,
    servo: ServoMonitor,
    goals: Publisher<PoseStamped>,
    _node: Node,
}

impl RaceWatch {
    /// Joins the graph with two nodes of these names.
    ///
    /// # Errors
    /// [`ViewError`] if the nodes cannot join the graph, or the parameters do not describe an arm.
    pub fn join(
        session: &Session,
        names: [Resolver; 2],
        logging: Logging,
        race: &Race,
    ) -> Result<Self, ViewError> {
        let contract = Contract::builtin().map_err(RosError::from)?.servo;
        let goal = contract.topic::<PoseStamped>("goal_pose", Direction::In).map_err(RosError::from)?;
        let mut arms = Vec::new();
        for (names, law) in names.into_iter().zip(&race.laws) {
            let kind = ServoKind::OneArm;
            let full_name = names.service(kind.node_name()).map_err(RosError::from)?;
            let mut node = session.node(names, logging)?;
            let servo = ServoMonitor::new(&mut node, kind, kind.node_name(), full_name)?;
            let goals = node.publisher_as(goal, "goal_pose")?;
            arms.push(RaceArm { law: law.clone(), servo, goals, _node: node });
        }
        let robot = Robot::new(ServoKind::OneArm, race.parameters.clone(), Vec::new())?;
        Ok(Self { arms, robot, begun: None })
    }

    /// Processes the received messages.
    pub fn take(&mut self) {
        for arm in &mut self.arms {
            arm.servo.take(Some(&self.robot));
        }
    }

    /// Returns whether the race can begin: both servos hold their arms at rest, and would receive a goal that is sent now.
    pub fn is_ready(&self) -> bool {
        let ready = |arm: &RaceArm| {
            let waits = arm.servo.report().is_some_and(|report| report.state == State::Holding);
            waits && arm.servo.positions().is_some() && arm.goals.readers() > 0
        };
        self.arms.iter().all(ready)
    }

    /// Sends both arms to `goal`.
    pub fn begin(&mut self, goal: PoseNumbers) {
        for arm in &self.arms {
            arm.goals.publish(PoseStamped { header: Header::now(""), pose: goal.into() });
        }
        self.begun = Some(Instant::now());
    }

    /// Returns whether both motions have ended.
    pub fn is_over(&self) -> bool {
        let over = |motion: &MotionReport| motion.outcome != Outcome::Underway;
        self.arms.iter().all(|arm| arm.servo.motion().is_some_and(over))
    }

    /// Returns the JSON message that shows both arms in race number `number`.
    pub fn frame(&self, number: u64, is_over: bool) -> String {
        let time = self.begun.as_ref().map_or(Duration::ZERO, Instant::elapsed).as_secs_f64();
        let arms: Vec<_> = self.arms.iter().map(|arm| self.arm(arm, time)).collect();
        json!({ "race": {
            "number": number,
            "over": is_over,
            "reach": self.robot.reach(),
            "joints": self.robot.joint_names(),
            "units": units(self.robot.chains()),
            "threshold": self.robot.damping_threshold(),
            "lanes": arms,
        }})
        .to_string()
    }

    fn arm(&self, arm: &RaceArm, time: f64) -> serde_json::Value {
        let figures = arm.servo.motion().map(|motion| motion.figures).unwrap_or_default();
        json!({
            "law": arm.law,
            "words": arm.servo.words(),
            "figures": figures,
            "sample": arm.servo.sample(&self.robot, time),
        })
    }
}
