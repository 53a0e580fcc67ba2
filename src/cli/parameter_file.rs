//! Writes parameter files from a running node, and loads them into one.

use super::Usage;
use dq_params::{FileParameters, ParameterOverride, Value, shares_namespace};
use dq_ros::ros::ParameterClient;
use dq_ros::stderr;
use std::path::Path;

/// Returns a parameter file with these values for the node `target`. The names are nested as in a file of `ros2 param dump`.
pub(super) fn text(target: &str, values: &[(String, Value)]) -> String {
    let mut sorted: Vec<_> = values.iter().collect();
    sorted.sort_by(|a, b| a.0.split('.').cmp(b.0.split('.')));
    let mut lines = vec![format!("{target}:"), "  ros__parameters:".to_owned()];
    let mut groups: Vec<&str> = Vec::new();
    for (name, value) in sorted {
        let mut path: Vec<_> = name.split('.').collect();
        let leaf = path.pop().unwrap_or_default();
        let common = path.iter().zip(&groups).take_while(|(a, b)| a == b).count();
        for (depth, group) in path.iter().enumerate().skip(common) {
            lines.push(format!("{:indent$}{group}:", "", indent = 4 + 2 * depth));
        }
        lines.push(format!("{:indent$}{leaf}: {value}", "", indent = 4 + 2 * path.len()));
        groups = path;
    }
    lines.join("\n")
}

/// Reads the parameters for the node `target` from the file.
pub(super) fn read(file: &str, target: &str) -> super::Result<Vec<ParameterOverride>> {
    let FileParameters { given, sections } = FileParameters::open(Path::new(file), target)?;
    match given.is_empty() {
        true => Err(Usage(format!("{file} has nothing for {target}: its sections are {sections:?}")).into()),
        false => Ok(given),
    }
}

/// Sets those parameters of `given` that differ from the node's present values. Sets none if the node refuses any of them.
pub(super) async fn load(
    mut parameters: ParameterClient<'_>,
    given: Vec<ParameterOverride>,
) -> super::Result<()> {
    let (now, own) = (parameters.all().await?, dq_config::names()?);
    let (total, mut changes) = (given.len(), Vec::<(String, Value)>::new());
    for ParameterOverride { name, value, by_name, .. } in given {
        let current = now.iter().find(|(known, _)| *known == name).map(|(_, value)| value);
        let is_ours = shares_namespace(&name, own.iter().copied()) && !own.contains(&&*name);
        if current.is_none() && !by_name && !is_ours {
            stderr::line(format!("warning: the node has no parameter {name:?}: ignored"));
            continue;
        }
        let value =
            current.map_or(Ok(value.clone()), |like| value.clone().convert_like(like)).unwrap_or(value);
        changes.retain(|(before, _)| *before != name);
        if current != Some(&value) {
            changes.push((name, value));
        }
    }
    if !changes.is_empty() {
        parameters.set_all(&changes).await?.map_err(Usage)?;
    }
    stderr::line(format!(
        "{} of {total} parameters set; the others already had these values, or are not this node's",
        changes.len()
    ));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_config::{NodeParameters, ServoParameters};
    use dq_params::parameters_for;

    #[test]
    fn a_dump_reads_back_unchanged() {
        let (store, _) = ServoParameters::start("/left/dq_servo", Vec::new()).unwrap();
        let mut values: Vec<_> = store.values().collect();
        values.push(("b.c.d".to_owned(), Value::String("no".to_owned())));
        values.push(("b.a".to_owned(), Value::StringArray(vec!["x, y".to_owned()])));
        let text = text("/left/dq_servo", &values);
        assert!(text.contains("    gains:\n      diffc: 185.0\n"), "{text}");
        let mut read = parameters_for(&text, "dump", "/left/dq_servo").unwrap();
        read.sort_by(|a, b| a.0.cmp(&b.0));
        values.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(read.len(), values.len());
        for (read, value) in read.into_iter().zip(values) {
            assert_eq!((read.0, read.1.convert_like(&value.1)), (value.0, Ok(value.1)));
        }
    }
}
