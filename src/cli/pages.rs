//! Tests that the README and the guide name only existing commands, switches and tests.

use super::Cli;
use clap::CommandFactory;
use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Appends to `into` the text of every file with this extension in the folder and its subfolders.
fn read(folder: &Path, extension: &str, into: &mut String) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            read(&entry, extension, into);
        } else if entry.extension().is_some_and(|its| its == extension) {
            into.push_str(&std::fs::read_to_string(&entry).unwrap());
        }
    }
}

/// Returns the command lines of this program in the shell blocks of the pages, without the ROS arguments.
fn command_lines(pages: &str) -> impl Iterator<Item = Vec<&str>> {
    let blocks = pages.split("```sh\n").skip(1);
    let lines = blocks.flat_map(|block| block.split("```").next().unwrap_or_default().lines());
    let ours = lines.filter_map(|line| line.strip_prefix("dq_servo "));
    ours.map(|line| {
        let words = line.split_whitespace();
        words.take_while(|word| !["#", "--ros-args", "&&", ">", "|"].contains(word)).collect()
    })
}

#[test]
fn every_command_and_switch_of_the_pages_is_one_of_the_program() {
    let mut program = Cli::command();
    // The subcommand `help` exists only after this call.
    program.build();
    let mut pages = include_str!("../../README.md").to_owned();
    read(&root().join("src/guide"), "md", &mut pages);
    let mut seen = 0;
    for words in command_lines(&pages) {
        let command = words.first().and_then(|name| program.find_subcommand(name));
        let command = command.unwrap_or_else(|| panic!("no such command: {words:?}"));
        for switch in words.iter().filter_map(|word| word.strip_prefix("--")).filter(|it| !it.is_empty()) {
            let known = command.get_arguments().any(|argument| argument.get_long() == Some(switch));
            assert!(known, "no such switch: --{switch} in {words:?}");
        }
        seen += 1;
    }
    assert!(seen > 20, "{seen}");
}

#[test]
fn every_test_that_the_safety_page_names_is_there() {
    let mut code = String::new();
    ["src", "tests"].iter().for_each(|folder| read(&root().join(folder), "rs", &mut code));
    // The name of a test is the name of a function, or the part before the arrow in a row of a table of cases.
    let of_functions = code.split("fn ").skip(1).filter_map(|rest| rest.split('(').next());
    let of_rows =
        code.lines().filter_map(|line| line.trim_start().split_once(" => \"")).map(|(name, _)| name);
    let names: Vec<_> = of_functions.chain(of_rows).collect();
    let page = include_str!("../guide/safety.md");
    let mentioned = page.split([' ', ',', ';', '|', '\n']).filter(|word| word.contains('…'));
    let mut seen = 0;
    for word in mentioned {
        let part = word.trim_matches('…');
        assert!(names.iter().any(|name| name.contains(part)), "no such test: {word}");
        seen += 1;
    }
    assert!(seen > 40, "{seen}");
}

/// Appends every text in a JSON document to `into`.
fn texts<'a>(of: &'a serde_json::Value, into: &mut Vec<&'a str>) {
    match of {
        serde_json::Value::String(text) => into.push(text),
        serde_json::Value::Array(list) => list.iter().for_each(|one| texts(one, into)),
        serde_json::Value::Object(fields) => fields.iter().for_each(|(key, one)| {
            into.push(key);
            texts(one, into);
        }),
        _ => {}
    }
}

#[test]
fn the_layouts_for_rviz_and_foxglove_name_only_existing_topics_and_services() {
    let rviz: serde_json::Value =
        serde_saphyr::from_str(include_str!("../../launch_scripts/dq_servo.rviz")).unwrap();
    let foxglove: serde_json::Value =
        serde_json::from_str(include_str!("../../launch_scripts/dq_servo.foxglove.json")).unwrap();
    let contract = dq_wire::Contract::builtin().unwrap();
    let all = [&contract.servo, &contract.plant, &contract.pictures];
    let known: Vec<_> = all
        .iter()
        .flat_map(|node| node.topics())
        .map(|(name, _)| format!("/{}", name.replace("~/", "dq_servo/").trim_start_matches('/')))
        .chain(["/dq_servo/goal", "/dq_servo/stop"].map(str::to_owned))
        .collect();
    let mut named = Vec::new();
    texts(&rviz, &mut named);
    texts(&foxglove, &mut named);
    // The part after a dot is a field of the message.
    let topics =
        named.iter().filter(|text| text.starts_with('/')).map(|text| text.split('.').next().unwrap());
    let topics: Vec<_> = topics.collect();
    assert!(topics.len() > 12, "{topics:?}");
    for topic in topics {
        assert!(known.iter().any(|name| name == topic), "{topic} is not among {known:?}");
    }
}
