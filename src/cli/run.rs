//! `dq_servo servo` and `dq_servo puma560`: one node each, until a signal.

use crate::nodes::{PlantNode, Prepared, ServoNode};
use crate::ros::{Environment, RosArgs, Session};
use anyhow::bail;
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};

pub(super) async fn servo(ros_args: &RosArgs) -> anyhow::Result<()> {
    let prepared = Prepared::servo(ros_args)?;
    let session = Session::open(&Environment::from_process()?)?;
    let node = ServoNode::start(&session, prepared)?;
    until_signal(|| node.is_running()).await
}

pub(super) async fn puma560(ros_args: &RosArgs) -> anyhow::Result<()> {
    let prepared = Prepared::plant(ros_args)?;
    let session = Session::open(&Environment::from_process()?)?;
    let node = PlantNode::start(&session, prepared)?;
    until_signal(|| node.is_running()).await
}

/// Waits for a signal, or for a cycle that ended by itself.
async fn until_signal(is_running: impl Fn() -> bool) -> anyhow::Result<()> {
    let mut look = tokio::time::interval(Duration::from_millis(100));
    let ended = async {
        while is_running() {
            look.tick().await;
        }
    };
    tokio::select! {
        signalled = signalled() => Ok(signalled?),
        () = ended => bail!("the node's cycle ended by itself"),
    }
}

/// Waits for SIGINT or SIGTERM.
pub(super) async fn signalled() -> std::io::Result<()> {
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::select! {
        _ = interrupt.recv() => Ok(()),
        _ = terminate.recv() => Ok(()),
    }
}
