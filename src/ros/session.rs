//! A process's place in the ROS graph: one DDS participant.

use super::environment::{Environment, Reach};
use super::error::RosError;
use super::log::LogLevel;
use super::matches::Matches;
use super::names::Resolver;
use super::network_threads::Participating;
use super::node::Node;
use super::nudge::Nudge;
use super::security;
use ros2_client::Context;
use rustdds::DomainParticipantBuilder;
use std::net::Ipv4Addr;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::task::JoinHandle;

/// One DDS participant and what it knows of the others. Lives inside a tokio runtime.
pub struct Session {
    context: Context,
    matches: Matches,
    follower: JoinHandle<()>,
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
        if environment.reach == Reach::Localhost {
            builder = builder.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let what = format!("a participant in domain {}", environment.domain_id);
        let (participant, warning) = match &environment.enclave {
            Some(enclave) => security::participant(builder, enclave, environment.domain_id, &what)?,
            None => (builder.build().map_err(|why| RosError::create(what.as_str())(&why))?, None),
        };
        let nudge = match environment.enclave {
            Some(_) => None,
            None => {
                let nudge = Nudge::new(participant.clone());
                Some(Arc::new(nudge.map_err(|why| RosError::create(what.as_str())(&why))?))
            }
        };
        let matches = Matches::default();
        let follower = tokio::spawn(matches.clone().follow(participant.clone(), nudge));
        let context =
            Context::from_domain_participant(participant).map_err(|why| RosError::create(what)(&why))?;
        let warning = Mutex::new(warning);
        Ok(Self { context, matches, follower, warning, _participating: Participating::new() })
    }

    /// A node with the names that `names` gives it.
    ///
    /// # Errors
    /// [`RosError::Create`].
    pub fn node(&self, names: Resolver, level: LogLevel) -> Result<Node, RosError> {
        let node = Node::new(self.context.clone(), self.matches.clone(), names, level)?;
        if let Some(text) = self.warning.lock().unwrap_or_else(PoisonError::into_inner).take() {
            node.log().warn(&text);
        }
        Ok(node)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.follower.abort();
    }
}
