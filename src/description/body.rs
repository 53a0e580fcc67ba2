//! The arm's body from a robot description: capsules around the collision shapes of its links.

use super::arm::DescriptionError;
use super::mesh_file;
use super::places::Place;
use super::urdf_reader::Description;
use super::urdf_shapes::{Collision, Shape, collisions};
use dq_space::space::{Body, Capsule, Fitted, merged};
use nalgebra::Vector3;
use std::path::Path;

/// The radius of the default capsule along a link \[m\].
pub const LIMB_RADIUS: f64 = 0.05;

/// Largest number of capsules of an arm, unless the arm has more links. The time of a cycle grows with the number of pairs of
/// capsules.
const MOST: usize = 16;

/// Largest distance of a shape from the joint that moves it \[m\]. A larger distance is probably in millimeters.
const FARTHEST: f64 = 10.0;

/// Least thickness of a shape \[m\].
const THINNEST: f64 = 1e-6;

/// The resolution of the numbers in the texts of capsules: steps per meter [1/m].
const STEPS: f64 = 1e4;

/// The capsules of an arm as texts of the parameter `body`.
#[derive(Debug, PartialEq)]
pub struct FittedBody {
    /// The texts; empty if the description has no usable shapes.
    pub texts: Vec<String>,
    /// A message about shapes that could not be read; `None` if all shapes could be read.
    pub warning: Option<String>,
}

/// Fits capsules around the shapes of the arm between the frames `base` and `tool`, and around the shapes of the parts that the arm
/// carries. `text` is the robot description, and `file` its file, if it comes from a file.
///
/// Carried parts are the links that fixed joints connect to a moving link of the arm, and all links beyond the arm's last joint.
/// Joints beyond the arm's last joint, such as those of fingers, are at their start positions. A link without shapes, or with a
/// shape that cannot be read, gets the capsule of [`Body::along`].
///
/// # Errors
/// [`DescriptionError`] if the description has no arm between the frames.
pub fn fitted(
    text: &str,
    [base, tool]: &[String; 2],
    file: Option<&Path>,
) -> Result<FittedBody, DescriptionError> {
    let description = Description::read(text, base, tool)?;
    let chain = description.arm.chain()?;
    let places = description.places(&chain)?;
    let last = chain.link_count();
    let is_body = |place: &&Place| match place.carrier {
        0 => place.is_of_arm,
        carrier => place.is_rigid || carrier == last,
    };
    let (mut all, mut missing) = (Vec::new(), Vec::new());
    for collision in collisions(text)? {
        let Some(place) = places.get(collision.link.as_str()).filter(is_body) else { continue };
        match around(&collision, place, file) {
            Ok(fitted) => all.push((place.carrier, fitted)),
            Err(why) => missing.push((place.carrier, collision.link, why)),
        }
    }
    let warning = warning(&missing);
    let names: Vec<_> = description.arm.links().map(|joint| joint.name.as_str()).collect();
    if all.is_empty() {
        return Ok(FittedBody { texts: Vec::new(), warning });
    }
    let is_whole =
        |joint: usize| all.iter().any(|(of, _)| *of == joint) && missing.iter().all(|(of, ..)| *of != joint);
    let along = Body::along(std::slice::from_ref(&chain), LIMB_RADIUS).capsules;
    let along = along.into_iter().filter(|capsule| !is_whole(capsule.link));
    let along: Vec<_> =
        along.map(|Capsule { link, core, radius, .. }| (link, Fitted { core, radius })).collect();
    // If a joint is called "base", parts fixed to the base are written without a name.
    let base = if names.contains(&"base") { "" } else { "base" };
    let texts = merged([all, along].concat(), MOST).into_iter().map(|(joint, fitted)| {
        let joint = joint.checked_sub(1).map_or(base, |number| names[number]);
        written(joint, &fitted)
    });
    Ok(FittedBody { texts: texts.collect(), warning })
}

/// Returns a capsule around a shape, in the frame of the joint that carries the shape.
fn around(collision: &Collision, place: &Place, file: Option<&Path>) -> Result<Fitted, String> {
    let (link_from_shape, shape) =
        collision.shape.as_ref().ok_or("expected a box, a cylinder, a capsule, a sphere or a mesh")?;
    let fitted = match shape {
        Shape::Sphere(radius) => Fitted::ball(&Vector3::zeros(), *radius),
        Shape::Cylinder { radius, length } => Fitted::cylinder(*radius, *length),
        Shape::Capsule { radius, length } => Fitted::capsule(*radius, *length),
        Shape::Box(edges) => {
            let side = |number: usize, axis: usize| if number >> axis & 1 == 0 { -0.5 } else { 0.5 };
            let corner = |number| Vector3::from_fn(|axis, _| side(number, axis) * edges[axis]);
            Fitted::points(&(0..8).map(corner).collect::<Vec<_>>()).ok_or("it has no corners")?
        }
        Shape::Mesh { scale, .. } if scale.iter().any(|factor| *factor == 0.0) => {
            return Err("its scale is 0".to_owned());
        }
        Shape::Mesh { file: mesh, scale } => {
            let scene = mesh_file::load(mesh, file)?;
            let corners = scene.meshes.iter().flat_map(|mesh| &mesh.vertices);
            let points: Vec<_> =
                corners.map(|corner| Vector3::from(corner.map(f64::from)).component_mul(scale)).collect();
            Fitted::points(&points).ok_or_else(|| format!("{mesh} has no corners"))?
        }
    };
    let fitted = fitted.moved(&(place.carrier_from_link * *link_from_shape).frame());
    let reach = fitted.core.ends.iter().map(|end| end.norm()).fold(fitted.radius, f64::max);
    match () {
        () if fitted.radius < THINNEST => Err("it has no size".to_owned()),
        () if reach < FARTHEST => Ok(fitted),
        // Both comparisons are false for NaN.
        () => Err(format!("it reaches farther than {FARTHEST} m")),
    }
}

/// Writes a capsule as a text of the parameter `body`, rounded to tenths of a millimeter. The radius is enlarged by the rounding
/// error of the ends.
fn written(joint: &str, Fitted { core, radius }: &Fitted) -> String {
    let rounded = |number: f64| (number * STEPS).round() / STEPS + 0.0;
    let ends: String = core.ends.iter().flatten().map(|number| format!(" {}", rounded(*number))).collect();
    let radius = (radius * STEPS + 0.5 * 3.0_f64.sqrt()).ceil() / STEPS;
    format!("{joint}{ends} {radius}")
}

/// Returns the warning about shapes that could not be read.
fn warning(missing: &[(usize, String, String)]) -> Option<String> {
    let (_, link, why) = missing.first()?;
    let more = match missing.len() - 1 {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    Some(format!(
        "a collision shape of link {link:?} cannot be used ({why}){more}: a capsule of {LIMB_RADIUS} m along the link is in its place"
    ))
}
