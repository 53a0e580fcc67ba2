//! Converts the servo's status to a message on `~/status`, and such a message to a report.

use super::poses::pose_numbers;
use super::servo_kind::{LawNames, law_and_aim};
use super::timing::{SpreadFigures, TimingFigures};
use dq_check::GuardState;
use dq_common::text::cut;
use dq_core::servo::{Input, Reconfiguration, RejectionCounts, Requester, State, Status};
use dq_messages::PoseNumbers;
use dq_messages::messages::{DiagnosticStatus, KeyValue, Time};
use dq_metrics::Figures;
use serde_json::Value;
use std::collections::BTreeMap;
use std::time::Duration;

/// The part of a message on `~/status` that readers need.
#[derive(Clone, Debug, PartialEq)]
pub struct StatusReport {
    /// The state.
    pub state: State,
    /// The present law.
    pub law: String,
    /// The name of the components of the pose that the law controls, such as `position`. `None` if the law controls the whole pose
    /// of one arm.
    pub aim: Option<String>,
    /// The input that moves the arm; `None` in bags of earlier versions.
    pub input: Option<Input>,
    /// The current goal: x y z \[m\], then qx qy qz qw.
    pub goal: Option<PoseNumbers>,
    /// Whether the goal is beyond reach.
    pub goal_beyond_reach: bool,
    /// The number of motions that have begun since the servo's start.
    pub goal_count: u64,
    /// The time stamp of the latest message with the current goal.
    pub goal_stamp: Option<String>,
    /// The reason for the state, and what to try; `None` if the state explains itself.
    pub reason: Option<String>,
    /// The name of the joint stopped by its position limit.
    pub joint_at_limit: Option<String>,
    /// The smallest gap between two parts of the scene \[m\]; `None` if constraints are off or no parts are near each other.
    pub clearance: Option<f64>,
    /// Whether another configuration of the arm reaches the goal, as the name of a [`Reconfiguration`]. `None` in bags of earlier
    /// versions.
    pub reconfiguration: Option<String>,
    /// The metrics of the motion; `None` until the first joint state.
    pub figures: Option<Figures>,
    /// How late the cycles woke since the motion began.
    pub cycle_jitter: CycleJitter,
}

/// How late the cycles of the servo woke \[µs\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CycleJitter {
    /// The lateness that 99 % of the cycles do not exceed.
    pub p99: f64,
    /// The largest lateness.
    pub max: f64,
}

impl From<&SpreadFigures> for CycleJitter {
    fn from(lateness: &SpreadFigures) -> Self {
        Self { p99: microseconds(lateness.p99), max: microseconds(lateness.max) }
    }
}

impl CycleJitter {
    pub(crate) fn add_to(&self, values: &mut KeyValues) {
        values.add("cycle_jitter_p99_us", self.p99);
        values.add("cycle_jitter_max_us", self.max);
    }

    /// Reads both numbers from a status. `number` returns the number for a key; a missing number counts as 0.
    pub(crate) fn from_named(number: impl Fn(&str) -> Option<f64>) -> Self {
        let amount = |key| number(key).unwrap_or_default();
        Self { p99: amount("cycle_jitter_p99_us"), max: amount("cycle_jitter_max_us") }
    }
}

/// A servo's report about itself: its [`Status`] and further information.
pub struct ServoReport<'a> {
    /// The law in force.
    pub law: LawNames,
    /// The name of the joint stopped by its position limit.
    pub joint_at_limit: Option<&'a str>,
    /// The reason why the arm does not arrive, and what to try.
    pub reason: Option<String>,
    /// The number of keep-outs and keep-ins that the servo obeys; `None` if constraints are off.
    pub keep_outs: Option<usize>,
    /// The smallest singular value of the controlled Jacobian.
    pub smallest_singular_value: f64,
    /// When the latest cycle began, by the cycle's clock.
    pub now: Duration,
    /// The publisher of the latest request; `None` if the request was not a message.
    pub asker: Option<String>,
    /// The status of the latest cycle.
    pub status: &'a Status,
    /// Whether the servo has received a joint state of every arm.
    pub heard: bool,
    /// The counts of rejected messages.
    pub rejections: &'a RejectionCounts,
}

