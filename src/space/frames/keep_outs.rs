//! Keep-outs in TF frames. This module keeps their poses in the base frame up to date until they are removed or expire.

use super::{FrameError, FrameTree};
use crate::space::{KeepOut, KeepOutError, LONGEST_NAME, MOST_KEEP_OUTS, Solid};
use dq_algebra::UnitDualQuaternion;
use std::time::Duration;
use thiserror::Error;

/// A solid in a TF frame that the arm must stay clear of.
#[derive(Clone, Debug, PartialEq)]
pub struct FramedKeepOut {
    /// The key. A keep-out replaces an earlier keep-out with the same key.
    pub key: KeepOutKey,
    /// The solid, in the frame `frame`.
    pub solid: Solid,
    /// The TF frame; empty for the base frame.
    pub frame: String,
    /// The time stamp of the pose \[ns\]; 0 for the newest transform.
    pub stamp: i64,
    /// Whether the keep-out moves with its frame.
    pub is_carried: bool,
    /// When the keep-out arrived.
    pub came: Duration,
    /// How long the keep-out stays in force; zero for forever.
    pub lifetime: Duration,
}

/// The key of a keep-out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeepOutKey {
    /// The namespace of the publisher's markers.
    pub namespace: String,
    /// The number of the marker in its namespace.
    pub id: i32,
}

/// The reason why a keep-out is not in force, or not up to date.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum KeepOutRefused {
    /// The solid is not valid as a keep-out.
    #[error(transparent)]
    NoKeepOut(#[from] KeepOutError),
    /// The marker is not a solid.
    #[error("{0}")]
    NoSolid(String),
    /// The pose of the frame is not known.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// There are as many keep-outs as allowed.
    #[error(
        "there are too many: at most {MOST_KEEP_OUTS} are possible, including those of keep_out and keep_in"
    )]
    TooMany,
    /// The keep-out would have the same [`Name`](crate::space::Name) as another keep-out.
    #[error("its name, shortened to {0:?}, is that of another one")]
    Namesake(String),
    /// The keep-out moves with a frame, and TF no longer sends transforms of this frame.
    #[error("TF no longer updates its frame {0:?}: it stays at the last position")]
    Silent(String),
}

/// A frame that has moved by less than this leaves its keep-outs where they are \[m, rad\]. Smaller motions are noise.
const STILL: f64 = 1e-3;

/// Keep-outs in TF frames.
#[derive(Clone, Debug, Default)]
pub struct FramedKeepOuts {
    all: Vec<Entry>,
    /// The keep-outs that are not in force or not up to date, with the reasons. There are at most [`MOST_REFUSED`].
    refused: Vec<(KeepOutKey, KeepOutRefused)>,
}

#[derive(Clone, Debug)]
struct Entry {
    key: KeepOutKey,
    /// The keep-out in force; `None` until its pose is found for the first time.
    current: Option<Placed>,
    /// The keep-out of the newest message; `None` after its pose is found.
    next: Option<FramedKeepOut>,
}

/// The inputs of one update: the transforms, the base frame, the time, and how long to wait for a transform.
struct Look<'a> {
    tree: &'a FrameTree,
    base: &'a str,
    now: Duration,
    patience: Duration,
}

/// A keep-out at its pose in the base frame.
#[derive(Clone, Debug)]
struct Placed {
    keep_out: FramedKeepOut,
    base_from_frame: UnitDualQuaternion,
    /// The keep-out in the base frame.
    in_base: KeepOut,
    heard: Heard,
    is_silent: bool,
}

/// When the last transform of a frame arrived.
#[derive(Clone, Copy, Debug)]
struct Heard {
    /// The stamp of the last transform \[ns\]; `None` if the frame never moves.
    stamp: Option<i64>,
    /// The time at which the last transform arrived.
    at: Duration,
}

