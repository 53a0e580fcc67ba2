//! Reads ROS 2 parameter files.

use super::yaml::Yaml;
use super::{ParameterError, Value};
use dq_common::text_file;
use std::collections::BTreeSet;
use std::path::Path;

/// The length of the longest file that is read \[bytes\]. The file of a whole robot is about a hundred times shorter.
const LONGEST: u64 = 16 << 20;

/// A value that a file or an argument gives to a parameter when the node starts.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterOverride {
    /// The name of the parameter.
    pub name: String,
    /// The value of the parameter.
    pub value: Value,
    /// The file or the argument that gives the value.
    pub source: String,
    /// Whether the file or the argument names this node. If true, a parameter that the node does not have is an error. If false, the
    /// value is for every node, and a node without the parameter ignores the value, as in ROS 2. There is one exception: an unknown
    /// name in a namespace of this node's parameters, such as `limits.`, is always an error, because other nodes do not use these namespaces.
    pub by_name: bool,
}

/// The content of a ROS 2 parameter file for one node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileParameters {
    /// The values for the node, in the order of the file.
    pub given: Vec<ParameterOverride>,
    /// The node names, or patterns of node names, of all sections of the file.
    pub sections: Vec<String>,
}

impl ParameterOverride {
    /// Creates a value that `source` gives to every node.
    pub fn new(name: impl Into<String>, value: Value, source: impl Into<String>) -> Self {
        Self { name: name.into(), value, source: source.into(), by_name: false }
    }
}

impl FileParameters {
    /// Reads the file's values for the node with the full name `node`; see [`read`](Self::read).
    ///
    /// # Errors
    /// [`ParameterError::File`] if the file cannot be read or is not a parameter file.
    pub fn open(path: &Path, node: &str) -> Result<Self, ParameterError> {
        let file = path.display().to_string();
        match text_file::read(path, LONGEST) {
            Ok(text) => Self::read(&text, &file, node),
            Err(why) => Err(ParameterError::File { file, why: why.to_string() }),
        }
    }

    /// Reads the values for the node with the full name `node` from `text`, the text of a file called `file`.
    ///
    /// Node names may be nested or written with slashes. They may contain the wildcards `*` (one token) and `**` (any number of
    /// tokens). Names nested under `ros__parameters` are joined by dots. [`by_name`](ParameterOverride::by_name) is false for values
    /// from a section whose node name has a wildcard.
    ///
    /// # Errors
    /// [`ParameterError::File`] with the name `file` if the text is not a parameter file.
    pub fn read(text: &str, file: &str, node: &str) -> Result<Self, ParameterError> {
        let error = |why: String| ParameterError::File { file: file.to_owned(), why };
        let Yaml::Map(nodes) = Yaml::read(text).map_err(error)? else {
            return Err(error("expected node names, each with ros__parameters".to_owned()));
        };
        let mut reader = Reader { file, node, seen: BTreeSet::new(), found: Self::default() };
        reader.take_nodes(nodes, "").map_err(error)?;
        Ok(reader.found)
    }

    /// Returns whether the file has a section for the node with the full name `node`. The section may be empty.
    pub fn has_section_of(&self, node: &str) -> bool {
        self.sections.iter().any(|section| matches_node(section, node))
    }
}

/// Returns the names and values for the node `node` in `text`, as [`FileParameters::read`] finds them.
///
/// # Errors
/// [`ParameterError::File`] if the text is not a parameter file.
pub fn parameters_for(text: &str, file: &str, node: &str) -> Result<Vec<(String, Value)>, ParameterError> {
    let found = FileParameters::read(text, file, node)?;
    Ok(found.given.into_iter().map(|given| (given.name, given.value)).collect())
}

/// Reads a file for one node.
struct Reader<'a> {
    file: &'a str,
    node: &'a str,
    /// The parameters that were read so far, as pairs of section and name.
    seen: BTreeSet<(String, String)>,
    found: FileParameters,
}

impl Reader<'_> {
    fn take_nodes(&mut self, nodes: Vec<(String, Yaml)>, path: &str) -> Result<(), String> {
        for (name, content) in nodes {
            match (name.as_str(), content) {
                ("ros__parameters", Yaml::Map(parameters)) => {
                    self.found.sections.push(path.to_owned());
                    if matches_node(path, self.node) {
                        self.take_parameters(parameters, "", path)?;
                    }
                }
                ("ros__parameters", Yaml::Nothing) => self.found.sections.push(path.to_owned()),
                ("ros__parameters", _) => return Err(format!("ros__parameters of {path:?} is not a map")),
                (_, Yaml::Map(inner)) => {
                    let path = format!("{}/{}", path.trim_end_matches('/'), name.trim_matches('/'));
                    self.take_nodes(inner, &path)?;
                }
                _ => {
                    return Err(format!(
                        "{name:?} of {path:?} is not a node: expected a map with ros__parameters"
                    ));
                }
            }
        }
        Ok(())
    }

    fn take_parameters(&mut self, all: Vec<(String, Yaml)>, prefix: &str, path: &str) -> Result<(), String> {
        for (name, content) in all {
            let name = if prefix.is_empty() { name } else { format!("{prefix}.{name}") };
            match content {
                Yaml::Map(inner) => self.take_parameters(inner, &name, path)?,
                Yaml::Nothing => return Err(format!("parameter {name:?}: expected a value, got nothing")),
                Yaml::Value(value) => {
                    // The YAML parser rejects a name that occurs twice in the same spelling, but not a name in two spellings, such
                    // as nested and dotted.
                    if !self.seen.insert((path.to_owned(), name.clone())) {
                        return Err(format!(
                            "parameter {name:?} of {path:?} is given twice, in two spellings"
                        ));
                    }
                    let (source, by_name) = (self.file.to_owned(), !path.contains('*'));
                    self.found.given.push(ParameterOverride { name, value, source, by_name });
                }
            }
        }
        Ok(())
    }
}

