//! The rooms of `src` as the README's map lists them: data flows one way.

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
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let rows = readme.lines().filter_map(|line| line.strip_prefix("| [`src/")?.split('`').next());
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