impl FramedKeepOut {
    /// Returns the name of the keep-out for messages to users: the shortened namespace and the marker's number.
    fn name(&self) -> String {
        let KeepOutKey { namespace, id } = &self.key;
        let id = format!("/{id}");
        let known = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '_' };
        let namespace = if namespace.is_empty() { "marker" } else { namespace };
        namespace.chars().map(known).take(LONGEST_NAME - id.len()).chain(id.chars()).collect()
    }

    fn frame<'a>(&'a self, base: &'a str) -> &'a str {
        if self.frame.is_empty() { base } else { &self.frame }
    }

    /// Returns whether the keep-out has expired at `now`.
    fn is_over(&self, now: Duration) -> bool {
        !self.lifetime.is_zero() && now.saturating_sub(self.came) >= self.lifetime
    }

    /// Returns the keep-out as placed at `now`, with its frame at `base_from_frame`. If the solid is the same as that of `before`,
    /// reuses the shape of `before`.
    fn placed(
        &self,
        base_from_frame: UnitDualQuaternion,
        before: Option<&Placed>,
        now: Duration,
    ) -> Result<Placed, KeepOutError> {
        let solid = self.solid.moved(&base_from_frame.frame());
        let in_base = match before.filter(|before| *before.in_base.solid() == solid) {
            Some(before) => before.in_base.clone(),
            None => KeepOut::new(self.name().parse()?, solid)?,
        };
        let (keep_out, heard) =
            (self.clone(), before.map_or(Heard { stamp: None, at: now }, |before| before.heard));
        Ok(Placed { keep_out, base_from_frame, in_base, heard, is_silent: false })
    }
}

impl Placed {
    /// Moves the keep-out with its frame. Returns the reason if the moved solid is invalid, or if TF has just stopped updating the
    /// frame; otherwise `None`.
    fn follow(&mut self, look: &Look) -> Option<KeepOutRefused> {
        let Look { tree, base, now, patience } = *look;
        let frame = self.keep_out.frame(base);
        let newest = tree.newest(base, frame);
        // A frame that never moves is never silent.
        if newest.as_ref().is_ok_and(|stamp| stamp.is_none() || *stamp != self.heard.stamp) {
            self.heard = Heard { stamp: newest.unwrap_or_default(), at: now };
        }
        let was_silent = std::mem::replace(&mut self.is_silent, now.saturating_sub(self.heard.at) > patience);
        if self.is_silent {
            return (!was_silent).then(|| KeepOutRefused::Silent(frame.to_owned()));
        }
        let found = tree.lookup(base, frame, 0).ok()?;
        if found.distances(&self.base_from_frame).iter().all(|distance| *distance < STILL) {
            return None;
        }
        match self.keep_out.placed(found, Some(self), now) {
            Ok(placed) => *self = placed,
            Err(why) => return Some(why.into()),
        }
        None
    }
}

impl Entry {
    fn name(&self) -> Option<String> {
        let current = self.current.as_ref().map(|placed| &placed.keep_out);
        self.next.as_ref().or(current).map(FramedKeepOut::name)
    }

    /// Puts the keep-out of the newest message into force, at the pose that its frame has at the message's stamp. For a keep-out that
    /// moves with its frame, this is the newest pose of the frame.
    ///
    /// While TF may still send the transform for that pose, uses the newest known pose of the frame, for `patience` at most. Returns the
    /// reason if the pose cannot be found or the moved solid is invalid; otherwise `None`.
    fn find(&mut self, look: &Look) -> Option<KeepOutRefused> {
        let Look { tree, base, now, patience } = *look;
        let next = self.next.take()?;
        let frame = next.frame(base);
        let exact = tree.lookup(base, frame, if next.is_carried { 0 } else { next.stamp });
        let is_early =
            exact.as_ref().is_err_and(|why| why.may_pass() && now.saturating_sub(next.came) < patience);
        // The newest known pose of the frame is a better approximation than no pose.
        let found = if is_early { tree.lookup(base, frame, 0) } else { exact };
        let placed = match found {
            Ok(found) => next.placed(found, self.current.as_ref(), now).map_err(KeepOutRefused::from),
            Err(_) if is_early => {
                self.next = Some(next);
                return None;
            }
            Err(why) => Err(why.into()),
        };
        match placed {
            Ok(placed) => self.current = Some(placed),
            Err(why) => return Some(why),
        }
        self.next = is_early.then_some(next);
        None
    }
}

