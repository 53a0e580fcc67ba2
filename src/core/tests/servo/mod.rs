//! The cycle in fake time: a test for each state and each safety rule of the guide. The rig checks the invariants in every cycle of
//! every test.

mod allocations;
mod asks;
mod delays;
mod events;
mod fed_back;
mod follow;
mod franka;
mod goals;
mod huge;
mod inputs;
mod interfaces;
mod jerk;
mod jog;
mod joint_goals;
mod keep_in;
mod keep_out;
mod keep_out_sequences;
mod law_memory;
mod laws;
mod limits;
mod link;
mod lost_frame;
#[cfg(debug_assertions)]
mod measured_gaps;
mod memory;
mod motions;
mod moving;
mod parts;
mod position_limits;
mod reconfigure;
mod resumed;
mod sag;
mod sequences;
mod settings;
mod singular;
mod stability;
mod standing;
mod stopping;
mod superseded;
mod swinging;
mod timing;
mod tool;
mod tool_speed;
mod unreachable;
mod what_is_sent;
