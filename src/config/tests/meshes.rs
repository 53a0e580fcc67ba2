//! Tests of meshes as programs write them, and of invalid meshes.

use crate::{start, started, text};
use dq_config::{NodeParameters, ServoParameters};
use dq_core::servo::Measured;
use dq_description::mesh_file;
use dq_params::Value;
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};
use std::time::Duration;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/cases").join(name)
}

/// The smallest and the largest value of each coordinate \[m\], computed with PyPI's trimesh (5.2.0).
type Bounds = [[f32; 3]; 2];

fn bounds(file: &Path) -> Result<Bounds, String> {
    let scene =
        mesh_file::load(file.file_name().unwrap().to_str().unwrap(), Some(&file.with_extension("urdf")))?;
    let corners = scene
        .meshes
        .iter()
        .flat_map(|mesh| mesh.faces.iter().flatten().map(|at| mesh.vertices[*at as usize]));
    let none = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    Ok(corners.fold(none, |[least, most], corner| {
        [
            [0, 1, 2].map(|axis| least[axis].min(corner[axis])),
            [0, 1, 2].map(|axis| most[axis].max(corner[axis])),
        ]
    }))
}

fn assert_bounds(file: &Path, expected: Bounds) {
    let bounds = bounds(file).unwrap_or_else(|why| panic!("{}: {why}", file.display()));
    let pairs = bounds.iter().flatten().zip(expected.iter().flatten());
    assert!(
        pairs.into_iter().all(|(one, other)| (one - other).abs() < 1e-6),
        "{}: {bounds:?}",
        file.display()
    );
}

const BOX: Bounds = [[0.0; 3], [0.1, 0.06, 0.2]];

/// Writes a file with these bytes.
fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    std::fs::write(&file, bytes).unwrap();
    (folder, file)
}

#[test]
fn stl_files_are_read_as_programs_write_them() {
    for case in ["solid_binary_nl", "ascii_noname", "tail"] {
        assert_bounds(&data(&format!("mesh/{case}.stl")), BOX);
    }
    let binary = std::fs::read(data("mesh/solid_binary_nl.stl")).unwrap();
    let with_head = |head: &[u8]| [head, &binary[head.len()..]].concat();
    let text = std::fs::read_to_string(data("mesh/ascii_noname.stl")).unwrap();
    let own = [
        with_head(b"solid by a program\r\nfacet normal\r\n"),
        [with_head(b"SOLID part"), b"\r\nmore".to_vec()].concat(),
        // The number of triangles is missing.
        [&binary[..80], &[0; 4], &binary[84..]].concat(),
        text.to_uppercase().replace('\n', "\r\n").into_bytes(),
        format!("\n solid a b\tc {}{text}", '\u{e9}').into_bytes(),
        text.replace('\n', "\r").into_bytes(),
    ];
    for bytes in own {
        let (_folder, file) = written("own.stl", &bytes);
        assert_bounds(&file, BOX);
    }
}

#[test]
fn the_unit_of_a_collada_file_applies_to_everything_in_it() {
    assert_bounds(&data("mesh/unit_translate_small.dae"), [[0.03, 0.0, 0.0], [0.13, 0.06, 0.2]]);
    assert_bounds(&data("mesh/unit_nested.dae"), [[0.05, 0.0, 0.0], [0.15, 0.06, 0.2]]);
    assert_bounds(&data("own/turned.dae"), [[0.494, 0.1, 0.0], [0.5, 0.12, 0.02]]);
    // A geometry that occurs at two places.
    assert_bounds(&data("own/twice.dae"), [[-0.0001, 0.0, 0.007], [0.001, 0.001, 0.302]]);
    // A translation may be less than 1 cm. A library node appears at the place that refers to it.
    let text = std::fs::read_to_string(data("mesh/unit_translate_small.dae")).unwrap();
    let node =
        "<node id=\"n\" name=\"n\"><translate>30 0 0</translate><instance_geometry url=\"#g\"/></node>";
    let other =
        text.replace(node, "<node id=\"m\"><translate>8 0 0</translate><instance_node url=\"#n\"/></node>");
    let other = other.replace(
        "<library_visual_scenes>",
        &format!("<library_nodes>{node}</library_nodes><library_visual_scenes>"),
    );
    let (_folder, file) = written("library.dae", other.as_bytes());
    assert_bounds(&file, [[0.038, 0.0, 0.0], [0.138, 0.06, 0.2]]);
}

#[test]
fn a_file_with_deep_or_circular_nesting_is_rejected() {
    let deep = format!("<COLLADA>{}{}</COLLADA>", "<node>".repeat(200_000), "</node>".repeat(200_000));
    let text = std::fs::read_to_string(data("mesh/unit_nested.dae")).unwrap();
    let scene =
        text.replace("<node id=\"cam\"/>", &format!("{}{}", "<node>".repeat(5_000), "</node>".repeat(5_000)));
    let itself = text.replace("<node id=\"cam\"/>", "<node id=\"a\"><instance_node url=\"#a\"/></node>");
    let twice = text
        .replace("<node id=\"cam\"/>", &"<node id=\"a\"><instance_node url=\"#p\"/></node>".repeat(20_000));
    for (text, why) in
        [(deep, "in each other"), (scene, "in each other"), (itself, "in themselves"), (twice, "too many")]
    {
        let (_folder, file) = written("bad.dae", text.as_bytes());
        let refused = bounds(&file).unwrap_err();
        assert!(refused.contains(why), "{refused}");
    }
}

