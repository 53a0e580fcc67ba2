//! Reads the messages of one servo and the joint states of its arms.

use super::announced::{AnnouncedParameters, changed};
use super::given_goals::{GivenGoals, MeasuredMotions};
use super::motion_rows::MotionRows;
use super::run::{ArmCommands, Change, ChangeKind, RecordedRun, Sample};
use super::{RunError, Thinned};
use dq_algebra::UnitDualQuaternion;
use dq_bags::BagMessage;
use dq_check::Gaps;
use dq_common::text::{NAME, shown};
use dq_config::ServoParameters;
use dq_core::servo::{Goal, Interface, JointOrder, Settings, StateError};
use dq_link::longest_travel;
use dq_messages::messages::{DiagnosticStatus, JointState, PoseStamped, TwistStamped, UInt8MultiArray};
use dq_metrics::GoalError;
use dq_wire::{Command, CycleRecord, MotionReport, ServoKind, StatusReport, command_topic, with_command};
use std::collections::HashSet;
use std::time::Duration;

/// The largest number of points of a curve, about fifty per pixel of a figure. With this limit, a long run needs no more memory
/// than a short one.
const POINTS: usize = 1 << 15;

/// The largest number of stored changes of goal, law and state.
const CHANGES: usize = 1 << 13;
/// The largest number of stored changes of the law. Figures draw a separate curve for each period between two changes.
const LAWS: usize = 1 << 9;

/// The stamp of a message counts as the time of measurement if the message was recorded at most this long afterwards \[s\].
const LATE: f64 = 1.0;

/// The curve of commanded positions has a gap where the servo sent nothing for a while. The gap is drawn this long before the cycle in
/// which the servo sends commands again \[s\].
///
/// This time is shorter than any pause. It is longer than the difference between the recorded times of a command and of its cycle.
/// So the gap is always before the first new command.
const SHORTEST_PAUSE: f64 = 5e-3;

/// A motion belongs to the shown part of a run if it begins at most this long before the first joint state of that part \[s\]. Time 0
/// of a figure is the start of the first such motion.
const LONGEST_START: f64 = 60.0;

/// If the servo reports no pose error for longer than this \[s\], it had no goal during that time.
const GAP: f64 = 0.5;

/// Reads the messages of a run.
pub(super) trait Reader {
    /// Returns whether the run needs the messages of the topic.
    fn hears(&self, topic: &str) -> bool;

    /// Processes a message that was recorded at `time` \[s\], counted from `origin` \[ns\].
    fn take(&mut self, time: f64, origin: i64, message: &BagMessage);

    /// Returns the run, or the reason why it cannot be drawn.
    fn finish(self: Box<Self>) -> Result<RecordedRun, String>;
}

/// Reads the messages of one servo, or of an arm whose servo is unknown.
pub(super) struct RunReader {
    run: RecordedRun,
    namespace: String,
    node: Option<String>,
    kind: ServoKind,
    parameters: ServoParameters,
    /// The announced parameters that have not taken effect yet, with their times \[ns\]. The earliest ones are at the end of the list.
    announced: Vec<(i64, ServoParameters)>,
    /// For each arm, whether the bag has had a joint state of the arm so far.
    heard: Vec<bool>,
    /// For each arm, whether there was a joint state of the arm since the last sample.
    fresh: Vec<bool>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    /// For each joint, the highest speed limit that was in force so far [rad/s, prismatic: m/s].
    fastest: Vec<f64>,
    /// Checks for overlaps of the arm with keep-outs and with itself; `None` if constraints are off.
    gaps: Option<Gaps>,
    /// Whether a change of the parameters has changed the tool offset or the arm's kinematics since the last sample.
    tool_changed: bool,
    law: Option<String>,
    state: Option<String>,
    goal: Option<UnitDualQuaternion>,
    /// The number and the time of the servo's last recorded cycle.
    cycle: Option<(u64, Duration)>,
    /// Whether the servo sent nothing in the last recorded cycle.
    sent_nothing: bool,
    motions: MotionRows,
    /// If no servo reports the motions: the motions that this program measures, and the topic of the goals (`None` for a given goal).
    measured: Option<(MeasuredMotions, Option<String>)>,
    /// The error of the first joint state that does not belong to this arm.
    unusable: Option<StateError>,
}

