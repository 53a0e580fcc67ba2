//! The fixed part of a link, in the form that takes the fewest multiplications.

use super::JointKind;
use super::pair::side_by_side;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use wide::f64x2;

/// The fixed transform before a joint, `Rz(γ) T(offset) Rx(α) Rz(φ)`, without its rotations about z. The angle of the previous
/// joint includes γ, and the angle of this joint includes φ. So each joint takes only a rotation about x and a rotation about z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    /// `cos ½α`, in both halves of the register.
    cos: f64x2,
    /// `sin ½α`, in both halves of the register.
    sin: f64x2,
    /// The offset; `None` if the joint's origin is the previous joint's origin.
    offset: Option<Vector3<f64>>,
}

impl Link {
    /// Splits a fixed transform `Rz(γ) T(offset) Rx(α) Rz(φ)` into a link and the half angles ½γ and ½φ \[rad\].
    ///
    /// Let `(w, x, y, z)` be the transform's quaternion. Then `½γ + ½φ` is the angle of the vector (w, z), and `½γ − ½φ` the angle
    /// of the vector (x, y). The lengths of the vectors are `cos ½α` and `sin ½α`. If a length is 0, the angle is arbitrary.
    pub fn new(transform: &Isometry3<f64>) -> (Self, f64, f64) {
        let q = transform.rotation.quaternion();
        let ((cos, sum), (sin, difference)) = (polar(q.w, q.k), polar(q.i, q.j));
        let (before, after) = (0.5 * (sum + difference), 0.5 * (sum - difference));
        let (y, x) = (-2.0 * before).sin_cos();
        let t = transform.translation.vector;
        let offset = Vector3::new(x * t.x - y * t.y, y * t.x + x * t.y, t.z);
        let offset = Some(offset).filter(|offset| *offset != Vector3::zeros());
        (Self { cos: f64x2::splat(cos), sin: f64x2::splat(sin), offset }, before, after)
    }
}

/// Two successive joints, or a single last joint, each with the link before it. The cosines and sines of both half angles are
/// computed at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LinkPair {
    pub links: [Link; 2],
    /// The half angles that the links add to the joints' half angles \[rad\].
    pub half_angles: f64x2,
    /// The kinds of the joints; `None` for the usual case of two revolute joints.
    pub kinds: Option<Kinds>,
}

/// The kinds of two joints as factors. For a missing second joint, both factors are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kinds {
    /// 1 for a revolute joint, otherwise 0.
    pub turns: f64x2,
    /// 1 for a prismatic joint, otherwise 0.
    pub slides: f64x2,
}

impl LinkPair {
    /// Creates a pair from one or two joints. `joints` has, for each joint, the link before the joint, the joint's additional half
    /// angle \[rad\], and its kind.
    pub fn new(joints: &[(Link, f64, JointKind)]) -> Self {
        let none = (Link::new(&Isometry3::identity()).0, 0.0);
        let both = [0, 1].map(|i| joints.get(i).map_or(none, |(link, half_angle, _)| (*link, *half_angle)));
        let are = |kind| {
            let is = |i: usize| joints.get(i).is_some_and(|(_, _, of)| *of == kind);
            f64x2::new([0, 1].map(|i| if is(i) { 1.0 } else { 0.0 }))
        };
        let kinds = Kinds { turns: are(JointKind::Revolute), slides: are(JointKind::Prismatic) };
        Self {
            links: both.map(|(link, _)| link),
            half_angles: f64x2::new(both.map(|(_, half_angle)| half_angle)),
            kinds: Some(kinds).filter(|kinds| kinds.turns != f64x2::ONE),
        }
    }
}

/// Returns the length of (x, y), and its angle in [−½π, ½π]. If the angle of (x, y) is outside this range, the returned length is
/// negative, and the returned angle is that of (−x, −y).
fn polar(x: f64, y: f64) -> (f64, f64) {
    let sign = 1.0_f64.copysign(x);
    (sign * x.hypot(y), (sign * y).atan2(sign * x))
}

