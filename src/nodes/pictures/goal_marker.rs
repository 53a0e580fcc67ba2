//! The goal as an interactive marker that a user can drag: a server of one marker for the InteractiveMarkers display of RViz.
//!
//! A client requests the marker once, and then follows the numbered updates. While one user drags the marker, the server sends no
//! update that would move it.

use super::trace::{angle, distance};
use dq_messages::messages::{Header, Pose, Quaternion};
use dq_messages::visualization::{
    GetInteractiveMarkersResponse, InteractiveMarker, InteractiveMarkerControl, InteractiveMarkerFeedback,
    InteractiveMarkerPose, InteractiveMarkerUpdate,
};
use std::f64::consts::FRAC_1_SQRT_2;
use std::time::Duration;

/// The name of the marker.
const NAME: &str = "goal";

/// The size of the handles \[m\].
const SIZE: f32 = 0.3;

/// The server does not move the marker while the marker is nearer than this to its target \[m, rad\].
const NEAR: f64 = 0.001;
const NEAR_ANGLE: f64 = 0.01;

/// A drag ends when its client has been silent for this long.
const PATIENCE: Duration = Duration::from_secs(10);

/// The longest time from the publication of a goal until the cycle's status shows it.
const TAKEN_WITHIN: Duration = Duration::from_millis(500);

/// The marker of a goal in `frame`.
#[derive(Debug)]
pub(super) struct GoalMarker {
    frame: String,
    server: String,
    pose: Option<Pose>,
    updates: u64,
    /// The name of the client whose user is dragging the marker; `None` if nobody drags it.
    hand: Option<String>,
    /// Until this time, only the client in `hand` moves the marker.
    held: Duration,
}

impl GoalMarker {
    /// Creates the marker of the node `server`, whose goals are in `frame`.
    pub fn new(server: &str, frame: &str) -> Self {
        let (frame, server) = (frame.to_owned(), server.to_owned());
        Self { frame, server, pose: None, updates: 0, hand: None, held: Duration::ZERO }
    }

    /// Returns all data that a new client needs.
    pub fn all(&self) -> GetInteractiveMarkersResponse {
        GetInteractiveMarkersResponse {
            server_id: self.server.clone(),
            sequence_number: self.updates,
            markers: self.marker().into_iter().collect(),
        }
    }

    /// Moves the marker to `pose`, which is the goal, or the tool if there is no goal. Does not move the marker while a user drags
    /// it. Returns the update to publish if the marker moved.
    pub fn follow(&mut self, pose: &Pose, now: Duration) -> Option<InteractiveMarkerUpdate> {
        if now < self.held {
            return None;
        }
        self.hand = None;
        let near = |at: &Pose| distance(at, pose) < NEAR && angle(at, pose) < NEAR_ANGLE;
        if self.pose.as_ref().is_some_and(near) {
            return None;
        }
        let is_new = self.pose.replace(pose.clone()).is_none();
        self.updates += 1;
        let moved =
            InteractiveMarkerPose { header: self.header(), pose: pose.clone(), name: NAME.to_owned() };
        Some(InteractiveMarkerUpdate {
            server_id: self.server.clone(),
            seq_num: self.updates,
            kind: InteractiveMarkerUpdate::UPDATE,
            markers: if is_new { self.marker().into_iter().collect() } else { Vec::new() },
            poses: if is_new { Vec::new() } else { vec![moved] },
            erases: Vec::new(),
        })
    }

    /// Processes an action of a client's user. At the end of a drag, returns the pose to which the marker was dragged, and the
    /// header of the message. Otherwise returns `None`.
    pub fn take(&mut self, feedback: InteractiveMarkerFeedback, now: Duration) -> Option<(Header, Pose)> {
        let InteractiveMarkerFeedback { header, client_id, marker_name, event_type, pose, .. } = feedback;
        let is_other = now < self.held && self.hand.as_ref().is_some_and(|hand| *hand != client_id);
        if marker_name != NAME || is_other {
            return None;
        }
        match event_type {
            InteractiveMarkerFeedback::POSE_UPDATE => {
                (self.hand, self.held) = (Some(client_id), now + PATIENCE);
                self.pose = Some(pose);
                None
            }
            InteractiveMarkerFeedback::MOUSE_UP if self.hand.take()? == client_id => {
                self.held = now + TAKEN_WITHIN;
                self.pose = Some(pose.clone());
                Some((header, pose))
            }
            _ => None,
        }
    }

    /// Returns the header of the marker. The stamp is zero, so that the marker moves with its frame.
    fn header(&self) -> Header {
        Header { frame_id: self.frame.clone(), ..Header::default() }
    }

    fn marker(&self) -> Option<InteractiveMarker> {
        Some(InteractiveMarker {
            header: self.header(),
            pose: self.pose.clone()?,
            name: NAME.to_owned(),
            description: NAME.to_owned(),
            scale: SIZE,
            menu_entries: Vec::new(),
            controls: controls(),
        })
    }
}

