//! Nodes that have one name: ROS 2 lets them be, and whoever calls one may reach the other.

use super::topic::reply_topic;
use crate::dds::matches::Matches;
use rustdds::GUID;

/// Looks out for several nodes of one name, by the replies of a service that every node with parameters has.
pub struct NameWatch {
    matches: Matches,
    reply_topic: String,
    /// An endpoint of this process.
    ours: GUID,
    name: String,
    /// 1 where the name is this process's own node's.
    here: usize,
}

impl NameWatch {
    pub(super) fn new(matches: Matches, ours: GUID, name: &str, is_own: bool) -> Self {
        let reply_topic = reply_topic(&format!("{name}/list_parameters"));
        Self { matches, reply_topic, ours, name: name.to_owned(), here: usize::from(is_own) }
    }

    /// What to say where there are several, as far as discovery knows.
    pub fn warning(&self) -> Option<String> {
        let count = self.here + self.matches.remote_writers(&self.reply_topic, self.ours);
        (count > 1).then(|| {
            format!(
                "{count} nodes are called {}: each needs a name of its own (one that was killed counts for up to a minute)",
                self.name
            )
        })
    }
}
