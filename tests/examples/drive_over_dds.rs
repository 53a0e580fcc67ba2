//! Drives a simulated arm over DDS with a servo in your own program. The program receives joint states and sends velocities like
//! the node. Both run in this process, in their own domain on this host. A real arm is driven in the same way.

use dq_config::{ForArm, PlantParameters, ServoParameters};
use dq_core::servo::{Event, Servo, State};
use dq_messages::messages::{Float64MultiArray, JointState};
use dq_nodes::{PlantNode, Prepared};
use dq_ros::ros::{Environment, LogLevel, Logging, Resolver, RosArgs, Session};
use dq_wire::{Contract, ServoKind, joint_reading};
use std::error::Error;
use std::time::{Duration, Instant};

#[tokio::main]
pub(crate) async fn main() -> Result<(), Box<dyn Error>> {
    let args = RosArgs::default();
    let (here, _domain) = Environment::from_process(&args)?.alone()?;
    let (arms_place, place) = (Session::open(&here)?, Session::open(&here)?);
    let _arm = PlantNode::start(&arms_place, Prepared::<PlantParameters>::new(&args)?)?;
    let mut node = place.node(Resolver::new("own_program", &args)?, Logging::new(&args, LogLevel::Warn))?;
    let topics = ServoKind::OneArm.contract(Contract::builtin()?);
    let states = node.subscription::<JointState>(&topics, "joint_states")?;
    let commands = node.publisher::<Float64MultiArray>(&topics, "forward_velocity_controller/commands")?;

    let mut servo: Servo = ServoParameters::for_arm("puma560")?
        .with(|settings| settings.controller = settings.controller.with_law(settings.controller.law, 4.0))
        .build()?;
    let (began, mut asked) = (Instant::now(), false);
    while began.elapsed() < Duration::from_secs(30) {
        // Run one cycle per joint state.
        let state = states.next().await;
        servo.cycle_with(began.elapsed(), [Event::JointState(0, joint_reading(&state, 0, None))]);
        if let Some(velocities) = servo.output() {
            commands.publish(Float64MultiArray { data: velocities.to_vec(), ..Float64MultiArray::default() });
        }
        if let Some(pose) = servo.pose().filter(|_| !asked && commands.readers() > 0) {
            servo.set_goal(nalgebra::Isometry3::translation(0.0, 0.1, 0.1) * pose.frame());
            asked = true;
        }
        if servo.status().state == State::Settled {
            println!("arrived {:.2} mm from the goal", 1e3 * servo.status().figures.position_error);
            return Ok(());
        }
    }
    Err(format!("the arm has not arrived: {}", servo.status().state).into())
}
