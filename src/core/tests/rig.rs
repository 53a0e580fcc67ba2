//! A servo with simulated arms in fake time.

mod checks;

use crate::opinion::Opinion;
use crate::reference::{dual_parameters, parameters, pose, theta};
use crate::sent::Sent as Outputs;
use dq_algebra::UnitDualQuaternion;
use dq_check::Gaps;
use dq_config::ServoParameters;
use dq_core::servo::{
    Arms, Event, GoalMotion, GoalReading, Interface, JointGoalReading, JointOrder, JointReading, Limits,
    PositionLimits, Reason, Rejection, Revocation, Sent, Servo, Settings, State, TwistReading,
};
use dq_kinematics::arm::Chain;
use dq_kinematics::control::{Aim, Law};
use dq_plant::{Plant, Realism};
use dq_search::{STARTS, Search};
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::VecDeque;
use std::time::Duration;

pub const PERIOD: Duration = Duration::from_millis(2);

/// Positions and velocities of an arm.
type ArmState = (Vec<f64>, Vec<f64>);

/// A joint state that has arrived at the servo.
struct Arrived {
    measured: Duration,
    arm: usize,
    /// The age of the joint state by its stamp, if it has a stamp.
    age: Option<Duration>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

/// A servo with its simulated arms. It checks the invariants in every cycle.
pub struct Rig {
    pub servo: Servo,
    pub plants: Vec<Plant>,
    pub names: Vec<String>,
    pub now: Duration,
    pub command: Vec<f64>,
    /// The output of the last cycle.
    pub output: Option<Vec<f64>>,
    /// Whether joint states of each arm reach the servo.
    pub connected: Vec<bool>,
    /// Whether the plants follow commands.
    pub following: bool,
    /// Whether the arms' positions are checked against their limits. If cycles are late, no rule ensures these limits.
    pub check_positions: bool,
    /// The delay of commands on the way to the robot.
    pub command_delay: Duration,
    /// The delay of joint states on the way to the servo.
    pub state_delay: Duration,
    /// Whether joint states have stamps, by a clock that agrees with the servo's.
    pub stamped: bool,
    /// The time by which the stamps make joint states look older than they are.
    pub stamp_error: Duration,
    /// The time from one joint state to the next.
    pub state_interval: Duration,
    /// Whether joint states carry velocities.
    pub with_velocities: bool,
    /// The joint that is stuck, counted from 0, arm after arm.
    pub stuck_joint: Option<usize>,
    /// A fault of the wires: a function that changes each velocity command on its way to the robot.
    pub wires: fn(&mut [f64]),
    /// Whether commands are checked against the invariants.
    pub check_commands: bool,
    /// Whether to check that an arm with consent moves. A test whose law may have an output of zero sets this to false.
    pub check_moves: bool,
    /// Whether the tools' speeds are checked against their limits. If the servo cannot know the arm's position, no rule ensures
    /// these limits.
    pub check_tools: bool,
    /// The publisher of the joint states.
    pub source: u32,
    /// The search for other configurations of the arm, which [`Servo::ask`] starts; `None` if the program has no search.
    pub search: Option<Search>,
    /// How long the search takes to answer.
    pub search_time: Duration,
    answer: Option<Duration>,
    /// Number of memory allocations in the servo's cycles.
    pub allocations: u64,
    /// The speed that an external force, such as gravity, subtracts from the commanded speed of each joint [rad/s]. It acts only if
    /// the commands are velocities.
    pub pull: Vec<f64>,
    /// A second publisher of the joint states.
    pub second_source: Option<u32>,
    /// Whether the next cycle runs without the joint states that have arrived. The cycle after it then receives them.
    deaf: bool,
    /// The independent model of who may move the arm.
    opinion: Opinion,
    /// The time since which the arm must move; `Duration::MAX` once the arm has moved, `None` if it need not move.
    awaited: Option<Duration>,
    /// Whether the robot stands despite its last command to move (true), or moves differently (false); `None` if it obeys.
    altered: Option<bool>,
    /// The last command that has reached the robot.
    asked: Vec<f64>,
    /// For each joint, the time since which it has not moved in spite of its command; `None` if it obeys.
    refused: Vec<Option<Duration>>,
    /// The velocities in the last joint states [rad/s].
    shown: Vec<f64>,
    /// The positions in the last joint states \[rad\].
    seen: Vec<f64>,
    /// When joint states or commands last resumed after an interruption.
    came: Duration,
    /// The last output that was not `None`.
    last_sent: Vec<f64>,
    /// The last time at which the parameter `integral` was on; zero if it never was.
    held: Duration,
    initial: Settings,
    /// The number of the last publisher of a single goal. Each single goal gets a new publisher, as with `ros2 topic pub --once`.
    next_publisher: u32,
    /// Number of cycles after which another servo takes over with the saved state of the present servo; 0: never.
    pub restored_each: u32,
    /// The output of each cycle, if the test wants it.
    pub sent: Option<Vec<Option<Vec<f64>>>>,
    /// The parameters from which [`restore`](Self::restore) builds another servo. `restore` replaces the settings in these parameters
    /// by the settings of the present servo.
    parameters: ServoParameters,
    period: Duration,
    cycles: u32,
    commands_under_way: VecDeque<(Duration, Vec<f64>)>,
    states_under_way: VecDeque<(Duration, Vec<ArmState>)>,
    next_state: Duration,
    outputs: Outputs,
    /// The largest deceleration limit of each joint that was ever in force [rad/s²].
    steepest: Vec<f64>,
    /// Measures the gaps between the arms and their obstacles.
    gaps: Option<Gaps>,
    /// The smallest gap so far \[m\].
    pub least_gap: f64,
    /// The arms at their real positions. The rig uses them to check the speeds of the tools.
    truth: Arms,
}

impl Rig {
    /// Returns a rig with the paper's arm at its start.
    pub fn new() -> Self {
        Self::with(|_| {})
    }

