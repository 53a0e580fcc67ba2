//! What the arm must keep out of, as markers on `~/keep_out`: they are in the servo's parameter `drawn`, in its base frame.

use super::frames::Tree;
use crate::frames::{FramedKeepOut, FramedKeepOuts};
use crate::params::Value;
use crate::ros::{Logger, Node, ParameterServer, RosError, Subscription};
use crate::servo::Goal;
use crate::space::MOST_KEEP_OUTS;
use crate::text::{NAME, shown};
use crate::wire::NodeContract;
use crate::wire::messages::Point;
use crate::wire::visualization::{Marker, MarkerArray};
use std::sync::Arc;
use std::time::Duration;
use tokio::time::Instant;

/// So often frames are looked up, and what is refused is logged.
const INTERVAL: Duration = Duration::from_millis(50);
const WARNING_INTERVAL: Duration = Duration::from_secs(1);

/// Obeys the markers that come to `node`, of which those in frames of `tree` are known in its frame `base`.
///
/// # Errors
/// [`RosError`] where the network refuses.
pub(super) fn obey(
    node: &mut Node,
    contract: &NodeContract,
    (tree, base): (Tree, &str),
    parameters: Arc<ParameterServer>,
) -> Result<(), RosError> {
    let markers = node.adapting_subscription(contract, "~/keep_out")?;
    let log = node.log().clone();
    let listener = Listener {
        markers,
        tree,
        base: base.to_owned(),
        parameters,
        keep_outs: FramedKeepOuts::default(),
        in_force: Vec::new(),
        began: Instant::now(),
        refused: Vec::new(),
        warned: None,
        log,
    };
    node.run(listener.run());
    Ok(())
}

struct Listener {
    markers: Subscription<MarkerArray>,
    tree: Tree,
    base: String,
    parameters: Arc<ParameterServer>,
    keep_outs: FramedKeepOuts,
    /// What the parameter has.
    in_force: Vec<String>,
    began: Instant,
    /// Why something is not obeyed, which is still to be logged; and when that was done.
    refused: Vec<String>,
    warned: Option<Duration>,
    log: Logger,
}

impl Listener {
    async fn run(mut self) {
        let mut is_pending = false;
        loop {
            tokio::select! {
                message = self.markers.next() => self.take(&message),
                () = tokio::time::sleep(INTERVAL), if is_pending || self.keep_outs.may_change() => {}
            }
            is_pending = self.put_into_force();
            // Whoever floods it holds up nothing else that runs here.
            tokio::task::yield_now().await;
        }
    }

    fn take(&mut self, message: &MarkerArray) {
        let count = |name: &str| match self.parameters.value(name) {
            Some(Value::StringArray(texts)) => texts.len(),
            _ => 0,
        };
        let fixed = count("keep_out") + count("keep_in");
        let (most, now) = (MOST_KEEP_OUTS.saturating_sub(fixed), self.began.elapsed());
        for marker in &message.markers {
            let key = (marker.ns.clone(), marker.id);
            let taken = match marker.action {
                Marker::ADD => solid(marker, now)
                    .and_then(|it| self.keep_outs.put(it, most).map_err(|why| why.to_string())),
                Marker::DELETE => {
                    self.keep_outs.remove(&key);
                    Ok(())
                }
                Marker::DELETE_ALL => {
                    self.keep_outs.clear();
                    Ok(())
                }
                other => Err(format!("there is no action {other}")),
            };
            taken.unwrap_or_else(|why| self.refuse(&key, &why));
        }
    }

    fn refuse(&mut self, (namespace, id): &(String, i32), why: &str) {
        self.refused.push(format!("{:?} {id} of ~/keep_out is not obeyed: {why}", shown(namespace, NAME)));
    }

