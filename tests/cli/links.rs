//! Tests that the links of the README and of the guide lead somewhere.

use std::path::{Path, PathBuf};

fn pages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let in_folder = std::fs::read_dir(root.join("src/guide")).unwrap().map(|entry| entry.unwrap().path());
    let guide = in_folder.filter(|file| file.extension().is_some_and(|its| its == "md"));
    guide.chain([root.join("README.md")]).collect()
}

/// Returns the targets of inline links, `[text](target)`.
fn inline(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| rest.split(')').next())
}

/// Returns the labels of reference links: `[text][label]`, or a quoted label alone.
fn labels(text: &str) -> impl Iterator<Item = &str> {
    let after = text.split("][").skip(1);
    let alone = text.match_indices("[`").map(|(at, _)| &text[at + 1..]);
    after.chain(alone).filter_map(|rest| rest.split(']').next())
}

/// Returns the target of a label, from `[label]: target`.
fn target<'a>(text: &'a str, label: &str) -> Option<&'a str> {
    let start = format!("[{label}]: ");
    text.lines().find_map(|line| line.strip_prefix(&start))
}

/// Returns whether a heading of the page has this anchor, as a forge would give it.
fn has_anchor(page: &str, anchor: &str) -> bool {
    let headings = page.lines().filter(|line| line.starts_with('#'));
    let mut anchors = headings.map(|line| {
        let heading = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
        heading.replace(|character: char| !character.is_alphanumeric() && !"-_".contains(character), "")
    });
    anchors.any(|one| one == anchor)
}

/// Fails if a link of `page` to a file leads nowhere.
fn check_file(page: &Path, target: &str) {
    let (path, anchor) = target.split_once('#').map_or((target, None), |(path, anchor)| (path, Some(anchor)));
    let file = if path.is_empty() { page.to_owned() } else { page.with_file_name(path) };
    let shown = page.display();
    assert!(file.exists(), "{shown}: no file {target}");
    if let Some(anchor) = anchor {
        assert!(has_anchor(&std::fs::read_to_string(file).unwrap(), anchor), "{shown}: no heading {target}");
    }
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let mut seen = 0;
    for page in pages() {
        let (text, shown) = (std::fs::read_to_string(&page).unwrap(), page.display());
        let of_labels = labels(&text).map(|label| {
            target(&text, label).unwrap_or_else(|| panic!("{shown}: nothing defines {label:?}"))
        });
        for target in inline(&text).chain(of_labels).filter(|target| !target.starts_with("http")) {
            check_file(&page, target);
            seen += 1;
        }
    }
    assert!(seen > 20, "{seen}");
}
