//! Tests of the servo with every kind of arm. The tests simulate the time, so that they do not wait.

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
