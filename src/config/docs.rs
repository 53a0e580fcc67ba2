//! The table of all parameters.

use super::{builtin, describes_arm, nodes};
use dq_params::{Declaration, ParameterError, Value};

const HEAD: &str = "\
| parameter | type | default | range | read-only | node | description |
|---|---|---|---|---|---|---|
";

/// All parameters of all nodes as a table in Markdown, from their declarations. One that several nodes declare alike has one row.
///
/// The default is what a node has that is given nothing; "the arm's" where that is the built-in arm's own and goes with it.
///
/// # Errors
/// As [`nodes`].
pub fn table() -> Result<String, ParameterError> {
    let mut rows: Vec<(Declaration, Vec<&str>)> = Vec::new();
    for (node, declarations) in nodes()? {
        for declared in declarations {
            match rows.iter_mut().find(|(row, _)| *row == declared) {
                Some((_, nodes)) => nodes.push(node),
                None => rows.push((declared, vec![node])),
            }
        }
    }
    let builtin = builtin()?;
    let row = |(declared, nodes): &(Declaration, Vec<&str>)| row(declared, &nodes.join(", "), builtin);
    Ok(HEAD.to_owned() + &rows.iter().map(row).collect::<String>())
}

fn row(declared: &Declaration, nodes: &str, builtin: &[(String, Value)]) -> String {
    let Declaration { name, description, .. } = declared;
    let (kind, default, expected) =
        (declared.default.type_name(), default(declared, builtin), declared.expected());
    let read_only = if declared.read_only { "yes" } else { "" };
    format!("| `{name}` | {kind} | {default} | {expected} | {read_only} | {nodes} | {description} |\n")
}

fn default(declared: &Declaration, builtin: &[(String, Value)]) -> String {
    let builtin = builtin.iter().find(|(name, _)| *name == declared.name);
    if declared.required || (builtin.is_some() && describes_arm(declared)) {
        return "the arm's".to_owned();
    }
    format!("`{}`", builtin.map_or(&declared.default, |(_, value)| value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DualParameters, NodeParameters, PlantParameters, ServoParameters};

    /// The rows of the node with the name that stands in their column.
    fn rows(table: &str, node: &str) -> Vec<Vec<String>> {
        let rows = table.lines().skip(2).map(|row| row.trim_matches('|').split(" | ").map(str::trim));
        let rows = rows.map(|row| row.map(str::to_owned).collect::<Vec<_>>());
        rows.filter(|row| row[5].split(", ").any(|name| name == node)).collect()
    }

    /// What a node has that is started with nothing.
    fn check<P: NodeParameters>() {
        let (store, _) = P::start(&format!("/{}", P::NODE_NAME), Vec::new()).unwrap();
        let rows = rows(&table().unwrap(), P::NODE_NAME);
        assert_eq!(rows.len(), store.iter().count());
        for (declared, value) in store.iter() {
            let row = rows.iter().find(|row| row[0] == format!("`{}`", declared.name)).unwrap();
            assert_eq!(row.len(), 7, "{row:?}");
            let of_arm = declared.required || (describes_arm(declared) && *value != declared.default);
            let default = if of_arm { "the arm's".to_owned() } else { format!("`{value}`") };
            let expected = [
                row[0].clone(),
                value.type_name().to_owned(),
                default,
                declared.expected(),
                if declared.read_only { "yes" } else { "" }.to_owned(),
            ];
            assert_eq!(row[..5], expected);
            assert_eq!(row[6], declared.description);
        }
    }

    #[test]
    fn the_table_has_what_each_node_declares_and_nothing_else() {
        check::<ServoParameters>();
        check::<DualParameters>();
        check::<PlantParameters>();
        assert!(table().unwrap().contains(
            "\n| `limits.linear_speed` | double | `2.0` | 0.000001 to 100 m/s |  | dq_servo, dq_dual_servo | largest speed of a tool point |"
        ));
    }

    /// The safety rules name parameters with their defaults, as in "`state_timeout`, 0.1 s".
    #[test]
    fn defaults_that_the_rules_name_are_those_declared() {
        let rules = include_str!("../guide/safety.md");
        let mut named = 0;
        for declared in nodes().unwrap().iter().flat_map(|(_, declarations)| declarations) {
            let default = declared.default.to_string().parse::<f64>();
            for after in rules.split(&format!("`{}`, ", declared.name)).skip(1) {
                let word = after.split_whitespace().next().unwrap_or_default();
                if let Ok(number) = word.trim_end_matches([',', ':', ';', '.']).parse::<f64>() {
                    assert_eq!(default, Ok(number), "{}: {word}", declared.name);
                    named += 1;
                }
            }
        }
        assert!(named >= 8, "{named}");
    }
}
