//! A process's membership in the ROS graph: one DDS participant.

use super::endpoint_names::{EndpointNames, announcements};
use super::endpoints::Domain;
use super::environment::Environment;
use super::error::RosError;
use super::log::Logging;
use super::node::Node;
use super::release;
use super::resolver::Resolver;
use crate::dds::ended_threads::Participating;
use crate::dds::first_sample_request::FirstSampleRequest;
use crate::dds::interfaces::Choice;
use crate::dds::matches::Matches;
use crate::dds::new_address::UsedAddresses;
use crate::dds::own_datagrams::OwnDatagrams;
use crate::dds::peer_recovery::{Lost, prefix};
use crate::dds::static_peers::StaticPeers;
use ros2_client::Context;
use rustdds::dds::CreateError;
use rustdds::{DomainParticipant, DomainParticipantBuilder, RTPSEntity};
use std::net::Ipv4Addr;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::Mutex;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use tokio::task::JoinHandle;

/// A DDS participant, and what it knows about other participants. Requires a tokio runtime. The participant leaves the graph when
/// this value and its nodes are dropped.
pub struct Session {
    tasks: Vec<JoinHandle<()>>,
    context: Context,
    domain: Domain,
    /// Warnings that no node has logged yet.
    warnings: Arc<Mutex<UnboundedReceiver<String>>>,
    _participating: Participating,
    /// The task that sends to the static peers. This field must be dropped after the participant, so that the task still sends the
    /// participant's last messages.
    _static_peers: Option<ServedPeers>,
}

impl Session {
    /// Joins the domain.
    ///
    /// # Errors
    /// [`RosError::NoNetwork`], [`RosError::NoFreePort`], [`RosError::Create`]; [`RosError::Security`] if the enclave's files are not
    /// valid. A process never runs unsecured if security is requested.
    pub fn open(environment: &Environment) -> Result<Self, RosError> {
        environment.check_network()?;
        let (domain_id, on_loopback) = (environment.domain_id, environment.is_on_loopback());
        let mut builder = DomainParticipantBuilder::new(domain_id);
        let (warn, warnings) = unbounded_channel();
        // Nobody receives warnings after the end of the session.
        let warn = move |warning: String| drop(warn.send(warning));
        let Choice { addresses, warning } = interfaces(environment);
        if let Some(addresses) = addresses {
            builder = builder.with_only_networks(addresses);
        }
        warning.into_iter().for_each(&warn);
        let static_peers = static_peers(environment, &warn);
        let used_addresses = (!on_loopback).then(UsedAddresses::now);
        let what = format!("a participant in domain {domain_id}");
        let (dds, warning) = match &environment.enclave {
            Some(enclave) => secured_participant(builder, enclave, domain_id, &what)?,
            None => (builder.build().map_err(|why| refused(&why, domain_id, &what))?, None),
        };
        warning.into_iter().chain(environment.warnings.iter().cloned()).for_each(&warn);
        let (names, dds) = (EndpointNames::default(), Arc::new(dds));
        let matches = Matches::new(Arc::new(names.clone()));
        let is_secured = environment.enclave.is_some();
        let datagrams = (!is_secured).then(|| OwnDatagrams::new(on_loopback));
        let datagrams = datagrams.transpose().unwrap_or_else(|why| {
            warn(format!("goals of `ros2 topic pub --once` may be lost, and no long reply is sent: {why}"));
            None
        });
        let datagrams = datagrams.map(Arc::new);
        let request = datagrams
            .clone()
            .map(|datagrams| FirstSampleRequest { participant: Arc::downgrade(&dds), datagrams });
        let request = request.map(Arc::new);
        let lost = Lost::new(domain_id, on_loopback, is_secured, static_peers.is_some());
        let own = prefix(dds.guid().prefix);
        let serve = |peers: StaticPeers| tokio::spawn(peers.serve(Arc::downgrade(&dds), own, warn.clone()));
        let static_peers = static_peers.map(serve).map(ServedPeers);
        let release_warn = warn.clone();
        let of_other_release =
            move |theirs| release_warn(release::warning_of_announcements(theirs, domain_id));
        let mut tasks = vec![
            tokio::spawn(names.clone().follow(announcements(&dds)?, of_other_release)),
            tokio::spawn(matches.clone().follow(dds.status_listener(), request, lost)),
        ];
        tasks.extend(used_addresses.map(|addresses| tokio::spawn(addresses.watch(warn.clone()))));
        let context = Context::from_domain_participant((*dds).clone());
        let context = context.map_err(|why| RosError::create(what.as_str())(&why))?;
        let domain = Domain { dds, matches, names, datagrams };
        let warnings = Arc::new(Mutex::new(warnings));
        let (_participating, _static_peers) = (Participating::new(), static_peers);
        Ok(Self { tasks, context, domain, warnings, _participating, _static_peers })
    }