/// The information from which a status message is built.
pub struct Reported<'a> {
    /// The node's name.
    pub node: &'a str,
    /// The state of the guards, which are the nodes that stop the arms if the servo is killed.
    pub guard: GuardState,
    /// The keep-outs and keep-ins that the servo does not obey, with the reasons; `None` if it obeys all of them.
    pub not_obeyed: Option<String>,
    /// The servo's report.
    pub servo: ServoReport<'a>,
    /// The timing of the cycle.
    pub timing: TimingFigures,
}

impl Reported<'_> {
    /// Returns the status message.
    pub fn message(&self) -> DiagnosticStatus {
        let Self { servo, timing, .. } = self;
        let mut values = KeyValues::default();
        servo.values().into_iter().for_each(|(key, value)| values.add(key, text(value)));
        values.add_some("keep_outs_not_obeyed", self.not_obeyed.as_ref());
        values.add("guard", self.guard);
        CycleJitter::from(&timing.lateness).add_to(&mut values);
        values.add("overruns", timing.overruns);
        let Status { state, goal_beyond_reach, reason, .. } = servo.status;
        let warns = state.is_warning() || *goal_beyond_reach || reason.is_some() || self.not_obeyed.is_some();
        values.status(warns, self.node, state.to_string())
    }
}

/// Formats a value for a message.
fn text(value: Value) -> String {
    match value {
        Value::String(text) => text,
        Value::Number(number) if number.is_f64() => number.as_f64().unwrap_or_default().to_string(),
        Value::Array(list) => list.into_iter().map(text).collect::<Vec<_>>().join(" "),
        other => other.to_string(),
    }
}

impl ServoReport<'_> {
    /// Returns the keys and values of the servo in `~/status`, in their order.
    pub fn values(&self) -> Vec<(&'static str, Value)> {
        let Self { status, rejections, .. } = self;
        let LawNames { law, aim, aim_key } = self.law;
        let mut values = vec![("law", law.into())];
        values.extend(aim.map(|aim| (aim_key, aim.into())));
        values.extend([("sign", status.sign.into()), ("input", status.input.name().into())]);
        values.extend(self.consent());
        values.push(("goal_count", status.goal_count.into()));
        if let Some(goal) = &status.goal {
            let stamp = Time::from_nanoseconds(status.goal_stamp).to_string();
            values.push(("goal", pose_numbers(goal.base_from_goal()).to_vec().into()));
            values.push(("goal_stamp", stamp.into()));
            values.push(("goal_beyond_reach", status.goal_beyond_reach.into()));
            if self.heard {
                let figures = status.figures.named();
                values.extend(figures.filter_map(|(key, figure)| Some((key, figure?.into()))));
            }
        }
        let contact = status.contact.filter(|_| self.heard);
        let sigma = self.heard.then_some(self.smallest_singular_value);
        let known = [
            ("stall", status.stall.map(|stall| stall.name().into())),
            ("reconfiguration", Some(status.reconfiguration.name().into())),
            ("reason", self.reason.clone().map(Value::from)),
            ("joint_at_limit", self.joint_at_limit.map(Value::from)),
            ("keep_outs", self.keep_outs.map(Value::from)),
            ("clearance_m", status.closest.map(|pair| pair.distance.into())),
            ("contact_force_n", contact.map(|it| it.wrench[0].into())),
            ("contact_torque_nm", contact.map(|it| it.wrench[1].into())),
            ("yielded_m", contact.map(|it| it.offset[0].into())),
            ("yielded_rad", contact.map(|it| it.offset[1].into())),
            ("smallest_singular_value", sigma.map(Value::from)),
            ("latency_ms", Some(milliseconds(status.latency).into())),
            ("gain_factor", Some(status.gain_factor.into())),
            ("speed_factor", Some(status.speed_factor.into())),
            ("rejected", Some(rejections.total().into())),
            ("last_rejection", rejections.last().map(|why| why.text().into())),
        ];
        values.extend(known.into_iter().filter_map(|(key, value)| Some((key, value?))));
        values
    }

    /// Returns key-value pairs about consent: whether there is consent, the latest request, and the latest revocation. Further pairs
    /// have the times since this request and since this revocation \[s\].
    fn consent(&self) -> Vec<(&'static str, Value)> {
        let consent = &self.status.consent;
        let ago = |time: Duration| Value::from(microseconds(self.now.saturating_sub(time)).round() / 1e6);
        let mut values = vec![("consent", Value::from(consent.is_given()))];
        if let Some(asked) = consent.request() {
            let what = match asked.by {
                Requester::Goal(_) => "goal",
                Requester::Twist(_) => "twist",
                Requester::Resume => "~/pause",
            };
            let by = self.asker.as_ref().map_or_else(String::new, |asker| format!(" of {asker}"));
            values.extend([("asked_by", format!("{what}{by}").into()), ("asked_s_ago", ago(asked.pushed))]);
        }
        if let Some(revoked) = consent.last_revocation() {
            values.extend([("revoked_by", revoked.why.name().into()), ("revoked_s_ago", ago(revoked.at))]);
        }
        values
    }
}

