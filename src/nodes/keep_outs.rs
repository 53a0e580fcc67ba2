//! The live keep-outs, which are markers on `~/keep_out`. The servo obeys them in addition to the keep-outs of the parameters. They
//! are built on their own thread, because hulls take long to build.

use super::frames::Tree;
use super::in_force::InForce;
use super::node_setup::NodeSetup;
use super::throttle::Throttle;
use dq_common::text::{NAME, cut, shown};
use dq_core::servo::Goal;
use dq_messages::messages::Point;
use dq_messages::visualization::{Marker, MarkerArray};
use dq_ros::ros::{Logger, RosError, Subscription};
use dq_space::frames::{FramedKeepOut, FramedKeepOuts, KeepOutKey, KeepOutRefused};
use dq_space::space::{NO_TURN, Solid};
use nalgebra::Vector3;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::Instant;

/// The interval at which frames are looked up.
const INTERVAL: Duration = Duration::from_millis(50);

/// The shortest time between two warnings.
const WARNING_INTERVAL: Duration = Duration::from_secs(1);

/// Subscribes to the markers, and lets the servo obey them as keep-outs. The frames of the markers are looked up in `tree`, relative
/// to the frame `base`.
///
/// # Errors
/// [`RosError`] if the network fails.
pub(super) fn obey(
    NodeSetup { node, contract, .. }: &mut NodeSetup,
    tree: Tree,
    base: &str,
    in_force: Arc<InForce>,
) -> Result<(), RosError> {
    let markers = node.adapting_subscription(contract, "~/keep_out")?;
    let drawn = DrawnKeepOuts {
        tree,
        base: base.to_owned(),
        in_force,
        keep_outs: FramedKeepOuts::default(),
        began: Instant::now(),
        unsaid: Vec::new(),
        warning_due: Throttle::new(WARNING_INTERVAL),
        log: node.log().clone(),
    };
    node.run(run(markers, drawn));
    Ok(())
}

/// Processes markers until the node ends. After each piece of work, pauses for as long as the work took, so that markers occupy at
/// most half of one processor.
async fn run(markers: Subscription<MarkerArray>, mut drawn: DrawnKeepOuts) {
    let mut is_pending = false;
    loop {
        let mut messages = Vec::new();
        tokio::select! {
            message = markers.next() => messages.push(message),
            () = tokio::time::sleep(INTERVAL), if is_pending || drawn.keep_outs.may_change() => {}
        }
        markers.each(|message, _| messages.push(message));
        // Hulls take long to build; requests for parameters must not wait for them.
        let work = tokio::task::spawn_blocking(move || {
            let began = Instant::now();
            messages.iter().for_each(|message| drawn.take(message));
            let is_pending = drawn.put_into_force();
            (drawn, is_pending, began.elapsed())
        });
        let Ok((back, pending, worked)) = work.await else { return };
        (drawn, is_pending) = (back, pending);
        tokio::time::sleep(worked).await;
    }
}

/// The live keep-outs.
struct DrawnKeepOuts {
    tree: Tree,
    base: String,
    in_force: Arc<InForce>,
    keep_outs: FramedKeepOuts,
    began: Instant,
    /// The reasons, not yet logged, why keep-outs are not obeyed. Deleting a keep-out also removes its reason.
    unsaid: Vec<(KeepOutKey, String)>,
    warning_due: Throttle,
    log: Logger,
}

impl DrawnKeepOuts {
    fn take(&mut self, message: &MarkerArray) {
        let (most, now) = (self.in_force.room(), self.began.elapsed());
        for marker in &message.markers {
            let key = key(marker);
            let taken = match marker.action {
                Marker::ADD => framed(marker, now).and_then(|one| self.keep_outs.put(one, most)),
                Marker::DELETE => {
                    self.keep_outs.remove(&key);
                    self.unsaid.retain(|(of, _)| *of != key);
                    Ok(())
                }
                Marker::DELETE_ALL => {
                    self.keep_outs.clear();
                    self.unsaid.clear();
                    Ok(())
                }
                other => Err(KeepOutRefused::NoSolid(format!("there is no action {other}"))),
            };
            if let Err(why) = taken {
                self.unsaid.push((key.clone(), said(&key, &why)));
                self.keep_outs.refuse(key, why);
            }
        }
    }

    /// Puts the keep-outs of `~/keep_out` into force, and logs refusals. Returns whether keep-outs or log lines are still pending.
    fn put_into_force(&mut self) -> bool {
        let (now, patience) = (self.began.elapsed(), self.in_force.patience());
        let lost = self.keep_outs.look(&self.tree.lock(), &self.base, now, patience);
        self.unsaid.extend(lost.into_iter().map(|(key, why)| {
            let why = said(&key, &why);
            (key, why)
        }));
        let drawn = self.keep_outs.in_base();
        let mut is_in_force = self.in_force.is_drawn(&drawn);
        // The latest refusal comes first.
        let refused = self.keep_outs.refused().iter().rev();
        let mut refused: Vec<_> = refused.map(|(key, why)| said(key, why)).collect();
        if !is_in_force {
            match self.in_force.draw(drawn) {
                Ok(()) => is_in_force = true,
                Err(why) => {
                    refused.insert(0, format!("what is drawn on ~/keep_out now is not obeyed: {why}"))
                }
            }
        }
        self.in_force.refuse(together(&refused));
        if !self.unsaid.is_empty() && self.warning_due.is_due(now) {
            let unsaid: Vec<_> = self.unsaid.drain(..).map(|(_, why)| why).collect();
            together(&unsaid).iter().for_each(|why| self.log.warn(why));
        }
        !(is_in_force && self.unsaid.is_empty())
    }
}

