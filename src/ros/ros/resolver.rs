//! Resolves a node's names: expansion and remapping by the command line.

use super::args::{LogLevel, LoggerLevel, Remap, RosArgs};
use super::names::{NameError, NodeName, check_absolute, join};

/// The kind of name to which a remapping rule is applied.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Topic,
    Service,
}

/// The names of a node, after the remappings of the command line.
#[derive(Clone, Debug)]
pub struct Resolver {
    node: NodeName,
    rules: Vec<Remap>,
    logger_levels: Vec<LoggerLevel>,
}

impl Resolver {
    /// Creates the names of a node that is called `default_name` unless the command line renames it.
    ///
    /// # Errors
    /// [`NameError`] if a rule has an invalid name.
    pub fn new(default_name: &str, args: &RosArgs) -> Result<Self, NameError> {
        let of = |node: &str| {
            let is_of = |rule: &&Remap| rule.node.as_deref().is_none_or(|only| only == node);
            args.remaps.iter().filter(is_of).cloned().collect::<Vec<_>>()
        };
        let special = |rules: Vec<Remap>, key: &str, default: &str| {
            rules.into_iter().find(|rule| rule.from == key).map_or(default.to_owned(), |rule| rule.to)
        };
        let name = special(of(default_name), "__node", default_name);
        // As in rcl, later rules refer to the node by its new name.
        let node = NodeName::new(&special(of(&name), "__ns", "/"), &name)?;
        let mut rules = of(&name);
        rules.retain(|rule| rule.from != "__ns" && rule.from != "__node");
        let resolver = Self { node, rules, logger_levels: args.logger_levels.clone() };
        for Remap { from, to, .. } in &resolver.rules {
            resolver.expand(without_scheme(from), "name to remap from")?;
            resolver.expand(to, "name to remap to")?;
        }
        Ok(resolver)
    }

    /// Returns the node's name.
    pub fn node(&self) -> &NodeName {
        &self.node
    }

    /// Returns the name of the node's logger: the node's fully qualified name, with dots. `/left/dq_servo` logs as `left.dq_servo`.
    pub(super) fn logger(&self) -> String {
        self.node.fully_qualified().trim_start_matches('/').replace('/', ".")
    }

