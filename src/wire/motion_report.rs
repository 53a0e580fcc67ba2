//! Converts a motion to a message on `~/motions`, and such a message to a report.

use super::poses::pose_numbers;
use super::servo_kind::{LawNames, law_and_aim};
use super::status::{CycleJitter, KeyValues, distance, parse_goal};
use dq_algebra::UnitDualQuaternion;
use dq_common::named;
use dq_common::text::cut;
use dq_core::servo::{self, Motion, Reconfiguration};
use dq_messages::PoseNumbers;
use dq_messages::messages::{DiagnosticStatus, KeyValue, Time};
use dq_metrics::Figures;
use std::collections::BTreeMap;

named! {
    /// The outcome of a motion or a goal.
    "outcome" Outcome {
        /// The motion is under way.
        Underway = "underway",
        /// The arm has settled at the goal.
        Arrived = "arrived",
        /// The motion has stalled. It continues if something changes.
        Stalled = "stalled",
        /// The motion's goal was replaced by another goal before the motion ended.
        Replaced = "replaced",
        /// Consent was revoked before the motion ended.
        Revoked = "revoked",
        /// The servo rejected the goal, so that no motion began.
        Rejected = "rejected",
    }
}

/// The report of a motion, or of a rejected goal, on `~/motions`.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionReport {
    /// The number of the motion since the servo's start, counted from 1; 0 for a rejected goal.
    pub number: u64,
    /// The outcome so far.
    pub outcome: Outcome,
    /// The reason for the outcome, unless the outcome explains itself.
    pub why: Option<String>,
    /// The goal in the base frame (for two arms, in the left tool's frame): x y z \[m\], then qx qy qz qw. `None` for a rejected
    /// goal.
    pub goal: Option<PoseNumbers>,
    /// The frame in which the goal's message gave the pose; empty for a rejected goal.
    pub goal_frame: String,
    /// The stamp of the goal's message.
    pub goal_stamp: String,
    /// The publisher of the goal; `None` if unknown.
    pub asked_by: Option<String>,
    /// The name of the law.
    pub law: String,
    /// The name of the components of the pose that the law controls, such as `position`. `None` if the law controls the whole pose
    /// of one arm.
    pub aim: Option<String>,
    /// The gains of the law, as text.
    pub gains: String,
    /// The pose that the law controls, at the start of the motion.
    pub start: Option<PoseNumbers>,
    /// The pose of the controlled tool in the arm's tool frame; `None` if the arm's tool frame itself is the controlled tool.
    pub tool: Option<PoseNumbers>,
    /// When the motion began, by the clock of the servo's host \[ns since 1970\].
    pub began: Option<i64>,
    /// Whether another configuration of the arm reaches the goal, as the name of a [`Reconfiguration`]. Empty in bags of earlier
    /// versions.
    pub reconfiguration: String,
    /// Whether the arm has started a reconfiguration during the motion.
    pub reconfigured: bool,
    /// The metrics of the motion so far.
    pub figures: Figures,
    /// The largest commanded speed of each joint, as a fraction of its limit.
    pub peak_speeds: Vec<f64>,
    /// How late the cycles woke during the motion.
    pub cycle_jitter: CycleJitter,
}

/// The data of a motion's report that the [`Motion`] does not contain.
#[derive(Default)]
pub struct MotionContext<'a> {
    /// The law of the motion.
    pub law: LawNames,
    /// The gains of the law, as text.
    pub gains: String,
    /// The reason for the outcome.
    pub why: Option<String>,
    /// The frame in which the goal was given.
    pub goal_frame: &'a str,
    /// The publisher of the request, if the request was a message.
    pub asked_by: Option<&'a str>,
    /// When the motion began; `None` if unknown.
    pub began: Option<&'a Time>,
    /// How late the cycles woke during the motion.
    pub cycle_jitter: CycleJitter,
}

impl MotionReport {
    /// Creates the report of a motion.
    pub fn new(motion: &Motion, context: MotionContext) -> Self {
        Self {
            number: motion.number,
            outcome: Outcome::from(&motion.outcome),
            why: context.why,
            goal: Some(pose_numbers(motion.goal.base_from_goal())),
            goal_frame: context.goal_frame.to_owned(),
            goal_stamp: Time::from_nanoseconds(motion.stamp).to_string(),
            asked_by: context.asked_by.map(str::to_owned),
            law: context.law.law.to_owned(),
            aim: context.law.aim.map(str::to_owned),
            gains: context.gains,
            start: motion.start.as_ref().map(pose_numbers),
            tool: (motion.tool != UnitDualQuaternion::identity()).then(|| pose_numbers(&motion.tool)),
            began: context.began.filter(|_| motion.start.is_some()).map(Time::nanoseconds),
            reconfiguration: motion.reconfiguration.name().to_owned(),
            reconfigured: motion.reconfigured,
            figures: motion.figures,
            peak_speeds: motion.peak_speeds.clone(),
            cycle_jitter: context.cycle_jitter,
        }
    }