    pub fn with(change: impl FnOnce(&mut Settings)) -> Self {
        let mut parameters = parameters();
        change(&mut parameters.settings);
        Self::start(parameters, starts(&["theta_initial"]))
    }

    /// Returns a rig with the paper's arm at its start. The servo runs at `rate` \[Hz\].
    pub fn at_rate(rate: u32, change: impl FnOnce(&mut Settings)) -> Self {
        let mut parameters = parameters();
        change(&mut parameters.settings);
        Self::start_at(parameters, starts(&["theta_initial"]), Duration::from_secs(1) / rate)
    }

    /// Returns a rig with the arm `chain` instead of the paper's arm. Each joint has the built-in settings.
    pub fn of_arm(chain: Chain, start: Vec<f64>) -> Self {
        Self::of_arm_with(chain, start, |_| {})
    }

    pub fn of_arm_with(chain: Chain, start: Vec<f64>, change: impl FnOnce(&mut Settings)) -> Self {
        let mut parameters = parameters();
        change(&mut parameters.settings);
        let count = chain.joint_count();
        let limits = &mut parameters.settings.limits;
        let Limits { joint_velocity, joint_acceleration, joint_deceleration, joint_jerk, .. } = limits;
        for list in [joint_velocity, joint_acceleration, joint_deceleration, joint_jerk] {
            list.resize(count, list[0]);
        }
        limits.position = PositionLimits { margin: limits.position.margin, ..PositionLimits::none(count) };
        parameters.joints = vec![JointOrder::new((1..=count).map(|i| format!("joint{i}")).collect())];
        parameters.arms = Arms::one(chain);
        Self::start(parameters, vec![start])
    }

    /// Returns a rig with the arm of these parameters.
    pub fn of(parameters: ServoParameters, start: Vec<f64>) -> Self {
        let period = parameters.period;
        Self::start_at(parameters, vec![start], period)
    }

