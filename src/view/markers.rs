//! The markers of the servo's `~/markers` that the page also draws: the keep-outs, the keep-ins, and the nearest pair.

use dq_messages::PoseNumbers;
use dq_messages::messages::Point;
use dq_messages::visualization::{Marker, MarkerArray};
use serde_json::{Value, json};

/// Returns the JSON message that shows the markers. It contains the kind, pose and size \[m\] of each solid, and the corners of the
/// triangles of hulls. If there is a nearest pair, it also contains the two ends of the gap.
pub(super) fn frame(drawn: &MarkerArray) -> String {
    let of = |ns: &'static str| drawn.markers.iter().filter(move |marker| marker.ns == ns);
    let solids =
        |ns| -> Vec<_> { of(ns).filter(|marker| marker.action == Marker::ADD).filter_map(solid).collect() };
    let closest: Vec<_> = of("closest").flat_map(|marker| &marker.points).map(numbers).collect();
    let (out, inside) = (solids("keep_out"), solids("keep_in"));
    json!({ "markers": { "keep_outs": out, "keep_ins": inside, "closest": closest } }).to_string()
}

fn solid(marker: &Marker) -> Option<Value> {
    let kind = match marker.kind {
        Marker::CUBE => "box",
        Marker::SPHERE => "ball",
        Marker::CYLINDER => "cylinder",
        Marker::TRIANGLE_LIST => "hull",
        _ => return None,
    };
    let (p, q) = (&marker.pose.position, &marker.pose.orientation);
    let pose: PoseNumbers = [p.x, p.y, p.z, q.x, q.y, q.z, q.w];
    let size = [marker.scale.x, marker.scale.y, marker.scale.z];
    let points: Vec<_> = marker.points.iter().map(numbers).collect();
    Some(json!({ "kind": kind, "pose": pose, "size": size, "points": points }))
}

fn numbers(point: &Point) -> [f64; 3] {
    [point.x, point.y, point.z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_gets_solids_that_are_there_and_the_nearest_pair() {
        let marker = |ns: &str, kind, action| Marker {
            ns: ns.to_owned(),
            kind,
            action,
            pose: [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0].into(),
            ..Marker::default()
        };
        let mut pair = marker("closest", Marker::LINE_LIST, Marker::ADD);
        pair.points = vec![Point { x: 0.1, y: 0.2, z: 0.3 }, Point { x: 0.4, y: 0.5, z: 0.6 }];
        let mut hull = marker("keep_in", Marker::TRIANGLE_LIST, Marker::ADD);
        hull.points = pair.points[..1].to_vec();
        let markers = vec![
            marker("keep_out", Marker::CUBE, Marker::ADD),
            marker("keep_out", Marker::SPHERE, Marker::DELETE),
            marker("goal", Marker::LINE_LIST, Marker::ADD),
            marker("keep_in", Marker::CUBE, Marker::ADD),
            hull,
            pair,
        ];
        let shown: Value = serde_json::from_str(&frame(&MarkerArray { markers })).unwrap();
        let solid = json!({ "kind": "box", "pose": [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0], "size": [0.0, 0.0, 0.0], "points": [] });
        let mut hull = solid.clone();
        (hull["kind"], hull["points"]) = (json!("hull"), json!([[0.1, 0.2, 0.3]]));
        assert_eq!(shown["markers"]["keep_outs"], json!([solid]));
        assert_eq!(shown["markers"]["keep_ins"], json!([solid, hull]));
        assert_eq!(shown["markers"]["closest"], json!([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]));
    }
}
