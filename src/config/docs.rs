//! The table of all parameters.

use super::{builtin, describes_arm, nodes};
use dq_params::{Declaration, ParameterError, Value};

const HEAD: &str = "\
| parameter | type | default | range | read-only | node | description |
|---|---|---|---|---|---|---|
";

/// Returns all parameters of all nodes as a Markdown table, from their declarations. A parameter has one row if several nodes
/// declare it identically.
///
/// The default in the table is the value in a node that starts without any settings. If that value comes from the built-in arm, the
/// table has the text "the arm's".
///
/// # Errors
/// The errors of [`nodes`].
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

    #[test]
    fn every_parameter_of_every_node_has_a_row() {
        let table = table().unwrap();
        for (node, declarations) in nodes().unwrap() {
            let rows = table.lines().skip(2).map(|row| row.split(" | ").collect::<Vec<_>>());
            let rows: Vec<_> = rows.filter(|row| row[5].split(", ").any(|name| name == node)).collect();
            let names: Vec<_> = rows.iter().map(|row| row[0].trim_matches(['|', ' ', '`'])).collect();
            assert!(names.iter().all(|name| declarations.iter().any(|declared| declared.name == *name)));
            assert!(rows.len() == declarations.len() && rows.iter().all(|row| row.len() == 7), "{node}");
        }
        for row in [
            "\n| `limits.linear_speed` | double | `2.0` | 0.000001 to 100 m/s |  | dq_servo, dq_dual_servo | largest speed of a tool point |",
            "\n| `update_rate` | integer | `500` | 1 to 2000 Hz | yes | dq_servo, dq_dual_servo, puma560, dq_servo_guard | rate of",
            "\n| `joints` | string array | the arm's |  | yes | dq_servo, dq_dual_servo, puma560, dq_servo_guard | joint names, base first |",
        ] {
            assert!(table.contains(row), "{row}");
        }
    }

    /// The safety page names parameters with their defaults, as in "`state_timeout`, 0.1 s".
    #[test]
    fn defaults_on_the_safety_page_are_those_declared() {
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
