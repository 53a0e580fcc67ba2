//! Tests the output of `reproduce`.

use crate::dq_servo;
use serde_json::Value;

#[test]
fn reproduce_writes_every_figure_and_number() {
    let folder = std::env::temp_dir().join(format!("dq_servo_reproduce_{}", std::process::id()));
    let out = folder.join("new/folder");
    let output =
        dq_servo(&format!("reproduce --out {}", out.display())).assert().success().get_output().clone();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("double_geodesic") && text.contains("diffc overshoots its goal: holds"), "{text}");
    assert!(output.stderr.is_empty(), "no terminal, no progress");
    let results: Value = serde_json::from_slice(&std::fs::read(out.join("results.json")).unwrap()).unwrap();
    let names: Vec<_> = results["figures"].as_object().unwrap().keys().collect();
    assert_eq!(names.len(), 14);
    for name in names {
        let svg = std::fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.matches("<polyline").count() > 5, "{name}");
        let png = std::fs::read(out.join(format!("{name}.png"))).unwrap();
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.len() > 10_000, "{name}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn reproduce_answers_bad_constants_and_places_with_one_line() {
    for (arguments, code, named) in [
        ("reproduce --experiment nothing.yaml", 2, "nothing.yaml"),
        ("reproduce --experiment msg_config/topics.yaml", 2, "topics.yaml"),
        ("reproduce --experiment msg_config/paper.yaml --out /proc/nowhere", 1, "/proc/nowhere"),
        ("reproduce --frob", 2, "--frob"),
    ] {
        let output = dq_servo(arguments).assert().code(code).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(named) && message.lines().count() == 1, "{arguments}: {message}");
    }
}
