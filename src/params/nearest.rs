//! Finds the known name that is most similar to a misspelled name.

/// The length of the longest misspelled name for which [`nearest`] looks for a similar name \[bytes\].
const LONGEST: usize = 200;

/// Returns the name among `known` that shares the most pairs of neighboring letters with `name`. Returns `None` if no known name is
/// similar enough.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if name.len() > LONGEST {
        return None;
    }
    let scored = known.into_iter().map(|known| (strsim::sorensen_dice(known, name), known));
    let (score, best) = scored.max_by(|one, other| one.0.total_cmp(&other.0))?;
    (score >= 0.5).then_some(best)
}

/// Returns whether `name` equals one of the names `known` after a change of at most a quarter of its letters.
pub fn is_misspelt<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> bool {
    known.into_iter().any(|known| 4 * strsim::damerau_levenshtein(name, known) <= name.len())
}

/// Returns whether `name` is a namespace of the names `known`, or a name in such a namespace. For example, `limits` and `limits.x`
/// share the namespace of `limits.y`.
pub fn shares_namespace<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> bool {
    let namespace = |name: &'a str| name.split_once('.').map(|(namespace, _)| namespace);
    let own = name.split('.').next();
    known.into_iter().any(|known| namespace(known) == own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_misspelt_if_it_resembles_another_but_not_if_it_is_another() {
        let known = ["controller", "joints", "robot_file", "limits.joint_velocity"];
        for name in ["controler", "contorller", "joint", "limits.joint_velocty"] {
            assert!(is_misspelt(name, known), "{name}");
        }
        for name in ["nope", "robot_name", "joint_names", "velocity", ""] {
            assert!(!is_misspelt(name, known), "{name}");
        }
        assert!(shares_namespace("limits.x", known) && shares_namespace("limits", known));
        assert!(!shares_namespace("joints", known) && !shares_namespace("joints.x", known));
    }
}
