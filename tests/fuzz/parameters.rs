//! Tests texts in place of parameter files, including robot descriptions, and values of parameters.

use crate::damage::{apply, damage};
use crate::{assert_one_line, cases, corpus, measured};
use dq_config::{BUILTIN_FILE, DualParameters, NodeParameters, PlantParameters, ServoParameters};
use dq_params::{Value, parameters_for};
use proptest::prelude::*;
use proptest::sample::{Index, select};
use std::sync::LazyLock;

const DUAL: &str = include_str!("../../msg_config/dual.yaml");

/// Valid files, and files that have found bugs or were likely to.
static ORIGINALS: LazyLock<Vec<&str>> = LazyLock::new(|| {
    let spoilt = include_str!("../data/fuzz/parameters.yaml").split("\n---\n");
    [BUILTIN_FILE, DUAL].into_iter().chain(spoilt).collect()
});

/// Values for `-p name:=value`.
static VALUES: LazyLock<Vec<&str>> = LazyLock::new(|| corpus(include_str!("../data/fuzz/values.txt")));

/// The largest memory of the parser for any file of some kilobytes \[bytes\].
const MEMORY: usize = 64 << 20;

/// Sets up a node from the file. Returns whether it could run.
fn check<P: NodeParameters>(text: &str, node: &str) -> bool {
    let found = match parameters_for(text, "file.yaml", node) {
        Ok(found) => found,
        Err(why) => {
            assert_one_line(&why);
            return false;
        }
    };
    let mut store = P::store().unwrap();
    let builtin = parameters_for(BUILTIN_FILE, "builtin", node).unwrap();
    for (name, value) in builtin.into_iter().chain(found) {
        if let Err(why) = store.override_initial(&name, value) {
            assert_one_line(&why);
            return false;
        }
    }
    P::from_store(&store).inspect_err(|why| assert_one_line(why)).is_ok()
}

fn check_all(text: &str) -> usize {
    let (right, memory) = measured(|| {
        let right = [
            check::<ServoParameters>(text, "/dq_servo"),
            check::<PlantParameters>(text, "/left/puma560"),
            check::<DualParameters>(text, "/dq_dual_servo"),
        ];
        right.iter().filter(|it| **it).count()
    });
    assert!(memory < MEMORY, "{memory} bytes for {} of YAML", text.len());
    right
}

fn check_value(text: &str) {
    let (value, memory) = measured(|| Value::from_yaml(text));
    assert!(memory < MEMORY, "{memory} bytes for {text:?}");
    let Ok(value) = value.inspect_err(|why| assert_one_line(why)) else { return };
    for name in
        ["controller", "update_rate", "gains.diffc", "gains.logc", "limits.joint_velocity", "joints", "arm.a"]
    {
        let _ = ServoParameters::store()
            .unwrap()
            .override_initial(name, value.clone())
            .inspect_err(|why| assert_one_line(why));
    }
}

#[test]
fn the_files_of_msg_config_are_right_for_every_node() {
    assert_eq!((check_all(BUILTIN_FILE), check_all(DUAL)), (3, 3));
}

#[test]
fn every_text_of_the_corpus_is_handled() {
    for text in ORIGINALS.iter() {
        check_all(text);
    }
    VALUES.iter().for_each(|text| check_value(text));
}

#[test]
fn nesting_without_end_is_refused() {
    for (open, close) in [("{a: ", "}"), ("[", "]"), ("- ", ""), ("? ", ""), ("!a ", ""), ("&a ", "")] {
        for depth in [100, 1000, 100_000] {
            let text = format!("{}x{}", open.repeat(depth), close.repeat(depth));
            check_all(&text);
            check_value(&text);
        }
    }
}

/// Returns a piece of a parameter file.
fn piece() -> impl Strategy<Value = &'static str> {
    select(concat!(
        "/**¦/*¦**¦*¦dq_servo¦puma560¦:¦: ¦\n¦\n  ¦\n    ¦ros__parameters:¦arm¦.a¦joints¦[¦]¦{¦}¦, ¦1.0¦-1¦",
        "1e999¦.nan¦.inf¦0x7fffffffffffffff¦9223372036854775808¦true¦~¦''¦\"¦'¦&a ¦*a¦<<¦!!binary ¦!!float ¦",
        "---\n¦...\n¦#¦|\n¦>\n¦- ¦? ¦%YAML 1.2\n¦\t¦\u{feff}¦\u{85}¦\\x¦limits.joint_velocity¦dh_convention¦",
        "controller¦primitive¦right_base",
    ).split('¦').collect::<Vec<_>>())
}

proptest! {
    #![proptest_config(cases(600))]
    #[test]
    fn damaged_files_are_read_or_refused(
        original in any::<Index>(),
        damages in prop::collection::vec(damage(), 1..6),
        insertions in prop::collection::vec((any::<Index>(), prop::collection::vec(piece(), 1..6)), 0..4),
    ) {
        let mut bytes = original.get(&ORIGINALS).as_bytes().to_vec();
        damages.iter().for_each(|damage| apply(damage, &mut bytes));
        for (at, pieces) in insertions {
            let tail = bytes.split_off(at.index(bytes.len() + 1));
            bytes.extend(pieces.concat().as_bytes());
            bytes.extend(tail);
        }
        // Files that are not UTF-8 are refused earlier.
        check_all(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn changed_numbers_make_a_robot_or_an_error(line in any::<Index>(), number in prop_oneof![
        any::<f64>().prop_map(|it| format!("{it:e}")), any::<i64>().prop_map(|it| it.to_string()),
        select(vec![".nan", ".inf", "-.inf", "0", "[]", "[1.0]", "{}", "~", "true"]).prop_map(str::to_owned),
    ]) {
        let mut lines: Vec<_> = BUILTIN_FILE.lines().map(str::to_owned).collect();
        let valued: Vec<_> = (0..lines.len()).filter(|at| lines[*at].contains(": ")).collect();
        let changed = &mut lines[*line.get(&valued)];
        *changed = format!("{}: {number}", changed.split_once(": ").unwrap().0);
        check_all(&lines.join("\n"));
    }

    #[test]
    fn values_are_read_or_refused(original in any::<Index>(), damages in prop::collection::vec(damage(), 0..4)) {
        let mut bytes = original.get(&VALUES).as_bytes().to_vec();
        damages.iter().for_each(|damage| apply(damage, &mut bytes));
        check_value(&String::from_utf8_lossy(&bytes));
    }
}
