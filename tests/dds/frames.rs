//! Goals in frames of TF, as another vendor's nodes send them; and their replay, which needs no TF.

use crate::host::Host;
use crate::replay::{assert_replays, place};

#[test]
fn goals_in_frames_of_tf_are_gone_to_or_rejected_by_name_and_replay_to_the_bit() {
    let mut host = Host::with_both_nodes();
    let (_directory, bag) = place();
    host.start("recorder", &["record", "-o", bag.to_str().unwrap()]);
    crate::record::wait_for(&bag, "/joint_states", 0.0);
    host.peer(&["framed_goals"]);
    assert_eq!(host.interrupt("recorder").0, Some(0));
    assert!(assert_replays(&bag) > 500);
}

#[test]
fn a_goal_follows_its_frame_holds_where_that_is_lost_and_replays_to_the_bit() {
    let mut host = Host::with_both_nodes();
    let (_directory, bag) = place();
    host.start("recorder", &["record", "-o", bag.to_str().unwrap()]);
    crate::record::wait_for(&bag, "/joint_states", 0.0);
    host.peer(&["followed_goal"]);
    assert_eq!(host.interrupt("recorder").0, Some(0));
    assert!(assert_replays(&bag) > 500);
}