/// Returns whether the node name `pattern` of a file matches `node`.
fn matches_node(pattern: &str, node: &str) -> bool {
    fn tokens(name: &str) -> Vec<&str> {
        name.split('/').filter(|token| !token.is_empty()).collect()
    }
    fn matches(pattern: &[&str], node: &[&str]) -> bool {
        match (pattern, node) {
            ([], []) => true,
            (["**", rest @ ..], _) => (0..=node.len()).any(|skip| matches(rest, &node[skip..])),
            (["*", rest @ ..], [_, others @ ..]) => matches(rest, others),
            ([first, rest @ ..], [name, others @ ..]) => first == name && matches(rest, others),
            _ => false,
        }
    }
    // Each `**` multiplies the time of matching. Real patterns have at most one `**`, so patterns with more than three match
    // nothing.
    let pattern = tokens(pattern);
    pattern.iter().filter(|token| **token == "**").count() <= 3 && matches(&pattern, &tokens(node))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn names(text: &str, node: &str) -> Vec<String> {
        parameters_for(text, "f.yaml", node).unwrap().into_iter().map(|(name, _)| name).collect()
    }

    #[test]
    fn sections_apply_to_the_nodes_they_name() {
        let text = "
            /**: {ros__parameters: {a: 1}}
            dq_servo: {ros__parameters: {b: {c: 2, d: [1.0]}}}
            left: {dq_servo: {ros__parameters: {e: 3}}}
            /left/dq_servo: {ros__parameters: {f: 3}}
            /*/dq_servo: {ros__parameters: {g: 3}}";
        assert_eq!(names(text, "/dq_servo"), ["a", "b.c", "b.d"]);
        assert_eq!(names(text, "/left/dq_servo"), ["a", "e", "f", "g"]);
        assert_eq!(names(text, "/x/y/other"), ["a"]);
    }

    /// A file for a whole robot may give other nodes infinite, undefined or huge numbers, and rcl accepts them.
    #[test]
    fn unusual_numbers_for_other_nodes_are_accepted() {
        let text = "
            lidar: {ros__parameters: {range_max: .inf, empty: -.inf, unknown: .nan, all: [1.0, .inf], id: 9223372036854775808}}
            dq_servo: {ros__parameters: {a: 1}}";
        assert_eq!(names(text, "/dq_servo"), ["a"]);
        let given = parameters_for(text, "f.yaml", "/lidar").unwrap();
        let huge = Value::Double(9_223_372_036_854_775_808.0);
        assert_eq!((&given[0].1, &given[4].1), (&Value::Double(f64::INFINITY), &huge));
    }

    #[test]
    fn errors_about_files_are_one_line() {
        for text in [
            "",
            "3",
            "a: 1",
            "a: {ros__parameters: 3}",
            "a: {ros__parameters: {b: [1, x]}}",
            "a: [",
            "\t- :",
            "a: {ros__parameters: {}}\na: {ros__parameters: {}}",
            "a: {ros__parameters: {}}\n---\nb: {ros__parameters: {}}",
            "a: {ros__parameters: {l.v: 1, l: {v: 2}}}",
            "a: {ros__parameters: {l: {v: 1}}}\n/a: {ros__parameters: {l: {v: 2}}}",
        ] {
            let message = parameters_for(text, "f.yaml", "/a").unwrap_err().to_string();
            assert!(message.starts_with("f.yaml: ") && !message.contains('\n'), "{message}");
            // The message must not contain the parser's advice for programmers.
            assert!(!message.contains("Options") && !message.contains("from_str"), "{message}");
        }
    }

    #[test]
    fn each_value_has_its_source_and_whether_it_is_given_by_name() {
        let text = "
            /**: {ros__parameters: {a: 1}}
            dq_servo: {ros__parameters: {b: {c: true}}}";
        let given = |name: &str, value, by_name| ParameterOverride {
            name: name.to_owned(),
            value,
            source: "f.yaml".to_owned(),
            by_name,
        };
        let found = FileParameters::read(text, "f.yaml", "/dq_servo").unwrap();
        let expected = [given("a", Value::Integer(1), false), given("b.c", Value::Bool(true), true)];
        assert_eq!(found.given, expected);
    }

    #[test]
    fn errors_name_the_line_of_a_wrong_list_or_tag() {
        for (bad, place) in
            [("[1, x]", "line 3"), ("!!int x", "line 3"), ("!!seq 3", "line 3"), ("[[1]]", "line 3")]
        {
            let text = format!("a:\n  ros__parameters:\n    b: {bad}\n    c: 1");
            let message = parameters_for(&text, "f.yaml", "/a").unwrap_err().to_string();
            assert!(message.contains(place), "{message}");
        }
    }

    /// Other nodes may use names that look like numbers: rcl accepts any scalar as a name.
    #[test]
    fn names_that_look_like_numbers_are_names() {
        assert_eq!(names("a: {ros__parameters: {1: {true: x}}}", "/a"), ["1.true"]);
    }

    #[test]
    fn an_empty_section_counts_as_a_section_of_its_node() {
        for (text, node, expected) in [
            ("a: {ros__parameters: }", "/a", true),
            ("/**: {ros__parameters: {}}", "/b/a", true),
            ("b: {ros__parameters: {}}", "/a", false),
        ] {
            assert_eq!(
                FileParameters::read(text, "f", node).unwrap().has_section_of(node),
                expected,
                "{text}"
            );
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "[a-z/*:{}\\[\\]\n ,_0-9.-]{0,200}") {
            let _ = parameters_for(&text, "f", "/n");
        }
    }
}