/// Returns a warning about several publishers of commands to one arm.
pub fn rivalry(topic: &str, publishers: usize) -> String {
    format!("{publishers} publishers on {topic}: only one may command the arm")
}

/// The key-value pairs of a diagnostic status, in their order.
#[derive(Default)]
pub struct KeyValues {
    list: Vec<KeyValue>,
}

/// Converts seconds to milliseconds, rounded to microseconds. Without rounding, an estimate that decays would have hundreds of
/// digits.
pub fn milliseconds(seconds: f64) -> f64 {
    (seconds * 1e6).round() / 1e3
}

/// Converts `time` to microseconds. Multiplying its seconds would give more digits, such as 24208.994000000002.
pub fn microseconds(time: Duration) -> f64 {
    time.as_nanos() as f64 / 1e3
}

impl KeyValues {
    /// Adds `value`.
    pub fn add(&mut self, key: &str, value: impl ToString) {
        self.list.push(KeyValue { key: key.to_owned(), value: value.to_string() });
    }

    /// Adds `value` if it is `Some`.
    pub fn add_some(&mut self, key: &str, value: Option<impl ToString>) {
        if let Some(value) = value {
            self.add(key, value);
        }
    }

    /// Returns the status of the component `name` with this `message` and these values. The level is WARN if `warns` is true,
    /// otherwise OK.
    pub fn status(self, warns: bool, name: &str, message: String) -> DiagnosticStatus {
        let (level, hardware_id) = (u8::from(warns), String::new());
        DiagnosticStatus { level, name: name.to_owned(), message, hardware_id, values: self.list }
    }
}

impl StatusReport {
    /// A servo that is silent for longer than this counts as ended.
    pub const SILENCE: Duration = Duration::from_secs(2);

    /// Reads a status message. `None` if it is not from a servo.
    pub fn from_message(message: &DiagnosticStatus) -> Option<Self> {
        let values: BTreeMap<_, _> =
            message.values.iter().map(|pair| (pair.key.as_str(), pair.value.as_str())).collect();
        let number = |key: &str| values.get(key).and_then(|text| text.parse::<f64>().ok());
        let text = |key: &str| values.get(key).map(|text| cut(text).into_owned());
        Some(Self {
            state: message.message.parse().ok()?,
            law: (*values.get("law")?).to_owned(),
            aim: text("primitive").or_else(|| text("task")),
            input: values.get("input").and_then(|text| text.parse().ok()),
            goal: values.get("goal").and_then(|text| parse_goal(text)),
            goal_beyond_reach: values.get("goal_beyond_reach") == Some(&"true"),
            goal_count: values.get("goal_count").and_then(|text| text.parse().ok()).unwrap_or_default(),
            goal_stamp: text("goal_stamp"),
            reason: text("reason"),
            joint_at_limit: text("joint_at_limit"),
            clearance: number("clearance_m"),
            reconfiguration: text("reconfiguration"),
            figures: number("elapsed_s").map(|_| Figures::from_named(number)),
            cycle_jitter: CycleJitter::from_named(number),
        })
    }
}

impl StatusReport {
    /// Returns the name of the law, followed by the name of the components that the law controls, if there is one.
    pub fn law_and_aim(&self) -> String {
        law_and_aim(&self.law, self.aim.as_deref())
    }

    /// Returns whether the arm has stalled but would move to another configuration on request.
    pub fn may_be_reconfigured(&self) -> bool {
        self.state == State::Stalled && self.reconfiguration.as_deref() == Some(Reconfiguration::FOUND)
    }