    /// Creates the report of a rejected goal with the time stamp `stamp`.
    pub fn rejected(stamp: &Time, asked_by: Option<String>, why: String) -> Self {
        Self {
            number: 0,
            outcome: Outcome::Rejected,
            why: Some(why),
            goal: None,
            goal_frame: String::new(),
            goal_stamp: stamp.to_string(),
            asked_by,
            law: String::new(),
            aim: None,
            gains: String::new(),
            start: None,
            tool: None,
            began: None,
            reconfiguration: String::new(),
            reconfigured: false,
            figures: Figures::default(),
            peak_speeds: Vec::new(),
            cycle_jitter: CycleJitter::default(),
        }
    }

    /// Returns the name of the law, followed by the name of the components that the law controls, if there is one.
    pub fn law_and_aim(&self) -> String {
        law_and_aim(&self.law, self.aim.as_deref())
    }

    /// Returns whether the arm has stalled but would move to another configuration on request.
    pub fn may_be_reconfigured(&self) -> bool {
        self.outcome == Outcome::Stalled && self.reconfiguration == Reconfiguration::FOUND
    }

    /// Returns the outcome as a sentence.
    pub fn sentence(&self) -> String {
        let Figures { elapsed, arrival_time, path_length, .. } = self.figures;
        let why = self.why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        match self.outcome {
            Outcome::Underway => format!("motion {} with {}", self.number, self.law_and_aim()),
            Outcome::Rejected => format!("the goal was rejected{why}"),
            Outcome::Arrived => {
                let seconds = arrival_time.unwrap_or(elapsed);
                let how = if self.reconfigured { " in another configuration" } else { "" };
                format!("arrived in {seconds:.2} s over {path_length:.3} m{how}")
            }
            outcome => format!("{outcome} after {elapsed:.2} s, {}{why}", distance(&self.figures)),
        }
    }

    /// Returns the message that the servo `node` publishes.
    pub fn message(&self, node: &str) -> DiagnosticStatus {
        let mut values = KeyValues::default();
        if self.number > 0 {
            values.add("motion", self.number);
        }
        values.add("outcome", self.outcome);
        values.add_some("why", self.why.as_ref());
        values.add("goal_stamp", &self.goal_stamp);
        values.add_some("asked_by", self.asked_by.as_ref());
        if self.number > 0 {
            self.add_motion(&mut values);
        }
        let warns = matches!(self.outcome, Outcome::Stalled | Outcome::Revoked | Outcome::Rejected);
        values.status(warns, node, self.sentence())
    }

    fn add_motion(&self, values: &mut KeyValues) {
        let text = |pose: &PoseNumbers| spaced(pose);
        values.add_some("goal", self.goal.as_ref().map(text));
        values.add("goal_frame", &self.goal_frame);
        values.add("law", &self.law);
        values.add_some("aim", self.aim.as_ref());
        values.add("gains", &self.gains);
        values.add_some("tool_offset", self.tool.as_ref().map(text));
        values.add_some("start", self.start.as_ref().map(text));
        values.add_some("began_ns", self.began);
        values.add("reconfiguration", &self.reconfiguration);
        values.add("reconfigured", self.reconfigured);
        self.figures.named().for_each(|(key, figure)| values.add_some(key, figure));
        values.add("peak_joint_speeds_of_limits", spaced(&self.peak_speeds));
        self.cycle_jitter.add_to(values);
    }

    /// Reads the report from `message`. `None` if the message is not from a servo, or if a number in it is invalid.
    pub fn from_message(message: &DiagnosticStatus) -> Option<Self> {
        let values: BTreeMap<_, _> =
            message.values.iter().map(|KeyValue { key, value }| (key.as_str(), value.as_str())).collect();
        let number = |key: &str| values.get(key).and_then(|text| text.parse::<f64>().ok());
        let text = |key: &str| values.get(key).map(|text| cut(text).into_owned());
        let pose = |key: &str| values.get(key).and_then(|text| parse_goal(text));
        let peaks = values.get("peak_joint_speeds_of_limits").map_or("", |text| text);
        Some(Self {
            number: values.get("motion").and_then(|text| text.parse().ok()).unwrap_or_default(),
            outcome: values.get("outcome")?.parse().ok()?,
            why: text("why"),
            goal: pose("goal"),
            goal_frame: text("goal_frame").unwrap_or_default(),
            goal_stamp: text("goal_stamp")?,
            asked_by: text("asked_by"),
            law: text("law").unwrap_or_default(),
            aim: text("aim"),
            gains: text("gains").unwrap_or_default(),
            start: pose("start"),
            tool: pose("tool_offset"),
            began: values.get("began_ns").and_then(|text| text.parse().ok()),
            reconfiguration: text("reconfiguration").unwrap_or_default(),
            reconfigured: values.get("reconfigured") == Some(&"true"),
            figures: Figures::from_named(number),
            peak_speeds: peaks.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?,
            cycle_jitter: CycleJitter::from_named(number),
        })
    }
}