    /// Returns the log level that the command line sets for the node's logger. If the command line does not set this level, the
    /// level of the closest parent logger applies, for example that of `left` for `left.dq_servo`. `None` if no parent has a level.
    /// If the command line sets the level of a logger several times, the last value counts.
    pub(super) fn log_level(&self) -> Option<LogLevel> {
        let logger = self.logger();
        let has_it = |above: &str| {
            logger.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let levels = self.logger_levels.iter().filter(|above| has_it(&above.logger));
        levels.max_by_key(|above| above.logger.len()).map(|above| above.level)
    }

    /// Returns the fully qualified name of a topic.
    ///
    /// # Errors
    /// [`NameError`] if the name is invalid.
    pub fn topic(&self, name: &str) -> Result<String, NameError> {
        self.resolve(name, Kind::Topic)
    }

    /// Returns the fully qualified name of a service.
    ///
    /// # Errors
    /// [`NameError`] if the name is invalid.
    pub fn service(&self, name: &str) -> Result<String, NameError> {
        self.resolve(name, Kind::Service)
    }

    /// Expands `name` and applies the first rule that matches. No second rule is applied to the result.
    fn resolve(&self, name: &str, kind: Kind) -> Result<String, NameError> {
        let label = if kind == Kind::Topic { "topic name" } else { "service name" };
        let expanded = self.expand(name, label)?;
        for Remap { from, to, .. } in &self.rules {
            let other_scheme = if kind == Kind::Topic { "rosservice://" } else { "rostopic://" };
            if !from.starts_with(other_scheme) && self.expand(without_scheme(from), label)? == expanded {
                return self.expand(to, label);
            }
        }
        Ok(expanded)
    }

    /// Expands a name to a fully qualified name. The name may be relative, begin with `~`, or contain `{node}`, `{ns}` or
    /// `{namespace}`.
    fn expand(&self, name: &str, kind: &'static str) -> Result<String, NameError> {
        let error = |why| NameError { name: name.to_owned(), kind, why };
        let fully_qualified = self.node.fully_qualified();
        let expanded = match name.strip_prefix('~') {
            Some("") => fully_qualified,
            Some(rest) if rest.starts_with('/') => fully_qualified + rest,
            Some(_) => return Err(error("expected a slash after ~")),
            None => name.to_owned(),
        };
        // The namespace without a trailing slash; an empty text for the root.
        let namespace = self.node.namespace().trim_end_matches('/');
        let expanded = expanded
            .replace("{node}", self.node.name())
            .replace("{ns}", namespace)
            .replace("{namespace}", namespace);
        let absolute =
            if expanded.starts_with('/') { expanded } else { join(self.node.namespace(), &expanded) };
        check_absolute(&absolute, kind).map_err(|bad| error(bad.why))?;
        Ok(absolute)
    }
}

fn without_scheme(name: &str) -> &str {
    name.trim_start_matches("rostopic://").trim_start_matches("rosservice://")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::args;
    use proptest::prelude::*;

    fn resolver(line: &str) -> Resolver {
        let (_, args) =
            args::split(format!("--ros-args {line}").split_whitespace().map(str::to_owned)).unwrap();
        Resolver::new("dq_servo", &args).unwrap()
    }

    #[test]
    fn names_expand_as_in_ros_2() {
        let root = resolver("");
        assert_eq!(root.topic("goal_pose").unwrap(), "/goal_pose");
        assert_eq!(root.topic("~/status").unwrap(), "/dq_servo/status");
        let left = resolver("-r __ns:=/left -r __node:=a");
        assert_eq!(left.topic("goal_pose").unwrap(), "/left/goal_pose");
        assert_eq!(left.topic("/tf").unwrap(), "/tf");
        assert_eq!(left.service("~/stop").unwrap(), "/left/a/stop");
        assert_eq!(left.topic("{node}/x").unwrap(), "/left/a/x");
        // A namespace includes its leading slash, as in rcl.
        for name in ["{ns}/x", "{namespace}/x"] {
            assert_eq!(
                (left.topic(name).unwrap(), root.topic(name).unwrap()),
                ("/left/x".into(), "/x".into())
            );
        }
        assert!(left.topic("/{ns}/x").is_err(), "//left/x");
        assert_eq!(left.node().fully_qualified(), "/left/a");
        assert_eq!(resolver("-r __ns:=/").topic("a").unwrap(), "/a");
        assert_eq!(resolver("-r __ns:=left").topic("a").unwrap(), "/left/a");
    }

    #[test]
    fn the_first_rule_that_fits_applies_to_its_kind_and_node() {
        let names = resolver(
            "-r goal_pose:=/g -r goal_pose:=/h -r other:joint_states:=/no -r rosservice://~/stop:=halt",
        );
        assert_eq!(names.topic("goal_pose").unwrap(), "/g");
        assert_eq!(names.topic("joint_states").unwrap(), "/joint_states");
        assert_eq!(names.service("~/stop").unwrap(), "/halt");
        assert_eq!(names.topic("~/stop").unwrap(), "/dq_servo/stop");
        let swap = resolver("-r a:=b -r b:=a");
        assert_eq!((swap.topic("a").unwrap(), swap.topic("b").unwrap()), ("/b".into(), "/a".into()));
    }

    #[test]
    fn a_node_is_renamed_by_its_own_name_and_all_other_rules_know_it_by_the_new_one() {
        let line =
            "-r dq_servo:__node:=a -r dq_servo:x:=/old -r a:x:=/new -r a:__ns:=/left -r dq_servo:__ns:=/no";
        let names = resolver(line);
        assert_eq!(
            (names.node().fully_qualified(), names.topic("x").unwrap()),
            ("/left/a".into(), "/new".into())
        );
        let names = resolver("-r a:__node:=b -r dq_servo:x:=/own -r __name:=dq_servo");
        assert_eq!(
            (names.node().fully_qualified(), names.topic("x").unwrap()),
            ("/dq_servo".into(), "/own".into())
        );
    }

    #[test]
    fn a_level_of_one_logger_is_that_of_the_nodes_in_it() {
        let line = "--log-level warn --log-level left:=error --log-level left.a:=debug --log-level rcl:=fatal \
                    --log-level left.a:=info";
        let level = |names: &str| resolver(&format!("{names} {line}")).log_level();
        assert_eq!(level("-r __ns:=/left -r __node:=a"), Some(LogLevel::Info));
        assert_eq!(level("-r __ns:=/left -r __node:=ab"), Some(LogLevel::Error));
        assert_eq!([level(""), level("-r __ns:=/leftover")], [None; 2]);
    }

    #[test]
    fn invalid_names_are_rejected_with_a_reason() {
        for bad in ["", "a b", "1a", "a//b", "a/", "~x", "/", "a__b", "é"] {
            assert!(resolver("").topic(bad).is_err(), "{bad:?}");
        }
        for bad in ["", "a/b", "a-b", "1"] {
            assert!(NodeName::new("/", bad).is_err(), "{bad:?}");
        }
        assert!(NodeName::new("/a//b", "n").is_err());
    }

    proptest! {
        #[test]
        fn no_text_panics(name in ".{0,40}") {
            let _ = resolver("-r __ns:=/left").topic(&name);
            let _ = NodeName::parse(&name);
        }
    }
}