impl RunReader {
    /// Creates the reader of the servo `node`; `None` if the arm's servo is unknown. `namespace` ends with a slash. `parameters` are in
    /// force until the servo announces others.
    pub fn new(name: String, namespace: &str, node: Option<String>, parameters: ServoParameters) -> Self {
        let kind = ServoKind::of(&parameters.arms);
        let count = parameters.arms.joint_count();
        let mut first_joint = 0;
        let commands = parameters.joints.iter().map(|arm| {
            let commands = ArmCommands {
                first_joint,
                velocities: Thinned::new(POINTS, larger_speeds),
                positions: Thinned::new(POINTS, |_, _| {}),
            };
            first_joint += arm.names().len();
            commands
        });
        let settings = &parameters.settings;
        let mut run = RecordedRun {
            name,
            joints: kind.joint_names(&parameters.joints).iter().map(|name| shown(name, NAME)).collect(),
            arms: parameters.arms.chains().cloned().collect(),
            samples: Thinned::new(POINTS, |next, gone: &Sample| next.jumped |= gone.jumped),
            commands: commands.collect(),
            errors: Thinned::new(POINTS, |_, _| {}),
            clearances: Thinned::new(POINTS, |next, gone: &(f64, f64)| next.1 = next.1.min(gone.1)),
            keep_outs: Vec::new(),
            keep_ins: Vec::new(),
            inside: None,
            jitter: Thinned::new(POINTS, |next, gone: &(f64, f64)| next.1 = larger(next.1, gone.1)),
            changes: Thinned::new(CHANGES, |_, _| {}),
            laws: Thinned::new(LAWS, |_, _| {}),
            goals: Thinned::new(POINTS, |_, _| {}),
            motions: Vec::new(),
            limits: vec![(f64::NEG_INFINITY, settings.limits.clone())],
            damping_thresholds: vec![(f64::NEG_INFINITY, settings.controller.damping.threshold)],
            tolerance: settings.goal_tolerance,
            parameters_known: node.is_some(),
            shown: 0.0..0.0,
            notes: Vec::new(),
        };
        run.add_scene(settings.scene.as_deref());
        let arms = parameters.joints.len();
        Self {
            motions: MotionRows::new(&run.name),
            measured: None,
            run,
            namespace: namespace.to_owned(),
            node,
            kind,
            announced: Vec::new(),
            heard: vec![false; arms],
            fresh: vec![false; arms],
            positions: vec![0.0; count],
            velocities: vec![0.0; count],
            fastest: parameters.settings.limits.joint_velocity.clone(),
            gaps: gaps(&parameters.settings),
            parameters,
            tool_changed: false,
            law: None,
            state: None,
            goal: None,
            cycle: None,
            sent_nothing: false,
            unusable: None,
        }
    }

    /// Makes this reader measure the motions toward the goals `given` itself. Call it for a run in which no servo reports motions.
    pub fn measure_toward(&mut self, given: &GivenGoals) {
        let measured = MeasuredMotions::new(&self.run.name, self.run.tolerance);
        self.measured = Some((measured, given.topic().map(str::to_owned)));
        if let GivenGoals::Pose(goal) = given {
            self.take_goal(0.0, *goal);
        }
    }

    fn take_goal(&mut self, time: f64, goal: UnitDualQuaternion) {
        let Some((measured, _)) = &mut self.measured else { return };
        self.run.goals.push((time, goal));
        if measured.take_goal(time, goal) {
            self.change(time, ChangeKind::Goal, "goal".to_owned());
        }
    }

    /// Stores the parameters that the servo announced, at its starts and afterwards. [`apply_until`](Self::apply_until) applies
    /// each of them at the time of its announcement.
    pub fn announce(&mut self, lives: &[AnnouncedParameters]) -> Result<(), RunError> {
        for (number, life) in lives.iter().enumerate() {
            let mut store = life.initial(self.kind)?;
            let unknown = life.unknown(&store).map(|name| shown(name, NAME)).collect::<Vec<_>>().join(", ");
            if number == 0 && !unknown.is_empty() {
                let name = &self.run.name;
                self.run
                    .notes
                    .push(format!("{name}: its servo was of another version: {unknown} is ignored"));
            }
            if number > 0 {
                self.announced.push((life.since, self.kind.from_store(&store)?));
            }
            for change in &life.changes {
                store = store.with(&changed(change.clone(), &store)?)?;
                self.announced.push((change.stamp.nanoseconds(), self.kind.from_store(&store)?));
            }
        }
        // The latest parameters come first, because `apply_until` pops the next ones from the end.
        self.announced.sort_by_key(|(stamp, _)| std::cmp::Reverse(*stamp));
        Ok(())
    }

