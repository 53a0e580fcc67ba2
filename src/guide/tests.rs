//! The links of the README and of the guide lead somewhere: between files, as a forge shows them, and in rustdoc.

use std::path::{Path, PathBuf};

/// A page: its file, and what in rustdoc comes before its text.
struct Page {
    file: PathBuf,
    in_rustdoc: &'static str,
}

impl Page {
    fn text(&self) -> String {
        std::fs::read_to_string(&self.file).unwrap()
    }
}

fn pages() -> Vec<Page> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let in_folder = std::fs::read_dir(root.join("src/guide")).unwrap().map(|entry| entry.unwrap().path());
    let guide = in_folder.filter(|file| file.extension().is_some_and(|its| its == "md"));
    let readme = Page { file: root.join("README.md"), in_rustdoc: include_str!("../lib.rs") };
    let guide = guide.map(|file| Page { file, in_rustdoc: links!() });
    guide.chain([readme]).collect()
}

/// The targets of the links that have them in place, `[text](target)`.
fn inline(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| rest.split(')').next())
}

/// The labels of the links that have their targets elsewhere: `[text][label]`, or a label in quotes by itself.
fn labels(text: &str) -> impl Iterator<Item = &str> {
    let after = text.split("][").skip(1);
    let alone = text.match_indices("[`").map(|(at, _)| &text[at + 1..]);
    after.chain(alone).filter_map(|rest| rest.split(']').next())
}

/// Where `[label]: target` leads a label.
fn target<'a>(text: &'a str, label: &str) -> Option<&'a str> {
    let start = format!("[{label}]: ");
    text.lines().find_map(|line| line.trim_start_matches("//! ").strip_prefix(&start))
}

/// The anchors of a page's headings, which forges and rustdoc name alike.
fn has_anchor(page: &str, anchor: &str) -> bool {
    let headings = page.lines().filter(|line| line.starts_with('#'));
    let mut anchors = headings.map(|line| {
        let heading = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
        heading.replace(|character: char| !character.is_alphanumeric() && !"-_".contains(character), "")
    });
    anchors.any(|one| one == anchor)
}

/// Fails where a link of `page` to a file leads nowhere.
fn check_file(page: &Page, target: &str) {
    let (path, anchor) = target.split_once('#').map_or((target, None), |(path, anchor)| (path, Some(anchor)));
    let file = if path.is_empty() { page.file.clone() } else { page.file.with_file_name(path) };
    let shown = page.file.display();
    assert!(file.exists(), "{shown}: no file {target}");
    if let Some(anchor) = anchor {
        assert!(has_anchor(&std::fs::read_to_string(file).unwrap(), anchor), "{shown}: no heading {target}");
    }
}

#[test]
fn every_link_leads_to_a_file_and_in_rustdoc_to_that_page() {
    let mut seen = 0;
    for page in pages() {
        let (text, shown) = (page.text(), page.file.display());
        for target in inline(&text).filter(|target| !target.starts_with("http")) {
            assert!(target.starts_with('#'), "{shown}: rustdoc finds no file: give {target} a label");
            check_file(&page, target);
            seen += 1;
        }
        for label in labels(&text) {
            let file = target(&text, label).unwrap_or_else(|| panic!("{shown}: nothing defines {label:?}"));
            if file.starts_with("http") {
                continue;
            }
            check_file(&page, file);
            let there = target(page.in_rustdoc, label);
            let is_picture = file.ends_with(".png");
            assert!(
                is_picture || there.is_some_and(|there| there == in_rustdoc(file)),
                "{shown}: {label:?} is {there:?} in rustdoc"
            );
            seen += 1;
        }
    }
    assert!(seen > 20, "{seen}");
}

/// The module of a page's file or a room's folder.
fn in_rustdoc(file: &str) -> String {
    file.trim_start_matches("src/").replacen(".md", "", 1).replace('/', "::")
}

#[test]
fn every_page_is_in_rustdoc() {
    for page in
        pages().iter().filter(|page| page.file.starts_with(concat!(env!("CARGO_MANIFEST_DIR"), "/src")))
    {
        let name = page.file.file_stem().unwrap().to_str().unwrap();
        assert!(include_str!("mod.rs").contains(&format!("page!({name}, \"{name}.md\");")), "{name}");
    }
}