    /// Returns a rig with the paper's arm, `seconds` after the arm began to move to theta_desired.
    pub fn in_motion(seconds: f64) -> Self {
        Self::new().moving(seconds)
    }

    /// Sends the goal theta_desired and runs for `seconds`.
    pub fn moving(mut self, seconds: f64) -> Self {
        self.goal("theta_desired");
        self.run(seconds);
        self
    }

    pub fn goal(&mut self, theta: &str) {
        let pose = pose(theta);
        self.goal_pose(&pose);
    }

    pub fn set_law(&mut self, law: dq_kinematics::control::Law) {
        self.change(|settings| settings.controller.law = law);
    }
}

impl Rig {
    /// Returns a rig with the paper's two arms: left β at theta_desired, right α at theta_initial.
    pub fn two_arms() -> Self {
        Self::two_arms_with(|_| {})
    }

    pub fn two_arms_with(change: impl FnOnce(&mut Settings)) -> Self {
        let mut parameters = dual_parameters();
        change(&mut parameters.settings);
        Self::start(parameters, starts(&["theta_desired", "theta_initial"]))
    }
}

impl Rig {
    fn start(parameters: ServoParameters, starts: Vec<Vec<f64>>) -> Self {
        Self::start_at(parameters, starts, PERIOD)
    }

    fn start_at(parameters: ServoParameters, starts: Vec<Vec<f64>>, period: Duration) -> Self {
        let parameters = parameters.with_period(period);
        let servo = parameters.build().unwrap();
        let again = parameters.clone();
        let ServoParameters { arms, joints, settings, .. } = parameters;
        let now = Duration::from_secs(1000);
        let plant = |start: &Vec<f64>| {
            let mut plant = Plant::new(start.clone(), Duration::from_millis(100));
            plant.step(now);
            plant
        };
        let names = joints[0].names().to_vec();
        let joints = arms.joint_count();
        let command = vec![0.0; joints];
        let mut steepest = vec![0.0; joints];
        let outputs = Outputs::new(&checked(&settings, settings.integral > 0.0, &mut steepest), period);
        let mut truth = arms.clone();
        truth.set_tool_offset(&settings.tool_offset);
        Self {
            pull: command.clone(),
            search: Some(Search::new(arms.clone())),
            search_time: Duration::ZERO,
            answer: None,
            output: None,
            truth,
            gaps: settings.scene.clone().map(Gaps::new),
            least_gap: f64::INFINITY,
            outputs,
            steepest,
            opinion: Opinion::new(&settings, starts.len(), period),
            initial: settings,
            servo,
            plants: starts.iter().map(plant).collect(),
            names,
            now,
            connected: vec![true; starts.len()],
            following: true,
            check_positions: true,
            command_delay: Duration::ZERO,
            state_delay: Duration::ZERO,
            stamped: true,
            stamp_error: Duration::ZERO,
            state_interval: Duration::ZERO,
            with_velocities: true,
            stuck_joint: None,
            wires: |_| {},
            check_commands: true,
            check_tools: true,
            check_moves: true,
            source: 0,
            allocations: 0,
            second_source: None,
            command,
            deaf: false,
            awaited: None,
            altered: None,
            asked: starts.concat(),
            refused: vec![None; joints],
            shown: vec![0.0; joints],
            seen: starts.concat(),
            came: Duration::ZERO,
            last_sent: starts.concat(),
            held: Duration::ZERO,
            next_publisher: 100,
            restored_each: 0,
            sent: None,
            parameters: again,
            period,
            cycles: 0,
            commands_under_way: VecDeque::new(),
            states_under_way: VecDeque::new(),
            next_state: Duration::ZERO,
        }
    }

    /// Sends a goal of the stream of publisher 0.
    pub fn stream(&mut self, pose: &UnitDualQuaternion) {
        self.take_goal(&reading(pose, 0)).unwrap();
    }

