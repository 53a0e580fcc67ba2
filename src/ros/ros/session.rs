//! A process's membership in the ROS graph: one DDS participant.

use super::endpoint_names::{EndpointNames, announcements};
use super::endpoints::Domain;
use super::environment::Environment;
use super::error::RosError;
use super::log::Logging;
use super::node::Node;
use super::resolver::Resolver;
use crate::dds::ended_threads::Participating;
use crate::dds::first_sample_request::FirstSampleRequest;
use crate::dds::matches::Matches;
use crate::dds::own_datagrams::OwnDatagrams;
use crate::dds::peer_recovery::Lost;
use ros2_client::Context;
use rustdds::{DomainParticipant, DomainParticipantBuilder};
use std::net::Ipv4Addr;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::task::JoinHandle;

/// A DDS participant, and its knowledge about others. Requires a tokio runtime. The participant leaves the graph when this value
/// and its nodes are dropped.
pub struct Session {
    tasks: Vec<JoinHandle<()>>,
    context: Context,
    domain: Domain,
    /// The warning about the enclave, until a node has logged it.
    warning: Mutex<Option<String>>,
    _participating: Participating,
}

impl Session {
    /// Joins the domain.
    ///
    /// # Errors
    /// [`RosError::NoNetwork`], [`RosError::Create`]; [`RosError::Security`] if the enclave's files are not valid. A process never runs
    /// unsecured if security is requested.
    pub fn open(environment: &Environment) -> Result<Self, RosError> {
        environment.check_network()?;
        let mut builder = DomainParticipantBuilder::new(environment.domain_id);
        if environment.is_on_loopback() {
            builder = builder.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let what = format!("a participant in domain {}", environment.domain_id);
        let (dds, warning) = match &environment.enclave {
            Some(enclave) => secured_participant(builder, enclave, environment.domain_id, &what)?,
            None => (builder.build().map_err(|why| RosError::create(what.as_str())(&why))?, None),
        };
        let (names, dds) = (EndpointNames::default(), Arc::new(dds));
        let matches = Matches::new(Arc::new(names.clone()));
        let (on_loopback, is_secured) = (environment.is_on_loopback(), environment.enclave.is_some());
        let datagrams = (!is_secured).then(|| OwnDatagrams::new(on_loopback));
        let (datagrams, warning) = match datagrams.transpose() {
            Ok(datagrams) => (datagrams.map(Arc::new), warning),
            Err(why) => (
                None,
                Some(format!(
                    "goals of `ros2 topic pub --once` may be lost, and no long reply is sent: {why}"
                )),
            ),
        };
        let request = datagrams
            .clone()
            .map(|datagrams| FirstSampleRequest { participant: Arc::downgrade(&dds), datagrams });
        let request = request.map(Arc::new);
        let lost = Lost::new(environment.domain_id, on_loopback, is_secured);
        let tasks = vec![
            tokio::spawn(names.clone().follow(announcements(&dds)?)),
            tokio::spawn(matches.clone().follow(dds.status_listener(), request, lost)),
        ];
        let context = Context::from_domain_participant((*dds).clone());
        let context = context.map_err(|why| RosError::create(what.as_str())(&why))?;
        let domain = Domain { dds, matches, names, datagrams };
        let warning = Mutex::new(warning);
        Ok(Self { tasks, context, domain, warning, _participating: Participating::new() })
    }

    /// Creates a node with these names.
    ///
    /// # Errors
    /// [`RosError::Create`].
    pub fn node(&self, names: Resolver, logging: Logging) -> Result<Node, RosError> {
        let node = Node::new(&self.context, self.domain.clone(), names, logging)?;
        let warning = self.warning.lock().unwrap_or_else(PoisonError::into_inner).take();
        warning.iter().for_each(|warning| node.log().warn(warning));
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
    use rustdds::dds::CreateError;
    certificates::check(enclave)
        .map_err(|certificates::Unusable { path, why }| RosError::Security { path, why })?;
    let files = Files::with_ros_default_names(enclave, String::new());
    let participant = builder.builtin_security(files).build().map_err(|why| match why {
        CreateError::NotAllowedBySecurity { reason } => {
            RosError::Security { path: enclave.to_owned(), why: reason }
        }
        other => RosError::create(what)(&other),
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

/// How long the tasks of the nodes may take to end.
const LAST_STEPS: Duration = Duration::from_millis(200);

impl Drop for Session {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
        // The tasks hold the participant, which leaves the graph when the last task ends. The process must not end before.
        let end = Instant::now() + LAST_STEPS;
        while !self.tasks.iter().all(JoinHandle::is_finished) && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::{node, outside, session};
    use crate::dds::matches::Owners;
    use dq_messages::messages::Float64MultiArray;
    use rustdds::QosPolicies;

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
}