    /// Returns whether no endpoint of this session is matched with an endpoint of another participant.
    pub fn is_alone(&self) -> bool {
        self.domain.matches.is_alone(self.domain.dds.guid())
    }

    /// Creates a node with these names. The node logs the warnings of the session, unless an earlier node still does.
    ///
    /// # Errors
    /// [`RosError::Create`].
    pub fn node(&self, names: Resolver, logging: Logging) -> Result<Node, RosError> {
        let mut node = Node::new(&self.context, self.domain.clone(), names, logging)?;
        let log = node.log().clone();
        if let Ok(mut warnings) = self.warnings.try_lock() {
            std::iter::from_fn(|| warnings.try_recv().ok()).for_each(|warning| log.warn(&warning));
        }
        let warnings = self.warnings.clone();
        node.run(async move {
            // The first node logs all warnings until it ends. Then another node goes on.
            let mut warnings = warnings.lock().await;
            while let Some(warning) = warnings.recv().await {
                log.warn(&warning);
            }
        });
        Ok(node)
    }
}

/// Creates a participant with the keys and permissions in the folder `enclave`. The files there have the names that sros2 gives
/// them. Errors call the participant `what`. Also returns a warning about the governance, if any.
///
/// # Errors
/// [`RosError::Security`] for the first file that is missing, invalid or out of date; [`RosError::Create`].
#[cfg(feature = "security")]
fn secured_participant(
    builder: DomainParticipantBuilder,
    enclave: &Path,
    domain: u16,
    what: &str,
) -> Result<(DomainParticipant, Option<String>), RosError> {
    use crate::dds::{certificates, payload_protection};
    use rustdds::DomainParticipantSecurityConfigFiles as Files;
    certificates::check(enclave)
        .map_err(|certificates::Unusable { path, why }| RosError::Security { path, why })?;
    let files = Files::with_ros_default_names(enclave, String::new());
    let participant = builder.builtin_security(files).build().map_err(|why| match why {
        CreateError::NotAllowedBySecurity { reason } => {
            RosError::Security { path: enclave.to_owned(), why: reason }
        }
        other => refused(&other, domain, what),
    })?;
    Ok((participant, payload_protection::warning(&enclave.join("governance.p7s"), domain)))
}

/// Returns an error, because this build lacks the feature `security`. [`Environment`] refuses security before anything calls this
/// function.
#[cfg(not(feature = "security"))]
fn secured_participant(
    _: DomainParticipantBuilder,
    _enclave: &Path,
    _domain: u16,
    what: &str,
) -> Result<(DomainParticipant, Option<String>), RosError> {
    Err(RosError::create(what)(&"built without security"))
}

/// Chooses the network interfaces. If the environment names static peers but no interfaces, chooses all interfaces, because any of
/// them may lead to a static peer.
fn interfaces(environment: &Environment) -> Choice {
    let Environment { interfaces, static_peers, .. } = environment;
    match environment.is_on_loopback() {
        true => Choice { addresses: Some(vec![Ipv4Addr::LOCALHOST]), warning: None },
        false if interfaces.is_empty() && !static_peers.is_empty() => {
            Choice { addresses: None, warning: None }
        }
        false => Choice::now(interfaces),
    }
}

/// Opens the sockets of [`StaticPeers`]. Returns `None` if there are no static peers. Also returns `None` after a warning, if the
/// sockets cannot be opened.
fn static_peers(environment: &Environment, warn: impl Fn(String)) -> Option<StaticPeers> {
    let Environment { domain_id, static_peers, .. } = environment;
    let listening = (!static_peers.is_empty()).then(|| StaticPeers::listen(*domain_id, static_peers.clone()));
    listening?.inspect_err(|why| warn(format!("ROS_STATIC_PEERS has no effect: {why}"))).ok()
}

/// Converts the error with which RustDDS refused to create the participant called `what`.
fn refused(why: &CreateError, domain: u16, what: &str) -> RosError {
    match why {
        // RustDDS also reports `OutOfResources` for other problems with sockets.
        CreateError::OutOfResources { reason } if reason.contains("ParticipantId") => {
            RosError::no_free_port(domain)
        }
        other => RosError::create(what)(other),
    }
}

/// The task that sends to the static peers. When this value is dropped, the task continues for [`LAST_MESSAGES`], so that the peers
/// learn that the participant has left.
struct ServedPeers(JoinHandle<()>);

/// How long the task of [`ServedPeers`] continues after the participant has left, to send the participant's final messages.
const LAST_MESSAGES: Duration = Duration::from_millis(50);

impl Drop for ServedPeers {
    fn drop(&mut self) {
        std::thread::sleep(LAST_MESSAGES);
        self.0.abort();
    }
}

/// The longest time that dropping a session waits for the session's tasks to end.
const LAST_STEPS: Duration = Duration::from_millis(200);