    /// Sends a single goal of a new publisher.
    pub fn goal_pose(&mut self, pose: &UnitDualQuaternion) {
        self.take_single(&reading(pose, 0)).unwrap();
    }

    /// Sends a single goal of a new publisher. The servo may reject the goal.
    pub fn take_single(&mut self, goal: &GoalReading) -> Result<(), Rejection> {
        let sent = Sent { by: self.next_publisher(), ..goal.sent };
        self.take_goal(&GoalReading { sent, ..*goal })
    }

    /// Returns the number of a publisher that has not sent anything yet.
    pub fn next_publisher(&mut self) -> u32 {
        self.next_publisher += 1;
        self.next_publisher
    }

    pub fn take_goal(&mut self, goal: &GoalReading) -> Result<(), Rejection> {
        match self.pose_of(goal) {
            None => self.opinion.unusable_goal(goal.sent, self.now),
            Some(pose) => {
                let ranges = std::iter::repeat_n((-4.0, 4.0), self.truth.joint_count());
                let reachable = !self.truth.reach(&pose.translation(), ranges).is_beyond(1e-9);
                self.opinion.goal(goal, pose, reachable, self.now);
            }
        }
        self.servo.take_stamped_goal(goal, self.now)
    }

    /// Sends a joint goal, which the servo may reject.
    pub fn take_joint_goal(&mut self, positions: &[Option<f64>], sent: Sent) -> Result<(), Rejection> {
        let is_named = positions.iter().any(Option::is_some);
        let mut place = self.positions();
        let joints = place.iter_mut().zip(positions);
        joints.for_each(|(place, position)| *place = position.unwrap_or(*place));
        let limits = self.servo.settings().limits.position.clone();
        let mut named = positions.iter().zip(limits.ranges());
        let is_valid = named.all(|(position, (lower, upper))| {
            position.is_none_or(|position| position.abs() <= 1e5 && (lower..=upper).contains(&position))
        });
        if is_named && is_valid && positions.len() == place.len() {
            let mut arms = self.truth.clone();
            arms.evaluate(&place);
            let is_whole = positions.iter().all(Option::is_some);
            self.opinion.joint_goal(sent, arms.pose(), is_whole, self.now);
        } else {
            self.opinion.unusable_goal(sent, self.now);
        }
        self.servo.take_joint_goal(&JointGoalReading { positions, stamp: 0, sent }, self.now)
    }

    /// Sends a joint goal of a new publisher.
    pub fn joint_goal(&mut self, positions: &[f64]) {
        let positions: Vec<_> = positions.iter().copied().map(Some).collect();
        let sent = Sent { by: self.next_publisher(), ago: Duration::ZERO };
        self.take_joint_goal(&positions, sent).unwrap();
    }

    /// Returns the pose that the goal `goal` denotes; `None` if the goal is invalid.
    fn pose_of(&self, goal: &GoalReading) -> Option<UnitDualQuaternion> {
        let numbers = goal.position.iter().all(|number| number.abs() <= 1e3);
        let [x, y, z, w] = goal.orientation_xyzw;
        let quaternion = Quaternion::new(w, x, y, z);
        let is_goal = numbers && (quaternion.norm() - 1.0).abs() < 1e-3 && self.is_own_frame(goal.frame_id);
        is_goal.then(|| {
            let rotation = UnitQuaternion::from_quaternion(quaternion);
            UnitDualQuaternion::from_parts(rotation, goal.position.into())
        })
    }

    fn is_own_frame(&self, frame: &str) -> bool {
        frame.is_empty() || frame.trim_start_matches('/') == self.parameters.goal_frame
    }

    /// Sends a goal whose frame TF does not have yet, so that the goal must wait.
    pub fn goal_waits(&mut self, sent: Sent) {
        self.opinion.unusable_goal(sent, self.now);
        self.servo.begin(self.now);
        self.servo.take(Event::Waits(sent)).unwrap();
    }

