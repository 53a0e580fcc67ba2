//! The servo's status as a message, and back: `~/status`.

use crate::ros::messages::{DiagnosticStatus, KeyValue};
use crate::servo::{CycleTiming, Figures, RejectionCounts, State, Status};
use std::collections::BTreeMap;

/// What `~/status` tells, as its readers need it.
#[derive(Clone, Debug, PartialEq)]
pub struct StatusReport {
    /// The state.
    pub state: State,
    /// The law in force.
    pub law: String,
    /// Why the arm is not driven, where the state alone does not say enough.
    pub reason: Option<String>,
    /// What of the relative pose is controlled, for two arms.
    pub primitive: Option<String>,
    /// The goal in force: x y z \[m\], then qx qy qz qw.
    pub goal: Option<[f64; 7]>,
    /// Whether the goal is beyond reach.
    pub goal_beyond_reach: bool,
    /// Figures of the motion.
    pub figures: Figures,
    /// Messages rejected so far.
    pub rejected: u64,
    /// The last reason.
    pub last_rejection: Option<String>,
    /// Lateness of the cycle since the goal was taken, 99 % and worst (µs).
    pub cycle_jitter_us: (f64, f64),
}

/// The message for `status`.
pub(super) fn message(
    node: &str,
    law: &[(&str, &str)],
    status: &Status,
    reason: Option<&str>,
    rejections: &RejectionCounts,
    timing: &CycleTiming,
) -> DiagnosticStatus {
    let figures = &status.figures;
    let mut values = Values::default();
    law.iter().for_each(|(key, name)| values.add(key, name));
    values.add_some("reason", reason);
    values.add("sign", status.sign);
    values.add("goal_count", status.goal_count);
    if let Some(goal) = &status.goal {
        let (t, r) = (goal.base_from_goal().translation(), goal.base_from_goal().rotation());
        values.add("goal", format!("{} {} {} {} {} {} {}", t.x, t.y, t.z, r.i, r.j, r.k, r.w));
        values.add("goal_beyond_reach", status.goal_beyond_reach);
        values.add("elapsed_s", figures.elapsed);
        values.add_some("settling_time_rotation_s", figures.settling_time_rotation);
        values.add_some("settling_time_position_s", figures.settling_time_position);
        values.add_some("arrival_time_s", figures.arrival_time);
        values.add("path_length_m", figures.path_length);
        values.add("straight_line_m", figures.straight_line);
        values.add("position_error_m", figures.position_error);
        values.add("rotation_error_rad", figures.rotation_error);
        values.add("peak_joint_speed_rad_s", figures.peak_joint_speed);
        values.add("overshoot_m", figures.overshoot);
        values.add("effort_rad2_s", figures.effort);
    }
    values.add_some("joint_at_limit", status.joint_at_limit);
    values.add("smallest_singular_value", status.smallest_singular_value);
    values.add("latency_ms", status.latency * 1e3);
    values.add("gain_factor", status.gain_factor);
    values.add("rejected", rejections.total());
    values.add_some("last_rejection", rejections.last());
    values.add("cycle_jitter_p99_us", timing.p99().as_secs_f64() * 1e6);
    values.add("cycle_jitter_max_us", timing.max().as_secs_f64() * 1e6);
    values.add("overruns", timing.overruns());
    DiagnosticStatus {
        level: u8::from(status.state.is_warning() || status.goal_beyond_reach || status.reason.is_some()),
        name: node.to_owned(),
        message: status.state.to_string(),
        hardware_id: String::new(),
        values: values.list,
    }
}

/// What to say where more than one publish commands for one arm.
pub(super) fn rivalry(topic: &str, publishers: usize) -> String {
    format!("{publishers} publishers on {topic}: only one may command the arm")
}

/// Key-value pairs in the making.
#[derive(Default)]
pub(super) struct Values {
    pub list: Vec<KeyValue>,
}

