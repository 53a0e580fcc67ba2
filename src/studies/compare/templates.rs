//! The texts of the page "What the laws do", with names in braces for the values.

use std::fmt::Display;

/// Each text begins after a line `=== name`.
const TEMPLATES: &str = include_str!("page_templates.md");

/// Returns the text `name` with these values. A name in braces without a value stays as it is.
pub(super) fn fill(name: &str, values: &[(&str, &dyn Display)]) -> String {
    let mut pieces = template(name).split('{');
    let begin = pieces.next().unwrap_or_default().to_owned();
    pieces.fold(begin, |text, piece| match piece.split_once('}') {
        Some((name, rest)) => {
            let value = values.iter().find(|(known, _)| *known == name);
            text + &value.map_or(format!("{{{name}}}"), |(_, value)| value.to_string()) + rest
        }
        None => text + piece,
    })
}

/// Returns the text `name` without its last line end.
fn template(name: &str) -> &'static str {
    let named = |part: &'static str| part.split_once('\n').filter(|(its, _)| *its == name);
    let text = TEMPLATES.split("=== ").find_map(named).map_or("", |(_, text)| text);
    text.strip_suffix('\n').unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_filled_in_once() {
        let text = fill("arm_reversed", &[("law", &"{arm}"), ("arm", &"ur5e"), ("told", &2)]);
        assert_eq!(text, "`{arm}` on ur5e with 2 points");
    }
}
