//! What is to be kept out of in frames of TF: where it is in the base frame, until it is removed or its time is up.

use super::{FrameError, FrameTree};
use crate::dq::UnitDualQuaternion;
use crate::space::{KeepOut, KeepOutError, LONGEST_NAME};
use nalgebra::Vector3;
use std::time::Duration;
use thiserror::Error;

/// A [`KeepOut`] in a frame of TF.
#[derive(Clone, Debug, PartialEq)]
pub struct FramedKeepOut {
    /// Its namespace and its number there: one more of the same takes its place.
    pub key: (String, i32),
    /// The shape as [`KeepOut`] writes it, and its sizes \[m\].
    pub shape: &'static str,
    /// As many as the shape has; of a hull the coordinates of its points.
    pub sizes: Vec<f64>,
    /// The frame of its pose.
    pub frame: String,
    /// When the pose holds \[ns\]; 0: at the newest time there is.
    pub stamp: i64,
    /// Its middle, and its axes.
    pub frame_from_shape: UnitDualQuaternion,
    /// Whether it moves with its frame from then on.
    pub is_carried: bool,
    /// When it came.
    pub came: Duration,
    /// How long it stays; zero for ever.
    pub lifetime: Duration,
}

/// Why a keep-out is not obeyed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum KeepOutRefused {
    /// It is none.
    #[error(transparent)]
    NoKeepOut(#[from] KeepOutError),
    /// Nobody says where its frame is.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// There are as many as there may be.
    #[error("there are {0} already, as many as there may be")]
    TooMany(usize),
    /// Its name, as a [`Name`](crate::space::Name) has it, would be that of another one.
    #[error("shortened to {0:?} it has the name of another one")]
    Namesake(String),
}

/// A frame that moves by less moves nothing \[m, rad\].
const STILL: f64 = 1e-3;

/// Keep-outs in frames of TF.
#[derive(Clone, Debug, Default)]
pub struct FramedKeepOuts {
    all: Vec<Entry>,
}

#[derive(Clone, Debug)]
struct Entry {
    keep_out: FramedKeepOut,
    /// Whether it was not found yet since it came.
    waits: bool,
    /// Where its frame was found last, and what [`KeepOut`] reads; of one that waits that of the one before.
    placed: Option<(UnitDualQuaternion, String)>,
}

impl FramedKeepOut {
    /// Its name in reasons.
    fn name(&self) -> String {
        let (namespace, id) = &self.key;
        let id = format!("/{id}");
        let known = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '_' };
        let namespace = if namespace.is_empty() { "marker" } else { namespace };
        namespace.chars().map(known).take(LONGEST_NAME - id.len()).chain(id.chars()).collect()
    }

    /// What [`KeepOut`] reads, with its frame there.
    fn text(&self, base_from_frame: &UnitDualQuaternion) -> Result<String, KeepOutError> {
        let pose = *base_from_frame * self.frame_from_shape;
        let (at, turn) = (pose.translation(), pose.rotation());
        let numbers: Vec<f64> = match self.shape {
            "hull" => {
                let points = self.sizes.chunks_exact(3).map(Vector3::from_column_slice);
                points.flat_map(|point| <[f64; 3]>::from(turn * point + at)).collect()
            }
            "sphere" => at.iter().chain(&self.sizes).copied().collect(),
            _ => at.iter().chain(&self.sizes).chain(&turn.coords).copied().collect(),
        };
        let numbers: String = numbers.iter().map(|number| format!(" {number}")).collect();
        let text = format!("{} {}{numbers}", self.name(), self.shape);
        text.parse::<KeepOut>().map(|_| text)
    }
}

impl FramedKeepOuts {
    /// Adds one, or puts it in the place of that with its key, where it becomes no more than `most`.
    ///
    /// # Errors
    /// [`KeepOutRefused`]: then all is as it was.
    pub fn put(&mut self, keep_out: FramedKeepOut, most: usize) -> Result<(), KeepOutRefused> {
        keep_out.text(&UnitDualQuaternion::identity())?;
        let name = keep_out.name();
        if let Some(known) = self.all.iter_mut().find(|known| known.keep_out.key == keep_out.key) {
            (known.keep_out, known.waits) = (keep_out, true);
        } else if self.all.len() >= most {
            return Err(KeepOutRefused::TooMany(most));
        } else if self.all.iter().any(|known| known.keep_out.name() == name) {
            return Err(KeepOutRefused::Namesake(name));
        } else {
            self.all.push(Entry { keep_out, waits: true, placed: None });
        }
        Ok(())
    }

