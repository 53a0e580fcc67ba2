//! `dq_servo stop`, `pause`, `resume`, `reconfigure` and `reset`: call the services of running servos and simulated arms.

use super::error::bail;
use super::find::{Kind, PATIENCE, Search, Targets};
use super::print::print_line;
use dq_messages::messages::{SetBool, SetBoolRequest, SuccessResponse, Trigger, TriggerRequest};
use dq_ros::ros::{Node, ParameterClient, RosArgs, RosError};
use dq_ros::stderr;

/// The service to call.
#[derive(Clone, Copy)]
pub(super) enum ServiceCall {
    Stop,
    Pause,
    Resume,
    Reconfigure,
    Reset,
}

/// Calls the service of each of the `targets` as soon as the target is found.
///
/// # Errors
/// An error if no target is found, or if a call failed.
pub(super) async fn call(ask: ServiceCall, targets: &Targets, ros_args: &RosArgs) -> super::Result<()> {
    let kind = if matches!(ask, ServiceCall::Reset) { Kind::Plant } else { Kind::Servo };
    let mut search = Search::begin("dq_servo_call", kind, targets, ros_args)?;
    let mut failed = Vec::new();
    let mut done = 0;
    while let Some(name) = search.next().await? {
        if kind == Kind::Plant && !is_simulated(&mut search.node, &name).await? {
            continue;
        }
        done += 1;
        match ask.of(&mut search.node, &name).await {
            Ok(answer) if answer.success => print_line!("{name}: {}", answer.message)?,
            Ok(answer) => failed.push(format!("{name}: {}", answer.message)),
            Err(why) => failed.push(why.to_string()),
        }
    }
    match failed.split_last() {
        None if done == 0 => bail!("the node with the service ~/reset is not a simulated arm"),
        None => Ok(()),
        Some((last, others)) => {
            others.iter().for_each(|why| stderr::line(format!("error: {why}")));
            bail!("{last}")
        }
    }
}

/// Returns whether the node is a simulated arm, by a parameter that only simulated arms have. Nodes of other programs may also
/// serve `~/reset`, with another meaning.
async fn is_simulated(node: &mut Node, name: &str) -> Result<bool, RosError> {
    Ok(ParameterClient::new(node, name, PATIENCE).get("initial_positions").await?.is_some())
}

impl ServiceCall {
    async fn of(self, node: &mut Node, name: &str) -> Result<SuccessResponse, RosError> {
        let trigger = |node, service| trigger(node, format!("{name}/{service}"));
        match self {
            Self::Stop => trigger(node, "stop").await,
            Self::Reconfigure => trigger(node, "reconfigure").await,
            Self::Reset => trigger(node, "reset").await,
            Self::Pause | Self::Resume => {
                let client = node.client::<SetBool>(&format!("{name}/pause"), PATIENCE).await?;
                client.call(SetBoolRequest { data: matches!(self, Self::Pause) }).await
            }
        }
    }
}

async fn trigger(node: &mut Node, service: String) -> Result<SuccessResponse, RosError> {
    let client = node.client::<Trigger>(&service, PATIENCE).await?;
    client.call(TriggerRequest::default()).await
}
