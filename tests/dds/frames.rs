//! Goals in frames of TF, as another vendor's nodes send them; and their replay, which needs no TF.

use crate::replay::recorded_and_replayed;

#[test]
fn goals_in_frames_of_tf_are_gone_to_or_rejected_by_name_and_replay_to_the_bit() {
    assert!(recorded_and_replayed(&["framed_goals"]).2 > 500);
}

#[test]
fn a_goal_follows_its_frame_holds_where_that_is_lost_and_replays_to_the_bit() {
    assert!(recorded_and_replayed(&["followed_goal"]).2 > 500);
}
