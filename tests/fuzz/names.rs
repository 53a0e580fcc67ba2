//! Tests command lines: `--ros-args` with remapping rules, and the resulting names.

use crate::damage::{apply, damage};
use crate::{assert_one_line, cases, corpus};
use dq_ros::ros::names::NodeName;
use dq_ros::ros::{Resolver, args};
use proptest::prelude::*;
use proptest::sample::{Index, select};
use std::sync::LazyLock;

/// Command lines, one per line.
static LINES: LazyLock<Vec<&str>> = LazyLock::new(|| corpus(include_str!("../data/fuzz/args.txt")));

/// Typical names of topics of nodes.
const NAMES: [&str; 8] =
    ["goal_pose", "~/status", "/tf", "left/joint_states", "{node}/x", "{ns}/y", "~", "rostopic://goal_pose"];

/// Parses the arguments and resolves names with them. Returns whether that gave a node.
fn check(line: Vec<String>) -> bool {
    let total = line.len();
    let (ours, ros) = match args::split(line) {
        Ok(split) => split,
        Err(why) => {
            assert_one_line(&why);
            return false;
        }
    };
    assert!(ours.len() + ros.remaps.len() + ros.overrides.len() <= total, "nothing comes from nowhere");
    let Ok(resolver) = Resolver::new("dq_servo", &ros).inspect_err(|why| assert_one_line(why)) else {
        return false;
    };
    // A resolved name resolves to itself if there are no rules.
    assert_eq!(NodeName::parse(&resolver.node().fully_qualified()).as_ref(), Ok(resolver.node()));
    let plain = Resolver::new("plain", &args::RosArgs::default()).unwrap();
    for name in NAMES {
        for resolved in [resolver.topic(name), resolver.service(name)] {
            match resolved {
                Ok(name) => assert_eq!(plain.topic(&name).as_ref(), Ok(&name)),
                Err(why) => assert_one_line(&why),
            }
        }
    }
    true
}

#[test]
fn every_text_of_the_corpus_is_handled() {
    let nodes = LINES.iter().filter(|line| check(line.split(' ').map(str::to_owned).collect())).count();
    assert!(nodes >= 4, "{nodes} of {} make a node", LINES.len());
}

fn argument() -> impl Strategy<Value = String> {
    let grammar = select(concat!(
        "--ros-args¦--¦-r¦--remap¦-p¦--param¦--params-file¦--log-level¦-e¦--enclave¦__ns¦__node¦__name¦:=¦:¦",
        "/¦~¦~/¦//¦{node}¦{ns}¦{namespace}¦rostopic://¦rosservice://¦goal_pose¦left¦_¦__¦1¦é¦\n¦\u{0}¦ ¦",
        "debug¦=¦a",
    ).split('¦').collect::<Vec<_>>());
    prop_oneof![
        3 => prop::collection::vec(grammar, 1..6).prop_map(|pieces| pieces.concat()),
        1 => any::<String>(),
    ]
}

proptest! {
    #![proptest_config(cases(5000))]
    #[test]
    fn any_arguments_are_accepted_or_rejected(mut line in prop::collection::vec(argument(), 0..10)) {
        line.insert(0, "--ros-args".to_owned());
        check(line);
    }

    #[test]
    fn damaged_command_lines_are_accepted_or_rejected(original in any::<Index>(), damages in prop::collection::vec(damage(), 1..4)) {
        let mut bytes = original.get(&LINES).as_bytes().to_vec();
        damages.iter().for_each(|damage| apply(damage, &mut bytes));
        check(String::from_utf8_lossy(&bytes).split(' ').map(str::to_owned).collect());
    }
}
