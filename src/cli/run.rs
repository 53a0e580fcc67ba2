//! `dq_servo servo`, `dq_servo dual`, `dq_servo arm`, `dq_servo puma560` and `dq_servo guard`. Each of them runs one node until a
//! signal arrives.

use super::error::NetworkLost;
use super::error::{bail, ensure};
use super::signals::Signals;
use dq_config::{GuardParameters, NodeParameters, PlantParameters, ServoParameters};
use dq_nodes::{GuardNode, NodeArguments, PlantNode, Prepared, ServoNode};
use dq_ros::ros::{Environment, NetworkWatch, RosArgs, Session};
use std::time::Duration;
use tokio::runtime::Handle;

/// Runs a servo for one arm or for two arms, depending on its parameters. At a signal, the servo brings the arm to rest and ends. At
/// a second signal, it ends at once.
pub(super) async fn servo<P: NodeParameters>(ros_args: &RosArgs) -> super::Result<()>
where
    Prepared<ServoParameters>: From<Prepared<P>>,
{
    let mut signals = Signals::new()?;
    let Some((session, prepared)) = described::<P>(&mut signals, ros_args).await? else { return Ok(()) };
    let node = ServoNode::start(&session, prepared.into())?;
    let check = || node.failure().map_or(Ok(()), |why| Err(why.into()));
    let why = until(&mut signals, || node.waits_for_robot(), check).await;
    tokio::select! {
        ended = node.shut_down() => Ok(why.and(ended.map_err(Into::into))?),
        // Dropping the node sends zeros.
        () = signals.next() => bail!("a second signal: zeros were sent before the arm was seen at rest"),
    }
}

/// Opens the session of a node and prepares its parameters. Returns `None` if a signal arrives while the node waits for a robot
/// description.
async fn described<P: NodeParameters>(
    signals: &mut Signals,
    ros_args: &RosArgs,
) -> super::Result<Option<(Session, Prepared<P>)>> {
    // Report invalid parameters before joining the network.
    let given = NodeArguments::<P>::new(ros_args)?;
    let priority = given.realtime_priority();
    if !given.is_awaited() {
        let prepared = given.prepare()?;
        return Ok(Some((session(ros_args, priority)?, prepared)));
    }
    let session = session(ros_args, priority)?;
    tokio::select! {
        described = given.when_described(&session) => Ok(Some((session, described?))),
        ended = until(signals, || true, || Ok(())) => ended.map(|()| None),
    }
}

/// Opens the session of a node. `priority` is the real-time priority of the node's cycle. If `priority` is not 0, the threads of
/// DDS also get a real-time priority.
fn session(ros_args: &RosArgs, priority: u8) -> super::Result<Session> {
    let environment = Environment::from_process(ros_args)?;
    let runtime = Handle::current();
    let open = || {
        let _inside = runtime.enter();
        Session::open(&environment)
    };
    Ok(dq_nodes::below(priority, open)??)
}

/// Runs a simulated arm.
pub(super) async fn plant(ros_args: &RosArgs) -> super::Result<()> {
    let mut signals = Signals::new()?;
    let given = NodeArguments::<PlantParameters>::new(ros_args)?;
    let priority = given.realtime_priority();
    let prepared = given.prepare()?;
    let session = session(ros_args, priority)?;
    let node = PlantNode::start(&session, prepared)?;
    let cycle =
        || if node.is_running() { Ok(()) } else { Err(super::error::failed!("the cycle ended by itself")) };
    until(&mut signals, || session.is_alone(), cycle).await
}

/// Runs the guard of one arm. After a signal, the guard ends once the arm is no longer commanded to move. At a second signal, it
/// ends at once.
pub(super) async fn guard(ros_args: &RosArgs) -> super::Result<()> {
    let mut signals = Signals::new()?;
    let Some((session, prepared)) = described::<GuardParameters>(&mut signals, ros_args).await? else {
        return Ok(());
    };
    let node = GuardNode::start(&session, prepared)?;
    let cycle =
        || if node.is_running() { Ok(()) } else { Err(super::error::failed!("the guard ended by itself")) };
    until(&mut signals, || node.waits_for_robot(), cycle).await?;
    tokio::select! {
        stands = node.shut_down() => ensure!(stands, "ended while the arm is commanded to move: the arm no longer has a guard"),
        () = signals.next() => bail!("a second signal: ended before the arm was commanded to stand"),
    }
    Ok(())
}

/// Waits for a signal. Returns an error as soon as `check` fails or this process loses the network.
///
/// If this host gets an address after the start of the process, the process does not use this address, and so may not find the
/// robot. While `waits` returns true, a new address is an error too.
pub(super) async fn until(
    signals: &mut Signals,
    waits: impl Fn() -> bool,
    check: impl Fn() -> super::Result<()>,
) -> super::Result<()> {
    let mut look = tokio::time::interval(Duration::from_millis(100));
    let mut network = NetworkWatch::default();
    let failed = async {
        loop {
            check()?;
            network.check().map_err(NetworkLost)?;
            if waits() {
                network.check_addresses().map_err(NetworkLost)?;
            }
            look.tick().await;
        }
    };
    tokio::select! {
        () = signals.next() => Ok(()),
        failed = failed => failed,
    }
}