    /// Sends a single goal at `position` in the frame `frame_id`.
    pub fn take_point(
        &mut self,
        position: [f64; 3],
        orientation_xyzw: [f64; 4],
        frame_id: &str,
    ) -> Result<(), Rejection> {
        let identity = reading(&UnitDualQuaternion::identity(), 0);
        self.take_single(&GoalReading { position, orientation_xyzw, frame_id, ..identity })
    }

    /// Pauses the servo, or resumes it.
    pub fn pause(&mut self, paused: bool) {
        self.pause_ago(paused, Duration::ZERO);
    }

    /// Pauses or resumes the servo by a request that was sent `ago` before now.
    pub fn pause_ago(&mut self, paused: bool, ago: Duration) {
        self.opinion.pause(paused, ago, self.now);
        self.servo.begin(self.now);
        // The servo rejects a request that is late.
        let _ = self.servo.take(Event::Pause { paused, ago });
    }

    /// Stops the servo. Nothing moves afterwards until there is a new request.
    pub fn stop(&mut self) {
        self.opinion.stop(self.now);
        self.servo.stop();
    }

    /// Sends a twist of publisher 0 in `frame`.
    pub fn twist(&mut self, linear: [f64; 3], angular: [f64; 3], frame: &str) -> Result<(), Rejection> {
        self.take_twist(&twist(linear, angular, frame))
    }

    pub fn take_twist(&mut self, reading: &TwistReading) -> Result<(), Rejection> {
        let taken = self.servo.take_twist(reading, self.now);
        let mut numbers = reading.linear.iter().chain(&reading.angular);
        let is_frame = self.is_own_frame(reading.frame_id) || reading.frame_id == self.parameters.tool_frame;
        match is_frame && numbers.all(|number| number.abs() <= 1e3) {
            true => self.opinion.twist(reading, self.now),
            false => self.opinion.unusable_twist(reading.sent, self.now),
        }
        taken
    }

    /// Tells the servo how the frame of the goal has moved, or that the frame is lost.
    pub fn move_goal(&mut self, motion: &GoalMotion) -> Result<(), Rejection> {
        match motion {
            GoalMotion::Lost => self.opinion.frame_is_lost(self.now),
            GoalMotion::To(goal) => {
                self.pose_of(goal).into_iter().for_each(|pose| self.opinion.goal_moves(pose, self.now));
            }
        }
        self.servo.move_goal(motion, self.now)
    }

    /// Gives the servo a joint state in addition to the joint states of the rig's arms.
    pub fn take_state(&mut self, arm: usize, state: &JointReading) -> Result<bool, Rejection> {
        self.opinion.hears_elsewhere(arm, self.now);
        self.servo.take_joint_state(arm, state, self.now)
    }

    /// Sets whether another publisher sends commands to the first arm.
    pub fn set_rival(&mut self, rival: bool) {
        self.opinion.set_rival_of_commands(rival);
        self.servo.set_rival(0, rival);
    }

    pub fn change(&mut self, change: impl FnOnce(&mut Settings)) {
        let mut settings = self.servo.settings().clone();
        change(&mut settings);
        let is_held = settings.integral > 0.0 || self.was_held();
        self.outputs.invariants().set_limits(checked(&settings, is_held, &mut self.steepest));
        self.opinion.configure(&settings, self.now);
        self.truth.set_tool_offset(&settings.tool_offset);
        if settings.scene != self.servo.settings().scene {
            self.gaps = settings.scene.clone().map(Gaps::new);
        }
        self.servo.configure(settings).unwrap();
    }

    /// Sets the delays of commands to the robot and of joint states to the servo.
    pub fn set_delays(&mut self, commands: Duration, states: Duration) {
        (self.command_delay, self.state_delay) = (commands, states);
        self.opinion.doubt(self.now);
    }