impl FramedKeepOuts {
    /// Adds a keep-out, or replaces the keep-out with the same key. There may be at most `most` keep-outs. The next call of
    /// [`look`](Self::look) finds the pose of the new keep-out.
    ///
    /// # Errors
    /// [`KeepOutRefused`] if the keep-out cannot be added. Then the other keep-outs do not change, and [`refused`](Self::refused())
    /// has the reason.
    pub fn put(&mut self, keep_out: FramedKeepOut, most: usize) -> Result<(), KeepOutRefused> {
        let (key, name) = (keep_out.key.clone(), keep_out.name());
        let why = if let Some(known) = self.all.iter_mut().find(|known| known.key == key) {
            known.next = Some(keep_out);
            self.refused.retain(|(other, _)| *other != key);
            return Ok(());
        } else if self.all.len() >= most {
            KeepOutRefused::TooMany
        } else if self.all.iter().any(|known| known.name().as_ref() == Some(&name)) {
            KeepOutRefused::Namesake(name)
        } else {
            self.refused.retain(|(other, _)| *other != key);
            self.all.push(Entry { key, current: None, next: Some(keep_out) });
            return Ok(());
        };
        self.refuse(key, why.clone());
        Err(why)
    }

    /// Records that a keep-out is not in force, and why, for [`refused`](Self::refused()).
    pub fn refuse(&mut self, key: KeepOutKey, why: KeepOutRefused) {
        self.refused.retain(|(other, _)| *other != key);
        if self.refused.len() < MOST_REFUSED {
            self.refused.push((key, why));
        }
    }

    /// Removes the keep-out with this key.
    pub fn remove(&mut self, key: &KeepOutKey) {
        self.all.retain(|known| known.key != *key);
        self.refused.retain(|(other, _)| other != key);
    }

    /// Removes all keep-outs.
    pub fn clear(&mut self) {
        self.all.clear();
        self.refused.clear();
    }

    /// Returns whether the pose of a keep-out may change, or a keep-out may expire, without a new message.
    pub fn may_change(&self) -> bool {
        let may_change = |placed: &Placed| placed.keep_out.is_carried || !placed.keep_out.lifetime.is_zero();
        self.all.iter().any(|known| known.next.is_some() || known.current.as_ref().is_some_and(may_change))
    }

    /// Updates the poses of all keep-outs in the frame `base` at `now`. Returns the keep-outs whose poses were not found within
    /// `patience`, and the keep-outs whose frames have been silent for `patience`, with the reasons. Returns each such keep-out
    /// only once. A keep-out remains in force until the pose of its replacement is found.
    pub fn look(
        &mut self,
        tree: &FrameTree,
        base: &str,
        now: Duration,
        patience: Duration,
    ) -> Vec<(KeepOutKey, KeepOutRefused)> {
        let (look, mut refused) = (Look { tree, base, now, patience }, Vec::new());
        self.all.retain_mut(|known| {
            let last = known.next.as_ref().or(known.current.as_ref().map(|placed| &placed.keep_out));
            if last.is_none_or(|last| last.is_over(now)) {
                return false;
            }
            let not_found = known.find(&look);
            let carried = known.current.as_mut().filter(|placed| placed.keep_out.is_carried);
            let not_followed = carried.and_then(|placed| placed.follow(&look));
            let why = not_found.into_iter().chain(not_followed);
            refused.extend(why.map(|why| (known.key.clone(), why)));
            known.next.is_some() || known.current.is_some()
        });
        refused.iter().for_each(|(key, why)| self.refuse(key.clone(), why.clone()));
        let all = &self.all;
        let is_heard = |key: &KeepOutKey| {
            let known = all.iter().find(|known| known.key == *key).and_then(|known| known.current.as_ref());
            known.is_none_or(|placed| !placed.is_silent)
        };
        self.refused.retain(|(key, why)| !matches!(why, KeepOutRefused::Silent(_)) || !is_heard(key));
        refused
    }

    /// Returns the keep-outs whose poses were found, in the base frame.
    pub fn in_base(&self) -> Vec<KeepOut> {
        self.found().map(|placed| placed.in_base.clone()).collect()
    }

    fn found(&self) -> impl Iterator<Item = &Placed> {
        self.all.iter().filter_map(|known| known.current.as_ref())
    }

    /// Returns the keep-outs that are not in force or not up to date, with their reasons. There are at most `MOST_REFUSED`.
    pub fn refused(&self) -> &[(KeepOutKey, KeepOutRefused)] {
        &self.refused
    }
}

