//! `dq_servo demo`: runs the nodes on this host, and moves the arm to a goal and back as in the paper.

use super::enter;
use super::node_set::{NodeSet, Setting};
use super::recording::Recording;
use super::rehearsal;
use super::table::{self, seconds};
use super::view::{Page, View};
use crate::cli::arm::RobotChoice;
use crate::cli::error::{Error, Usage, failed};
use crate::cli::print::{self, print_line};
use crate::cli::signals::Signals;
use dq_algebra::UnitDualQuaternion;
use dq_common::UnknownName;
use dq_config::{DualParameters, NodeParameters, PlantParameters, ServoParameters};
use dq_kinematics::arm::{Chain, JointKind};
use dq_kinematics::control::{Aim, Map};
use dq_messages::PoseNumbers;
use dq_nodes::Prepared;
use dq_params::Value;
use dq_ros::ros::args::{Override, Remap};
use dq_ros::ros::{Environment, RosArgs};
use dq_ros::stderr;
use dq_studies::paper::Experiment;
use dq_wire::{CycleJitter, MotionReport, pose_numbers};
use serde_json::json;
use std::cell::Cell;
use std::path::PathBuf;
use std::time::Duration;

/// Move a simulated arm to a goal under one law, and back under another law
#[derive(clap::Args, Default)]
pub(in crate::cli) struct Demo {
    /// Two arms: control one tool relative to the other
    #[arg(long, conflicts_with_all = ["arm", "robot"])]
    dual: bool,
    #[command(flatten)]
    arm: RobotChoice,
    /// Show the arm in a browser until ctrl-C. The arm moves to the goal once the page is open; then you can send it goals
    #[arg(long, conflicts_with_all = ["json", "record"])]
    view: bool,
    /// Address and port of the page; port 0: any free one. With 0.0.0.0:8123, other hosts can open the page
    #[arg(long, value_name = "ADDRESS:PORT", conflicts_with_all = ["json", "record"])]
    listen: Option<String>,
    /// Print a JSON list instead of a table
    #[arg(long)]
    json: bool,
    /// Record the motions into a rosbag2 directory that does not exist yet
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// How long the demo waits for a browser.
const INVITATION: Duration = Duration::from_secs(60);

impl Demo {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        let mut signals = Signals::new()?;
        // Keep the domain until the end, so that no other demo takes it.
        let (environment, domain) = Environment::from_process(ros_args)?.alone()?;
        let recording = self.record.as_deref();
        let recording = recording.map(|bag| Recording::start(bag, &environment, ros_args)).transpose()?;
        let id = domain.id();
        let node = if self.dual { DualParameters::NODE_NAME } else { ServoParameters::NODE_NAME };
        stderr::line(format!(
            "the demo has a domain of its own on this host: ROS_DOMAIN_ID={id} ros2 topic echo /{node}/status"
        ));
        if self.view {
            let setting = Setting { environment, ros_args, recording: None };
            let view = View::at(self.listen.clone());
            return match self.dual {
                true => in_a_browser(&setting, two_arm_scene(&setting)?, &view, &mut signals).await,
                false => {
                    in_a_browser(&setting, one_arm_scene(&setting, &self.arm)?, &view, &mut signals).await
                }
            };
        }
        let setting = Setting { environment, ros_args, recording: recording.as_ref() };
        // If the user stores or processes the output, do not offer the page.
        let has_page = !self.dual && !self.json && self.record.is_none();
        let page = match &self.listen {
            Some(_) if self.dual => return Err(Usage("with --dual, --listen needs --view".to_owned()).into()),
            Some(_) => Some(View::offer(self.listen.clone(), &setting.environment, ros_args).await?),
            None if has_page => View::offer(None, &setting.environment, ros_args).await.ok(),
            None => None,
        };
        let played = match self.dual {
            true => two_arms(&setting, &mut signals).await,
            false => one_arm(&setting, &self.arm, page, &mut signals).await,
        };
        let (played, ended) = Recording::end(recording, played).await?;
        let Some(played) = played else { return ended };
        let results = if self.json { format!("{:#}", json(&played.motions)) } else { table(&played) };
        print::results(results, &mut signals).await?;
        ended
    }
}

/// The nodes, the start and the goal of a demo.
struct Scene<'a> {
    nodes: NodeSet<'a>,
    /// The pose at which the arm starts.
    start: PoseNumbers,
    goal: PoseNumbers,
    /// The kinds of the joints.
    joints: Vec<JointKind>,
}

/// The motions that a demo has made, and the kinds of the arms' joints.
struct Played {
    motions: Vec<MotionReport>,
    joints: Vec<JointKind>,
}

