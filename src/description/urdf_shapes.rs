//! Reads the shapes of the links in a URDF document: visuals and collision shapes.

use super::arm::{DescriptionError, pose};
use super::urdf_reader::quaternion;
use super::urdf_tree::{child_of, name_of, with_document};
use dq_algebra::UnitDualQuaternion;
use nalgebra::Vector3;
use roxmltree::Node;
use std::collections::HashMap;

/// A color as red, green and blue, from 0 to 1.
pub type Rgb = [f32; 3];

/// A visual shape of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Visual {
    /// The name of the link.
    pub link: String,
    /// The pose of the shape in the link's frame.
    pub link_from_shape: UnitDualQuaternion,
    /// The shape in its own frame.
    pub shape: Shape,
    /// The color of the shape, if the document has one.
    pub color: Option<Rgb>,
}

/// A collision shape of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// The name of the link.
    pub link: String,
    /// The pose in the link's frame, and the shape; `None` if the shape cannot be read.
    pub shape: Option<(UnitDualQuaternion, Shape)>,
}

/// A shape about its own origin \[m\]. Cylinders and capsules are along z.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A mesh file.
    Mesh {
        /// The name in the description: a path, `file://…` or `package://…`.
        file: String,
        /// The scale along each axis.
        scale: Vector3<f64>,
    },
    /// A box with edges of these lengths.
    Box(Vector3<f64>),
    /// A cylinder along z.
    Cylinder {
        /// The radius of the cylinder.
        radius: f64,
        /// The length of the cylinder.
        length: f64,
    },
    /// A capsule along z (URDF 1.1 and later).
    Capsule {
        /// The radius of the capsule.
        radius: f64,
        /// The length of the capsule without its round ends.
        length: f64,
    },
    /// A ball with this radius.
    Sphere(f64),
}

/// Returns all visual shapes in the URDF document `text` that can be read. Shapes that cannot be read are left out, because motion
/// does not depend on visual shapes.
///
/// # Errors
/// [`DescriptionError`] for a text that is not a URDF document.
pub fn visuals(text: &str) -> Result<Vec<Visual>, DescriptionError> {
    with_document(text, |document| {
        let robot = document.root_element();
        let materials = robot.children().filter(|node| node.has_tag_name("material"));
        let materials: HashMap<_, _> =
            materials.filter_map(|node| Some((name_of(node).to_owned(), color(node)?))).collect();
        let shown = shapes(robot, "visual").filter_map(|(link, node)| visual(link, node));
        let named = |mut visual: Visual, material: Option<String>| {
            visual.color = visual.color.or_else(|| materials.get(&material?).copied());
            visual
        };
        Ok(shown.map(|(visual, material)| named(visual, material)).collect())
    })
}

/// Returns all collision shapes in the URDF document `text`, including shapes that cannot be read.
///
/// # Errors
/// [`DescriptionError`] for a text that is not a URDF document.
pub fn collisions(text: &str) -> Result<Vec<Collision>, DescriptionError> {
    with_document(text, |document| {
        let all = shapes(document.root_element(), "collision");
        let read = |(link, node)| Collision { link: name_of(link).to_owned(), shape: placed(node) };
        Ok(all.map(read).collect())
    })
}

/// Yields each element of the kind `kind`, together with its link.
fn shapes<'a>(robot: Node<'a, 'a>, kind: &'static str) -> impl Iterator<Item = (Node<'a, 'a>, Node<'a, 'a>)> {
    let links = robot.children().filter(|node| node.has_tag_name("link"));
    links.flat_map(move |link| {
        let all = link.children().filter(move |node| node.has_tag_name(kind));
        all.map(move |node| (link, node))
    })
}

/// Returns a visual shape, and the name of its material if it has one. Returns `None` if the shape cannot be read.
fn visual(link: Node, node: Node) -> Option<(Visual, Option<String>)> {
    let (link_from_shape, shape) = placed(node)?;
    let material = child_of(node, "material");
    let link = name_of(link).to_owned();
    let visual = Visual { link, link_from_shape, shape, color: material.and_then(color) };
    Some((visual, material.map(|material| name_of(material).to_owned())))
}

