//! Tests that the paths and cargo features that the pages name exist.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Appends the files of the folder, and of the folders in it, that `wanted` accepts.
fn files(folder: &Path, wanted: fn(&Path) -> bool, into: &mut Vec<PathBuf>) {
    for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => files(&path, wanted, into),
            false if wanted(&path) => into.push(path),
            false => {}
        }
    }
}

/// Returns the pages of the guide and the READMEs, each with its text.
fn pages() -> Vec<(PathBuf, String)> {
    let is_page = |path: &Path| {
        path.file_name().is_some_and(|name| name == "README.md") || path.parent().unwrap().ends_with("guide")
    };
    let mut pages = vec![Path::new(ROOT).join("README.md")];
    ["src", "tests"].iter().for_each(|folder| files(&Path::new(ROOT).join(folder), is_page, &mut pages));
    let read = |page: PathBuf| Some((page.clone(), std::fs::read_to_string(page).ok()?));
    pages.into_iter().filter_map(read).collect()
}

/// Returns the paths in a text that begin in a folder of the repository. A pattern such as `src/*/README.md` counts as its folder.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    const FOLDERS: [&str; 6] = ["src", "tests", "msg_config", "launch_scripts", ".ci", ".config"];
    let words = text.split(|end: char| end.is_whitespace() || "`\"'()[]|,;=".contains(end));
    let words = words.map(|word| word.trim_start_matches("./").trim_end_matches(['.', ':']));
    let of_ours =
        words.filter(|word| word.split_once('/').is_some_and(|(first, _)| FOLDERS.contains(&first)));
    of_ours.map(|word| {
        let fixed = word.find(['*', '{', '<', '…']).map_or(word, |end| &word[..end]);
        if fixed == word { word } else { fixed.rsplit_once('/').unwrap().0 }
    })
}

/// Returns the features in a text: `--features one,other`, or `one` after the word `feature`.
fn features(text: &str) -> impl Iterator<Item = &str> {
    let is_end = |end: char| !(end.is_alphanumeric() || "-_,".contains(end));
    let switches = text.split("--features ").skip(1).filter_map(move |rest| rest.split(is_end).next());
    let words = text.split("feature `").skip(1).filter_map(|rest| rest.split('`').next());
    switches.flat_map(|list| list.split(',')).chain(words)
}

/// Returns the features that the manifests of the workspace declare.
fn declared() -> BTreeSet<String> {
    let mut manifests = vec![Path::new(ROOT).join("Cargo.toml")];
    files(&Path::new(ROOT).join("src"), |path| path.ends_with("Cargo.toml"), &mut manifests);
    let read = |manifest: PathBuf| std::fs::read_to_string(manifest).unwrap();
    let declared = |text: String| -> Vec<String> {
        let Some((_, rest)) = text.split_once("\n[features]\n") else { return Vec::new() };
        let lines = rest.lines().take_while(|line| !line.starts_with('['));
        lines.filter_map(|line| Some(line.split_once(" = ")?.0.to_owned())).collect()
    };
    manifests.into_iter().map(read).flat_map(declared).collect()
}

#[test]
fn every_path_that_the_pages_name_is_there() {
    let mut seen = 0;
    for (page, text) in pages() {
        for path in paths(&text) {
            assert!(Path::new(ROOT).join(path).exists(), "{}: no {path}", page.display());
            seen += 1;
        }
    }
    assert!(seen > 40, "{seen}");
}

#[test]
fn every_feature_that_the_pages_name_is_declared() {
    let (declared, mut seen) = (declared(), BTreeSet::new());
    for (page, text) in pages() {
        for feature in features(&text) {
            assert!(declared.contains(feature), "{}: no feature {feature}", page.display());
            seen.insert(feature.to_owned());
        }
    }
    assert!(seen.len() > 1, "{seen:?}");
}

#[test]
fn names_in_a_text_are_found() {
    let text = "Run `tests/run.sh`: the pages (src/guide/*.md) and ./.ci/run, with a feature `tools` \
                or --features security,other; not /src/x.";
    assert_eq!(paths(text).collect::<Vec<_>>(), ["tests/run.sh", "src/guide", ".ci/run"]);
    assert_eq!(features(text).collect::<Vec<_>>(), ["security", "other", "tools"]);
}
