//! `dq_servo status`: prints what running servos are doing.

use super::error::bail;
use super::find::{Kind, PATIENCE, Search, Targets};
use super::print::{print_line, short};
use dq_messages::Direction;
use dq_messages::PoseNumbers;
use dq_messages::messages::DiagnosticStatus;
use dq_ros::ros::RosArgs;
use dq_wire::Contract;
use dq_wire::{ServoKind, StatusReport};
use serde_json::{Map, Value, json};

/// Print what the servo is doing
#[derive(clap::Args)]
pub(super) struct Status {
    #[command(flatten)]
    targets: Targets,
    /// Print a JSON list with every value of ~/status
    #[arg(long)]
    json: bool,
}

impl Status {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> super::Result<()> {
        let mut search = Search::begin("dq_servo_call", Kind::Servo, &self.targets, ros_args)?;
        // Both kinds of servo have the same status.
        let contract = ServoKind::OneArm.contract(Contract::builtin()?);
        let topic = contract.topic::<DiagnosticStatus>("~/status", Direction::Out)?;
        let (mut listed, mut silent) = (Vec::new(), Vec::new());
        while let Some(name) = search.next().await? {
            let statuses =
                search.node.subscription_as::<DiagnosticStatus>(topic, &format!("{name}/status"))?;
            match tokio::time::timeout(PATIENCE, statuses.next()).await {
                Ok(status) if self.json => listed.push(as_json(&name, &status)),
                Ok(status) => print_line!("{name}: {}", line(&status))?,
                Err(_) => silent.push(name),
            }
        }
        if self.json {
            print_line!("{:#}", Value::Array(listed))?;
        }
        match silent.is_empty() {
            true => Ok(()),
            false => bail!("no status from {} within {} s", silent.join(", "), PATIENCE.as_secs()),
        }
    }
}

/// Returns a line of text with the law, a sentence about the servo's state, and the goal.
fn line(status: &DiagnosticStatus) -> String {
    let Some(report) = StatusReport::from_message(status) else { return status.message.clone() };
    let numbers = |goal: PoseNumbers| goal.map(|number| short(number).to_string()).join(" ");
    let goal = report.goal.map_or_else(String::new, |goal| format!(", goal {}", numbers(goal)));
    format!("{}, {}{goal}", report.law_and_aim(), report.sentence())
}

/// Converts a status to JSON. Numbers and booleans keep their types. All other values become text, including stamps, because stamps
/// have more digits than a JSON number keeps.
fn as_json(name: &str, status: &DiagnosticStatus) -> Value {
    let value = |key: &str, text: &str| match serde_json::from_str(text) {
        Ok(value @ (Value::Number(_) | Value::Bool(_))) if !key.ends_with("_stamp") => value,
        _ => Value::from(text),
    };
    let mut object = Map::new();
    object.insert("node".to_owned(), json!(name));
    object.insert("state".to_owned(), json!(status.message));
    for pair in &status.values {
        object.insert(pair.key.clone(), value(&pair.key, &pair.value));
    }
    Value::Object(object)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_messages::messages::KeyValue;

    #[test]
    fn a_status_is_a_line_or_an_object_with_every_figure() {
        let pair = |(key, value): (&str, &str)| KeyValue { key: key.to_owned(), value: value.to_owned() };
        let stamp = ("goal_stamp", "1795410323.100000000");
        let values =
            [("law", "logc"), ("goal_count", "0"), ("goal_beyond_reach", "false"), stamp].map(pair).to_vec();
        let status =
            DiagnosticStatus { message: "holding".to_owned(), values, ..DiagnosticStatus::default() };
        assert_eq!(line(&status), "logc, holding: no goal");
        let expected = json!({"node": "/a", "state": "holding", "law": "logc", "goal_count": 0, "goal_beyond_reach": false, "goal_stamp": "1795410323.100000000"});
        assert_eq!(as_json("/a", &status), expected);
    }
}
