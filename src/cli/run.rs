//! `dq_servo servo` and `dq_servo puma560`: one node each, until a signal.

use crate::nodes::{PlantNode, ServoNode};
use crate::ros::{Environment, RosArgs, Session};
use anyhow::bail;
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};

pub(super) async fn servo(ros_args: &RosArgs) -> anyhow::Result<()> {
    let session = Session::open(&Environment::from_process()?)?;
    let node = ServoNode::start(&session, ros_args)?;
    until_signal(|| node.is_running()).await
}

pub(super) async fn puma560(ros_args: &RosArgs) -> anyhow::Result<()> {
    let session = Session::open(&Environment::from_process()?)?;
    let node = PlantNode::start(&session, ros_args)?;
    until_signal(|| node.is_running()).await
}

/// Waits for SIGINT or SIGTERM, or for a cycle that ended by itself.
async fn until_signal(is_running: impl Fn() -> bool) -> anyhow::Result<()> {
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut look = tokio::time::interval(Duration::from_millis(100));
    loop {
        tokio::select! {
            _ = interrupt.recv() => return Ok(()),
            _ = terminate.recv() => return Ok(()),
            _ = look.tick() => if !is_running() { bail!("the node's cycle ended by itself") },
        }
    }
}