/// Largest number of refused keep-outs that are reported.
const MOST_REFUSED: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Transform;
    use nalgebra::Vector3;

    const PATIENCE: Duration = Duration::from_secs(1);

    fn key(namespace: &str, id: i32) -> KeepOutKey {
        KeepOutKey { namespace: namespace.to_owned(), id }
    }

    fn sphere(radius: f64) -> Solid {
        Solid::Sphere { center: Vector3::x(), radius }
    }

    fn texts(all: &FramedKeepOuts) -> Vec<String> {
        all.in_base().iter().map(ToString::to_string).collect()
    }

    fn ball(id: i32, frame: &str) -> FramedKeepOut {
        FramedKeepOut {
            key: key("a ball", id),
            solid: sphere(0.1),
            frame: frame.to_owned(),
            stamp: 5,
            is_carried: false,
            came: Duration::ZERO,
            lifetime: Duration::ZERO,
        }
    }

    fn table_at(tree: &mut FrameTree, stamp: i64, x: f64) {
        let (translation, rotation_xyzw) = ([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
        let table = Transform { parent: "base", child: "table", stamp, translation, rotation_xyzw };
        tree.insert(&table, false).unwrap();
    }

    #[test]
    fn each_keep_out_is_where_its_frame_was_or_moves_with_it() {
        let (mut tree, mut all) = (FrameTree::default(), FramedKeepOuts::default());
        all.put(ball(1, "base"), 4).unwrap();
        all.put(ball(2, "table"), 4).unwrap();
        all.put(FramedKeepOut { is_carried: true, ..ball(3, "table") }, 4).unwrap();
        let look =
            |all: &mut FramedKeepOuts, tree: &FrameTree| all.look(tree, "base", Duration::ZERO, PATIENCE);
        look(&mut all, &tree);
        assert_eq!(all.refused(), []);
        assert_eq!(texts(&all), ["a_ball/1 sphere 1 0 0 0.1"], "others wait for their frame");
        table_at(&mut tree, 4, 0.0);
        look(&mut all, &tree);
        assert_eq!(texts(&all)[1], "a_ball/2 sphere 1 0 0 0.1", "as far as is known");
        table_at(&mut tree, 6, 2.0);
        look(&mut all, &tree);
        let expected =
            ["a_ball/1 sphere 1 0 0 0.1", "a_ball/2 sphere 2 0 0 0.1", "a_ball/3 sphere 3 0 0 0.1"];
        assert_eq!(texts(&all), expected);
        table_at(&mut tree, 7, 2.0005);
        look(&mut all, &tree);
        assert_eq!(texts(&all), expected, "that is noise");
        table_at(&mut tree, 8, 3.0);
        look(&mut all, &tree);
        assert_eq!(texts(&all)[1..], ["a_ball/2 sphere 2 0 0 0.1", "a_ball/3 sphere 4 0 0 0.1"]);
        all.remove(&key("a ball", 2));
        assert_eq!(texts(&all).len(), 2);
        all.clear();
        assert!(texts(&all).is_empty() && !all.may_change());
    }

    #[test]
    fn a_flat_hull_leaves_the_one_before_in_force() {
        let mut all = FramedKeepOuts::default();
        let tent: Solid = "hull 0 0 0 1 0 0 0 1 0 0 0 1".parse().unwrap();
        all.put(FramedKeepOut { solid: tent, ..ball(1, "") }, 1).unwrap();
        all.look(&FrameTree::default(), "base", Duration::ZERO, PATIENCE);
        let hull = all.in_base();
        assert_eq!(texts(&all), ["a_ball/1 hull 0 0 0 1 0 0 0 1 0 0 0 1"]);
        let flat = FramedKeepOut { solid: Solid::Hull { points: vec![Vector3::z(); 4] }, ..ball(1, "") };
        all.put(flat, 1).unwrap();
        all.look(&FrameTree::default(), "base", Duration::ZERO, PATIENCE);
        let [(_, why)] = all.refused() else { panic!("{:?}", all.refused()) };
        assert!(matches!(why, KeepOutRefused::NoKeepOut(KeepOutError::Flat)), "{why}");
        assert_eq!(all.in_base(), hull);
    }

    #[test]
    fn a_refused_keep_out_changes_no_other_and_is_reported_until_it_is_in_force() {
        let (tree, mut all) = (FrameTree::default(), FramedKeepOuts::default());
        let look = |all: &mut FramedKeepOuts, now: Duration| all.look(&tree, "base", now, PATIENCE);
        let says =
            |all: &FramedKeepOuts| all.refused().iter().map(|(_, why)| why.clone()).collect::<Vec<_>>();
        all.put(ball(1, ""), 2).unwrap();
        look(&mut all, Duration::ZERO);
        for size in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            all.put(FramedKeepOut { solid: sphere(size), ..ball(1, "") }, 2).unwrap();
            assert_eq!(look(&mut all, Duration::ZERO).len(), 1);
            assert!(matches!(says(&all)[..], [KeepOutRefused::NoKeepOut(_)]), "{:?}", says(&all));
            assert_eq!(texts(&all), ["a_ball/1 sphere 1 0 0 0.1"]);
        }
        let namesake = FramedKeepOut { key: key("a_ball", 1), ..ball(1, "") };
        assert!(matches!(all.put(namesake, 2), Err(KeepOutRefused::Namesake(_))));
        // The second keep-out would replace the first one, but its frame does not exist.
        all.put(ball(1, "nowhere"), 2).unwrap();
        all.put(ball(2, "nowhere"), 2).unwrap();
        assert_eq!(all.put(ball(3, ""), 2), Err(KeepOutRefused::TooMany));
        assert!(matches!(says(&all)[..], [KeepOutRefused::Namesake(_), KeepOutRefused::TooMany]));
        look(&mut all, PATIENCE / 2);
        assert!(all.may_change() && all.refused().len() == 2);
        look(&mut all, PATIENCE);
        use KeepOutRefused::Frame;
        assert!(matches!(says(&all)[2..], [Frame(_), Frame(_)]), "{:?}", says(&all));
        assert_eq!(texts(&all), ["a_ball/1 sphere 1 0 0 0.1"]);
        look(&mut all, PATIENCE);
        assert!(!all.may_change() && all.refused().len() == 4);
        all.put(ball(3, ""), 2).unwrap();
        all.remove(&key("a ball", 2));
        assert!(matches!(says(&all)[..], [KeepOutRefused::Namesake(_), Frame(_)]), "{:?}", says(&all));
        all.clear();
        assert!(all.refused().is_empty() && texts(&all).is_empty());
    }

    #[test]
    fn a_keep_out_with_a_silent_frame_is_reported_until_the_frame_is_heard_again() {
        let (mut tree, mut all) = (FrameTree::default(), FramedKeepOuts::default());
        table_at(&mut tree, 4, 0.0);
        all.put(FramedKeepOut { is_carried: true, ..ball(1, "table") }, 4).unwrap();
        all.put(FramedKeepOut { is_carried: true, ..ball(2, "") }, 4).unwrap();
        let count = |all: &mut FramedKeepOuts, tree: &FrameTree, now: f64| {
            all.look(tree, "base", PATIENCE.mul_f64(now), PATIENCE);
            all.refused().len()
        };
        assert_eq!([0.0, 0.5, 1.0].map(|now| count(&mut all, &tree, now)), [0; 3]);
        assert_eq!([1.1, 3600.0].map(|now| count(&mut all, &tree, now)), [1; 2]);
        assert_eq!(all.refused()[0].1, KeepOutRefused::Silent("table".to_owned()));
        table_at(&mut tree, 5, 0.5);
        assert_eq!(count(&mut all, &tree, 3601.0), 0);
        assert_eq!(texts(&all)[0], "a_ball/1 sphere 1.5 0 0 0.1");
    }

    #[test]
    fn a_lifetime_begins_again_with_each_message() {
        let (tree, mut all) = (FrameTree::default(), FramedKeepOuts::default());
        let at = |came: u64| FramedKeepOut {
            lifetime: Duration::from_secs(2),
            came: Duration::from_secs(came),
            ..ball(1, "")
        };
        let count = |all: &mut FramedKeepOuts, now: u64| {
            all.look(&tree, "base", Duration::from_secs(now), PATIENCE);
            texts(all).len()
        };
        all.put(at(0), 1).unwrap();
        assert_eq!(count(&mut all, 1), 1);
        all.put(at(1), 1).unwrap();
        assert_eq!((count(&mut all, 2), count(&mut all, 3)), (1, 0));
    }
}
