//! The shape of the arm from its robot description: the visual shapes of all links as triangles that move with the joints.

use super::surface::{Corner, Surface, Triangle, mesh, moved, triangles};
use dq_common::text_file;
use dq_description::{Description, LONGEST_DESCRIPTION, Place, Rgb, Shape, Visual, visuals};
use dq_kinematics::arm::Chain;
use nalgebra::{Point3, Vector3};
use serde_json::json;
use std::path::{Path, PathBuf};

/// The color of shapes that have no color of their own.
const GREY: Rgb = [0.78, 0.8, 0.82];

/// Shapes are simplified to cells of this edge length, as a fraction of the arm's reach.
const CELL: f64 = 1e-3;

/// The largest number of triangles. Real robots have fewer. Further triangles are left out.
const MOST: usize = 1_000_000;

/// The triangles of the arm, and the reasons why some shapes could not be read.
pub(super) struct ArmShape {
    /// A surface for each link of the arm. Surface 0 stands still with the base, and surface 1 moves with the first moving link.
    surfaces: Vec<Surface>,
    /// The reasons why some shapes are missing.
    pub missing: Vec<String>,
}

/// A robot description, and the arm in it.
#[derive(PartialEq)]
pub(super) struct Model {
    /// The text of the description.
    pub text: String,
    /// The first and the last link of the arm.
    pub frames: [String; 2],
    /// The arm that the page shows.
    pub chain: Chain,
    /// The path of the description's file, if the servo's parameters name one; `None` if the description came from elsewhere.
    pub file: Option<PathBuf>,
}

impl ArmShape {
    /// Returns the shapes of the description; `None` if it has no shapes or cannot be read.
    pub fn of(model: &Model) -> Option<Self> {
        let Model { text, frames: [base, tool], chain, file } = model;
        let description = Description::read(text, base, tool).ok()?;
        let links = description.places(chain).ok()?;
        // If the text differs from the file's content, the description did not come from that file. Then relative names of mesh
        // files in the text do not refer to the file's folder.
        let read = |file: &&PathBuf| text_file::read(file, LONGEST_DESCRIPTION as u64);
        let file = file.as_ref().filter(|file| read(file).is_ok_and(|own| own == *text));
        let cell = CELL * chain.reach(std::iter::repeat((0.0, 0.0))).max(1e-3);
        let mut arm_shape = Self { surfaces: Vec::new(), missing: Vec::new() };
        arm_shape.surfaces.resize_with(chain.link_count() + 1, Surface::default);
        let mut left = MOST;
        for visual in visuals(text).ok()? {
            let Some(Place { carrier, carrier_from_link, .. }) = links.get(visual.link.as_str()) else {
                continue;
            };
            let place = (*carrier_from_link * visual.link_from_shape).frame();
            let (shape, color) = (arm_shape.triangles(&visual, file.map(PathBuf::as_path)), visual.color);
            for (triangle, own) in shape.into_iter().take(left) {
                left -= 1;
                arm_shape.surfaces[*carrier].add(
                    &moved(&triangle, &place),
                    own.or(color).unwrap_or(GREY),
                    cell,
                );
            }
        }
        arm_shape.surfaces.iter().any(|surface| !surface.triangles.is_empty()).then_some(arm_shape)
    }

    fn triangles(&mut self, visual: &Visual, file: Option<&Path>) -> Vec<(Triangle, Option<Rgb>)> {
        let Shape::Mesh { file: named, scale } = &visual.shape else {
            return triangles(&visual.shape).into_iter().map(|triangle| (triangle, None)).collect();
        };
        match mesh(named, file) {
            Ok(triangles) => {
                triangles.into_iter().map(|(triangle, color)| (scaled(&triangle, scale), color)).collect()
            }
            Err(why) => {
                self.missing.push(why);
                Vec::new()
            }
        }
    }

    /// Returns the data in the page's format. First comes the length of a JSON list \[bytes\], then the list itself, which has the
    /// sizes of each surface. The corners and the triangles of each surface follow, surface by surface. Numbers have 4 bytes,
    /// little endian. Each part of the data begins at a multiple of 4 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let shown = self.surfaces.iter().enumerate().filter(|(_, surface)| !surface.triangles.is_empty());
        let list = shown.clone().map(|(carrier, surface)| {
            json!({ "carrier": carrier, "corners": surface.corners.len(), "triangles": surface.triangles.len() })
        });
        let mut head = serde_json::Value::from_iter(list).to_string();
        head.extend(std::iter::repeat_n(' ', head.len().next_multiple_of(4) - head.len()));
        let mut bytes = (head.len() as u32).to_le_bytes().to_vec();
        bytes.extend(head.as_bytes());
        for (_, surface) in shown {
            bytes.extend(surface.corners.iter().flatten().flat_map(|number| number.to_le_bytes()));
            bytes.extend(surface.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes()));
        }
        bytes
    }
}

