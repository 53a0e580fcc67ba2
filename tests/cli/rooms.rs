//! The rooms of `src` as the page "Architecture" lists them: data flows one way.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The code of a file without comments and tests.
fn code(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The files of a folder that are no tests.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = folder.read_dir().unwrap().map(|entry| entry.unwrap().path());
    let of = |path: PathBuf| if path.is_dir() { files(&path) } else { vec![path] };
    entries.flat_map(of).filter(|path| !path.ends_with("tests.rs")).collect()
}

#[test]
fn a_room_imports_only_rooms_that_the_map_lists_before_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("src/guide/architecture.md")).unwrap();
    let rows = page.lines().filter_map(|line| line.strip_prefix("| [`src/")?.split('`').next());
    let rooms: Vec<_> = rows.filter(|room| *room != "guide").collect();
    let mut imports = 0;
    for (number, room) in rooms.iter().enumerate() {
        for file in
            files(&root.join("src").join(room)).iter().filter(|file| file.extension().unwrap() == "rs")
        {
            for path in code(file).split("crate::").skip(1) {
                let other = path.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap();
                let place = rooms.iter().position(|room| *room == other);
                assert!(
                    place.is_none_or(|place| place <= number),
                    "{}: {room} imports {other}",
                    file.display()
                );
                imports += usize::from(place.is_some());
            }
        }
    }
    assert!(rooms.len() > 17 && imports > 300, "{rooms:?}, {imports} imports");
}

/// The files of a room by the path of their module, and their code.
fn modules(room: &Path) -> BTreeMap<Vec<String>, String> {
    let of_file = |file: PathBuf| {
        let path = file.strip_prefix(room).unwrap().with_extension("");
        let parts = path.iter().map(|part| part.to_str().unwrap().to_owned());
        (parts.filter(|part| part != "mod").collect(), code(&file))
    };
    let files = files(room).into_iter().filter(|file| file.extension().is_some_and(|kind| kind == "rs"));
    files.map(of_file).collect()
}

/// The paths of a `use` item: `super::{a::B, c}` gives `super::a::B` and `super::c`.
fn paths(item: &str) -> Vec<Vec<String>> {
    let mut paths = vec![String::new()];
    let mut stack = vec![String::new()];
    for character in item.chars().filter(|character| !character.is_whitespace()) {
        match character {
            '{' => stack.push(paths.pop().unwrap()),
            '}' => drop(stack.pop()),
            ',' => {}
            _ => {
                paths.last_mut().into_iter().for_each(|path| path.push(character));
                continue;
            }
        }
        paths.push(stack.last().unwrap().clone());
    }
    let split = |path: &String| path.split("::").map(str::to_owned).collect();
    paths.iter().filter(|path| !path.ends_with("::")).map(split).collect()
}

/// The items of this code's `use` lines.
fn uses(code: &str) -> impl Iterator<Item = Vec<String>> {
    let items = code.split(';').filter_map(|line| {
        let (before, item) = line.rsplit_once("use ")?;
        let begins = before.is_empty()
            || ["\n", "\npub ", "\npub(super) ", "\npub(crate) "].iter().any(|end| before.ends_with(end));
        begins.then_some(item)
    });
    items.flat_map(paths)
}

/// The module of a room that a path in `from` means; what a module hands on of another is of that one.
fn target<'m>(
    modules: &'m BTreeMap<Vec<String>, String>,
    room: &str,
    from: &[String],
    path: &[String],
) -> Option<&'m Vec<String>> {
    let ups = path.iter().take_while(|part| *part == "super").count();
    let (base, rest): (Vec<String>, _) = match path.first()?.as_str() {
        "crate" if path.get(1).is_some_and(|part| part == room) => (Vec::new(), &path[2..]),
        "super" if ups <= from.len() => (from[..from.len() - ups].to_vec(), &path[ups..]),
        _ => return None,
    };
    let (name, mut module) = (rest.first()?, base.clone());
    for part in rest {
        module.push(part.clone());
        if !modules.contains_key(&module) {
            module.pop();
        }
    }
    let handed_on = || {
        let of_it = uses(modules.get(&base)?)
            .find(|of| of.last() == Some(name) && of[0] != "super" && of[0] != "crate")?;
        modules.get_key_value(&[base.clone(), of_it[..of_it.len() - 1].to_vec()].concat())
    };
    let found = if module == base { handed_on() } else { modules.get_key_value(&module) };
    found.map(|(module, _)| module).filter(|module| !from.starts_with(module))
}

#[test]
fn no_files_of_a_room_import_each_other_in_a_circle() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut imports = 0;
    for room in root.read_dir().unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir()) {
        let (modules, name) = (modules(&room), room.file_name().unwrap().to_str().unwrap());
        let mut arrows: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
        for (module, code) in &modules {
            let targets = uses(code).filter_map(|path| target(&modules, name, module, &path));
            arrows.insert(module, targets.filter(|target| *target != module).collect());
        }
        imports += arrows.values().map(BTreeSet::len).sum::<usize>();
        // Who imports nobody that is left goes; a circle stays.
        loop {
            let leaves: Vec<_> =
                arrows.iter().filter(|(_, of)| of.is_empty()).map(|(module, _)| *module).collect();
            if leaves.is_empty() {
                break;
            }
            leaves.iter().for_each(|leaf| drop(arrows.remove(leaf)));
            arrows.values_mut().for_each(|of| of.retain(|target| !leaves.contains(target)));
        }
        assert!(arrows.is_empty(), "{name}: {arrows:?}");
    }
    assert!(imports > 500, "{imports} imports");
}
