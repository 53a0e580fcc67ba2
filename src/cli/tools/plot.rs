//! `dq_servo plot`: figures and metrics of recorded runs.

use super::figure_width::FigureWidth;
use super::table;
use crate::cli::Usage;
use crate::cli::arm::ArmChoice;
use crate::cli::print::print_line;
use comfy_table::Table;
use dq_core::servo::Goal;
use dq_figures::{DrawError, Figure};
use dq_kinematics::arm::{Chain, JointKind};
use dq_ros::ros::RosArgs;
use dq_ros::stderr;
use dq_runs::{GivenGoals, MotionRow, Recorded, RecordedRun, csv, plot, recorded_toward};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Draw recorded runs and print the metrics of each motion; several bags are drawn together
#[derive(clap::Args)]
pub(in crate::cli) struct Plot {
    /// Bags: rosbag2 directories or their files (MCAP, SQLite)
    #[arg(required = true, value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Folder for the figures (SVG and PNG): a new one, or one with figures of the same bags
    #[arg(short, long, value_name = "DIR", default_value = "plots")]
    out: PathBuf,
    #[command(flatten)]
    width: FigureWidth,
    /// Write the curves as CSV too
    #[arg(long)]
    csv: bool,
    /// Print a JSON list instead of a table
    #[arg(long)]
    json: bool,
    /// Measure the motions of another controller to these goals in the arm's base frame: a topic of PoseStamped in the bag, or the
    /// numbers x y z qx qy qz qw of one goal
    #[arg(long, value_name = "TOPIC|NUMBER", num_args = 1..=7, allow_negative_numbers = true)]
    goal: Vec<String>,
    #[command(flatten)]
    arm: ArmChoice,
}

impl Plot {
    pub(super) fn run(&self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        let runs = read_all(&self.bags, &self.arm.and(ros_args), self.given_goals()?.as_ref())?;
        for run in &runs {
            if !run.parameters_known && !self.arm.is_some() {
                stderr::line(format!(
                    "warning: {}: the bag does not have the servo's parameters; those of --ros-args are presumed, or else the PUMA 560's: --arm chooses another",
                    run.name
                ));
            }
            if let Some((time, inside)) = &run.inside {
                stderr::line(format!("warning: {}: at {time:.2} s {inside}", run.name));
            }
            if !run.has_speeds() {
                stderr::line(format!(
                    "warning: {}: the bag has no joint velocities and no commands: peak and effort are not known, and joint_velocities has nothing to show",
                    run.name
                ));
            }
        }
        let figures = plot(&runs);
        self.claim_folder(&figures)?;
        dq_figures::save(&figures, &self.out, self.width.width)?;
        if self.csv {
            self.write_curves(&runs)?;
        }
        let motions: Vec<_> = runs.iter().flat_map(|run| &run.motions).collect();
        if self.json {
            print_line!("{:#}", json!(motions))?;
        } else {
            let figures = format!("{} figures are in {}", figures.len(), self.out.display());
            let kinds = runs.iter().flat_map(|run| &run.arms).flat_map(Chain::kinds);
            let joints: Vec<_> = kinds.copied().collect();
            match motions.is_empty() {
                true => print_line!(
                    "the bag has no motions that a servo reported (~/motions); --goal names the goals of another controller\n\n{figures}"
                )?,
                false => {
                    let notes = notes(&motions) + &clearances(&runs);
                    print_line!("{}{notes}\n\n{figures}", table(&motions, &joints))?;
                }
            }
        }
        Ok(())
    }
}

impl Plot {
    /// Returns the goals of another controller, if they are given.
    fn given_goals(&self) -> Result<Option<GivenGoals>, Usage> {
        let numbers: Result<Vec<f64>, _> = self.goal.iter().map(|text| text.parse()).collect();
        let (position, orientation) = match (self.goal.as_slice(), numbers.as_deref()) {
            ([], _) => return Ok(None),
            ([topic], Err(_)) => {
                return Ok(Some(GivenGoals::Topic(format!("/{}", topic.trim_start_matches('/')))));
            }
            (_, Ok([x, y, z, qx, qy, qz, qw])) => ([*x, *y, *z], [*qx, *qy, *qz, *qw]),
            _ => {
                return Err(Usage("--goal takes a topic, or the seven numbers x y z qx qy qz qw".to_owned()));
            }
        };
        let goal = Goal::new(position, orientation, "", "").map_err(|why| Usage(format!("--goal: {why}")))?;
        Ok(Some(GivenGoals::Pose(*goal.base_from_goal())))
    }