    /// Removes that one.
    pub fn remove(&mut self, key: &(String, i32)) {
        self.all.retain(|known| known.keep_out.key != *key);
    }

    /// Removes all.
    pub fn clear(&mut self) {
        self.all.clear();
    }

    /// Whether time alone may change something.
    pub fn may_change(&self) -> bool {
        let may_change = |one: &FramedKeepOut| one.is_carried || !one.lifetime.is_zero();
        self.all.iter().any(|known| known.waits || may_change(&known.keep_out))
    }

    /// Looks where frames are in `base` at `now`; those that are not found in `patience` are returned. One that took the place of another
    /// leaves that in force until then, and after.
    pub fn look(
        &mut self,
        tree: &FrameTree,
        base: &str,
        now: Duration,
        patience: Duration,
    ) -> Vec<((String, i32), KeepOutRefused)> {
        let mut refused = Vec::new();
        self.all.retain_mut(|known| {
            let Entry { keep_out, waits, placed } = known;
            let waited = now.saturating_sub(keep_out.came);
            let is_over = !keep_out.lifetime.is_zero() && waited >= keep_out.lifetime;
            if is_over || !(*waits || keep_out.is_carried) {
                return !is_over;
            }
            let frame = if keep_out.frame.is_empty() { base } else { &keep_out.frame };
            let exact = tree.lookup(base, frame, if keep_out.is_carried { 0 } else { keep_out.stamp });
            let is_early = exact.as_ref().is_err_and(|why| why.may_pass() && waited < patience);
            // Where the frame was last is nearer to the truth than nowhere.
            let found = if is_early { tree.lookup(base, frame, 0) } else { exact };
            if is_early && found.is_err() {
                return true;
            }
            let stands = |now: &UnitDualQuaternion| {
                let is_near =
                    |before: &UnitDualQuaternion| now.distances(before).iter().all(|way| *way < STILL);
                !*waits && placed.as_ref().is_some_and(|(before, _)| is_near(before))
            };
            let next = found.map_err(KeepOutRefused::from).and_then(|found| {
                let text = if stands(&found) { None } else { Some(keep_out.text(&found)?) };
                Ok(text.map(|text| (found, text)))
            });
            match next {
                Ok(next) => *placed = next.or(placed.take()),
                // Of one that was found once it is not said again.
                Err(why) if *waits => refused.push((keep_out.key.clone(), why)),
                Err(_) => {}
            }
            *waits = is_early;
            placed.is_some()
        });
        refused
    }

