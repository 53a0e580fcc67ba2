//! Tests that crates import in the order of the README, and that no files of a crate import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A module, given by the names on the path from the crate's root.
type Module = Vec<String>;

/// The modules of a crate, each a file.
#[derive(Default)]
struct Crate {
    files: BTreeMap<Module, File>,
}

struct File {
    path: PathBuf,
    /// The code without comments, tests and re-exports.
    code: String,
    /// The `use` statements, without their visibility.
    uses: Vec<String>,
    children: BTreeSet<String>,
}

impl Crate {
    fn read(root: &Path) -> Self {
        let mut read = Self::default();
        read.add(Vec::new(), root.to_owned(), root.parent().unwrap());
        read
    }

    fn add(&mut self, module: Module, path: PathBuf, folder: &Path) {
        let text = std::fs::read_to_string(&path).unwrap();
        let (text, _tests) = text.split_once("\n#[cfg(test)]\nmod tests {").unwrap_or((&text, ""));
        let lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let text: String = lines.flat_map(|line| [line, "\n"]).collect();
        let mut file = File { path, code: String::new(), uses: Vec::new(), children: BTreeSet::new() };
        for statement in text.split_inclusive(';') {
            let begun = statement.trim_start();
            let code = begun.lines().find(|line| !line.starts_with("#[")).unwrap_or_default();
            let public = code.starts_with("pub");
            let code = code.strip_prefix("pub").unwrap_or(code);
            let code =
                code.strip_prefix("(crate)").or(code.strip_prefix("(super)")).unwrap_or(code).trim_start();
            if let Some(name) = code.strip_prefix("mod ").and_then(|rest| rest.strip_suffix(';')) {
                file.children.insert(name.to_owned());
                continue;
            }
            if code.starts_with("use ") {
                let from = begun.find("use ").unwrap() + 4;
                file.uses.push(begun[from..].trim_end_matches(';').to_owned());
            }
            if !(public && code.starts_with("use ")) {
                file.code += statement;
            }
        }
        for name in file.children.clone() {
            let (flat, deep) = (folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs"));
            let child = [&module[..], std::slice::from_ref(&name)].concat();
            match flat.exists() {
                true => self.add(child, flat, &folder.join(&name)),
                false => self.add(child, deep, &folder.join(&name)),
            }
        }
        self.files.insert(module, file);
    }

    /// Returns the module to which `path` leads from `from`; `None` if it belongs to another crate.
    fn target(&self, from: &Module, path: &[String], depth: usize) -> Option<Module> {
        let mut at = match path.first()?.as_str() {
            "crate" => Vec::new(),
            "self" => from.clone(),
            "super" => from.split_last()?.1.to_vec(),
            child if self.files[from].children.contains(child) => from.clone(),
            _ => return None,
        };
        let skipped = usize::from(matches!(path[0].as_str(), "crate" | "self" | "super"));
        let mut rest = &path[skipped..];
        while let Some((name, after)) = rest.split_first() {
            if name == "super" {
                at.pop();
            } else if self.files[&at].children.contains(name) {
                at.push(name.clone());
            } else {
                break;
            }
            rest = after;
        }
        let Some(name) = rest.first().filter(|_| depth < 8) else { return Some(at) };
        // An item that a module imports belongs to the other module.
        let imported =
            self.files[&at].uses.iter().flat_map(|tree| paths(tree)).find(|(_, as_name)| as_name == name);
        match imported {
            Some((path, _)) => self.target(&at, &path, depth + 1),
            None => Some(at),
        }
    }

    /// Returns the modules from which `module` imports, including paths in the middle of its code.
    fn imports(&self, module: &Module) -> BTreeSet<Module> {
        let file = &self.files[module];
        let roots = ["crate", "super", "self"].into_iter().chain(file.children.iter().map(String::as_str));
        let mut found = BTreeSet::new();
        for root in roots {
            let start = format!("{root}::");
            for (at, _) in file.code.match_indices(&start) {
                let before = file.code[..at].chars().next_back().unwrap_or(' ');
                if before.is_alphanumeric() || "_:$.".contains(before) {
                    continue;
                }
                for (path, _) in paths(&file.code[at..]) {
                    found.extend(self.target(module, &path, 0));
                }
            }
        }
        found.remove(module);
        found
    }

    /// Returns a circle of files. Each file imports the next, and the last one imports the first.
    fn circle(&self) -> Option<Vec<&Path>> {
        let imports: BTreeMap<_, _> =
            self.files.keys().map(|module| (module, self.imports(module))).collect();
        let mut left = imports.clone();
        // A file that imports none of the remaining files is not in a circle.
        loop {
            let free: BTreeSet<Module> = left
                .iter()
                .filter(|(_, imports)| imports.iter().all(|other| !left.contains_key(other)))
                .map(|(module, _)| (*module).clone())
                .collect();
            if free.is_empty() {
                break;
            }
            left.retain(|module, _| !free.contains(*module));
        }
        let mut walked = vec![(*left.keys().next()?).clone()];
        loop {
            let next = left[walked.last()?].iter().find(|other| left.contains_key(other))?.clone();
            if let Some(first) = walked.iter().position(|module| *module == next) {
                let paths = walked[first..].iter().map(|module| self.files[module].path.as_path());
                return Some(paths.collect());
            }
            walked.push(next);
        }
    }
}

/// Returns the paths of a `use` tree at the beginning of `text`, with the names that they get.
fn paths(text: &str) -> Vec<(Vec<String>, String)> {
    let end = text.find(|c: char| !c.is_alphanumeric() && !"_:".contains(c)).unwrap_or(text.len());
    let (plain, rest) = text.split_at(end);
    let names: Vec<_> = plain.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect();
    if !plain.ends_with("::") || !rest.starts_with('{') {
        let own = names.last().cloned().unwrap_or_default();
        let renamed = rest.strip_prefix(" as ").map(|rest| {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            rest[..end].to_owned()
        });
        return vec![(names, renamed.unwrap_or(own))];
    }
    let (mut all, mut depth, mut begun) = (Vec::new(), 0, 1);
    for (at, character) in rest.char_indices() {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 || depth == 1 && character == ',' {
            let branch = rest[begun..at].trim();
            begun = at + 1;
            let of_branch = if branch.is_empty() { Vec::new() } else { paths(branch) };
            for (path, name) in of_branch {
                let itself = path.len() == 1 && path[0] == "self";
                let name = if itself { names.last().cloned().unwrap_or_default() } else { name };
                let path = if itself { names.clone() } else { [&names[..], &path].concat() };
                all.push((path, name));
            }
        }
        if depth == 0 {
            break;
        }
    }
    all
}

#[test]
fn files_of_a_crate_have_no_circular_imports() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let folders = std::fs::read_dir(&source).unwrap().map(|entry| entry.unwrap().path());
    let roots =
        folders.chain([source.clone(), source.join("params/derive")]).map(|folder| folder.join("lib.rs"));
    let circles = roots.filter(|root| root.exists()).filter_map(|root| {
        let read = Crate::read(&root);
        let circle = read.circle()?.into_iter().map(|path| path.strip_prefix(&source).unwrap().to_owned());
        Some(circle.collect::<Vec<_>>())
    });
    assert_eq!(circles.collect::<Vec<_>>(), Vec::<Vec<PathBuf>>::new());
}

