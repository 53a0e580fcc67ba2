//! Reads Collada files with mesh-loader (0.1), and places each geometry as the scene does, in meters.
//!
//! mesh-loader itself does not scale the translations of nodes by the file's unit. It also multiplies the transforms of nodes in
//! the wrong order, ignores translations below 1 cm, and places each geometry only once, even if the scene has it several times.

use dq_common::text::cut;
use mesh_loader::{Loader, Mesh, Scene};
use nalgebra::{Matrix4, Point3, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node, ParsingOptions};
use std::path::Path;

/// Largest depth of elements. mesh-loader recurses into nested nodes, so a deeper file could overflow the stack.
const DEEPEST: usize = 100;
/// Largest number of geometries in a scene. A geometry counts each time that the scene places it.
const MOST_PLACES: usize = 10_000;

/// Largest number of elements and attributes.
const MOST_NODES: u32 = 2_000_000;

/// The elements that place a node.
const TRANSFORMS: [&str; 6] = ["matrix", "translate", "rotate", "scale", "lookat", "skew"];

/// Reads the scene of the Collada file with these `bytes`.
///
/// # Errors
/// The reason why the file cannot be read.
pub(crate) fn read(bytes: &[u8], path: &Path) -> Result<Scene, String> {
    let text = String::from_utf8_lossy(bytes);
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(&text, options).map_err(|why| cut(&why.to_string()).into_owned())?;
    check_depth(document.root())?;
    // Without a path, mesh-loader does not search for textures.
    let unplaced =
        Loader::default().load_collada_from_slice(without_places(&text, &document).as_bytes(), path);
    let unplaced: Scene = unplaced.map_err(|why: std::io::Error| why.to_string())?;
    let placed = places(&document)?;
    let mut scene = Scene::default();
    for (geometry, place) in placed {
        let is_it = |mesh: &Mesh| geometry.is_none_or(|geometry| mesh.name == geometry);
        for (mesh, material) in
            unplaced.meshes.iter().zip(&unplaced.materials).filter(|(mesh, _)| is_it(mesh))
        {
            scene.meshes.push(moved(mesh, &place));
            scene.materials.push(material.clone());
        }
    }
    Ok(scene)
}

fn check_depth(root: Node) -> Result<(), String> {
    let mut below = vec![(root, 0)];
    while let Some((node, depth)) = below.pop() {
        if depth > DEEPEST {
            return Err(format!("more than {DEEPEST} elements are in each other"));
        }
        below.extend(node.children().filter(Node::is_element).map(|child| (child, depth + 1)));
    }
    Ok(())
}

/// Returns the text of the document without its declaration of the unit, and without the transforms of its nodes. From this text,
/// mesh-loader reads each geometry in its own frame.
fn without_places(text: &str, document: &Document) -> String {
    let places = |node: &Node| {
        let parent = node.parent_element().map_or("", |parent| parent.tag_name().name());
        let name = node.tag_name().name();
        name == "unit" || (parent == "node" && TRANSFORMS.contains(&name))
    };
    let (mut kept, mut from) = (String::new(), 0);
    for cut in document.descendants().filter(places).map(|node| node.range()) {
        kept.push_str(&text[from..cut.start]);
        from = cut.end;
    }
    kept + &text[from..]
}

/// The name of a geometry, or `None` for all geometries, and its transform, which scales lengths to meters.
type Placed<'a> = (Option<&'a str>, Matrix4<f64>);

