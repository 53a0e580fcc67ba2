//! `dq_servo demo`: both nodes on this host, the paper's motion there and back.

use super::watch::{GoalNumbers, Watch};
use crate::config::Value;
use crate::control::Law;
use crate::nodes::{PlantNode, Prepared, ServoNode, StatusReport};
use crate::ros::{Environment, LogLevel, Node, ParameterClient, Resolver, RosArgs, RosError, Session};
use anyhow::Context;
use comfy_table::{Table, presets};
use serde::Deserialize;
use serde_json::json;
use std::time::Duration;

/// Move the simulated arm there and back, under one law and another
#[derive(clap::Args, Default)]
pub(super) struct Demo {
    /// Print a JSON list instead of a table
    #[arg(long)]
    json: bool,
}

/// What `msg_config/paper.yaml` says.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Experiment {
    theta_desired: Vec<f64>,
}

/// Longest time for one motion. diffc with the paper's gain takes about 20 s to the goal tolerance.
const MOTION_TIMEOUT: Duration = Duration::from_secs(90);

/// How long a parameter service may take.
const SERVICE: Duration = Duration::from_secs(10);

impl Demo {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let experiment: Experiment = serde_saphyr::from_str(include_str!("../../msg_config/paper.yaml"))
            .context("msg_config/paper.yaml")?;
        let (servo, plant) = (Prepared::servo(ros_args)?, Prepared::plant(ros_args)?);
        let chain = &servo.parameters().arm.chain;
        let plan = Plan {
            servo: servo.node(),
            start: numbers(&chain.forward_kinematics(&plant.parameters().initial_positions)?),
            goal: numbers(&chain.forward_kinematics(&experiment.theta_desired)?),
        };
        let environment = Environment::from_process()?.this_host_only();
        // Each node is a participant of its own: what passes between them passes over DDS.
        let sessions =
            (Session::open(&environment)?, Session::open(&environment)?, Session::open(&environment)?);
        let _plant = PlantNode::start(&sessions.0, plant)?;
        let _servo = ServoNode::start(&sessions.1, servo)?;
        let names = Resolver::new("dq_servo_demo", ros_args).map_err(RosError::from)?;
        let mut node = sessions.2.node(names, ros_args.log_level.unwrap_or(LogLevel::Warn))?;
        let motions = tokio::select! {
            motions = plan.carry_out(&mut node) => motions?,
            signalled = super::run::signalled() => { signalled?; anyhow::bail!("interrupted") }
        };
        if self.json {
            print_json(&motions)
        } else {
            println!("{}", table(&motions))
        }
        Ok(())
    }
}

/// The demo's motions.
struct Plan {
    servo: String,
    start: GoalNumbers,
    goal: GoalNumbers,
}

impl Plan {
    /// To the paper's goal with the law that the parameters name, and back with another.
    async fn carry_out(&self, node: &mut Node) -> anyhow::Result<Vec<StatusReport>> {
        let watch = Watch::new(node, &self.servo, "")?;
        watch.servo_ready().await?;
        let there = watch.go(self.goal, MOTION_TIMEOUT).await?;
        let other = if there.law == Law::Diffc.name() { Law::Logc } else { Law::Diffc };
        let mut parameters = ParameterClient::new(node, &self.servo, SERVICE);
        let switched = parameters.set("controller", &Value::String(other.name().to_owned())).await?;
        switched.map_err(anyhow::Error::msg)?;
        let back = watch.go(self.start, MOTION_TIMEOUT).await?;
        Ok(vec![there, back])
    }
}

fn numbers(pose: &crate::dq::UnitDualQuaternion) -> GoalNumbers {
    let (t, r) = (pose.translation(), pose.rotation());
    [t.x, t.y, t.z, r.i, r.j, r.k, r.w]
}

fn print_json(motions: &[StatusReport]) {
    let motion = |report: &StatusReport| {
        let figures = &report.figures;
        json!({
            "law": report.law,
            "settling_time_s": figures.settling_time(),
            "settling_time_rotation_s": figures.settling_time_rotation,
            "settling_time_position_s": figures.settling_time_position,
            "arrival_time_s": figures.arrival_time,
            "path_length_m": figures.path_length,
            "straight_line_m": figures.straight_line,
            "path_ratio": figures.path_length / figures.straight_line,
            "position_error_m": figures.position_error,
            "rotation_error_rad": figures.rotation_error,
            "peak_joint_speed_rad_s": figures.peak_joint_speed,
            "cycle_jitter_p99_us": report.cycle_jitter_us.0,
            "cycle_jitter_max_us": report.cycle_jitter_us.1,
        })
    };
    println!("{:#}", serde_json::Value::from_iter(motions.iter().map(motion)));
}

fn table(motions: &[StatusReport]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header([
        "law",
        "settled to 2 % [s]",
        "arrived [s]",
        "path [m]",
        "straight [m]",
        "ratio",
        "position error [mm]",
        "rotation error [°]",
        "peak joint speed [rad/s]",
        "cycle jitter p99 / max [µs]",
    ]);
    for report in motions {
        let figures = &report.figures;
        let seconds = |time: Option<f64>| time.map_or("-".to_owned(), |time| format!("{time:.2}"));
        table.add_row([
            report.law.clone(),
            seconds(figures.settling_time()),
            seconds(figures.arrival_time),
            format!("{:.3}", figures.path_length),
            format!("{:.3}", figures.straight_line),
            format!("{:.2}", figures.path_length / figures.straight_line),
            format!("{:.2}", figures.position_error * 1e3),
            format!("{:.3}", figures.rotation_error.to_degrees()),
            format!("{:.2}", figures.peak_joint_speed),
            format!("{:.0} / {:.0}", report.cycle_jitter_us.0, report.cycle_jitter_us.1),
        ]);
    }
    table
}