#[test]
fn each_crate_imports_only_crates_above_it_in_the_readme() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let (_, map) = readme.split_once("## Map").unwrap();
    let named = map.split("](src/").skip(1).filter_map(|rest| rest.split_once(')'));
    // The crate that all other crates share is listed last.
    let mut above = vec!["common"];
    above.extend(named.map(|(name, _)| name).filter(|name| *name != "common"));
    for entry in std::fs::read_dir(root.join("src")).unwrap() {
        let folder = entry.unwrap().path();
        let Ok(manifest) = std::fs::read_to_string(folder.join("Cargo.toml")) else { continue };
        let name = folder.file_name().unwrap().to_str().unwrap();
        let own = above
            .iter()
            .position(|other| *other == name)
            .unwrap_or_else(|| panic!("{name} is not in the map"));
        let (_, dependencies) = manifest.split_once("\n[dependencies]\n").unwrap_or_default();
        let (dependencies, _) = dependencies.split_once("\n[").unwrap_or((dependencies, ""));
        for import in dependencies.lines().filter_map(|line| line.strip_prefix("dq_")) {
            let (import, _) = import.split_once(['.', ' ']).unwrap();
            assert!(above[..own].contains(&import) || import == "params_derive", "{name} imports {import}");
        }
    }
}

#[test]
fn a_circle_of_files_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a;\nmod b;\npub use b::B;\n");
    write("a.rs", "use super::B;\npub struct A;\n");
    write("b.rs", "pub struct B;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n");
    assert_eq!(Crate::read(&folder.path().join("lib.rs")).circle(), None);
    write("b.rs", "pub struct B;\nfn b() -> crate::a::A {}\n");
    let read = Crate::read(&folder.path().join("lib.rs"));
    let circle = read.circle().unwrap();
    assert_eq!(circle, ["a.rs", "b.rs"].map(|name| folder.path().join(name)));
}