/// Returns the controls: an arrow along each axis of the marker, and a ring around each axis.
fn controls() -> Vec<InteractiveMarkerControl> {
    let half = FRAC_1_SQRT_2;
    let turned = |y, z, w| Quaternion { x: 0.0, y, z, w };
    // The rotations that turn the x axis to the x, the y and the z axis.
    let axes =
        [("x", turned(0.0, 0.0, 1.0)), ("y", turned(0.0, half, half)), ("z", turned(-half, 0.0, half))];
    let modes =
        [("move", InteractiveMarkerControl::MOVE_AXIS), ("turn", InteractiveMarkerControl::ROTATE_AXIS)];
    let control = |(axis, orientation): &(&str, Quaternion), (mode, interaction_mode): (&str, u8)| {
        InteractiveMarkerControl {
            name: format!("{mode}_{axis}"),
            orientation: orientation.clone(),
            interaction_mode,
            ..InteractiveMarkerControl::default()
        }
    };
    axes.iter().flat_map(|axis| modes.map(|mode| control(axis, mode))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    const MS: Duration = Duration::from_millis(1);

    fn at(x: f64) -> Pose {
        [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into()
    }

    fn feedback(client: &str, event_type: u8, x: f64) -> InteractiveMarkerFeedback {
        let (client_id, marker_name) = (client.to_owned(), NAME.to_owned());
        InteractiveMarkerFeedback { client_id, marker_name, event_type, pose: at(x), ..Default::default() }
    }

    const DRAG: u8 = InteractiveMarkerFeedback::POSE_UPDATE;
    const UP: u8 = InteractiveMarkerFeedback::MOUSE_UP;

    #[test]
    fn the_six_handles_move_along_and_about_the_three_axes() {
        let controls = controls();
        assert_eq!(controls.len(), 6);
        for (control, axis) in controls.iter().zip([0, 0, 1, 1, 2, 2]) {
            let Quaternion { x, y, z, w } = control.orientation;
            let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
            assert!((turn * Vector3::x())[axis] > 1.0 - 1e-12, "{}", control.name);
        }
    }

    #[test]
    fn updates_are_numbered_and_sent_only_on_changes() {
        let mut marker = GoalMarker::new("/dq_servo", "base_link");
        assert_eq!((marker.all().markers.len(), marker.all().sequence_number), (0, 0));
        let first = marker.follow(&at(0.0), MS).unwrap();
        assert_eq!((first.seq_num, first.markers.len(), first.poses.len()), (1, 1, 0));
        assert_eq!(marker.follow(&at(0.0005), MS), None, "nobody sees that");
        let second = marker.follow(&at(0.1), MS).unwrap();
        assert_eq!((second.seq_num, second.markers.len(), second.poses[0].pose.clone()), (2, 0, at(0.1)));
        let all = marker.all();
        assert_eq!((all.sequence_number, all.markers[0].pose.clone()), (2, at(0.1)));
        assert_eq!(
            (all.markers[0].header.frame_id.as_str(), all.markers[0].controls.len()),
            ("base_link", 6)
        );
    }

    #[test]
    fn the_end_of_a_drag_is_a_goal_but_a_click_is_not() {
        let mut marker = GoalMarker::new("/dq_servo", "base_link");
        marker.follow(&at(0.0), MS);
        assert_eq!(marker.take(feedback("a", UP, 0.0), MS), None, "a click");
        assert_eq!(marker.take(feedback("a", DRAG, 0.3), MS), None);
        assert_eq!(marker.follow(&at(0.0), 2 * MS), None, "not under the user's hand");
        let others = InteractiveMarkerFeedback { marker_name: "x".to_owned(), ..feedback("a", UP, 1.0) };
        assert_eq!(marker.take(others, 2 * MS), None);
        assert_eq!(marker.take(feedback("a", UP, 0.4), 3 * MS), Some((Header::default(), at(0.4))));
        assert_eq!(marker.take(feedback("a", UP, 0.4), 3 * MS), None, "once");
        assert_eq!(marker.follow(&at(0.4), 4 * MS), None, "it is where the goal is");
        let refused = marker.follow(&at(0.0), 600 * MS).unwrap();
        assert_eq!(refused.poses[0].pose, at(0.0), "a goal that was not taken lets the marker go back");
    }

    #[test]
    fn one_client_drags_at_a_time_and_a_silent_one_loses_the_drag() {
        let mut marker = GoalMarker::new("/dq_servo", "base_link");
        marker.follow(&at(0.0), MS);
        marker.take(feedback("a", DRAG, 0.3), MS);
        assert_eq!(marker.take(feedback("b", DRAG, 0.7), 2 * MS), None);
        assert_eq!(marker.take(feedback("b", UP, 0.7), 2 * MS), None, "b has nothing in hand");
        let later = PATIENCE + 2 * MS;
        assert!(marker.follow(&at(0.0), later).is_some());
        marker.take(feedback("b", DRAG, 0.7), later);
        assert_eq!(marker.take(feedback("b", UP, 0.7), later), Some((Header::default(), at(0.7))));
    }
}