/// Returns a text that says why a keep-out is not obeyed, or why it no longer moves with its frame.
fn said(KeepOutKey { namespace, id }: &KeepOutKey, why: &KeepOutRefused) -> String {
    let how = if matches!(why, KeepOutRefused::Silent(_)) { "does not move" } else { "is not obeyed" };
    cut(&format!("{:?} {id} of ~/keep_out {how}: {why}", shown(namespace, NAME))).into_owned()
}

/// Returns the first of the texts, followed by the number of other texts; `None` if there are no texts.
fn together(all: &[String]) -> Option<String> {
    let (first, more) = all.split_first()?;
    Some(if more.is_empty() { first.clone() } else { format!("{first} (and {} more)", more.len()) })
}

/// Converts a marker that arrived at `came` to a keep-out. Returns an error if the marker is not a solid.
fn framed(marker: &Marker, came: Duration) -> Result<FramedKeepOut, KeepOutRefused> {
    Ok(FramedKeepOut {
        key: key(marker),
        solid: solid(marker).map_err(KeepOutRefused::NoSolid)?,
        frame: marker.header.frame_id.clone(),
        stamp: marker.header.stamp.nanoseconds(),
        is_carried: marker.frame_locked,
        came,
        lifetime: (&marker.lifetime).into(),
    })
}

fn key(marker: &Marker) -> KeepOutKey {
    KeepOutKey { namespace: marker.ns.clone(), id: marker.id }
}

/// Converts a marker to a solid in the marker's frame, or returns the error in the marker.
fn solid(marker: &Marker) -> Result<Solid, String> {
    let scale = &marker.scale;
    let (is_round, center, turn) = (scale.x == scale.y, Vector3::zeros(), NO_TURN);
    let solid = match marker.kind {
        Marker::CUBE => Solid::Box { center, turn, lengths: Vector3::new(scale.x, scale.y, scale.z) },
        Marker::SPHERE if is_round && scale.x == scale.z => Solid::Sphere { center, radius: 0.5 * scale.x },
        Marker::CYLINDER if is_round => {
            Solid::Cylinder { center, turn, radius: 0.5 * scale.x, length: scale.z }
        }
        Marker::SPHERE | Marker::CYLINDER => return Err("its scale is not that of a circle".to_owned()),
        Marker::TRIANGLE_LIST => Solid::Hull { points: corners(marker) },
        other => {
            return Err(format!(
                "its type is {other}: expected CUBE (1), SPHERE (2), CYLINDER (3) or TRIANGLE_LIST (11)"
            ));
        }
    };
    let (at, turn) = (&marker.pose.position, &marker.pose.orientation);
    let turn = match [turn.x, turn.y, turn.z, turn.w] {
        // RViz draws a quaternion of zeros as not rotated.
        [0.0, 0.0, 0.0, 0.0] => NO_TURN,
        turn => turn,
    };
    let pose = Goal::new([at.x, at.y, at.z], turn, "", "").map_err(|why| why.to_string())?;
    Ok(solid.moved(&pose.base_from_goal().frame()))
}

/// Returns the points of a marker, multiplied by the marker's scale. Adjacent triangles share corners, so duplicates are removed.
fn corners(marker: &Marker) -> Vec<Vector3<f64>> {
    let scale = &marker.scale;
    let scaled = |point: &Point| [scale.x * point.x, scale.y * point.y, scale.z * point.z];
    let mut points: Vec<_> = marker.points.iter().map(scaled).collect();
    points.sort_by_key(|point| point.map(f64::to_bits));
    points.dedup();
    points.into_iter().map(Vector3::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_messages::messages;

    #[test]
    fn triangles_are_the_hull_of_their_points_each_once_as_large_as_they_are_drawn() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let points = [a, c, b, a, b, d, a, d, c, b, c, d].map(|[x, y, z]| Point { x, y, z });
        let scale = messages::Vector3 { x: 2.0, y: 3.0, z: 4.0 };
        let marker =
            Marker { kind: Marker::TRIANGLE_LIST, scale, points: points.to_vec(), ..Marker::default() };
        let tent = solid(&marker).unwrap();
        assert_eq!(tent.to_string(), "hull 0 0 0 0 0 4 0 3 0 2 0 0");
        let mut all = FramedKeepOuts::default();
        let empty = framed(&Marker { points: Vec::new(), ..marker }, Duration::ZERO).unwrap();
        all.put(empty, 1).unwrap();
        let lost = all.look(&dq_space::frames::FrameTree::default(), "base", Duration::ZERO, Duration::ZERO);
        assert_eq!(lost[0].1.to_string(), "expected finite numbers after hull: x y z of 4 to 100 points");
        assert_eq!(
            said(&lost[0].0, &lost[0].1),
            "\"\" 0 of ~/keep_out is not obeyed: expected finite numbers after hull: x y z of 4 to 100 points"
        );
    }
}