    /// Applies the parameters that were announced up to `time` \[s\], counted from `origin` \[ns\].
    fn apply_until(&mut self, time: f64, origin: i64) {
        let seconds = |stamp: i64| (i128::from(stamp) - i128::from(origin)) as f64 * 1e-9;
        while let Some((stamp, _)) = self.announced.last().filter(|(stamp, _)| seconds(*stamp) <= time) {
            let since = seconds(*stamp);
            let Some((_, parameters)) = self.announced.pop() else { return };
            let (before, now) = (&self.parameters.settings, &parameters.settings);
            if before.limits != now.limits {
                self.run.limits.push((since, now.limits.clone()));
                for (fastest, limit) in self.fastest.iter_mut().zip(&now.limits.joint_velocity) {
                    *fastest = fastest.max(*limit);
                }
            }
            let [threshold, other] = [before, now].map(|of| of.controller.damping.threshold);
            if threshold != other {
                self.run.damping_thresholds.push((since, other));
            }
            if before.scene != now.scene {
                self.gaps = gaps(now);
                self.run.add_scene(now.scene.as_deref());
            }
            self.tool_changed |= before.tool_offset != now.tool_offset
                || !parameters.arms.chains().eq(self.parameters.arms.chains());
            self.run.arms = parameters.arms.chains().cloned().collect();
            self.parameters = parameters;
            self.parameters.arms.set_tool_offset(&self.parameters.settings.tool_offset);
        }
    }

    fn range(&self, arm: usize) -> std::ops::Range<usize> {
        let first = self.run.commands[arm].first_joint;
        first..first + self.parameters.joints[arm].names().len()
    }

    /// Returns whether all joint names differ, so that one topic may carry the joint states of all arms.
    pub fn shares_topic(&self) -> bool {
        let mut names = HashSet::new();
        self.parameters.joints.iter().flat_map(JointOrder::names).all(|name| names.insert(name))
    }

    /// Processes a joint state of arm number `arm`. `measured` converts the stamp of the joint state \[ns\] to the time of
    /// measurement \[s\].
    fn take_joint_states(&mut self, measured: impl Fn(i64) -> f64, arm: usize, message: &BagMessage) {
        if let Ok(state) = message.decode::<JointState>() {
            self.take_joint_state(measured(state.header.stamp.nanoseconds()), arm, &state);
        }
    }

    fn take_joint_state(&mut self, time: f64, arm: usize, state: &JointState) {
        let (range, joints) = (self.range(arm), &self.parameters.joints[arm]);
        let positions = &mut self.positions[range.clone()];
        if let Err(why) = joints.positions(&state.name, &state.position, positions) {
            self.unusable.get_or_insert(why);
            return;
        }
        let velocities = &mut self.velocities[range];
        if joints.positions(&state.name, &state.velocity, velocities).is_err() {
            velocities.fill(f64::NAN);
        }
        // Add a sample once each arm has sent a joint state. An arm that is silent for longer than the timeout does not delay the
        // samples.
        (self.fresh[arm], self.heard[arm]) = (true, true);
        let timeout = self.parameters.settings.state_timeout.as_secs_f64();
        let last = self.run.samples.last().map(|last| last.time);
        let due = last.is_some_and(|last| time - last > timeout) || self.fresh.iter().all(|fresh| *fresh);
        // Joint states that are older than the last sample get no sample.
        if due && self.heard.iter().all(|heard| *heard) && last.is_none_or(|last| last < time) {
            self.fresh.fill(false);
            self.sample(time);
        }
    }