/// Returns the body and the warnings of an arm whose first link has the mesh `mesh`.
fn fitted(mesh: &[u8], scale: &str) -> (Vec<String>, Vec<String>) {
    let (folder, _) = written("mesh.stl", mesh);
    let robot = std::fs::read_to_string(data("mesh/tail.stl.urdf")).unwrap();
    let robot = robot.replace(
        "<mesh filename=\"tail.stl\"/>",
        &format!("<mesh filename=\"mesh.stl\" scale=\"{scale}\"/>"),
    );
    let file = folder.path().join("robot.urdf");
    std::fs::write(&file, robot).unwrap();
    let frames = [("base_frame", text("base_link")), ("tool_frame", text("tool0"))];
    let robot = [("robot_file", text(file.to_str().unwrap())), ("constraints", Value::Bool(true))];
    let (store, warnings) = start(&[robot, frames].concat()).unwrap();
    assert!(ServoParameters::from_store(&store).is_ok());
    let Some(Value::StringArray(body)) = store.get("body") else { panic!() };
    (body.clone(), warnings)
}

#[test]
fn a_mesh_without_size_or_with_nan_gets_a_capsule_along_its_link_and_a_warning() {
    let mesh = std::fs::read(data("mesh/tail.stl")).unwrap();
    let (body, warnings) = fitted(&mesh, "1 1 1");
    assert!(warnings.is_empty() && body[0].ends_with(" 0.0597"), "{body:?} {warnings:?}");
    let mut no_number = mesh.clone();
    no_number[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut none = mesh.clone();
    none[84..].chunks_exact_mut(4).for_each(|number| number.copy_from_slice(&f32::NAN.to_le_bytes()));
    let mut point = mesh.clone();
    point[84..].fill(0);
    for (mesh, scale, why) in [
        (&no_number, "1 1 1", "has corners that are no numbers"),
        (&none, "1 1 1", "has corners that are no numbers"),
        (&mesh, "0 0 0", "its scale is 0"),
        (&mesh, "1 0 1", "its scale is 0"),
        (&mesh, "1e-9 1e-9 1e-9", "it has no size"),
        (&point, "1 1 1", "it has no size"),
    ] {
        let (body, warnings) = fitted(mesh, scale);
        assert!(warnings.len() == 1 && warnings[0].contains(why), "{warnings:?}");
        assert_eq!(body, [""; 0], "empty: 5 cm along each link");
    }
}

/// Runs the servo of an arm with a joint about z and two joints about y. The goal is a quarter turn of the first joint, but a post
/// is in the path of the paddle that the first link carries. Returns the last position of the first joint \[rad\], and the smallest
/// distance between the center line of the paddle and the post \[m\].
fn way_past_a_post(robot: &Path) -> (f64, f64) {
    const POST: [f64; 3] = [0.0, 0.35, 0.0];
    let parameters = started(&[
        ("robot_file", text(robot.to_str().unwrap())),
        ("base_frame", text("base_link")),
        ("tool_frame", text("tool0")),
        ("constraints", Value::Bool(true)),
        ("keep_out", Value::StringArray(vec!["post sphere 0 0.35 0 0.05".to_owned()])),
    ]);
    let parameters = parameters.unwrap();
    let (mut angles, mut speeds) = ([0.0, 0.4, -0.8], [0.0; 3]);
    let goal = parameters.arms.chain().forward_kinematics(&[FRAC_PI_2, 0.4, -0.8]).unwrap();
    let mut servo = parameters.build().unwrap();
    servo.set_goal(goal.frame());
    let mut nearest = f64::INFINITY;
    for cycle in 1..5000 {
        let measured = Measured { positions: &angles, velocities: &speeds };
        if let Some(output) = servo.cycle(cycle * Duration::from_millis(2), &measured).unwrap() {
            speeds.copy_from_slice(output);
        }
        angles.iter_mut().zip(&speeds).for_each(|(angle, speed)| *angle += 0.002 * speed);
        // The center line of the paddle begins at the axis and is 0.4 m long.
        let (sin, cos) = angles[0].sin_cos();
        let along = (POST[0] * cos + POST[1] * sin).clamp(0.0, 0.4);
        nearest = nearest.min((POST[0] - along * cos).hypot(POST[1] - along * sin));
    }
    (angles[0], nearest)
}

#[test]
fn a_paddle_stops_at_a_keep_out_whatever_the_joint_names() {
    let (plain, distance) = way_past_a_post(&data("mesh/paddle_without.urdf"));
    // The radius of the post is 5 cm, and the radius of the paddle at least 4 cm. The arm does not complete the quarter turn.
    assert!(distance > 0.09 && plain < 1.4 && plain > 0.3, "{plain} {distance}");
    assert_eq!(way_past_a_post(&data("mesh/paddle_with_spaces.urdf")), (plain, distance));
    let text = std::fs::read_to_string(data("mesh/paddle_without.urdf")).unwrap();
    for names in [["base", "1", "a b "], ["j", "j\u{a0}1", "j 0 0 0 0 0 0 1"], ["'a', \"b\"", "é/ü", " "]] {
        let name = |text: String, (number, name): (usize, &str)| {
            text.replace(&format!("\"j{}\"", number + 1), &format!("\"{}\"", name.replace('"', "&quot;")))
        };
        let (_folder, file) =
            written("robot.urdf", names.into_iter().enumerate().fold(text.clone(), name).as_bytes());
        assert_eq!(way_past_a_post(&file), (plain, distance), "{names:?}");
    }
}
