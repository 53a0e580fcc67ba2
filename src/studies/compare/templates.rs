//! The texts of the page "What the laws do", with names in braces for the values.

use std::collections::BTreeMap;

/// The texts of the page. Each text begins after a line `=== name`.
const TEMPLATES: &str = include_str!("page_templates.md");

/// The values that replace the names in braces in the texts.
pub(super) type Values = BTreeMap<&'static str, String>;

/// Returns the text `name` with these values; `None` if the text needs a value that is missing.
pub(super) fn fill(name: &str, values: &Values) -> Option<String> {
    let named = |part: &'static str| part.split_once('\n').filter(|(its, _)| *its == name);
    let (_, text) = TEMPLATES.split("=== ").find_map(named)?;
    let mut pieces = text.strip_suffix('\n').unwrap_or(text).split('{');
    let begin = pieces.next()?.to_owned();
    pieces.try_fold(begin, |text, piece| {
        let (name, rest) = piece.split_once('}')?;
        Some(text + values.get(name)? + rest)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_written_only_with_all_of_its_values() {
        let mut values = Values::from([("law", "{arm}".to_owned()), ("arm", "ur5e".to_owned())]);
        assert_eq!(fill("arm_reversed", &values), None);
        values.insert("told", "2 points".to_owned());
        assert_eq!(fill("arm_reversed", &values).as_deref(), Some("`{arm}` on ur5e with 2 points"));
    }
}