impl Values {
    pub fn add(&mut self, key: &str, value: impl ToString) {
        self.list.push(KeyValue { key: key.to_owned(), value: value.to_string() });
    }

    pub fn add_some(&mut self, key: &str, value: Option<impl ToString>) {
        if let Some(value) = value {
            self.add(key, value);
        }
    }
}

impl StatusReport {
    /// Reads a status message; none where it is not from a servo.
    pub fn from_message(message: &DiagnosticStatus) -> Option<Self> {
        let values: BTreeMap<_, _> =
            message.values.iter().map(|pair| (pair.key.as_str(), pair.value.as_str())).collect();
        let number = |key: &str| values.get(key).and_then(|text| text.parse::<f64>().ok());
        let amount = |key: &str| number(key).unwrap_or_default();
        Some(Self {
            state: State::from_name(&message.message)?,
            law: (*values.get("law")?).to_owned(),
            reason: values.get("reason").map(|text| (*text).to_owned()),
            primitive: values.get("primitive").map(|name| (*name).to_owned()),
            goal: values.get("goal").and_then(|text| parse_goal(text)),
            goal_beyond_reach: values.get("goal_beyond_reach") == Some(&"true"),
            figures: Figures {
                elapsed: amount("elapsed_s"),
                settling_time_rotation: number("settling_time_rotation_s"),
                settling_time_position: number("settling_time_position_s"),
                arrival_time: number("arrival_time_s"),
                path_length: amount("path_length_m"),
                straight_line: amount("straight_line_m"),
                position_error: amount("position_error_m"),
                rotation_error: amount("rotation_error_rad"),
                peak_joint_speed: amount("peak_joint_speed_rad_s"),
                overshoot: amount("overshoot_m"),
                effort: amount("effort_rad2_s"),
            },
            rejected: values.get("rejected").and_then(|text| text.parse().ok()).unwrap_or_default(),
            last_rejection: values.get("last_rejection").map(|text| (*text).to_owned()),
            cycle_jitter_us: (amount("cycle_jitter_p99_us"), amount("cycle_jitter_max_us")),
        })
    }
}

impl StatusReport {
    /// The law, and for two arms what it controls.
    pub fn law_and_primitive(&self) -> String {
        self.primitive.iter().fold(self.law.clone(), |law, primitive| format!("{law} {primitive}"))
    }
}

fn parse_goal(text: &str) -> Option<[f64; 7]> {
    let numbers: Result<Vec<f64>, _> = text.split(' ').map(str::parse).collect();
    numbers.ok()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_reads_back_as_it_was() {
        let figures = Figures {
            elapsed: 1.5,
            settling_time_rotation: Some(0.25),
            path_length: 0.7,
            overshoot: 0.01,
            effort: 2.5,
            ..Figures::default()
        };
        let goal = crate::servo::Goal::new([0.1, 0.2, 0.3], [0.0, 0.6, 0.0, 0.8], "", "base").unwrap();
        let status = Status {
            state: State::Tracking,
            reason: None,
            goal_count: 2,
            goal: Some(goal),
            goal_beyond_reach: true,
            sign: -1.0,
            joint_at_limit: Some(2),
            figures,
            pose_error: nalgebra::Vector6::zeros(),
            smallest_singular_value: 0.1,
            latency: 0.002,
            gain_factor: 1.0,
        };
        let message = message(
            "dq_servo",
            &[("law", "logc")],
            &status,
            None,
            &RejectionCounts::default(),
            &CycleTiming::default(),
        );
        let report = StatusReport::from_message(&message).unwrap();
        assert_eq!((report.state, report.law.as_str(), report.figures), (State::Tracking, "logc", figures));
        assert_eq!(report.goal, Some([0.1, 0.2, 0.3, 0.0, 0.6, 0.0, 0.8]));
        assert!(report.goal_beyond_reach && message.level == 1);
        assert_eq!(StatusReport::from_message(&DiagnosticStatus::default()), None);
    }
}