/// Returns the shape of a `<visual>` or a `<collision>`, and its pose in the link's frame; `None` if the shape cannot be read.
fn placed(node: Node) -> Option<(UnitDualQuaternion, Shape)> {
    let origin = child_of(node, "origin");
    let three = |name: &str| match origin.and_then(|origin| origin.attribute(name)) {
        Some(text) => vector(text),
        None => Some(Vector3::zeros()),
    };
    let link_from_shape = match origin.and_then(quaternion) {
        Some(rotation) => UnitDualQuaternion::from_parts(rotation.ok()?, three("xyz")?),
        None => pose(three("xyz")?.into(), three("rpy")?.into()),
    };
    Some((link_from_shape, shape(child_of(node, "geometry")?)?))
}

fn shape(geometry: Node) -> Option<Shape> {
    let node = geometry.children().find(Node::is_element)?;
    let size = |name: &str| number(node.attribute(name)?).filter(|size| *size > 0.0);
    match node.tag_name().name() {
        "mesh" => {
            let scale = node.attribute("scale").map_or(Some(Vector3::repeat(1.0)), vector)?;
            Some(Shape::Mesh { file: node.attribute("filename")?.to_owned(), scale })
        }
        "box" => Some(Shape::Box(vector(node.attribute("size")?)?)),
        "cylinder" => Some(Shape::Cylinder { radius: size("radius")?, length: size("length")? }),
        "capsule" => Some(Shape::Capsule { radius: size("radius")?, length: size("length")? }),
        "sphere" => Some(Shape::Sphere(size("radius")?)),
        _ => None,
    }
}

fn color(material: Node) -> Option<Rgb> {
    let text = child_of(material, "color")?.attribute("rgba")?;
    let parts: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
    let parts = parts?;
    let [red, green, blue, ..] = parts[..] else { return None };
    Some([red, green, blue].map(|part| part.clamp(0.0, 1.0) as f32))
}

fn vector(text: &str) -> Option<Vector3<f64>> {
    let parts: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
    <[f64; 3]>::try_from(parts?).ok().map(Vector3::from)
}

/// Parses a number \[m, rad\]; `None` if the text is not a number, or the number is too large for a shape.
fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.abs() <= 1e4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_have_their_pose_and_color() {
        let text = r#"<robot name="r"><material name="blue"><color rgba="0 0 1 1"/></material>
          <link name="a">
            <visual><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/><geometry><box size="1 2 3"/></geometry><material name="blue"/></visual>
            <visual><geometry><mesh filename="package://p/a.stl" scale="0.001 0.001 0.001"/></geometry></visual>
            <visual><geometry><cylinder radius="-1" length="1"/></geometry></visual>
            <visual><geometry><sphere radius="nan"/></geometry></visual>
          </link>
          <link name="b"><visual><geometry><sphere radius="0.5"/></geometry><material name=""><color rgba="2 0.5 0 1"/></material></visual></link>
        </robot>"#;
        let [boxed, mesh, ball] = <[Visual; 3]>::try_from(visuals(text).unwrap()).unwrap();
        assert_eq!((boxed.link.as_str(), &boxed.shape), ("a", &Shape::Box(Vector3::new(1.0, 2.0, 3.0))));
        assert_eq!(boxed.color, Some([0.0, 0.0, 1.0]));
        assert_eq!(boxed.link_from_shape.translation(), Vector3::z());
        let turned = boxed.link_from_shape.rotation() * Vector3::x();
        assert!((turned - Vector3::y()).norm() < 1e-15);
        let scale = Vector3::repeat(0.001);
        assert_eq!(mesh.shape, Shape::Mesh { file: "package://p/a.stl".to_owned(), scale });
        assert_eq!((ball.link.as_str(), ball.color), ("b", Some([1.0, 0.5, 0.0])));
        let all = collisions(&text.replace("visual", "collision")).unwrap();
        let read: Vec<_> = all.iter().map(|one| (one.link.as_str(), one.shape.is_some())).collect();
        assert_eq!(read, [("a", true), ("a", true), ("a", false), ("a", false), ("b", true)]);
        assert_eq!(all[0].shape, Some((boxed.link_from_shape, boxed.shape)));
    }
}