fn scaled(triangle: &Triangle, scale: &Vector3<f64>) -> Triangle {
    triangle.map(|Corner { place, normal }| {
        let place = Point3::from(place.coords.component_mul(scale));
        // Dividing the normal by the scale keeps it perpendicular to the scaled surface.
        let normal = normal.component_div(scale).try_normalize(1e-12).unwrap_or(normal);
        Corner { place, normal }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    /// A robot that consists of a pedestal, an arm with a revolute and a prismatic joint, a hand, and a finger. The pedestal, the
    /// upper arm, the hand and the finger are balls. The mesh of the forearm is missing.
    const ROBOT: &str = r#"<robot name="r">
      <link name="pedestal"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
      <link name="base"/>
      <link name="upper"><visual><origin xyz="0.1 0 0"/><geometry><sphere radius="0.1"/></geometry></visual></link>
      <link name="fore"><visual><geometry><mesh filename="package://nowhere/fore.stl"/></geometry></visual></link>
      <link name="hand"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
      <link name="finger"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
      <joint name="stand" type="fixed"><parent link="pedestal"/><child link="base"/><origin xyz="0 0 0.5" rpy="0 0 1"/></joint>
      <joint name="turn" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0.2 0.3" rpy="0.4 0 0"/><axis xyz="0 1 0"/></joint>
      <joint name="slide" type="prismatic"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0" rpy="0 0.2 0"/><axis xyz="1 0 0"/>
        <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
      <joint name="wrist" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0 0 0.2"/></joint>
      <joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/><origin xyz="0 0.1 0"/><axis xyz="0 0 1"/>
        <limit lower="0.02" upper="0.04" velocity="1" effort="1"/></joint>
    </robot>"#;

    fn model(text: &str) -> Model {
        let chain = Description::read(text, "base", "hand").unwrap().arm.chain().unwrap();
        Model { text: text.to_owned(), frames: ["base", "hand"].map(str::to_owned), chain, file: None }
    }

    #[test]
    fn every_link_is_drawn_where_the_joints_have_taken_it() {
        let model = model(ROBOT);
        let arm_shape = ArmShape::of(&model).unwrap();
        assert_eq!(arm_shape.missing, ["package://nowhere/fore.stl is not there"]);
        let positions = [0.7, -0.3];
        let joint =
            |number: usize| Description::read(ROBOT, "base", "hand").unwrap().arm.joints[number].clone();
        let upper = joint(0).parent_from_child(positions[0]);
        let hand = upper * joint(1).parent_from_child(positions[1]) * joint(2).parent_from_child(0.0);
        let frames = model.chain.link_poses(&positions).unwrap();
        let middle = |carrier: usize| {
            let pose = carrier.checked_sub(1).map_or(Isometry3::identity(), |at| frames[at].frame());
            let corners = &arm_shape.surfaces[carrier].corners;
            let places = corners.iter().map(|corner| {
                pose * Point3::new(f64::from(corner[0]), f64::from(corner[1]), f64::from(corner[2]))
            });
            places.map(|place| place.coords).sum::<Vector3<f64>>() / corners.len() as f64
        };
        let pedestal = Vector3::new(0.0, 0.0, -0.5);
        assert!((middle(0) - pedestal).norm() < 1e-3, "{}", middle(0));
        let shown = upper.frame() * Point3::new(0.1, 0.0, 0.0);
        assert!((middle(1) - shown.coords).norm() < 1e-3, "{}", middle(1));
        // The hand and the finger have equally many corners.
        let between = hand.frame() * Point3::new(0.0, 0.05, 0.015);
        assert!((middle(2) - between.coords).norm() < 1e-2, "{} {between}", middle(2));
    }

    #[test]
    fn the_page_can_take_the_bytes_apart() {
        let bytes = ArmShape::of(&model(ROBOT)).unwrap().bytes();
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let list: serde_json::Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        let size = |one: &serde_json::Value| {
            36 * one["corners"].as_u64().unwrap() + 12 * one["triangles"].as_u64().unwrap()
        };
        let numbers: u64 = list.as_array().unwrap().iter().map(size).sum();
        assert_eq!((length % 4, bytes.len()), (0, 4 + length + numbers as usize));
        assert_eq!(
            list.as_array().unwrap().iter().map(|one| one["carrier"].clone()).collect::<Vec<_>>(),
            [0, 1, 2]
        );
        let plain = ROBOT.replace("visual", "collision");
        assert!(ArmShape::of(&model(&plain)).is_none());
    }

    #[test]
    fn what_lies_beside_a_file_is_drawn_where_the_text_is_that_file_s_own() {
        let folder = tempfile::tempdir().unwrap();
        let beside = ROBOT.replace("package://nowhere/fore.stl", "fore.obj");
        std::fs::write(folder.path().join("fore.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let file = folder.path().join("robot.urdf");
        std::fs::write(&file, &beside).unwrap();
        let missing =
            |text: &str| ArmShape::of(&Model { file: Some(file.clone()), ..model(text) }).unwrap().missing;
        assert_eq!(missing(&beside), [""; 0]);
        assert!(missing(&format!("{beside}\n"))[0].contains("fore.obj"), "it came from elsewhere");
    }
}