/// The frame at the end of a chain, in the base frame.
///
/// The frame is stored as a quaternion and a point. Products of frames then take a quarter fewer multiplications than with a dual
/// quaternion, and the Jacobian needs the point.
///
/// The quaternion is stored as two complex numbers, `w + iz` and `x + iy`, so that two operations are done at once. A rotation about
/// z multiplies both by complex numbers of length 1; a rotation about x mixes them with real factors. Such a rotation takes twelve
/// operations, a general quaternion product twenty-eight. The quaternion has the sign that a product of dual quaternions would give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChainEnd {
    /// The numbers w and z of the quaternion.
    along: f64x2,
    /// The numbers x and y of the quaternion.
    across: f64x2,
    /// The x and y of the point.
    xy: f64x2,
    /// The z of the point.
    z: f64,
}

impl ChainEnd {
    /// Creates a frame at the base's origin, rotated about z by twice `half_angle` \[rad\].
    pub fn turned(half_angle: f64) -> Self {
        let (sin, cos) = half_angle.sin_cos();
        Self { along: f64x2::new([cos, sin]), across: f64x2::ZERO, xy: f64x2::ZERO, z: 0.0 }
    }

    /// Moves the frame from one joint to the next: along the offset of `link`, then about x by its twist α.
    #[inline(always)]
    pub fn follow(&mut self, link: &Link) {
        if let Some(offset) = &link.offset {
            let rotation = self.rotation();
            let axis = rotation.imag();
            let turn = 2.0 * axis.cross(offset);
            self.advance(offset + rotation.w * turn + axis.cross(&turn));
        }
        let (along, across) = (self.along, self.across);
        self.along = link.cos * along - link.sin * across;
        self.across = link.cos * across + link.sin * along;
    }

    /// Moves the frame by `way` \[m\], along the base's axes.
    #[inline(always)]
    pub fn advance(&mut self, way: Vector3<f64>) {
        self.xy += side_by_side(way.x, way.y);
        self.z += way.z;
    }

    /// Rotates the frame about its z axis. `cos` and `sin` are the cosine and sine of half the angle.
    #[inline(always)]
    pub fn turn(&mut self, cos: f64, sin: f64) {
        let (cos, sin) = (f64x2::splat(cos), f64x2::new([-sin, sin]));
        self.along = cos * self.along + sin * swapped(self.along);
        self.across = cos * self.across - sin * swapped(self.across);
    }

    /// Returns the direction of the z axis.
    #[inline(always)]
    pub fn z_axis(&self) -> Vector3<f64> {
        Self::z_axes(&[*self; 2]).0.map(|same| same.to_array()[0])
    }

    /// Returns the directions of the z axes of two frames, and the origins of the frames.
    #[inline(always)]
    pub fn z_axes(both: &[Self; 2]) -> (Vector3<f64x2>, Vector3<f64x2>) {
        let [w, z] = f64x2::transpose(both.map(|end| end.along));
        let [x, y] = f64x2::transpose(both.map(|end| end.across));
        let direction =
            Vector3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
        let [x, y] = f64x2::transpose(both.map(|end| end.xy));
        (direction, Vector3::new(x, y, side_by_side(both[0].z, both[1].z)))
    }

    /// Returns the rotation and position of `tool`, whose pose is relative to this frame. If `tool` is `None`, returns the rotation
    /// and position of this frame. Normalizes the rotation.
    #[inline(always)]
    pub fn tool(&self, tool: Option<&Isometry3<f64>>) -> (UnitQuaternion<f64>, Vector3<f64>) {
        let (mut rotation, mut point) = (self.rotation(), self.point());
        if let Some(tool) = tool {
            point += UnitQuaternion::new_unchecked(rotation) * tool.translation.vector;
            rotation *= tool.rotation.quaternion();
        }
        let scale = 0.5 * (3.0 - rotation.norm_squared());
        (UnitQuaternion::new_unchecked(rotation * scale), point)
    }

    /// Returns the origin of the frame.
    #[inline(always)]
    pub fn point(&self) -> Vector3<f64> {
        let [x, y] = self.xy.to_array();
        Vector3::new(x, y, self.z)
    }

    #[inline(always)]
    fn rotation(&self) -> Quaternion<f64> {
        let ([w, z], [x, y]) = (self.along.to_array(), self.across.to_array());
        Quaternion::new(w, x, y, z)
    }
}

/// Swaps the two numbers of a register.
#[inline(always)]
fn swapped(numbers: f64x2) -> f64x2 {
    let [first, second] = numbers.to_array();
    f64x2::new([second, first])
}