    /// Whether something is still to be put into force or to be logged.
    fn put_into_force(&mut self) -> bool {
        let (now, patience) = (self.began.elapsed(), self.patience());
        let lost = self.keep_outs.look(&self.tree.lock(), &self.base, now, patience);
        lost.iter().for_each(|(key, why)| self.refuse(key, &why.to_string()));
        let texts = self.keep_outs.texts();
        let mut is_in_force = texts == self.in_force;
        if !is_in_force {
            match self.parameters.change("drawn", Value::StringArray(texts.clone())) {
                Ok(()) => (self.in_force, is_in_force) = (texts, true),
                Err(why) => self.refused.push(format!("~/keep_out is not obeyed: {why}")),
            }
        }
        let is_due = self.warned.is_none_or(|warned| now.saturating_sub(warned) >= WARNING_INTERVAL);
        if let Some(why) = self.refused.first().filter(|_| is_due) {
            let more = self.refused.len() - 1;
            let more = if more > 0 { format!(" (and {more} more)") } else { String::new() };
            self.log.warn(&format!("{why}{more}"));
            self.refused.clear();
            self.warned = Some(now);
        }
        !(is_in_force && self.refused.is_empty())
    }

    /// How long a frame may be on its way, as that of a goal.
    fn patience(&self) -> Duration {
        match self.parameters.value("transform_timeout") {
            Some(Value::Double(seconds)) => Duration::try_from_secs_f64(seconds).unwrap_or_default(),
            _ => Duration::ZERO,
        }
    }
}

/// What the arm must keep out of, where a marker that came at `came` is a solid.
fn solid(marker: &Marker, came: Duration) -> Result<FramedKeepOut, String> {
    let scale = &marker.scale;
    let is_round = scale.x == scale.y;
    let (shape, sizes) = match marker.kind {
        Marker::CUBE => ("box", vec![scale.x, scale.y, scale.z]),
        Marker::SPHERE if is_round && scale.x == scale.z => ("sphere", vec![0.5 * scale.x]),
        Marker::CYLINDER if is_round => ("cylinder", vec![0.5 * scale.x, scale.z]),
        Marker::SPHERE | Marker::CYLINDER => return Err("its scale is not that of a circle".to_owned()),
        Marker::TRIANGLE_LIST => ("hull", corners(marker)),
        other => {
            return Err(format!(
                "its type is {other}: expected CUBE (1), SPHERE (2), CYLINDER (3) or TRIANGLE_LIST (11)"
            ));
        }
    };
    let (at, turn) = (&marker.pose.position, &marker.pose.orientation);
    let turn = match [turn.x, turn.y, turn.z, turn.w] {
        // As RViz draws what nobody has turned.
        [0.0, 0.0, 0.0, 0.0] => [0.0, 0.0, 0.0, 1.0],
        turn => turn,
    };
    let pose = Goal::new([at.x, at.y, at.z], turn, "", "").map_err(|why| why.to_string())?;
    Ok(FramedKeepOut {
        key: (marker.ns.clone(), marker.id),
        shape,
        sizes,
        frame: marker.header.frame_id.clone(),
        stamp: marker.header.stamp.nanoseconds(),
        frame_from_shape: *pose.base_from_goal(),
        is_carried: marker.frame_locked,
        came,
        lifetime: (&marker.lifetime).into(),
    })
}

/// The coordinates of the points of a marker, each point once: triangles beside each other share corners.
fn corners(marker: &Marker) -> Vec<f64> {
    let scale = &marker.scale;
    let scaled = |point: &Point| [scale.x * point.x, scale.y * point.y, scale.z * point.z];
    let mut points: Vec<_> = marker.points.iter().map(scaled).collect();
    points.sort_by_key(|point| point.map(f64::to_bits));
    points.dedup();
    points.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::messages::Vector3;

    #[test]
    fn triangles_are_the_hull_of_their_points_each_once_as_large_as_they_are_drawn() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let points = [a, c, b, a, b, d, a, d, c, b, c, d].map(|[x, y, z]| Point { x, y, z });
        let scale = Vector3 { x: 2.0, y: 3.0, z: 4.0 };
        let marker =
            Marker { kind: Marker::TRIANGLE_LIST, scale, points: points.to_vec(), ..Marker::default() };
        let tent = solid(&marker, Duration::ZERO).unwrap();
        let sizes = [[0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 3.0, 0.0], [2.0, 0.0, 0.0]].concat();
        assert_eq!((tent.shape, tent.sizes), ("hull", sizes));
        let mut all = FramedKeepOuts::default();
        let empty = solid(&Marker { points: Vec::new(), ..marker }, Duration::ZERO).unwrap();
        let why = all.put(empty, 1).unwrap_err().to_string();
        assert_eq!(why, "expected finite numbers after hull: x y z of 4 to 100 points");
    }
}
