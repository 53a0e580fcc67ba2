//! The same goal under two laws side by side: what the page asks for, and what is seen of the two arms.

use super::robot::{Robot, units};
use super::seen::Seen;
use dq_core::servo::State;
use dq_messages::messages::{Header, PoseStamped};
use dq_messages::{Direction, PoseNumbers};
use dq_params::Value;
use dq_ros::ros::{Logging, Node, Publisher, Resolver, RosError, Session};
use dq_wire::{Contract, MotionReport, Outcome, ServoKind};
use serde_json::json;
use std::time::{Duration, Instant};

/// A race that a browser asks for: where from, where to, and under which laws.
#[derive(Clone, Debug)]
pub struct Race {
    /// The two laws.
    pub laws: [String; 2],
    /// The joint angles at which both arms start \[rad\].
    pub start: Vec<f64>,
    /// Where both are to go, in the base frame.
    pub goal: PoseNumbers,
    /// The parameters of both servos, but for the law.
    pub parameters: Vec<(String, Value)>,
}

/// Sees the two arms of a race, which are in a namespace each.
pub struct RaceWatch {
    lanes: Vec<Lane>,
    robot: Robot,
    begun: Option<Instant>,
}

/// One of them.
struct Lane {
    law: String,
    seen: Seen,
    goals: Publisher<PoseStamped>,
    _node: Node,
}

impl RaceWatch {
    /// Joins the graph by two nodes called as `names` say.
    ///
    /// # Errors
    /// [`RosError`]; the parameters' where they describe no arm.
    pub fn join(
        session: &Session,
        names: [Resolver; 2],
        logging: Logging,
        race: &Race,
    ) -> anyhow::Result<Self> {
        let contract = Contract::builtin().map_err(RosError::from)?.servo;
        let goal = contract.topic::<PoseStamped>("goal_pose", Direction::In).map_err(RosError::from)?;
        let mut lanes = Vec::new();
        for (names, law) in names.into_iter().zip(&race.laws) {
            let kind = ServoKind::OneArm;
            let full_name = names.service(kind.node_name()).map_err(RosError::from)?;
            let mut node = session.node(names, logging)?;
            let seen = Seen::new(&mut node, kind, kind.node_name(), full_name)?;
            let goals = node.publisher_as(goal, "goal_pose")?;
            lanes.push(Lane { law: law.clone(), seen, goals, _node: node });
        }
        let robot = Robot::new(ServoKind::OneArm, race.parameters.clone(), Vec::new())?;
        Ok(Self { lanes, robot, begun: None })
    }

    /// Takes what came.
    pub fn take(&mut self) {
        for lane in &mut self.lanes {
            lane.seen.take(Some(&self.robot));
        }
    }

    /// Whether both arms stand ready and would hear a goal.
    pub fn is_ready(&self) -> bool {
        let ready = |lane: &Lane| {
            let waits = lane.seen.report().is_some_and(|report| report.state == State::Holding);
            waits && lane.seen.positions().is_some() && lane.goals.readers() > 0
        };
        self.lanes.iter().all(ready)
    }

    /// Sends both arms to `goal`.
    pub fn begin(&mut self, goal: PoseNumbers) {
        for lane in &self.lanes {
            lane.goals.publish(PoseStamped { header: Header::now(""), pose: goal.into() });
        }
        self.begun = Some(Instant::now());
    }

    /// Whether both arms have arrived, or given up.
    pub fn is_over(&self) -> bool {
        let over = |motion: &MotionReport| motion.outcome != Outcome::Underway;
        self.lanes.iter().all(|lane| lane.seen.motion().is_some_and(over))
    }

    /// The frame that shows both as they are now, in the race of that number.
    pub fn frame(&self, number: u64, is_over: bool) -> String {
        let time = self.begun.as_ref().map_or(Duration::ZERO, Instant::elapsed).as_secs_f64();
        let lanes: Vec<_> = self.lanes.iter().map(|lane| self.lane(lane, time)).collect();
        json!({ "race": {
            "number": number,
            "over": is_over,
            "reach": self.robot.reach(),
            "joints": self.robot.joint_names(),
            "units": units(self.robot.chains()),
            "threshold": self.robot.damping_threshold(),
            "lanes": lanes,
        }})
        .to_string()
    }

    fn lane(&self, lane: &Lane, time: f64) -> serde_json::Value {
        let figures = lane.seen.motion().map(|motion| motion.figures).unwrap_or_default();
        json!({
            "law": lane.law,
            "words": lane.seen.words(),
            "figures": figures,
            "sample": lane.seen.sample(&self.robot, time),
        })
    }
}
