//! A process's place in the ROS graph: one DDS participant.

use super::announcement::Announcement;
use super::endpoint::Plan;
use super::environment::Environment;
use super::error::RosError;
use super::log::Logging;
use super::names::Resolver;
use super::node::Node;
use super::participant::Participant;
use super::security;
use crate::dds::ended_threads::Participating;
use crate::dds::first_sample_request::FirstSampleRequest;
use crate::dds::peer_recovery::Lost;
use rustdds::DomainParticipantBuilder;
use std::net::Ipv4Addr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::task::JoinHandle;

/// One DDS participant and what it knows of the others. Lives inside a tokio runtime. It leaves the graph when it and its nodes are
/// dropped.
pub struct Session {
    tasks: Vec<JoinHandle<()>>,
    participant: Arc<Participant>,
    /// What an operator should know of the enclave, until a node has logged it.
    warning: Mutex<Option<String>>,
    _participating: Participating,
}

impl Session {
    /// Joins the domain.
    ///
    /// # Errors
    /// [`RosError::NoNetwork`], [`RosError::Create`]; [`RosError::Security`] where the enclave's files do not allow it:
    /// what was to be secured never runs unsecured.
    pub fn open(environment: &Environment) -> Result<Self, RosError> {
        environment.check_network()?;
        let mut builder = DomainParticipantBuilder::new(environment.domain_id);
        if environment.is_on_loopback() {
            builder = builder.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let what = format!("a participant in domain {}", environment.domain_id);
        let (dds, warning) = match &environment.enclave {
            Some(enclave) => security::participant(builder, enclave, environment.domain_id, &what)?,
            None => (builder.build().map_err(|why| RosError::create(what.as_str())(&why))?, None),
        };
        let participant = Arc::new(Participant::new(dds)?);
        let (on_loopback, is_secured) = (environment.is_on_loopback(), environment.enclave.is_some());
        let request =
            (!is_secured).then(|| FirstSampleRequest::new(Arc::downgrade(participant.dds()), on_loopback));
        let (request, warning) = match request.transpose() {
            Ok(request) => (request.map(Arc::new), warning),
            Err(why) => (None, Some(format!("goals of `ros2 topic pub --once` may be lost: {why}"))),
        };
        let announcements = participant.reader(Plan::unannounced(Announcement::topic()))?;
        let (names, matches) = (participant.names().clone(), participant.matches().clone());
        let lost = Lost::new(environment.domain_id, on_loopback, is_secured);
        let listener = participant.dds().status_listener();
        let tasks = vec![
            tokio::spawn(participant.announcement().clone().follow()),
            tokio::spawn(names.follow(announcements)),
            tokio::spawn(matches.follow(listener, request, lost)),
        ];
        let warning = Mutex::new(warning);
        Ok(Self { tasks, participant, warning, _participating: Participating::new() })
    }

    /// A node with the names that `names` gives it.
    ///
    /// # Errors
    /// [`RosError::Create`].
    pub fn node(&self, names: Resolver, logging: Logging) -> Result<Node, RosError> {
        let node = Node::new(self.participant.clone(), names, logging)?;
        let warning = self.warning.lock().unwrap_or_else(PoisonError::into_inner).take();
        warning.iter().for_each(|warning| node.log().warn(warning));
        Ok(node)
    }
}

/// How long the tasks may take to be gone.
const LAST_STEPS: Duration = Duration::from_millis(200);

impl Drop for Session {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
        // They hold the participant. The last to hold it takes it out of the graph; were that a task, the process could end before.
        let end = Instant::now() + LAST_STEPS;
        while !self.tasks.iter().all(JoinHandle::is_finished) && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dds::matches::Owners;
    use crate::ros::alone::{node, outside, session};
    use crate::ros::graph::ParticipantEntitiesInfo;
    use crate::ros::topic::DdsTopic;
    use crate::wire::messages::Float64MultiArray;
    use rustdds::QosPolicies;
    use rustdds::policy::History;

    #[tokio::test(flavor = "multi_thread")]
    async fn the_endpoints_of_a_node_are_announced_together_and_its_end_at_once() {
        const TEST: &str =
            "ros::session::tests::the_endpoints_of_a_node_are_announced_together_and_its_end_at_once";
        if outside(TEST) {
            return;
        }
        let other = session();
        let topic = Announcement::topic();
        let all = QosPolicies::builder().history(History::KeepLast { depth: 100 }).build();
        let topic = DdsTopic { qos: topic.qos.modify_by(&all), ..topic };
        let heard = other.participant.reader::<ParticipantEntitiesInfo>(Plan::unannounced(topic)).unwrap();
        let (ours, node) = node("ours");
        let name = node.name().clone();
        let writers: Vec<_> = (0..20)
            .map(|number| {
                let topic = format!("/topic{number}");
                let topic =
                    DdsTopic::of_messages(&topic, "std_msgs/msg/Float64MultiArray", QosPolicies::default());
                ours.participant.writer::<Float64MultiArray>(Plan::of(&name, topic)).unwrap()
            })
            .collect();
        let names = other.participant.names();
        let known = || writers.iter().all(|writer| names.knows(writer.guid()));
        let mut announcements = 0;
        while tokio::time::timeout(Duration::from_secs(1), heard.next()).await.is_ok() {
            announcements += 1;
        }
        assert!(known(), "after {announcements} announcements");
        assert!(
            announcements < writers.len() / 2,
            "{announcements} announcements of {} writers",
            writers.len()
        );
        drop(node);
        let end = Instant::now() + Duration::from_secs(5);
        while known() {
            assert!(Instant::now() < end, "a node that is gone is announced");
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
}