    fn sample(&mut self, time: f64) {
        let jumped = self.has_jumped(time);
        let ServoParameters { arms, settings, .. } = &mut self.parameters;
        arms.evaluate(&self.positions);
        // The controller cannot have caused the jump. So check for overlaps from the new position on.
        if jumped {
            self.gaps = gaps(settings);
        }
        let found = self.gaps.as_mut().and_then(|gaps| gaps.check(arms.chains(), &self.positions).err());
        self.run.inside = self.run.inside.take().or(found.map(|found| (time, found)));
        let pose = arms.pose();
        if let Some((measured, _)) = &mut self.measured
            && let Some(error) = measured.sample(time, &pose, &self.positions, &self.velocities)
        {
            self.run.errors.push((time, error));
        }
        self.run.samples.push(Sample {
            time,
            positions: self.positions.clone(),
            velocities: self.velocities.clone(),
            pose,
            jumped: std::mem::take(&mut self.tool_changed) || jumped,
            smallest_singular_value: settings.controller.smallest_singular_value(arms.state()),
        });
    }

    /// Returns whether a joint has moved farther since the last sample than its highest speed limit so far allows. The highest
    /// limit counts, because a joint may still brake after its limit was lowered.
    fn has_jumped(&self, time: f64) -> bool {
        let kinds = self.parameters.arms.joint_kinds();
        self.run.samples.last().is_some_and(|last| {
            let ends = last.positions.iter().zip(&self.positions);
            let mut ways = ends
                .zip(kinds)
                .map(|((from, to), kind)| kind.displacement(*from, *to).abs())
                .zip(&self.fastest);
            ways.any(|(way, speed)| way > longest_travel(*speed, time - last.time))
        })
    }

    fn take_command(&mut self, time: f64, arm: usize, numbers: Vec<f64>) {
        if numbers.len() != self.parameters.joints[arm].names().len() {
            return;
        }
        let commands = &mut self.run.commands[arm];
        match self.parameters.settings.interface {
            Interface::Velocity => commands.velocities.push((time, numbers)),
            Interface::Position | Interface::Trajectory => commands.positions.push((time, numbers)),
        }
    }

    /// Processes the record of a cycle: computes the cycle's jitter, and notes whether the servo sent a command.
    fn take_cycle(&mut self, time: f64, record: &CycleRecord) {
        let sends_nothing = record.output.is_none();
        if std::mem::replace(&mut self.sent_nothing, sends_nothing) && !sends_nothing {
            self.positions_begin(time - SHORTEST_PAUSE);
        }
        let (number, now) = (record.number, record.now);
        let before = self.cycle.replace((number, now));
        if let Some((_, before)) = before.filter(|(before, _)| before.checked_add(1) == Some(number)) {
            let late = now.as_secs_f64() - before.as_secs_f64() - self.parameters.period.as_secs_f64();
            self.run.jitter.push((time, 1e3 * late));
        }
    }

    /// Breaks the curves of commanded positions at `time`. Changes positions that are already stored, because the record of a cycle
    /// arrives later than its commands.
    fn positions_begin(&mut self, time: f64) {
        for positions in self.run.commands.iter_mut().map(|commands| &mut commands.positions) {
            let before = positions.partition_point(|(of, _)| *of < time).checked_sub(1);
            if let Some((_, last)) = before.and_then(|before| positions.get_mut(before)) {
                last.fill(f64::NAN);
            }
        }
    }

    fn take_status(&mut self, time: f64, status: &DiagnosticStatus) {
        let Some(report) = StatusReport::from_message(status) else { return };
        let law = shown(&report.law_and_aim(), NAME);
        if self.law.as_ref() != Some(&law) {
            if self.law.is_some() {
                self.change(time, ChangeKind::Law, law.clone());
            }
            self.run.laws.push((time, law.clone()));
            self.law = Some(law);
        }
        let was_near = self.run.clearances.last().is_some_and(|(_, clearance)| clearance.is_finite());
        if report.clearance.is_some() || was_near {
            self.run.clearances.push((time, report.clearance.unwrap_or(f64::NAN)));
        }
        if self.state.as_ref() != Some(&status.message) {
            self.change(time, ChangeKind::State, status.message.clone());
            self.state = Some(status.message.clone());
        }
        let goal = report.goal.and_then(|[x, y, z, orientation @ ..]| {
            Goal::new([x, y, z], orientation, "", "").ok().map(|goal| *goal.base_from_goal())
        });
        if let Some(goal) = goal.filter(|goal| self.goal.as_ref() != Some(goal)) {
            self.run.goals.push((time, goal));
        }
        self.goal = goal;
    }