impl From<&servo::Outcome> for Outcome {
    fn from(outcome: &servo::Outcome) -> Self {
        match outcome {
            servo::Outcome::Underway => Self::Underway,
            servo::Outcome::Arrived => Self::Arrived,
            servo::Outcome::Stalled(_) => Self::Stalled,
            servo::Outcome::Replaced => Self::Replaced,
            servo::Outcome::Revoked(_) => Self::Revoked,
        }
    }
}

/// Formats numbers with spaces between them.
fn spaced(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_core::servo::{Goal, Requester, Revocation};
    use dq_kinematics::control::Controller;
    use std::time::Duration;

    fn motion(outcome: servo::Outcome) -> Motion {
        let goal = Goal::new([0.1, 0.2, 0.3], [0.0, 0.6, 0.0, 0.8], "", "base").unwrap();
        Motion {
            number: 3,
            goal,
            by_joints: false,
            stamp: 7_000_000_001,
            asker: Requester::Goal(2),
            controller: Controller::default(),
            tool: *goal.base_from_goal(),
            start: Some(*goal.base_from_goal()),
            began: Duration::from_secs(5),
            outcome,
            reconfiguration: Reconfiguration::Taken,
            reconfigured: false,
            figures: Figures {
                elapsed: 3.5,
                arrival_time: Some(3.25),
                path_length: 0.633,
                path_ratio: Some(1.1),
                position_error: 1e-3,
                stalls: 1.0,
                ..Figures::default()
            },
            peak_speeds: vec![0.25, 1.0],
        }
    }

    fn report(outcome: servo::Outcome, why: Option<&str>) -> MotionReport {
        let context = MotionContext {
            law: LawNames { law: "logc", aim: Some("position"), aim_key: "task" },
            gains: "angular 1, linear 2".to_owned(),
            why: why.map(str::to_owned),
            goal_frame: "table",
            asked_by: Some("/rviz (01.0f)"),
            began: Some(&Time { sec: 1_700_000_000, nanosec: 5 }),
            cycle_jitter: CycleJitter { p99: 12.5, max: 40.0 },
        };
        MotionReport::new(&motion(outcome), context)
    }

    #[test]
    fn a_report_reads_back_unchanged() {
        for report in [
            report(servo::Outcome::Arrived, None),
            report(servo::Outcome::Revoked(Revocation::Stopped), Some("~/stop was called")),
            MotionReport::rejected(&Time { sec: 4, nanosec: 0 }, None, "no such frame".to_owned()),
        ] {
            assert_eq!(MotionReport::from_message(&report.message("dq_servo")), Some(report));
        }
        assert_eq!(MotionReport::from_message(&DiagnosticStatus::default()), None);
    }

    #[test]
    fn a_list_arrives_whole_over_cdr_or_not_at_all() {
        let report =
            MotionReport { peak_speeds: vec![1.0 / 3.0; 64], ..report(servo::Outcome::Arrived, None) };
        let mut message = report.message("dq_servo");
        let mut bytes = dq_messages::CDR_LE.to_vec();
        let cdr_le = rustdds::RepresentationIdentifier::CDR_LE;
        rustdds::serialization::to_writer_with_rep_id(&mut bytes, &message, cdr_le).unwrap();
        assert_eq!(MotionReport::from_message(&dq_messages::decode(&bytes).unwrap()), Some(report));
        message.values.iter_mut().for_each(|value| value.value.push('…'));
        assert_eq!(MotionReport::from_message(&message), None);
    }

    #[test]
    fn the_message_of_an_outcome_is_a_complete_sentence() {
        let sentences = [
            report(servo::Outcome::Arrived, None),
            report(servo::Outcome::Revoked(Revocation::Stopped), Some("~/stop was called")),
            MotionReport::rejected(&Time::default(), None, "no such frame".to_owned()),
        ]
        .map(|report| report.message("dq_servo").message);
        assert_eq!(
            sentences,
            [
                "arrived in 3.25 s over 0.633 m",
                "revoked after 3.50 s, 1.0 mm and 0.00° from the goal: ~/stop was called",
                "the goal was rejected: no such frame"
            ]
        );
    }
}