    /// Returns a sentence that says what the servo is doing. If known, it also says why the arm does not arrive, and how far the
    /// goal is.
    pub fn sentence(&self) -> String {
        if let (State::Settled, Some(Figures { arrival_time: Some(time), path_length, .. })) =
            (self.state, self.figures)
        {
            return format!("settled after {time:.1} s and {path_length:.2} m");
        }
        let doing = match self.state {
            State::WaitingForState => "waiting for the robot's joint states",
            State::Holding if self.reason.is_none() => "holding: no goal",
            State::Tracking if self.goal_beyond_reach => "tracking a goal beyond reach",
            State::Jogging => "jogging: a twist moves the tool",
            State::JointLimit | State::Constrained => "held back",
            State::NotFollowing if self.reason.is_none() => {
                "not following: the arm does not move as commanded"
            }
            State::NotFollowing => "not following",
            State::StaleState => "the robot's joint states are late: standing",
            State::StaleWrench => "no usable wrench arrives: standing",
            State::StaleGoal => "the stream of goals is silent: standing",
            state => state.name(),
        };
        let limit = || self.joint_at_limit.as_ref().map(|joint| format!("{joint} is at its position limit"));
        let why = self.reason.clone().or_else(limit).map_or_else(String::new, |why| format!(": {why}"));
        let way = self.figures.map_or_else(String::new, |figures| {
            format!(", {} after {:.1} s", distance(&figures), figures.elapsed)
        });
        format!("{doing}{why}{way}")
    }
}

/// Formats the distance to the goal.
pub fn distance(figures: &Figures) -> String {
    let (position, rotation) = (1e3 * figures.position_error, figures.rotation_error.to_degrees());
    format!("{position:.1} mm and {rotation:.2}° from the goal")
}

