//! The tree of frames.

use super::history::{History, MOST, Outside, Place};
use super::{FrameError, Ignored};
use dq_algebra::{UnitDualQuaternion, unit_rotation};
use dq_common::text::cut;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Frames that are kept: anyone can publish more.
const MOST_FRAMES: usize = 1000;

/// Transforms that are kept of all frames together, 7 MB of them.
const MOST_PLACES: usize = 100_000;

/// Places farther from each other [m] are not on one planet.
const FARTHEST: f64 = 1e7;

/// A transform as it came: where `child` is in `parent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform<'a> {
    /// The frame in which it is given.
    pub parent: &'a str,
    /// The frame whose place it is.
    pub child: &'a str,
    /// When \[ns\]; of no meaning for a static one.
    pub stamp: i64,
    /// The child's origin \[m\].
    pub translation: [f64; 3],
    /// The child's rotation (x, y, z, w).
    pub rotation_xyzw: [f64; 4],
}

/// A frame below its parent.
#[derive(Clone, Debug)]
struct Edge {
    parent: String,
    history: History,
}

/// All frames that TF has named, each with where it was in its parent.
///
/// It never grows beyond 1000 frames and 100 000 transforms, with names of 250 bytes. A frame that gets another parent, or becomes
/// static or moves from then on, begins anew.
#[derive(Clone, Debug, Default)]
pub struct FrameTree {
    edges: BTreeMap<String, Edge>,
    places: usize,
}

/// A name as ROS 1 wrote it too, with a leading slash.
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
    /// Takes a transform.
    ///
    /// # Errors
    /// [`Ignored`]: then it was not taken, and all is as it was.
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

    /// Forgets where frames were that move: their clock begins anew.
    pub fn forget_moving(&mut self) {
        self.edges.retain(|_, edge| edge.history.is_static);
        self.places = self.edges.values().map(|edge| edge.history.len()).sum();
    }

    /// Where `frame` was in `base` at `stamp` \[ns\]; at 0 at the newest time at which all frames between them are known.
    ///
    /// # Errors
    /// [`FrameError`]. Nothing is extrapolated.
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

    /// The newest time \[ns\] at which all frames between `frame` and `base` are known; none where none of them moves.
    ///
    /// # Errors
    /// [`FrameError`] where no frames connect them.
    pub fn newest(&self, base: &str, frame: &str) -> Result<Option<i64>, FrameError> {
        Ok(self.path(name(base), name(frame))?.newest())
    }

    /// Whether nothing between the two frames moves.
    pub fn are_rigid(&self, one: &str, other: &str) -> bool {
        let path = self.path(name(one), name(other));
        path.is_ok_and(|path| path.edges().all(|(_, edge)| edge.history.is_static))
    }

    /// The path from `frame` to `base`.
    fn path<'a>(&'a self, base: &'a str, frame: &'a str) -> Result<Path<'a>, FrameError> {
        if base == frame {
            return Ok(Path { up: Vec::new(), down: Vec::new() });
        }
        let (mut up, mut down) = (self.ancestry(frame)?, self.ancestry(base)?);
        // What both have above them is no part of the path.
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

    /// The frame's edge, its parent's, and so on to the root.
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

/// An edge with the name of its child.
type Named<'a> = (&'a str, &'a Edge);

/// How two frames are connected.
struct Path<'a> {
    /// The edges from one frame up to where it meets the other.
    up: Vec<Named<'a>>,
    /// Those from the other up to there.
    down: Vec<Named<'a>>,
}

impl<'a> Path<'a> {
    fn edges(&self) -> impl Iterator<Item = &Named<'a>> {
        self.up.iter().chain(&self.down)
    }

    /// The newest time \[ns\] at which all of it is known; none where nothing on it moves.
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
