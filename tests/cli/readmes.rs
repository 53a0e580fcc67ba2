//! Tests that the examples in the READMEs of the library crates compile in projects that depend only on what the README names.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn file(path: &str) -> String {
    std::fs::read_to_string(Path::new(ROOT).join(path)).unwrap()
}

/// Returns the code blocks of a page in this language.
fn blocks<'a>(page: &'a str, language: &str) -> Vec<&'a str> {
    let start = format!("\n```{language}");
    let after = page.split(&start).skip(1);
    after.map(|rest| rest.split_once('\n').unwrap().1.split("```").next().unwrap()).collect()
}

/// Returns the content of `main.rs` for an example. Like rustdoc, wraps an example without `main` in one, which returns the result that the
/// example ends with.
fn program(example: &str) -> String {
    let example = example.replace("\n# ", "\n");
    let error = example.split_once("Ok::<(), ").and_then(|(_, end)| end.split(">(())").next());
    match error {
        _ if example.contains("fn main()") => example,
        Some(error) => format!("fn main() -> Result<(), {error}> {{\n{example}}}\n"),
        None => format!("fn main() {{\n{example}}}\n"),
    }
}

/// Returns a workspace in which the crates of this repository replace those that are not on crates.io. It has the same profile, so that
/// common dependencies are compiled once.
fn workspace(members: &[&str]) -> String {
    let ours = file("Cargo.toml");
    let crates = ours.lines().filter(|line| line.starts_with("dq_") && line.contains("path = \"src/"));
    // A patch has no features.
    let crates = crates.map(|line| line.replace(", default-features = false", ""));
    let crates: Vec<_> = crates.map(|line| line.replace("\"src/", &format!("\"{ROOT}/src/"))).collect();
    let profile = &ours[ours.find("[profile.dev]").unwrap()..ours.find("[profile.release]").unwrap()];
    format!(
        "[workspace]\nresolver = \"3\"\nmembers = {members:?}\n\n[patch.crates-io]\n{}\n\n{profile}",
        crates.join("\n")
    )
}

/// Returns the folders of the library crates. The Python package has its example in Python, on the page Python of the guide.
fn library_crates() -> Vec<String> {
    let folders = Path::new(ROOT).join("src").read_dir().unwrap().map(|entry| entry.unwrap());
    let crates = folders.filter(|folder| folder.path().join("Cargo.toml").exists());
    let names =
        crates.map(|folder| folder.file_name().into_string().unwrap()).filter(|name| name != "python");
    names.collect()
}

#[test]
fn the_examples_of_each_crate_compile_in_a_project_of_its_readers() {
    let members = library_crates();
    let members: Vec<_> = members.iter().map(String::as_str).collect();
    let projects = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readmes");
    let write = |path: &str, text: &str| {
        let path = projects.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("Cargo.toml", &workspace(&members));
    write("Cargo.lock", &file("Cargo.lock"));
    for member in members {
        let page = file(&format!("src/{member}/README.md"));
        let [dependencies] = blocks(&page, "toml")[..] else { panic!("{member}: one block of dependencies") };
        let mut manifest =
            format!("[package]\nname = \"readme_{member}\"\nedition = \"2024\"\n\n{dependencies}");
        let examples = blocks(&page, "rust");
        assert!(!examples.is_empty(), "{member} has no example");
        for (number, example) in examples.into_iter().enumerate() {
            let name = format!("{member}_{number}");
            write(&format!("{member}/{name}.rs"), &program(example));
            write!(manifest, "\n[[bin]]\nname = \"{name}\"\npath = \"{name}.rs\"\n").unwrap();
        }
        write(&format!("{member}/Cargo.toml"), &manifest);
    }
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    let check = Command::new(env!("CARGO"))
        .args(["check", "--offline", "--quiet", "--workspace"])
        .current_dir(&projects)
        .env("CARGO_TARGET_DIR", target)
        .output()
        .unwrap();
    assert!(check.status.success(), "{}", String::from_utf8_lossy(&check.stderr));
}

/// `tests/dds` runs it.
#[test]
fn the_program_counter_is_the_example_of_the_readme() {
    let (page, program) = (file("src/ros/README.md"), file("src/ros/examples/counter.rs"));
    assert!(program.ends_with(blocks(&page, "rust")[0]), "src/ros/examples/counter.rs and the README differ");
}