    /// Places the robot at `place`, removes all its faults, and restores the initial settings.
    pub fn make_sound(&mut self, place: &[f64]) {
        (self.following, self.stuck_joint, self.source, self.second_source) = (true, None, 0, None);
        (self.command_delay, self.state_delay, self.state_interval) = Default::default();
        (self.with_velocities, self.connected) = (true, vec![true; self.plants.len()]);
        // The servo sees the jump in its next cycle.
        self.opinion.doubt(self.now + self.period);
        let places = place.chunks(self.names.len());
        self.plants = places.map(|place| Plant::new(place.to_vec(), self.outputs.timeout())).collect();
        self.set_rival(false);
        let initial = self.initial.clone();
        self.change(|settings| *settings = initial);
        let is_one = self.plants.len() == 1;
        self.change(|settings| {
            settings.controller.aim = Aim::Pose;
            settings.controller.law = if is_one { Law::Logc } else { settings.controller.law };
        });
        self.pull.fill(0.0);
    }

    /// Skips `missed` cycles of the servo, and then runs one cycle. If `heard`, this cycle receives the joint states that are due;
    /// otherwise the cycle after it receives them.
    pub fn gap(&mut self, missed: u32, heard: bool) {
        self.deaf = !heard;
        self.cycle_late(missed);
    }

    pub fn period(&self) -> Duration {
        self.period
    }

    /// Makes joints follow velocities with the time constant `lag`.
    pub fn set_lag(&mut self, lag: Duration) {
        let realism = Realism { velocity_time_constant: lag, ..Realism::default() };
        self.plants.iter_mut().for_each(|plant| plant.set_realism(realism));
        self.opinion.doubt(self.now);
    }

    /// Displaces `joint` instantly by `by` \[rad, prismatic: m\], as if somebody moved it by hand. Joints are counted from 0, arm after arm.
    pub fn jump(&mut self, joint: usize, by: f64) {
        let (arm, joint) = (joint / self.names.len(), joint % self.names.len());
        let mut positions = self.plants[arm].positions().to_vec();
        positions[joint] += by;
        self.opinion.doubt(self.now);
        self.plants[arm] = Plant::new(positions, self.outputs.timeout());
    }

    pub fn connect(&mut self, connected: bool) {
        self.connected.fill(connected);
    }

    /// Runs one cycle of the servo and its arms, on time.
    pub fn cycle(&mut self) {
        self.cycle_late(0);
    }

    /// Skips `missed` cycles of the servo, during which its arms move on, and then runs one cycle.
    pub fn cycle_late(&mut self, missed: u32) {
        if self.restored_each > 0 && self.cycles.is_multiple_of(self.restored_each) {
            self.restore();
        }
        self.cycles += 1;
        for _ in 0..missed {
            self.now += self.period;
            self.step_plants();
        }
        self.now += self.period;
        self.send_states();
        let rejected = self.servo.rejections().total();
        let arrived = self.arrived_states();
        self.observe(&arrived);
        let (names, source, second_source) = (&self.names, self.source, self.second_source);
        let mut events = Vec::new();
        for state in &arrived {
            let velocities = if self.with_velocities { state.velocities.as_slice() } else { &[] };
            let (positions, stamp_age) = (state.positions.as_slice(), state.age);
            for source in [Some(source), second_source].into_iter().flatten() {
                let reading = JointReading { names, positions, velocities, source, stamp_age };
                events.push(Event::JointState(state.arm, reading));
            }
        }
        let (servo, now) = (&mut self.servo, self.now);
        let search = self.search.as_ref().filter(|_| self.answer.take_if(|due| *due <= now).is_some());
        events.extend(search.map(|search| Event::Found(search.found())));
        let cycle = || {
            servo.begin(now);
            events.drain(..).for_each(|event| drop(servo.take(event)));
            servo.step(now);
        };
        self.allocations += allocation_counter::measure(cycle).count_total;
        if let Some(search) = self.search.as_mut()
            && self.servo.ask(search)
        {
            search.run(STARTS, || true);
            self.answer = Some(self.now + self.search_time);
        }
        assert_eq!(self.servo.rejections().total(), rejected, "{:?}", self.servo.rejections());
        self.command.copy_from_slice(self.servo.command());
        let before = std::mem::replace(&mut self.output, self.servo.output().map(<[f64]>::to_vec));
        self.check(before.as_deref());
        if let Some(output) = &self.output {
            self.commands_under_way.push_back((self.now + self.command_delay, output.clone()));
        }
        let output = &self.output;
        self.sent.iter_mut().for_each(|sent| sent.push(output.clone()));
        self.step_plants();
    }