/// Moves the arm to the goal with the law of the parameters, and back with another law.
///
/// If a browser shows the `page` at the end, prints the results, and lets the user control the arm until a signal. In this case,
/// returns no motions.
async fn one_arm(
    setting: &Setting<'_>,
    arm: &RobotChoice,
    page: Option<Page>,
    signals: &mut Signals,
) -> crate::cli::Result<Option<Played>> {
    let Scene { nodes, start, goal, joints } = one_arm_scene(setting, arm)?;
    let stays = Cell::new(false);
    let play = async |nodes: &mut NodeSet<'_>| {
        if let Some(page) = &page {
            invite(page).await;
        }
        let played = there_and_back(nodes, goal, start).await.map(|motions| Played { motions, joints });
        if !page.as_ref().is_some_and(|page| *page.watched.borrow()) {
            return played.map(Some);
        }
        stays.set(true);
        match played.map(|played| table(&played)) {
            Ok(table) => tokio::task::spawn_blocking(move || print::line(format_args!("{table}"))).await??,
            // The user may have driven the arm somewhere else.
            Err(why) => stderr::line(format!("no table: {}", why.line())),
        }
        stderr::line("the page stays open, and its user controls the arm: ctrl-C ends it");
        std::future::pending().await
    };
    let performed = nodes.perform(play, signals).await;
    if let Some(page) = page {
        page.close().await;
    }
    match performed {
        Err(Error::Interrupted) if stays.get() => Ok(None),
        other => other,
    }
}

/// Prints the link of the page. If a user can press keys, waits until a browser connects, the enter key is pressed, or
/// [`INVITATION`] has passed.
async fn invite(page: &Page) {
    let Some(pressed) = enter::pressed() else {
        return stderr::line(format!("watch the arm move: {}", page.link));
    };
    stderr::line(format!("open {} to watch the arm move, or press Enter to go on without", page.link));
    let mut watched = page.watched.clone();
    tokio::select! {
        _ = watched.wait_for(|watched| *watched) => {}
        () = pressed => {}
        () = tokio::time::sleep(INVITATION) => stderr::line("nobody has opened the page: the arm moves now"),
    }
}

/// Moves the arm to `goal` with the law in force, and to `start` with another law.
async fn there_and_back(
    nodes: &mut NodeSet<'_>,
    goal: PoseNumbers,
    start: PoseNumbers,
) -> crate::cli::Result<Vec<MotionReport>> {
    let there = nodes.go(goal).await?;
    let back = rehearsal::return_law(there.law.parse().map_err(|why: UnknownName| failed!("{why}"))?);
    nodes.set_parameter("controller", back.name()).await?;
    Ok(vec![there, nodes.go(start).await?])
}

/// Prepares the arm, its servo, its start and its goal. For the paper's arm, the goal is the paper's. For another arm, the goal is
/// a tool pose near the start that one law reaches and from which another law returns.
fn one_arm_scene<'a>(setting: &Setting<'a>, arm: &RobotChoice) -> crate::cli::Result<Scene<'a>> {
    let servo = Prepared::<ServoParameters>::new(&arm.and(setting.ros_args))?;
    let parameters = servo.parameters();
    let (chain, papers) = (parameters.arms.chain(), papers_chain()?);
    // The paper's arm with another tool is still the built-in arm, so its plant is the built-in one.
    let mut bare = chain.clone();
    bare.set_tool_offset(papers.tool_offset());
    let is_builtin = !arm.is_some() && bare == papers;
    let of_plant = if is_builtin { setting.ros_args.clone() } else { arm.of_plant(setting.ros_args) };
    let plant = Prepared::<PlantParameters>::new(&of_plant)?;
    let from = &plant.parameters().initial_positions;
    let to = match *chain == papers {
        true => Experiment::builtin()?.theta_desired,
        false => rehearsal::nearby(parameters, from)?,
    };
    let [start, goal] = [from, &to].map(|theta| chain.forward_kinematics(theta));
    let (start, goal, joints) = (pose_numbers(&start?), pose_numbers(&goal?), chain.kinds().to_vec());
    Ok(Scene { nodes: NodeSet::set(setting, servo, vec![plant])?, start, goal, joints })
}

fn papers_chain() -> crate::cli::Result<Chain> {
    let (store, _) = ServoParameters::start(ServoParameters::NODE_NAME, Vec::new())?;
    Ok(ServoParameters::from_store(&store)?.arms.chain().clone())
}

/// Opens the page, and moves the arm to the goal once a browser is connected. After that the user controls the arm until a signal.
async fn in_a_browser(
    setting: &Setting<'_>,
    Scene { nodes, goal, .. }: Scene<'_>,
    view: &View,
    signals: &mut Signals,
) -> crate::cli::Result<()> {
    let mut page = view.open(nodes.kind(), &setting.environment, setting.ros_args).await?;
    print_line!("{}", page.link)?;
    let play = async |nodes: &mut NodeSet<'_>| {
        let _ = page.watched.wait_for(|watched| *watched).await;
        // The result is not used: from now on the user controls the arm and may have sent another goal already.
        let _ = nodes.go(goal).await;
        std::future::pending::<crate::cli::Result<()>>().await
    };
    let performed = nodes.perform(play, signals).await;
    page.close().await;
    match performed {
        Err(Error::Interrupted) => Ok(()),
        other => other,
    }
}

