//! The tree of frames.

use super::history::{History, MOST, Outside, Place};
use super::{FrameError, Ignored};
use dq_algebra::{UnitDualQuaternion, unit_rotation};
use dq_common::text::cut;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Largest number of frames that are kept. Without this limit, anyone could fill the memory.
const MOST_FRAMES: usize = 1000;

/// Largest number of transforms that the tree keeps for all frames together. They take about 7 MB.
const MOST_PLACES: usize = 100_000;

/// Largest translation \[m\]. No distance on Earth is larger.
const FARTHEST: f64 = 1e7;

/// A transform as received: the pose of `child` in `parent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform<'a> {
    /// The parent frame.
    pub parent: &'a str,
    /// The child frame.
    pub child: &'a str,
    /// The time stamp \[ns\]; ignored for a static transform.
    pub stamp: i64,
    /// The child's origin \[m\].
    pub translation: [f64; 3],
    /// The child's rotation (x, y, z, w).
    pub rotation_xyzw: [f64; 4],
}

/// The parent of a frame, and the frame's recent transforms relative to it.
#[derive(Clone, Debug)]
struct Edge {
    parent: String,
    history: History,
}

/// All frames of TF, each with its recent transforms relative to its parent.
///
/// The tree has at most 1000 frames with names of up to 250 bytes, and at most 100 000 transforms. If a frame gets another parent,
/// or changes between static and moving, its earlier transforms are removed.
#[derive(Clone, Debug, Default)]
pub struct FrameTree {
    edges: BTreeMap<String, Edge>,
    places: usize,
}

/// Returns the name of the frame without the leading slash that ROS 1 wrote.
fn name(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

impl Transform<'_> {
    fn place(&self) -> Result<Place, Ignored> {
        let is_near = self.translation.iter().all(|number| (-FARTHEST..=FARTHEST).contains(number));
        match unit_rotation(self.rotation_xyzw) {
            Ok(rotation) if is_near => {
                Ok(Place { stamp: self.stamp, rotation, translation: Vector3::from(self.translation) })
            }
            _ => Err(Ignored::Numbers),
        }
    }
}

impl FrameTree {
    /// Adds a transform.
    ///
    /// # Errors
    /// [`Ignored`]; nothing changes then.
    pub fn insert(&mut self, transform: &Transform, is_static: bool) -> Result<(), Ignored> {
        let (parent, child) = (cut(name(transform.parent)), cut(name(transform.child)));
        if parent.is_empty() || child.is_empty() || parent == child {
            return Err(Ignored::Names);
        }
        let place = transform.place()?;
        let room = MOST_PLACES.saturating_sub(self.places);
        let count = self.edges.len();
        match self.edges.get_mut(&*child) {
            None if count >= MOST_FRAMES || room == 0 => return Err(Ignored::TooMany),
            None => {
                let edge = Edge { parent: parent.into_owned(), history: History::new(place, is_static) };
                self.edges.insert(child.into_owned(), edge);
                self.places += 1;
            }
            Some(edge) => {
                let before = edge.history.len();
                if edge.parent == parent && edge.history.is_static == is_static {
                    edge.history.add(place, before.saturating_add(room).min(MOST));
                } else {
                    *edge = Edge { parent: parent.into_owned(), history: History::new(place, is_static) };
                }
                self.places = self.places - before + edge.history.len();
            }
        }
        Ok(())
    }

    /// Removes all moving frames, because their clock was reset.
    pub fn forget_moving(&mut self) {
        self.edges.retain(|_, edge| edge.history.is_static);
        self.places = self.edges.values().map(|edge| edge.history.len()).sum();
    }

    /// Returns the pose of `frame` in `base` at `stamp` \[ns\]. A stamp of 0 stands for the newest time at which the transforms of
    /// all frames between `base` and `frame` are known.
    ///
    /// # Errors
    /// [`FrameError`] if the pose is not known. Nothing is extrapolated.
    pub fn lookup(&self, base: &str, frame: &str, stamp: i64) -> Result<UnitDualQuaternion, FrameError> {
        let path = self.path(name(base), name(frame))?;
        let stamp = match stamp {
            0 => path.newest().unwrap_or(0),
            stamp => stamp,
        };
        let of = |edges: &[Named]| {
            let poses = edges.iter().map(|(child, edge)| at(child, edge, stamp));
            poses.into_iter().try_fold(UnitDualQuaternion::identity(), |pose, next| Ok(next? * pose))
        };
        Ok(of(&path.down)?.inverse() * of(&path.up)?)
    }

