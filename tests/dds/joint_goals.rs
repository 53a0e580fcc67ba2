//! Tests joint goals from the command line over DDS, and that their record replays.

use crate::commands::{err, status};
use crate::host::Host;
use crate::record::wait_for;
use crate::replay::{assert_replays, place};
use dq_config::ServoParameters;
use dq_nodes::Prepared;
use dq_ros::ros::RosArgs;
use dq_runs::recorded;

#[test]
fn joint_goals_arrive_are_rejected_with_their_reason_and_replay_bit_for_bit() {
    let mut host = Host::with_both_nodes();
    let (_directory, bag) = place();
    host.record(&bag);
    wait_for(&bag, "/dq_servo/events", 0.0);
    let all = host.output(&["goal", "--joints", "0.9,1.0,2.0,0.5,-0.5,1.9"]);
    assert!(all.starts_with("arrived with joint_line after") && !all.contains("path 0.00"), "{all}");
    host.output(&["goal", "--joints", "joint2=0.7,joint5=-0.4"]);
    let now = status(&host);
    assert_eq!((&now["state"], &now["goal_count"]), (&"settled".into(), &2.into()), "{now}");
    for (joints, reason) in [
        ("elbow=1", "\"elbow\" is not a joint of the arm, expected joint1, joint2"),
        ("0.9,1.0", "2 numbers, expected 6: one per joint"),
        ("joint1=nan", "position of joint 1 is NaN"),
    ] {
        let rejected = host.run(&["goal", "--joints", joints]);
        assert_eq!(rejected.status.code(), Some(1), "{joints}");
        let message = err(&rejected);
        assert!(message.contains(&format!("the goal was rejected: {reason}")), "{message}");
    }
    assert_eq!(status(&host)["state"], "settled", "the last goal stays");
    assert_eq!(host.interrupt("recorder").0, Some(0));
    assert!(assert_replays(&bag) > 100);
    let servo = Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap();
    let runs = recorded(&bag, "run", servo.parameters()).unwrap().runs;
    let [run] = runs.as_slice() else { panic!("{runs:?}") };
    let laws: Vec<_> = run.motions.iter().map(|motion| motion.law.as_str()).collect();
    assert_eq!(laws, ["joint_line", "joint_line"]);
    let end = &run.samples.last().unwrap().positions;
    let apart = end.iter().zip([0.9, 0.7, 2.0, 0.5, -0.4, 1.9]).map(|(is, goal)| (is - goal).abs());
    assert!(apart.fold(0.0, f64::max) < 0.01, "{end:?}");
}