    /// Replaces the servo by another servo with the saved state of the replaced servo.
    fn restore(&mut self) {
        let saved = postcard::to_stdvec(&self.servo.saved()).unwrap();
        let settings = self.servo.settings().clone();
        let mut other = ServoParameters { settings, ..self.parameters.clone() }.build().unwrap();
        other.restore(&mut postcard::Deserializer::from_bytes(&saved)).unwrap();
        assert!(postcard::to_stdvec(&other.saved()).unwrap() == saved);
        self.servo = other;
    }

    fn send_states(&mut self) {
        if self.now < self.next_state {
            return;
        }
        self.next_state = self.now + self.state_interval;
        let state = |plant: &Plant| (plant.positions().to_vec(), plant.velocities().to_vec());
        self.states_under_way.push_back((self.now, self.plants.iter().map(state).collect()));
    }

    /// Returns the joint states that have arrived by now.
    fn arrived_states(&mut self) -> Vec<Arrived> {
        let mut arrived = Vec::new();
        if std::mem::take(&mut self.deaf) {
            return arrived;
        }
        while self.states_under_way.front().is_some_and(|(sent, _)| *sent + self.state_delay <= self.now) {
            let (sent, states) = self.states_under_way.pop_front().unwrap();
            let age = self.stamped.then_some(self.now - sent + self.stamp_error);
            let connected = states.into_iter().enumerate().filter(|(arm, _)| self.connected[*arm]);
            arrived.extend(connected.map(|(arm, (positions, velocities))| Arrived {
                measured: sent,
                arm,
                age,
                positions,
                velocities,
            }));
        }
        arrived
    }

    fn step_plants(&mut self) {
        self.altered = None;
        if self.commands_under_way.front().is_none_or(|(due, _)| *due > self.now) {
            self.refused.fill(None);
        }
        while self.commands_under_way.front().is_some_and(|(due, _)| *due <= self.now) {
            let (_, mut command) = self.commands_under_way.pop_front().unwrap();
            let interface = self.servo.settings().interface;
            let stays = if interface.takes_positions() { self.positions() } else { vec![0.0; command.len()] };
            let asked = command.clone();
            (self.wires)(&mut command);
            for (joint, command) in command.iter_mut().enumerate() {
                // A joint that does not obey stands, even if something pulls at it.
                if !self.following || self.stuck_joint == Some(joint) {
                    *command = stays[joint];
                } else if !interface.takes_positions() {
                    *command -= self.pull[joint];
                }
            }
            self.note_refusals(&asked, &command, &stays);
            for (plant, part) in self.plants.iter_mut().zip(command.chunks(self.names.len())) {
                match interface {
                    Interface::Velocity => plant.take_command(part, self.now).unwrap(),
                    Interface::Position => plant.take_positions(part, self.now, Duration::ZERO).unwrap(),
                    Interface::Trajectory => plant.take_positions(part, self.now, self.period).unwrap(),
                }
            }
        }
        self.plants.iter_mut().for_each(|plant| plant.step(self.now));
        if let Some(gaps) = &mut self.gaps {
            let positions: Vec<_> = self.plants.iter().flat_map(Plant::positions).copied().collect();
            let least = gaps.check(self.truth.chains(), &positions);
            self.least_gap = self.least_gap.min(least.unwrap_or_else(|why| panic!("{why}")));
        }
        if self.check_positions {
            let positions = self.positions();
            self.outputs.invariants().check_positions(&positions).unwrap();
        }
    }

