//! Robot descriptions, meshes and bags from practice, in `tests/data/cases` with the expected result for each.

use crate::run;
use std::ffi::OsString;
use std::path::Path;
use std::process::Stdio;

/// Runs `pose` on the file, with two of its links as base and tool. Returns the code, stdout and stderr.
fn pose(file: &str, [base, tool]: [&str; 2], joints: usize) -> (Option<i32>, String, String) {
    let file = format!("robot_file:={file}");
    let (base, tool) = (format!("base_frame:={base}"), format!("tool_frame:={tool}"));
    let ros = ["--ros-args", "-p", &file, "-p", &base, "-p", &tool].map(str::to_owned);
    let zeros = std::iter::repeat_n("0".to_owned(), joints);
    let arguments = std::iter::once("pose".to_owned()).chain(zeros).chain(["--json".to_owned()]).chain(ros);
    let out = tempfile::NamedTempFile::new().unwrap();
    let arguments: Vec<_> = arguments.map(OsString::from).collect();
    let arguments: Vec<_> = arguments.iter().map(OsString::as_os_str).collect();
    let (code, stderr) = run(&arguments, out.reopen().unwrap(), Stdio::piped());
    (code, std::fs::read_to_string(out.path()).unwrap(), stderr)
}

fn place(pose: &str) -> Vec<f64> {
    let pose: serde_json::Value = serde_json::from_str(pose).unwrap();
    pose["position"].as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The position of the tool of the made-up arm with all joints at 0, according to `pin` from PyPI.
const TOOL: [f64; 3] = [0.4, 0.0, 0.5];

#[test]
fn each_description_is_read_as_urdfdom_reads_it() {
    // Invalid XML is reported with its line, once.
    let odd = [
        ("blank_line_before_decl", 2),
        ("spaces_before_decl", 1),
        ("dashes_in_comment", 2),
        ("undeclared_prefix", 2),
        ("unquoted_version", 1),
        ("amp_in_text", 2),
        ("doctype", 2),
        ("latin1", 2),
        ("second_root", 3),
        ("default_ns_xacro", 2),
    ];
    let plain = ["ok", "yaml_comment"].map(|name| (name, 0));
    for (name, line) in odd.into_iter().chain(plain) {
        let (code, stdout, stderr) =
            pose(&format!("tests/data/cases/urdf/{name}.urdf"), ["base_link", "tool0"], 3);
        assert_eq!(code, Some(0), "{name}: {stderr}");
        let off: f64 = place(&stdout).iter().zip(TOOL).map(|(one, other)| (one - other).abs()).sum();
        assert!(off < 1e-9, "{name}: {stdout}");
        let warnings: Vec<_> = stderr.lines().collect();
        assert_eq!(warnings.len(), usize::from(line > 0), "{name}: {stderr}");
        assert!(warnings.iter().all(|one| one.contains(&format!("line {line} "))), "{name}: {stderr}");
    }
    let (code, stdout, _) = pose("tests/data/cases/urdf/cont6.urdf", ["base_link", "tool0"], 6);
    assert_eq!(code, Some(0));
    let [x, y, z] = place(&stdout)[..] else { panic!() };
    assert!(
        (x - 0.81725).abs() < 1e-5 && (y - 0.19145).abs() < 1e-5 && (z + 0.005_491).abs() < 1e-5,
        "{stdout}"
    );
    let (code, _, stderr) = pose("tests/data/cases/urdf/empty_robot.urdf", ["base_link", "tool0"], 3);
    assert!(code == Some(2) && stderr.contains("defines no link: is it a macro file"), "{stderr}");
    // The expected values are those of `pin`, to the seven digits of the file.
    let (code, stdout, stderr) = pose("tests/data/cases/urdf/urdf_1_2.urdf", ["base", "l6"], 6);
    assert!(code == Some(0) && stderr.is_empty(), "{stderr}");
    let off: f64 = place(&stdout).iter().zip([1.0, 0.0, 0.5]).map(|(one, other)| (one - other).abs()).sum();
    assert!(off < 1e-6, "{stdout}");
}

#[test]
fn a_bag_whose_recorder_was_killed_is_plotted() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).unwrap();
    for file in Path::new("tests/data/cases/bags/wal_killed").read_dir().unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), bag.join(file.file_name())).unwrap();
    }
    let plots = folder.path().join("plots");
    let arguments = ["plot".as_ref(), bag.as_os_str(), "--out".as_ref(), plots.as_os_str()];
    let (code, stderr) = run(&arguments, Stdio::null(), Stdio::piped());
    assert!(code == Some(0) && stderr.contains("its recorder has not ended it"), "{stderr}");
    assert!(plots.join("joint_positions.svg").is_file());
}