    fn take_motion(&mut self, time: f64, origin: i64, report: MotionReport) {
        if let Some(begin) = self.motions.take(time, origin, report) {
            self.change(begin, ChangeKind::Goal, "goal".to_owned());
        }
    }

    /// Processes the pose error that the servo reports.
    fn take_error(&mut self, time: f64, error: &TwistStamped) {
        let none = GoalError { position: f64::NAN, rotation: f64::NAN };
        if let Some((last, _)) = self.run.errors.last().filter(|(last, _)| time - *last > GAP) {
            let last = *last;
            self.run.errors.push((last, none));
        }
        let error = dq_wire::error_distance(error);
        if self.run.errors.last().is_none_or(|(last, _)| *last < time) && error.position.is_finite() {
            self.run.errors.push((time, error));
        }
    }

    fn change(&mut self, time: f64, what: ChangeKind, to: String) {
        self.run.changes.push(Change { time, what, to: shown(&to, NAME) });
    }
}

impl Reader for RunReader {
    fn hears(&self, topic: &str) -> bool {
        let of_node = self.node.as_ref().and_then(|node| topic.strip_prefix(node.as_str()));
        let of_namespace = || topic.strip_prefix(&self.namespace);
        let of_arm = |topic: &str| self.kind.arms().iter().any(|arm| is_of_arm(topic, arm));
        let of_goals = self.measured.as_ref().is_some_and(|(_, goals)| goals.as_deref() == Some(topic));
        of_goals
            || of_node.is_some_and(|topic| ["/status", "/motions", "/pose_error", "/events"].contains(&topic))
            || of_namespace()
                .is_some_and(|topic| of_arm(topic) || topic == JOINT_STATES && self.shares_topic())
    }

    fn take(&mut self, time: f64, origin: i64, message: &BagMessage) {
        self.apply_until(time, origin);
        if self.measured.as_ref().is_some_and(|(_, goals)| goals.as_deref() == Some(&*message.topic)) {
            let goal = message.decode::<PoseStamped>().ok().and_then(|message| goal_of(&message));
            return goal.into_iter().for_each(|goal| self.take_goal(time, goal));
        }
        let measured = |stamp: i64| {
            let stamp = (i128::from(stamp) - i128::from(origin)) as f64 * 1e-9;
            if (time - LATE..=time).contains(&stamp) { stamp } else { time }
        };
        if let Some(topic) = self.node.as_ref().and_then(|node| message.topic.strip_prefix(node.as_str())) {
            // Damaged messages are skipped.
            match topic {
                "/status" => drop(message.decode().map(|status| self.take_status(time, &status))),
                "/motions" => {
                    let report = message.decode().ok().as_ref().and_then(MotionReport::from_message);
                    report.into_iter().for_each(|report| self.take_motion(time, origin, report));
                }
                "/events" => {
                    let record = message.decode::<UInt8MultiArray>().unwrap_or_default().data;
                    let cycles = CycleRecord::read_all(&record).unwrap_or_default();
                    let end = cycles.last().map_or(Duration::ZERO, |last| last.now);
                    for cycle in &cycles {
                        let before = end.saturating_sub(cycle.now).as_secs_f64();
                        self.take_cycle(time - before, cycle);
                    }
                }
                "/pose_error" => {
                    if let Ok(error) = message.decode::<TwistStamped>() {
                        self.take_error(measured(error.header.stamp.nanoseconds()), &error);
                    }
                }
                _ => {}
            }
            return;
        }
        let topic = &message.topic[self.namespace.len()..];
        if topic == JOINT_STATES {
            (0..self.parameters.joints.len()).for_each(|arm| self.take_joint_states(measured, arm, message));
            return;
        }
        let Some(arm) = self.kind.arms().iter().position(|arm| is_of_arm(topic, arm)) else { return };
        let topic = &topic[self.kind.arms()[arm].len()..];
        let interface = self.parameters.settings.interface;
        if topic == JOINT_STATES {
            self.take_joint_states(measured, arm, message);
        } else if topic == command_topic(interface) {
            let command = with_command!(interface, M => message.decode::<M>().ok().map(Command::numbers));
            command.into_iter().for_each(|numbers| self.take_command(time, arm, numbers));
        }
    }

