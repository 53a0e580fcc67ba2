//! A ROS 2 node on ros2-client for every vendor. It knows no arm.

#[cfg(test)]
mod alone;
mod dds;
pub mod log_file;
pub mod ros;
pub mod stderr;
