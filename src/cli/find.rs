//! Finds running servos and simulated arms.

use super::Usage;
use super::error::bail;
use dq_ros::ros::names::NodeName;
use dq_ros::ros::{Environment, LogLevel, Logging, Node, Resolver, RosArgs, Session};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// The longest time to wait for the first node, and for each reply of a node.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// The time to search for further nodes after one node was found.
const MORE: Duration = Duration::from_secs(1);

/// The arguments that name the nodes of a command.
#[derive(clap::Args)]
pub(super) struct Targets {
    /// The node; by default every one in this namespace (--ros-args -r __ns:=/left for another)
    #[arg(value_name = "NODE")]
    node: Option<String>,
    /// All nodes in the domain, in any namespace
    #[arg(long, conflicts_with = "node")]
    all: bool,
}

/// The kind of node to search for.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// Servos, for one arm or for two.
    Servo,
    /// Simulated arms.
    Plant,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Servo => "servo",
            Self::Plant => "simulated arm",
        }
    }

    /// Returns the fully qualified names of the nodes of this kind, identified by their services.
    fn nodes(self, node: &Node) -> BTreeSet<String> {
        let (services, graph) = (node.services(), node.graph());
        let serves = |name: &str, service: &str| services.contains(&format!("{name}/{service}"));
        let is_servo = |name: &&str| {
            serves(name, "stop") && serves(name, "pause") && graph.contains_key(&format!("{name}/status"))
        };
        let is_plant = |name: &&str| serves(name, "get_parameters");
        let with = |service: &'static str| services.iter().filter_map(move |name| name.strip_suffix(service));
        match self {
            Self::Servo => with("/stop").filter(is_servo).map(str::to_owned).collect(),
            Self::Plant => with("/reset").filter(is_plant).map(str::to_owned).collect(),
        }
    }
}

/// Returns the names of the nodes of these kinds that discovery knows, in one line; `None` if there are none.
pub(super) fn there(kinds: &[Kind], node: &Node) -> Option<String> {
    let names: Vec<_> = kinds.iter().flat_map(|kind| kind.nodes(node)).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// A search in progress.
pub(super) struct Search {
    /// The searching node.
    pub node: Node,
    _session: Session,
    kind: Kind,
    namespace: String,
    /// The name of the only node to search for; `None` if no name was given.
    only: Option<String>,
    all: bool,
    domain_id: u16,
    found: BTreeSet<String>,
    started: Instant,
    last: Instant,
}

impl Search {
    /// Starts a node called `name`, with which to search for `targets`.
    pub fn begin(name: &str, kind: Kind, targets: &Targets, ros_args: &RosArgs) -> super::Result<Self> {
        let names = Resolver::new(name, ros_args)?;
        let only = targets.node.as_ref().map(|node| names.service(node)).transpose()?;
        only.as_deref().map(NodeName::parse).transpose()?;
        let namespace = names.node().namespace().to_owned();
        let environment = Environment::from_process(ros_args)?;
        let session = Session::open(&environment)?;
        let node = session.node(names, Logging::new(ros_args, LogLevel::Warn))?;
        let now = Instant::now();
        let all = targets.all;
        Ok(Self {
            node,
            _session: session,
            kind,
            namespace,
            only,
            all,
            domain_id: environment.domain_id,
            found: BTreeSet::new(),
            started: now,
            last: now,
        })
    }

    /// Waits for the next target, and returns its name. Returns `None` once the only requested node has been returned, or once no
    /// further target has appeared for [`MORE`].
    ///
    /// # Errors
    /// An error if no node is found.
    pub async fn next(&mut self) -> super::Result<Option<String>> {
        loop {
            let there = self.kind.nodes(&self.node);
            let next = there.iter().find(|name| self.is_meant(name) && !self.found.contains(*name));
            if let Some(name) = next {
                self.found.insert(name.clone());
                self.last = Instant::now();
                super::warn(self.node.watch_name(name).warning().as_slice());
                return Ok(Some(name.clone()));
            }
            let only_one = self.only.is_some() && !self.found.is_empty();
            if only_one || !self.found.is_empty() && self.last.elapsed() > MORE {
                return Ok(None);
            }
            if self.found.is_empty() && self.started.elapsed() > PATIENCE {
                return self.nothing(&there);
            }
            self.node.graph_change().await;
        }
    }

    /// Returns whether the node `name` is a target. The simulated arms of a servo for two arms are targets too: their namespaces are
    /// `left` and `right` below the servo's namespace.
    fn is_meant(&self, name: &str) -> bool {
        let namespace = name.rsplit_once('/').map_or("", |(namespace, _)| namespace);
        let ours = self.namespace.trim_end_matches('/');
        let below = namespace.strip_prefix(ours).unwrap_or("?");
        match &self.only {
            Some(only) => only == name,
            None if self.all || below.is_empty() => true,
            None => self.kind == Kind::Plant && ["/left", "/right"].contains(&below),
        }
    }

    fn nothing(&self, there: &BTreeSet<String>) -> super::Result<Option<String>> {
        let (kind, seconds) = (self.kind.name(), PATIENCE.as_secs());
        let others = there.iter().cloned().collect::<Vec<_>>().join(", ");
        let where_ = match &self.only {
            Some(only) => format!("called {only}"),
            None if self.all => "in any namespace".to_owned(),
            None => format!("in the namespace {}", self.namespace),
        };
        match there.is_empty() {
            true => bail!(
                "no {kind} {where_} of domain {} within {seconds} s: is it running, and with the same ROS_DOMAIN_ID?",
                self.domain_id
            ),
            false => {
                bail!("no {kind} {where_} within {seconds} s, but there is {others} (name it, or --all)")
            }
        }
    }
}

/// Checks `name`, the argument that names the node. It is the name of a parameter if the user has left out the node.
///
/// # Errors
/// [`Usage`] if `name` is one of `parameters`, the names of all parameters.
pub(super) fn check_is_node(name: &str, parameters: &[&str], usage: &str) -> Result<(), Usage> {
    match parameters.contains(&name) {
        true => Err(Usage(format!(
            "{name:?} is a parameter, not a node: {usage} (a node of that name is /{name})"
        ))),
        false => Ok(()),
    }
}
