//! Tests of descriptions that are not valid XML, compared with ROS 2's own parser.

use crate::{start, text};
use dq_config::{NodeParameters, ServoParameters};
use dq_params::{ParameterStore, Value};

fn bytes(hex: &str) -> Vec<u8> {
    let pairs = hex.as_bytes().chunks_exact(2).map(|pair| str::from_utf8(pair).unwrap());
    pairs.map(|pair| u8::from_str_radix(pair, 16).unwrap()).collect()
}

/// Returns the description that results from the mutation in `line`, and urdfdom's result for that description; `None` if urdfdom
/// rejects the description. The script `make.py` in the folder of the data explains the format of the lines.
fn mutation<'a>(robot: &str, line: &'a str) -> (Vec<u8>, Option<&'a str>) {
    let [at, cut, piece, verdict] = line.splitn(4, ' ').collect::<Vec<_>>().try_into().unwrap();
    let [at, cut]: [usize; 2] = [at, cut].map(|number| number.parse().unwrap());
    let piece = if piece == "-" { Vec::new() } else { bytes(piece) };
    let [before, after] = [at, at + cut].map(|at| robot.as_bytes().split_at(at.min(robot.len())));
    let text = [before.0, &piece, after.1].concat();
    (text, Some(verdict).filter(|verdict| *verdict != "-"))
}

/// Returns this program's result: the joint names in hexadecimal, and the position of the tool with all joints at 0.
fn verdict(store: &ParameterStore) -> (Vec<String>, [f64; 3]) {
    let parameters = ServoParameters::from_store(store).unwrap();
    let hex = |name: &String| name.bytes().map(|byte| format!("{byte:02x}")).collect::<String>();
    let Some(Value::StringArray(names)) = store.get("joints") else { panic!() };
    let tool = parameters.arms.chain().forward_kinematics(&vec![0.0; names.len()]).unwrap();
    (names.iter().map(hex).collect(), tool.translation().into())
}

#[test]
fn mutated_descriptions_are_read_as_urdfdom_reads_them() {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/urdf_lenient");
    let robot = std::fs::read_to_string(format!("{data}/robot.urdf")).unwrap();
    let mutations = std::fs::read_to_string(format!("{data}/mutations.txt")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mutated = folder.path().join("robot.urdf");
    let file = ("robot_file", text(mutated.to_str().unwrap()));
    let values = [file, ("base_frame", text("base")), ("tool_frame", text("hand"))];
    let (mut alike, mut missed) = (0, Vec::new());
    for line in mutations.lines() {
        let (bytes, expected) = mutation(&robot, line);
        std::fs::write(&mutated, &bytes).unwrap();
        let read = start(&values);
        // A description that urdfdom rejects may be accepted here, but must not end the process.
        let Some(expected) = expected else { continue };
        let shown = String::from_utf8_lossy(&bytes);
        let Ok((store, warnings)) = read else {
            missed.push(format!("{}\n{shown}", read.unwrap_err()));
            continue;
        };
        let (names, place) = verdict(&store);
        let words: Vec<_> = expected.split(' ').collect();
        let (joints, numbers) = words.split_at(words.len() - 3);
        let off = |(number, here): (&&str, f64)| (number.parse::<f64>().unwrap() - here).abs();
        assert!(numbers.iter().zip(place).all(|pair| off(pair) < 1e-8), "{place:?} {expected}\n{shown}");
        assert!(warnings.len() <= 1, "one warning at most: {warnings:?}\n{shown}");
        if joints == names { alike += 1 } else { missed.push(format!("{names:?} {expected}\n{shown}")) }
    }
    assert!(alike > 200 && missed.is_empty(), "{alike} alike, not these: {missed:#?}");
}