pub(crate) fn parse_goal(text: &str) -> Option<PoseNumbers> {
    let numbers: Result<Vec<f64>, _> = text.split(' ').map(str::parse).collect();
    numbers.ok()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_algebra::UnitDualQuaternion;
    use dq_config::ForArm;
    use dq_core::servo::{Servo, Stall};

    #[test]
    fn a_latency_that_fades_away_has_few_digits() {
        let texts = [4.372e-203, 0.0027504, 0.12].map(|latency| milliseconds(latency).to_string());
        assert_eq!(texts, ["0", "2.75", "120"]);
    }

    #[test]
    fn times_have_no_more_digits_than_nanoseconds() {
        for nanoseconds in (0..1_000_000_000).step_by(12_347) {
            let text = microseconds(Duration::from_nanos(nanoseconds)).to_string();
            assert!(text.split_once('.').is_none_or(|(_, digits)| digits.len() <= 3), "{text}");
        }
    }

    /// Other programs read the names of these figures in `~/status`.
    #[test]
    fn figures_keep_their_names() {
        let names: Vec<_> = Figures::default().named().map(|(name, _)| name).collect();
        let expected = [
            "elapsed_s",
            "settling_time_2_percent_rotation_s",
            "settling_time_2_percent_position_s",
            "arrival_time_s",
            "path_length_m",
            "straight_line_m",
            "path_ratio",
            "position_error_m",
            "rotation_error_rad",
            "peak_joint_speed_rad_s",
            "overshoot_m",
            "effort_rad2_s",
            "min_singular_value",
            "stalls",
        ];
        assert_eq!(names, expected);
    }

    #[test]
    fn a_status_is_a_sentence_for_people() {
        let says = |state: State, values: &[(&str, &str)]| {
            let pair =
                |(key, value): &(&str, &str)| KeyValue { key: (*key).to_owned(), value: (*value).to_owned() };
            let values = values.iter().chain(&[("law", "logc")]).map(pair).collect();
            let message =
                DiagnosticStatus { message: state.to_string(), values, ..DiagnosticStatus::default() };
            StatusReport::from_message(&message).unwrap().sentence()
        };
        assert_eq!(says(State::Holding, &[]), "holding: no goal");
        let away = [("reason", "the robot was away for 3 s")];
        assert_eq!(says(State::Holding, &away), "holding: the robot was away for 3 s");
        assert_eq!(says(State::WaitingForState, &[]), "waiting for the robot's joint states");
        let elsewhere = [("reason", "two publishers")];
        assert_eq!(
            says(State::WaitingForState, &elsewhere),
            "waiting for the robot's joint states: two publishers"
        );
        let way = [("elapsed_s", "1.25"), ("position_error_m", "0.1204"), ("rotation_error_rad", "0.1")];
        let there = [("elapsed_s", "9"), ("arrival_time_s", "4.21"), ("path_length_m", "0.634")];
        assert_eq!(says(State::Settled, &there), "settled after 4.2 s and 0.63 m");
        assert_eq!(says(State::Tracking, &way), "tracking, 120.4 mm and 5.73° from the goal after 1.2 s");
        let limited = [&way[..], &[("joint_at_limit", "elbow")]].concat();
        let text = says(State::JointLimit, &limited);
        assert_eq!(
            text,
            "held back: elbow is at its position limit, 120.4 mm and 5.73° from the goal after 1.2 s"
        );
    }

    #[test]
    fn a_status_reads_back_unchanged() {
        let figures = Figures {
            elapsed: 1.5,
            settling_time_rotation: Some(0.25),
            path_length: 0.7,
            overshoot: 0.01,
            effort: 2.5,
            ..Figures::default()
        };
        let goal = dq_core::servo::Goal::new([0.1, 0.2, 0.3], [0.0, 0.6, 0.0, 0.8], "", "base").unwrap();
        let mut servo = Servo::for_arm("ur5e").unwrap();
        servo.set_goal(nalgebra::Isometry3::translation(-0.4, -0.3, 0.4));
        let seconds = Duration::from_secs;
        servo.cycle_with(seconds(1), []);
        servo.cycle_with(seconds(7), []);
        let longer = UnitDualQuaternion::from_parts(Default::default(), nalgebra::Vector3::repeat(0.1));
        let settings = dq_core::servo::Settings { tool_offset: longer, ..servo.settings().clone() };
        servo.configure(settings).unwrap();
        let consent = *servo.consent();
        let status = Status {
            state: State::Tracking,
            reason: None,
            consent,
            input: Input::Goal,
            goal_count: 2,
            goal: Some(goal),
            goal_stamp: 3_000_000_007,
            goal_beyond_reach: true,
            sign: -1.0,
            joint_at_limit: Some(2),
            held_by: None,
            closest: None,
            too_far: None,
            speed_factor: 1.0,
            leaving_singularity: false,
            instead_of_twist: None,
            contact: None,
            stall: Some(Stall::Singular { sigma: 1e-5 }),
            reconfiguration: Reconfiguration::NotFound { starts: 7 },
            figures,
            pose_error: nalgebra::Vector6::zeros(),
            latency: 0.002,
            gain_factor: 1.0,
        };
        let rejections = RejectionCounts::default();
        let mut reported = Reported {
            node: "dq_servo",
            guard: GuardState::Watching,
            not_obeyed: None,
            servo: ServoReport {
                law: LawNames { law: "logc", aim: None, aim_key: "task" },
                joint_at_limit: Some("elbow"),
                reason: Some("singular: sigma = 1.0e-5".to_owned()),
                keep_outs: Some(3),
                smallest_singular_value: 1e-5,
                now: Duration::from_secs(9),
                asker: Some("/rviz".to_owned()),
                status: &status,
                heard: true,
                rejections: &rejections,
            },
            timing: TimingFigures::default(),
        };
        let (sent, sent_reason) = (reported.message(), reported.servo.reason.clone());
        let report = StatusReport::from_message(&sent).unwrap();
        assert_eq!(
            (report.state, report.law.as_str(), report.figures),
            (State::Tracking, "logc", Some(figures))
        );
        assert_eq!(report.input, Some(Input::Goal));
        assert_eq!(report.goal, Some([0.1, 0.2, 0.3, 0.0, 0.6, 0.0, 0.8]));
        assert!(report.goal_beyond_reach && sent.level == 1);
        assert_eq!((report.goal_count, report.goal_stamp.as_deref()), (2, Some("3.000000007")));
        assert_eq!(report.joint_at_limit.as_deref(), Some("elbow"));
        assert_eq!(report.reason, sent_reason);
        let keys = |message: &DiagnosticStatus, key: &str| {
            let pair = message.values.iter().find(|pair| pair.key == key);
            pair.map_or_else(String::new, |pair| pair.value.clone())
        };
        let of_consent = ["consent", "asked_by", "asked_s_ago", "revoked_by", "revoked_s_ago"];
        assert_eq!(
            of_consent.map(|key| keys(&sent, key)),
            ["false", "goal of /rviz", "8", "another_tool", "2"]
        );
        reported.servo.heard = false;
        let unheard = StatusReport::from_message(&reported.message()).unwrap();
        assert_eq!(unheard.figures, None, "no figures before there are any");
        assert_eq!(StatusReport::from_message(&DiagnosticStatus::default()), None);
    }
}