    /// Reserves the output folder for the figures of these bags: writes the paths of the bags into `bags.txt` in the folder. So a later
    /// call with other bags does not overwrite the figures.
    ///
    /// # Errors
    /// [`Usage`] if the folder has figures of other bags.
    fn claim_folder(&self, figures: &[Figure]) -> crate::cli::Result<()> {
        let note = self.out.join("bags.txt");
        let path = |bag: &PathBuf| std::path::absolute(bag).map(|path| format!("{}\n", path.display()));
        let bags = self.bags.iter().map(path).collect::<Result<String, _>>()?;
        let is_free = || !figures.iter().any(|figure| self.out.join(format!("{}.svg", figure.name)).exists());
        if !std::fs::read_to_string(&note).map_or_else(|_| is_free(), |before| before == bags) {
            let folder = self.out.display();
            return Err(Usage(format!(
                "{folder} has figures of another run: choose another folder by --out"
            ))
            .into());
        }
        dq_figures::make_folder(&self.out)?;
        Ok(dq_figures::write(&note, bags.as_bytes())?)
    }

    /// Writes the curves of each run. The files are numbered if there are several runs.
    fn write_curves(&self, runs: &[RecordedRun]) -> Result<(), DrawError> {
        for (number, run) in (1..).zip(runs) {
            let before = if runs.len() > 1 { format!("{number}_") } else { String::new() };
            for (name, text) in csv(run) {
                dq_figures::write(&self.out.join(format!("{before}{name}.csv")), text.as_bytes())?;
            }
        }
        Ok(())
    }
}

/// Reads the runs of all bags, and lists on stderr what could not be read. Runs without recorded parameters get the parameters that
/// a servo with these ROS arguments has.
///
/// The motions of other controllers are measured toward the goals `given`.
pub(super) fn read_all(
    bags: &[PathBuf],
    ros_args: &RosArgs,
    given: Option<&GivenGoals>,
) -> crate::cli::Result<Vec<RecordedRun>> {
    let servo = crate::cli::offline(ros_args.clone())?;
    let mut runs = Vec::new();
    for bag in bags {
        let Recorded { runs: more, warnings, losses } =
            recorded_toward(bag, &name(bag, bags), servo.parameters(), given)?;
        warnings.into_iter().chain(losses.lines()).for_each(|why| stderr::line(format!("warning: {why}")));
        runs.extend(more);
    }
    Ok(runs)
}

/// Returns the name of a bag, or its path if another bag has the same name.
fn name(bag: &Path, bags: &[PathBuf]) -> String {
    let is_shared = bags.iter().any(|other| other != bag && other.file_name() == bag.file_name());
    let name = bag.file_name().filter(|_| !is_shared).unwrap_or(bag.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Returns a line for each motion that did not arrive, with its outcome and the reason.
fn notes(motions: &[&MotionRow]) -> String {
    let note = |motion: &&MotionRow| {
        let MotionRow { run, motion, outcome, why, .. } = motion;
        let why = why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        (outcome != "arrived").then(|| format!("\n{run} {motion}: {outcome}{why}"))
    };
    motions.iter().filter_map(note).collect()
}

/// Returns a line with the smallest clearance for each run in which the servo reported clearances.
fn clearances(runs: &[RecordedRun]) -> String {
    let least = |run: &RecordedRun| {
        run.least_clearance()
            .map(|least| format!("\n{}: the closest pair was {:.1} mm apart", run.name, 1e3 * least))
    };
    runs.iter().filter_map(least).collect()
}

pub(super) fn table(motions: &[&MotionRow], joints: &[JointKind]) -> Table {
    // If there is a single run, its name is omitted.
    let run = usize::from(motions.iter().all(|motion| motion.run == motions[0].run));
    let mut table = table::motions(&["run", "#", "law"][run..], joints, &[table::AT_GOAL]);
    for motion in motions {
        let names = [motion.run.clone(), motion.motion.to_string(), table::in_lines(&motion.law)];
        let figures = table::figures(&motion.figures);
        let at_goal = table::seconds(motion.figures.arrival_time);
        table.add_row(names.into_iter().skip(run).chain(figures).chain([at_goal]));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bags_of_one_name_are_called_by_their_paths() {
        let bags = ["today/run", "yesterday/run", "yesterday/other"].map(PathBuf::from);
        let names = bags.each_ref().map(|bag| name(bag, &bags));
        assert_eq!(names, ["today/run", "yesterday/run", "other"]);
    }
}
