//! `dq_servo servo`, `dq_servo dual` and `dq_servo puma560`: one node each, until a signal.

use crate::config::{CycleParameters, NodeParameters, PlantParameters};
use crate::nodes::{PlantNode, Prepared, ServoNode, Wiring};
use crate::ros::{Environment, RosArgs, Session, network_threads_run};
use anyhow::bail;
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};

/// The servo for one arm or for two, by its parameters.
pub(super) async fn servo<T: Wiring>(ros_args: &RosArgs) -> anyhow::Result<()>
where
    CycleParameters<T>: NodeParameters,
{
    let prepared = Prepared::<CycleParameters<T>>::new(ros_args)?;
    let session = Session::open(&Environment::from_process(ros_args)?)?;
    let node = ServoNode::start(&session, prepared)?;
    until_signal(|| node.is_running()).await
}

pub(super) async fn puma560(ros_args: &RosArgs) -> anyhow::Result<()> {
    let prepared = Prepared::<PlantParameters>::new(ros_args)?;
    let session = Session::open(&Environment::from_process(ros_args)?)?;
    let node = PlantNode::start(&session, prepared)?;
    until_signal(|| node.is_running()).await
}

/// Waits for a signal, or for a cycle or a network that ended by itself.
async fn until_signal(is_running: impl Fn() -> bool) -> anyhow::Result<()> {
    let mut look = tokio::time::interval(Duration::from_millis(100));
    let ended = async {
        while is_running() && network_threads_run() {
            look.tick().await;
        }
    };
    tokio::select! {
        signalled = signalled() => return Ok(signalled?),
        () = ended => {}
    }
    if is_running() {
        bail!(
            "DDS has ended in this process, as it does when the process was stopped (ctrl-Z, a debugger, a suspended machine): \
             start the node again"
        );
    }
    bail!("the node's cycle ended by itself");
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