/// Returns the geometries that the scene places, with their transforms \[m\]. Without a scene, returns all geometries, scaled by
/// the unit.
fn places<'a>(document: &'a Document) -> Result<Vec<Placed<'a>>, String> {
    let root = document.root_element();
    let child = |name: &'static str| root.children().filter(move |node| node.has_tag_name(name));
    let unit = child("asset").flat_map(|asset| asset.children()).find(|node| node.has_tag_name("unit"));
    let meters = match unit.and_then(|unit| unit.attribute("meter")) {
        None => 1.0,
        Some(text) => number(text)
            .filter(|meters| *meters > 0.0)
            .ok_or_else(|| format!("its unit is {:?} m", cut(text)))?,
    };
    let unit = Matrix4::new_scaling(meters);
    let scenes =
        child("library_visual_scenes").flat_map(|library| library.children().filter(Node::is_element));
    let shown = child("scene")
        .flat_map(|scene| scene.children())
        .find_map(|node| target(node, "instance_visual_scene"));
    let scene = scenes.clone().find(|scene| shown.is_none_or(|shown| scene.attribute("id") == Some(shown)));
    let Some(scene) = scene else { return Ok(vec![(None, unit)]) };
    let (mut below, mut found, mut left) = (vec![(scene, unit, 0)], Vec::new(), MOST_PLACES);
    while let Some((node, place, depth)) = below.pop() {
        left = left
            .checked_sub(1)
            .filter(|_| depth <= DEEPEST)
            .ok_or("its nodes are too many, or in themselves")?;
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "instance_geometry" => {
                    found.extend(target(child, "instance_geometry").map(|id| (Some(id), place)))
                }
                "node" => below.push((child, place * transform(child)?, depth + 1)),
                "instance_node" => {
                    let id = target(child, "instance_node");
                    let other = document
                        .descendants()
                        .find(|node| id.is_some() && node.has_tag_name("node") && node.attribute("id") == id);
                    if let Some(other) = other {
                        below.push((other, place * transform(other)?, depth + 1));
                    }
                }
                _ => {}
            }
        }
    }
    Ok(found)
}

/// Returns the id to which `node` refers. Returns `None` if `node` is not an element with the name `name`, or does not refer to an
/// id in the same file.
fn target<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    Some(node).filter(|node| node.has_tag_name(name))?.attribute("url")?.strip_prefix('#')
}

/// Returns the transform of a node: the product of its transform elements. The last element is applied first.
fn transform(node: Node) -> Result<Matrix4<f64>, String> {
    let each =
        node.children().filter(|child| child.is_element() && TRANSFORMS.contains(&child.tag_name().name()));
    each.map(one_transform).product()
}

fn one_transform(node: Node) -> Result<Matrix4<f64>, String> {
    let (name, text) = (node.tag_name().name(), node.text().unwrap_or_default());
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
    let of = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let matrix = match (name, numbers.as_deref().unwrap_or_default()) {
        ("matrix", all) if all.len() == 16 => Matrix4::from_row_slice(all),
        ("translate", &[x, y, z]) => Matrix4::new_translation(&of(x, y, z)),
        ("scale", &[x, y, z]) => Matrix4::new_nonuniform_scaling(&of(x, y, z)),
        ("rotate", &[x, y, z, degrees]) => {
            let axis = Unit::try_new(of(x, y, z), f64::MIN_POSITIVE);
            axis.map_or_else(Matrix4::identity, |axis| {
                Rotation3::from_axis_angle(&axis, degrees.to_radians()).to_homogeneous()
            })
        }
        _ => return Err(format!("<{name}> {:?} is no transform that is known", cut(text.trim()))),
    };
    Ok(matrix)
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// Returns `mesh` transformed by `place`.
fn moved(mesh: &Mesh, place: &Matrix4<f64>) -> Mesh {
    let mut mesh = mesh.clone();
    let linear = place.fixed_view::<3, 3>(0, 0).into_owned();
    let of_normals = linear.try_inverse().map_or(linear, |inverse| inverse.transpose());
    for vertex in &mut mesh.vertices {
        let moved = place.transform_point(&Point3::from(vertex.map(f64::from)));
        *vertex = moved.coords.map(|number| number as f32).into();
    }
    for normal in &mut mesh.normals {
        *normal = (of_normals * Vector3::from(normal.map(f64::from))).map(|number| number as f32).into();
    }
    mesh
}
