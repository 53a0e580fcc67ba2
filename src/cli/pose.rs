//! `dq_servo pose`: forward kinematics on the command line.

use super::arm::ArmChoice;
use super::print::{StdoutError, print_line, short};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::JointOrder;
use dq_kinematics::arm::JointKind;
use dq_ros::ros::RosArgs;
use dq_ros::stderr;
use dq_wire::pose_numbers;
use serde_json::json;
use std::f64::consts::TAU;

/// Print the tool pose of joint positions
#[derive(clap::Args)]
pub(super) struct Pose {
    /// Joint positions, base first [rad, prismatic: m]
    #[arg(required = true, allow_negative_numbers = true, value_name = "J")]
    joints: Vec<f64>,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    arm: ArmChoice,
}

impl Pose {
    pub(super) fn run(&self, ros_args: &RosArgs) -> super::Result<()> {
        let prepared = super::offline(self.arm.and(ros_args))?;
        let parameters = prepared.parameters();
        if let Some(bad) = self.joints.iter().find(|position| !position.is_finite()) {
            return Err(super::Usage(format!("joint position {bad}: expected a finite number")).into());
        }
        let chain = parameters.arms.chain();
        let base_from_tool = chain.forward_kinematics(&self.joints)?;
        let names = parameters.joints.iter().flat_map(JointOrder::names);
        for ((position, kind), name) in self.joints.iter().zip(chain.kinds()).zip(names) {
            if *kind == JointKind::Revolute && position.abs() > TAU {
                stderr::line(format!(
                    "warning: {name} at {position} rad is more than a full turn from 0: positions are in rad, not in degrees"
                ));
            }
        }
        if self.json {
            print_json(&base_from_tool)?;
        } else {
            print_text(&base_from_tool, &parameters.goal_frame)?;
        }
        Ok(())
    }
}

fn print_json(pose: &UnitDualQuaternion) -> Result<(), StdoutError> {
    let [x, y, z, orientation @ ..] = pose_numbers(pose);
    let object = json!({
        "position": [x, y, z],
        "orientation_xyzw": orientation,
        "dual_quaternion": pose.to_vector8().as_slice(),
    });
    print_line!("{object}")
}

fn print_text(pose: &UnitDualQuaternion, frame: &str) -> Result<(), StdoutError> {
    let ([x, y, z, qx, qy, qz, qw], numbers) = (pose_numbers(pose).map(short), pose.to_vector8().map(short));
    print_line!("position [m]            {x} {y} {z}")?;
    print_line!("orientation (x y z w)   {qx} {qy} {qz} {qw}")?;
    print_line!("dual quaternion (w x y z, w x y z)")?;
    print_line!("  {} {} {} {}", numbers[0], numbers[1], numbers[2], numbers[3])?;
    print_line!("  {} {} {} {}", numbers[4], numbers[5], numbers[6], numbers[7])?;
    print_line!("dq_servo goal {x} {y} {z} {qx} {qy} {qz} {qw}")?;
    print_line!("ros2 topic pub --once /goal_pose geometry_msgs/msg/PoseStamped \\")?;
    print_line!(
        "  \"{{header: {{frame_id: {frame}}}, pose: {{position: {{x: {x:?}, y: {y:?}, z: {z:?}}}, orientation: {{x: {qx:?}, y: {qy:?}, z: {qz:?}, w: {qw:?}}}}}}}\""
    )
}