    /// Returns the joint positions of all arms, arm after arm \[rad\].
    pub fn positions(&self) -> Vec<f64> {
        self.plants.iter().flat_map(Plant::positions).copied().collect()
    }

    pub fn run(&mut self, seconds: f64) {
        let end = self.now + Duration::from_secs_f64(seconds);
        while self.now < end {
            self.cycle();
        }
    }

    pub fn run_until(&mut self, state: State, seconds: f64) {
        let end = self.now + Duration::from_secs_f64(seconds);
        while self.servo.status().state != state {
            assert!(self.now < end, "{} instead of {state} after {seconds} s", self.servo.status().state);
            self.cycle();
        }
    }

    /// Returns the arms at their real positions.
    pub fn arms(&self) -> &Arms {
        &self.truth
    }

    pub fn state(&self) -> State {
        self.servo.status().state
    }

    /// Returns the reason why requests were revoked, if the status shows one.
    pub fn revoked(&self) -> Option<Revocation> {
        match self.servo.status().reason {
            Some(Reason::Revoked(why)) => Some(why),
            _ => None,
        }
    }

    pub fn speed(&self) -> f64 {
        self.command.iter().fold(0.0, |max, speed| speed.abs().max(max))
    }
}

/// Returns the limits that the commands must keep. First raises `steepest`, the largest deceleration limit of each joint so far
/// [rad/s²], to the limits in `settings`. `is_held` says whether the parameter `integral` is on or was ever on. If so, joints may also
/// accelerate at `steepest`.
fn checked(settings: &Settings, is_held: bool, steepest: &mut [f64]) -> Limits {
    let mut limits = settings.limits.clone();
    for (joint, steepest) in steepest.iter_mut().enumerate() {
        *steepest = steepest.max(settings.limits.deceleration(joint));
        if is_held {
            limits.joint_acceleration[joint] = limits.joint_acceleration[joint].max(*steepest);
        }
    }
    limits
}

/// Returns a twist of publisher 0 in the frame `frame_id`.
pub fn twist(linear: [f64; 3], angular: [f64; 3], frame_id: &str) -> TwistReading<'_> {
    TwistReading { linear, angular, frame_id, sent: Sent::default() }
}

/// Returns a goal at `pose` in the base frame, with the time stamp `stamp` \[ns\].
pub fn reading(pose: &UnitDualQuaternion, stamp: i64) -> GoalReading<'static> {
    let (t, r) = (pose.translation(), pose.rotation());
    let (orientation_xyzw, waited) = ([r.i, r.j, r.k, r.w], Duration::ZERO);
    GoalReading { position: t.into(), orientation_xyzw, frame_id: "", stamp, waited, sent: Sent::default() }
}

/// Returns the joint angles that the reference work (Sathuluri 2018) calls by these names \[rad\].
fn starts(names: &[&str]) -> Vec<Vec<f64>> {
    names.iter().map(|name| theta(name)).collect()
}

/// Returns the joint state of an arm of six joints at rest at `positions` \[rad\].
pub fn at_rest<'a>(names: &'a [String], positions: &'a [f64]) -> JointReading<'a> {
    JointReading { velocities: &[0.0; 6], ..state_of(names, positions, 0) }
}

/// Returns a joint state of the publisher `source` at `positions` \[rad\], without velocities and without a stamp.
pub fn state_of<'a>(names: &'a [String], positions: &'a [f64], source: u32) -> JointReading<'a> {
    JointReading { names, positions, velocities: &[], source, stamp_age: None }
}