    /// Returns the newest time at which the transforms of all frames between `frame` and `base` are known \[ns\]. Returns `None` if
    /// none of these frames moves.
    ///
    /// # Errors
    /// [`FrameError`] if no transforms connect the two frames.
    pub fn newest(&self, base: &str, frame: &str) -> Result<Option<i64>, FrameError> {
        Ok(self.path(name(base), name(frame))?.newest())
    }

    /// Returns whether TF connects `one` and `other`, and no frame between them moves.
    pub fn are_rigid(&self, one: &str, other: &str) -> bool {
        let path = self.path(name(one), name(other));
        path.is_ok_and(|path| path.edges().all(|(_, edge)| edge.history.is_static))
    }

    /// Returns the path from `frame` to `base` through their nearest common ancestor.
    fn path<'a>(&'a self, base: &'a str, frame: &'a str) -> Result<Path<'a>, FrameError> {
        if base == frame {
            return Ok(Path { up: Vec::new(), down: Vec::new() });
        }
        let (mut up, mut down) = (self.ancestry(frame)?, self.ancestry(base)?);
        // Common ancestors are not part of the path.
        while let (Some((one, _)), Some((other, _))) = (up.last(), down.last())
            && one == other
        {
            up.pop();
            down.pop();
        }
        let top =
            |edges: &[Named<'a>], of: &'a str| edges.last().map_or(of, |(_, edge)| edge.parent.as_str());
        match top(&up, frame) == top(&down, base) {
            true => Ok(Path { up, down }),
            false => Err(self.unconnected(base, frame)),
        }
    }

    /// Returns the edge of the frame, then the edge of its parent, and so on up to the root.
    fn ancestry<'a>(&'a self, frame: &'a str) -> Result<Vec<Named<'a>>, FrameError> {
        let (mut edges, mut at) = (Vec::new(), frame);
        while let Some((child, edge)) = self.edges.get_key_value(at) {
            edges.push((child.as_str(), edge));
            at = &edge.parent;
            if edges.len() > self.edges.len() {
                return Err(FrameError::Loop(cut(frame).into_owned()));
            }
        }
        Ok(edges)
    }

    fn unconnected(&self, base: &str, frame: &str) -> FrameError {
        let known = |frame: &str| {
            self.edges.contains_key(frame) || self.edges.values().any(|edge| edge.parent == frame)
        };
        let own = |text: &str| cut(text).into_owned();
        match [frame, base].into_iter().find(|frame| !known(frame)) {
            Some(unknown) => FrameError::Unknown(own(unknown)),
            None => FrameError::NotConnected { frame: own(frame), base: own(base) },
        }
    }
}

/// An edge with the name of its child frame.
type Named<'a> = (&'a str, &'a Edge);

/// The path between two frames.
struct Path<'a> {
    /// The edges from the frame whose pose is requested up to the common ancestor.
    up: Vec<Named<'a>>,
    /// The edges between the base frame and the common ancestor, the edge at the base frame first.
    down: Vec<Named<'a>>,
}

impl<'a> Path<'a> {
    fn edges(&self) -> impl Iterator<Item = &Named<'a>> {
        self.up.iter().chain(&self.down)
    }

    /// Returns the newest time at which all transforms of the path are known \[ns\]; `None` if no frame of the path moves.
    fn newest(&self) -> Option<i64> {
        self.edges().filter_map(|(_, edge)| edge.history.newest()).min()
    }
}

fn at(child: &str, edge: &Edge, stamp: i64) -> Result<UnitDualQuaternion, FrameError> {
    let frame = || child.to_owned();
    edge.history.at(stamp).map_err(|outside| match outside {
        Outside::Before(by) => FrameError::TooOld { frame: frame(), seconds: by as f64 * 1e-9 },
        Outside::After(by) => FrameError::TooNew { frame: frame(), seconds: by as f64 * 1e-9 },
    })
}