impl Drop for Session {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
        // Each task holds a reference to the participant. The participant leaves the graph when the last task ends, so the process
        // must not end earlier.
        let end = Instant::now() + LAST_STEPS;
        while !self.tasks.iter().all(JoinHandle::is_finished) && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::args::{LogLevel, RosArgs};
    use super::super::environment::Reach;
    use super::*;
    use crate::alone::{node, outside, session};
    use crate::dds::matches::Owners;
    use crate::dds::ports;
    use dq_messages::messages::Float64MultiArray;
    use rustdds::{GUID, QosPolicies};
    use std::io::{BufRead, BufReader};
    use std::net::UdpSocket;
    use std::process::{Command, Stdio};

    #[tokio::test(flavor = "multi_thread")]
    async fn other_participants_see_the_endpoints_of_a_node_under_its_name_until_it_ends() {
        if outside(
            "ros::session::tests::other_participants_see_the_endpoints_of_a_node_under_its_name_until_it_ends",
        ) {
            return;
        }
        let (other, (_ours, mut node)) = (session(), node("ours"));
        let publisher = node.publisher_with::<Float64MultiArray>("/topic", QosPolicies::default()).unwrap();
        let is_known = || other.domain.names.knows(publisher.id().guid());
        let wait_until = async |known| {
            let end = Instant::now() + Duration::from_secs(5);
            while is_known() != known {
                assert!(Instant::now() < end, "not {known}");
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        wait_until(true).await;
        assert!(other.domain.names.describe(publisher.id()).starts_with("/ours ("));
        drop(node);
        wait_until(false).await;
    }

    /// Runs a node on another vendor's DDS that announces itself with GIDs of `length` bytes. Returns three results: the description
    /// of this node's publisher in our session, the word `known` or `unknown` from this node about our node, and our warnings.
    async fn meet(length: usize) -> (String, String, Vec<String>) {
        let session = session();
        // The test holds this lock, so the node does not take the warnings.
        let mut warnings = session.warnings.clone().lock_owned().await;
        let names = Resolver::new("ours", &RosArgs::default()).unwrap();
        let mut node = session.node(names, Logging::new(&RosArgs::default(), LogLevel::Info)).unwrap();
        let _publisher = node.publisher_with::<Float64MultiArray>("/topic", QosPolicies::default()).unwrap();
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
        let mut peer = Command::new(format!("{root}/target/venv/bin/python"));
        let peer = peer.args([&format!("{root}/src/ros/tests/peer.py"), "7", &length.to_string()]);
        let mut peer = peer.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("tests/install.sh");
        let mut lines = BufReader::new(peer.stdout.take().unwrap()).lines();
        let guid = hex::decode(lines.next().unwrap().unwrap()).unwrap();
        let guid = GUID::from_bytes(guid.try_into().unwrap());
        let knows = tokio::task::spawn_blocking(move || lines.next().unwrap().unwrap()).await.unwrap();
        let described = session.domain.matches.introduced(guid).await;
        drop(peer.stdin.take());
        assert!(peer.wait().unwrap().success());
        let warnings = std::iter::from_fn(|| warnings.try_recv().ok()).collect();
        (described, knows, warnings)
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn nodes_of_the_same_release_know_each_other_and_others_are_warned_of_once() {
        if outside(
            "ros::session::tests::nodes_of_the_same_release_know_each_other_and_others_are_warned_of_once",
        ) {
            return;
        }
        let (own, other) = if cfg!(feature = "humble") { (24, 16) } else { (16, 24) };
        let (described, knows, warnings) = meet(own).await;
        assert!(described.starts_with("/peer ("), "{described}");
        assert_eq!((knows.as_str(), warnings.len()), ("known", 0), "{warnings:?}");
        let (described, knows, warnings) = meet(other).await;
        assert!(described.starts_with("/peer ("), "{described}");
        assert_eq!((knows.as_str(), warnings.len()), ("unknown", 1), "{warnings:?}");
        assert!(warnings[0].contains("--features humble"), "{warnings:?}");
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn without_a_free_port_the_error_names_the_ports_and_the_remedy() {
        if outside("ros::session::tests::without_a_free_port_the_error_names_the_ports_and_the_remedy") {
            return;
        }
        let taken =
            |number| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, ports::of_participant(7, number))).unwrap();
        let mut taken: Vec<_> = (0..120).map(taken).collect();
        let refused = Session::open(&Environment::new(7, Reach::Localhost)).err().unwrap().to_string();
        for part in ["domain 7", "120", "9160 to 9398", "ROS_DOMAIN_ID"] {
            assert!(refused.contains(part), "{refused}");
        }
        taken.pop();
        assert!(Session::open(&Environment::new(7, Reach::Localhost)).is_ok());
    }
}