    fn finish(mut self: Box<Self>) -> Result<RecordedRun, String> {
        if self.run.samples.is_empty() {
            let topic = || format!("the bag has none on {}joint_states", self.namespace);
            let why = self.unusable.map_or_else(topic, |why| why.to_string());
            return Err(format!(
                "{}: no joint state belongs to this arm: {why}; choose another arm with --arm or --ros-args --params-file",
                self.run.name
            ));
        }
        self.run.motions = match self.measured {
            Some((measured, _)) => measured.finish(),
            None => self.motions.finish(),
        };
        self.run.show_most();
        let shown = self.run.shown.clone();
        // Let the times count from the first motion of the shown part. This motion may have begun before the first joint state of
        // this part.
        let begins = self
            .run
            .motions
            .iter()
            .map(|motion| motion.start_s)
            .filter(|start| (shown.start - LONGEST_START..=shown.end).contains(start));
        let zero = begins.reduce(f64::min).unwrap_or(shown.start);
        self.run.begin_at(zero);
        Ok(self.run)
    }
}

/// Returns the goal of a message; `None` if its numbers are not a pose.
fn goal_of(message: &PoseStamped) -> Option<UnitDualQuaternion> {
    let (p, r) = (&message.pose.position, &message.pose.orientation);
    Goal::new([p.x, p.y, p.z], [r.x, r.y, r.z, r.w], "", "").ok().map(|goal| *goal.base_from_goal())
}

/// Returns the checks for overlaps of the arm with keep-outs and with itself; `None` if constraints are off. The checks ignore
/// overlaps that exist at the arm's first position.
fn gaps(settings: &Settings) -> Option<Gaps> {
    settings.scene.clone().map(Gaps::new)
}

/// The name of a topic of joint states, after the arm's prefix. The topic of this name without a prefix has the joint states of all arms.
const JOINT_STATES: &str = "joint_states";

/// Returns whether a topic has the joint states of, or the commands to, the arm with this prefix. `topic` is the name without the
/// namespace.
fn is_of_arm(topic: &str, prefix: &str) -> bool {
    let kinds = [Interface::Velocity, Interface::Position, Interface::Trajectory];
    topic
        .strip_prefix(prefix)
        .is_some_and(|topic| topic == JOINT_STATES || kinds.iter().any(|kind| topic == command_topic(*kind)))
}

/// Returns the value with the larger absolute value.
fn larger(one: f64, other: f64) -> f64 {
    if other.abs() > one.abs() { other } else { one }
}

fn larger_speeds((_, next): &mut (f64, Vec<f64>), (_, gone): &(f64, Vec<f64>)) {
    next.iter_mut().zip(gone).for_each(|(next, gone)| *next = larger(*next, *gone));
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_config::ForArm;

    /// Returns the reason why a bag cannot be drawn. `state` is the only joint state in the bag; `None` for a bag without joint states.
    fn refused(state: Option<(&[&str], &[f64])>) -> String {
        let parameters = ServoParameters::for_arm("panda").unwrap();
        let mut reader = RunReader::new("run".to_owned(), "/", None, parameters);
        if let Some((name, position)) = state {
            let name = name.iter().map(|name| (*name).to_owned()).collect();
            let state = JointState { name, position: position.to_vec(), ..JointState::default() };
            reader.take_joint_state(1.0, 0, &state);
        }
        Box::new(reader).finish().unwrap_err()
    }

    #[test]
    fn a_run_without_joint_states_of_the_arm_says_why() {
        let panda: Vec<_> = (1..=7).map(|joint| format!("panda_joint{joint}")).collect();
        let panda: Vec<_> = panda.iter().map(String::as_str).collect();
        for (state, why) in [
            (None, "the bag has none on /joint_states"),
            (Some((&["elbow"][..], &[0.0][..])), "is not in the joint state (it has [\"elbow\"])"),
            // A joint state with names but no positions, as for efforts only.
            (Some((&panda, &[])), "7 joint names with 0 positions"),
        ] {
            let refused = refused(state);
            assert!(refused.contains(why) && refused.contains("--arm"), "{refused}");
        }
    }
}