/// Makes the paper's two motions of relative position control. The first doubles the distance between the tools, with the transposed
/// Jacobian. The second moves back, with the damped inverse, and also controls the orientation.
async fn two_arms(setting: &Setting<'_>, signals: &mut Signals) -> crate::cli::Result<Option<Played>> {
    let Scene { nodes, start, goal, joints } = two_arm_scene(setting)?;
    let play = async |nodes: &mut NodeSet<'_>| {
        nodes.set_parameter("primitive", Aim::Position.relative_name()).await?;
        nodes.set_parameter("controller", Map::Transpose.name()).await?;
        let there = nodes.go(goal).await?;
        nodes.set_parameter("controller", Map::DampedInverse.name()).await?;
        nodes.set_parameter("primitive", Aim::Pose.relative_name()).await?;
        Ok(Some(Played { motions: vec![there, nodes.go(start).await?], joints }))
    };
    nodes.perform(play, signals).await
}

/// Prepares the paper's two arms and their servo. The start and the goal are poses of the right tool relative to the left tool.
fn two_arm_scene<'a>(setting: &Setting<'a>) -> crate::cli::Result<Scene<'a>> {
    let experiment = Experiment::builtin()?;
    let servo = Prepared::<ServoParameters>::from(Prepared::<DualParameters>::new(setting.ros_args)?);
    let left =
        Prepared::<PlantParameters>::new(&of_arm("left", &experiment.theta_desired, setting.ros_args))?;
    let right =
        Prepared::<PlantParameters>::new(&of_arm("right", &experiment.theta_initial, setting.ros_args))?;
    let mut arms = servo.parameters().arms.clone();
    arms.evaluate(&[&left, &right].map(|plant| plant.parameters().initial_positions.as_slice()).concat());
    let start = arms.pose();
    let far = experiment.relative_position.target_factor * start.translation();
    let goal = pose_numbers(&UnitDualQuaternion::from_parts(start.rotation(), far));
    let (start, joints) = (pose_numbers(&start), arms.chain().kinds().to_vec());
    Ok(Scene { nodes: NodeSet::set(setting, servo, vec![left, right])?, start, goal, joints })
}

/// Returns the ROS arguments of the plant in the namespace `side`. The plant starts at `theta` \[rad\], unless `ros_args` give other
/// initial positions.
fn of_arm(side: &str, theta: &[f64], ros_args: &RosArgs) -> RosArgs {
    let mut args = ros_args.clone();
    let namespace = args.remaps.iter().find(|rule| rule.from == "__ns").map_or("", |rule| &rule.to);
    let to = format!("{}/{side}", namespace.trim_end_matches('/'));
    args.remaps.insert(0, Remap { node: None, from: "__ns".to_owned(), to });
    let parameter = |name: &str, value| Override::Value { node: None, name: name.to_owned(), value };
    args.overrides.insert(0, parameter("initial_positions", Value::DoubleArray(theta.to_vec())));
    args.overrides.insert(0, parameter("frame_prefix", Value::String(format!("{side}/"))));
    args
}

fn json(motions: &[MotionReport]) -> serde_json::Value {
    let motion = |report: &MotionReport| {
        let mut listed = json!(report.figures);
        listed["law"] = json!(report.law);
        listed["primitive"] = json!(report.aim);
        listed["settling_time_2_percent_s"] = json!(report.figures.settling_time());
        listed["cycle_jitter_p99_us"] = json!(report.cycle_jitter.p99);
        listed["cycle_jitter_max_us"] = json!(report.cycle_jitter.max);
        listed
    };
    serde_json::Value::from_iter(motions.iter().map(motion))
}

/// Returns the table of the motions. A line below the table has the lateness of the servo's cycles.
fn table(Played { motions, joints }: &Played) -> String {
    let mut table = table::motions(&["law"], joints, &[table::AT_GOAL]);
    for report in motions {
        let figures = table::figures(&report.figures);
        let law = table::in_lines(&report.law_and_aim());
        table.add_row([law].into_iter().chain(figures).chain([seconds(report.figures.arrival_time)]));
    }
    let late = |of: fn(&CycleJitter) -> f64| {
        motions.iter().map(|report| of(&report.cycle_jitter)).fold(0.0, f64::max)
    };
    let (p99, max) = (late(|jitter| jitter.p99), late(|jitter| jitter.max));
    let busy = if max > BUSY { "\nThis machine was busy: repeat the demo when it is idle." } else { "" };
    format!("{table}\n\nCycles woke late by at most {p99:.0} µs (99 %) and {max:.0} µs (all).{busy}")
}

/// If a cycle of the servo woke up later than this [µs], the delay has affected the motion. This is a quarter of the robot's
/// command timeout.
const BUSY: f64 = 25_000.0;

#[cfg(test)]
mod tests {
    use super::*;
    use dq_messages::messages::Time;

    #[test]
    fn a_table_of_a_busy_machine_says_that() {
        let motion = |max| {
            let report = MotionReport::rejected(&Time::default(), None, String::new());
            MotionReport { cycle_jitter: CycleJitter { max, ..report.cycle_jitter }, ..report }
        };
        let text = |max| table(&Played { motions: vec![motion(max)], joints: Vec::new() });
        assert!(text(30_000.0).contains("This machine was busy") && !text(900.0).contains("busy"));
    }
}