    /// What [`KeepOut`] reads of each that was found.
    pub fn texts(&self) -> Vec<String> {
        self.all.iter().filter_map(|known| Some(known.placed.as_ref()?.1.clone())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Transform;
    use nalgebra::UnitQuaternion;

    const PATIENCE: Duration = Duration::from_secs(1);

    fn ball(id: i32, frame: &str) -> FramedKeepOut {
        FramedKeepOut {
            key: ("a ball".to_owned(), id),
            shape: "sphere",
            sizes: vec![0.1],
            frame: frame.to_owned(),
            stamp: 5,
            frame_from_shape: UnitDualQuaternion::from_parts(Default::default(), [1.0, 0.0, 0.0].into()),
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
    fn each_is_where_its_frame_was_or_moves_with_it() {
        let (mut tree, mut all) = (FrameTree::default(), FramedKeepOuts::default());
        all.put(ball(1, "base"), 4).unwrap();
        all.put(ball(2, "table"), 4).unwrap();
        all.put(FramedKeepOut { is_carried: true, ..ball(3, "table") }, 4).unwrap();
        let look =
            |all: &mut FramedKeepOuts, tree: &FrameTree| all.look(tree, "base", Duration::ZERO, PATIENCE);
        assert_eq!(look(&mut all, &tree), []);
        assert_eq!(all.texts(), ["a_ball/1 sphere 1 0 0 0.1"], "others wait for their frame");
        table_at(&mut tree, 4, 0.0);
        look(&mut all, &tree);
        assert_eq!(all.texts()[1], "a_ball/2 sphere 1 0 0 0.1", "as far as is known");
        table_at(&mut tree, 6, 2.0);
        look(&mut all, &tree);
        let expected =
            ["a_ball/1 sphere 1 0 0 0.1", "a_ball/2 sphere 2 0 0 0.1", "a_ball/3 sphere 3 0 0 0.1"];
        assert_eq!(all.texts(), expected);
        table_at(&mut tree, 7, 2.0005);
        look(&mut all, &tree);
        assert_eq!(all.texts(), expected, "that is noise");
        table_at(&mut tree, 8, 3.0);
        look(&mut all, &tree);
        assert_eq!(all.texts()[1..], ["a_ball/2 sphere 2 0 0 0.1", "a_ball/3 sphere 4 0 0 0.1"]);
        all.remove(&("a ball".to_owned(), 2));
        assert_eq!(all.texts().len(), 2);
        all.clear();
        assert!(all.texts().is_empty() && !all.may_change());
    }

    #[test]
    fn the_points_of_a_hull_are_in_the_base_frame() {
        let mut all = FramedKeepOuts::default();
        let sizes = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let frame_from_shape = UnitDualQuaternion::from_parts(turn, [1.0, 0.0, 0.0].into());
        let tent = FramedKeepOut { shape: "hull", sizes, frame_from_shape, ..ball(1, "") };
        all.put(tent.clone(), 1).unwrap();
        all.look(&FrameTree::default(), "base", Duration::ZERO, PATIENCE);
        let hull: KeepOut = all.texts()[0].parse().unwrap();
        // What was along x is along y.
        let (above, _) = hull.shape.distance(&Vector3::new(1.0, 1.2, 0.0));
        assert!((above - 0.2).abs() < 1e-12, "{above}");
        let flat = FramedKeepOut { sizes: [0.0, 0.0, 1.0].repeat(4), ..tent };
        let why = all.put(flat, 1).unwrap_err();
        assert!(matches!(why, KeepOutRefused::NoKeepOut(KeepOutError::Flat)), "{why}");
    }

    #[test]
    fn what_is_refused_leaves_all_else_as_it_was() {
        let (tree, mut all) = (FrameTree::default(), FramedKeepOuts::default());
        all.put(ball(1, ""), 2).unwrap();
        let refused = |all: &mut FramedKeepOuts, one: FramedKeepOut| all.put(one, 2).unwrap_err();
        for size in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            let why = refused(&mut all, FramedKeepOut { sizes: vec![size], ..ball(1, "") });
            assert!(matches!(why, KeepOutRefused::NoKeepOut(_)), "{why}");
        }
        let namesake = FramedKeepOut { key: ("a_ball".to_owned(), 1), ..ball(1, "") };
        assert!(matches!(refused(&mut all, namesake), KeepOutRefused::Namesake(_)));
        all.look(&tree, "base", Duration::ZERO, PATIENCE);
        // In the place of the first, but in a frame that there is not.
        all.put(ball(1, "nowhere"), 2).unwrap();
        all.put(ball(2, "nowhere"), 2).unwrap();
        assert_eq!(refused(&mut all, ball(3, "")), KeepOutRefused::TooMany(2));
        assert!(all.may_change() && all.look(&tree, "base", PATIENCE / 2, PATIENCE).is_empty());
        let lost = all.look(&tree, "base", PATIENCE, PATIENCE);
        assert!(
            matches!(lost[..], [(_, KeepOutRefused::Frame(_)), (_, KeepOutRefused::Frame(_))]),
            "{lost:?}"
        );
        assert_eq!(all.texts(), ["a_ball/1 sphere 1 0 0 0.1"]);
        assert!(!all.may_change() && all.look(&tree, "base", PATIENCE, PATIENCE).is_empty());
    }

    #[test]
    fn a_lifetime_begins_anew_with_each_message() {
        let (tree, mut all) = (FrameTree::default(), FramedKeepOuts::default());
        let at = |came: u64| FramedKeepOut {
            lifetime: Duration::from_secs(2),
            came: Duration::from_secs(came),
            ..ball(1, "")
        };
        let count = |all: &mut FramedKeepOuts, now: u64| {
            all.look(&tree, "base", Duration::from_secs(now), PATIENCE);
            all.texts().len()
        };
        all.put(at(0), 1).unwrap();
        assert_eq!(count(&mut all, 1), 1);
        all.put(at(1), 1).unwrap();
        assert_eq!((count(&mut all, 2), count(&mut all, 3)), (1, 0));
    }
}
