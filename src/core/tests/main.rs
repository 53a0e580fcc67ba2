//! The servo in fake time, on every kind of arm.

#[path = "../../kinematics/tests/aims.rs"]
mod aims;
mod arms;
mod cooperative;
mod fewer_joints;
mod invariants;
mod opinion;
mod own_loop;
mod posture;
mod reference;
mod rig;
mod search;
mod second_order;
mod sent;
mod servo;
mod sim;
