//! A servo and its arms in fake time.

use crate::opinion::Opinion;
use crate::reference::{dual_parameters, parameters, pose, theta};
use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{
    Arms, Event, GoalMotion, GoalReading, Interface, JointOrder, JointReading, Limits, PositionLimits,
    Reason, Rejection, Revocation, STARTS, STREAM, Search, Sent, Servo, Settings, State, TwistReading,
};
use dq_kinematics::arm::Chain;
use dq_limits::check::{Gaps, Invariants};
use dq_plant::Plant;
use std::collections::VecDeque;
use std::time::Duration;

pub const PERIOD: Duration = Duration::from_millis(2);

/// Positions and velocities of an arm.
type ArmState = (Vec<f64>, Vec<f64>);

/// A servo and its plants, with the invariants checked at every cycle.
pub struct Rig {
    pub servo: Servo,
    pub plants: Vec<Plant>,
    pub names: Vec<String>,
    pub now: Duration,
    pub command: Vec<f64>,
    /// What was sent in the last cycle.
    pub output: Option<Vec<f64>>,
    /// Whether joint states of each arm reach the servo.
    pub connected: Vec<bool>,
    /// Whether the plants follow commands.
    pub following: bool,
    /// Whether the plants' positions are checked against position limits too: no rule holds them where cycles come late.
    pub check_positions: bool,
    /// How late the robot hears commands, and the servo joint states.
    pub command_delay: Duration,
    pub state_delay: Duration,
    /// Whether joint states carry stamps of a clock that agrees.
    pub stamped: bool,
    /// The difference between the age by their stamps and their real age.
    pub stamp_error: Duration,
    /// Time from one joint state to the next.
    pub state_interval: Duration,
    /// Whether joint states carry velocities.
    pub with_velocities: bool,
    /// A joint that does not move.
    pub stuck_joint: Option<usize>,
    /// What the wires make of velocity commands.
    pub wires: fn(&mut [f64]),
    /// Whether commands are held against the invariants.
    pub check_commands: bool,
    /// Whether the tools' speeds are held against their limits: no rule does where the servo cannot know where the arm is.
    pub check_tools: bool,
    /// The publisher of the joint states.
    pub source: u32,
    /// Searches for the servo, and how long it takes until the answer comes; none: nobody answers.
    pub search: Option<Search>,
    pub search_time: Duration,
    answer: Option<Duration>,
    /// How often the servo's cycles have allocated memory.
    pub allocations: u64,
    /// The second opinion of whose request is in force.
    pub opinion: Opinion,
    /// The publisher of the next single goal: each `ros2 topic pub --once` is another one.
    next_publisher: u32,
    /// Whether the last that was heard of the goal is that its frame is lost.
    frame_lost: bool,
    /// Every this many cycles another servo takes over, with the state of this one; 0: never.
    pub restored_each: u32,
    /// What was sent in each cycle, while somebody wants to know.
    pub sent: Option<Vec<Option<Vec<f64>>>>,
    /// What another servo is built from, with the settings of this one.
    parameters: ServoParameters,
    period: Duration,
    commands_under_way: VecDeque<(Duration, Vec<f64>)>,
    states_under_way: VecDeque<(Duration, Vec<ArmState>)>,
    next_state: Duration,
    invariants: Invariants,
    /// The largest deceleration of each joint so far [rad/s²].
    steepest: Vec<f64>,
    /// What looks whether the arms keep out of what they must, and the least gap \[m\] so far.
    gaps: Option<Gaps>,
    pub least_gap: f64,
    /// The arms as they are, for what no limit may let their tools do.
    truth: Arms,
    cycles: u32,
}

impl Rig {
    /// The paper's arm at its start.
    pub fn new() -> Self {
        Self::with(|_| {})
    }

    pub fn with(change: impl FnOnce(&mut Settings)) -> Self {
        let mut parameters = parameters();
        change(&mut parameters.settings);
        Self::start(parameters, starts(&["theta_initial"]))
    }

    /// The same with a servo of another cycle.
    pub fn at_rate(rate: u32, change: impl FnOnce(&mut Settings)) -> Self {
        let mut parameters = parameters();
        change(&mut parameters.settings);
        Self::start_at(parameters, starts(&["theta_initial"]), Duration::from_secs(1) / rate)
    }

    /// Another arm, with the built-in settings for each joint.
    pub fn of_arm(chain: Chain, start: Vec<f64>) -> Self {
        let mut parameters = parameters();
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

    /// An arm with its own parameters.
    pub fn of(parameters: ServoParameters, start: Vec<f64>) -> Self {
        let period = parameters.period;
        Self::start_at(parameters, vec![start], period)
    }

    /// The paper's arm on its way to theta_desired for so long \[s\].
    pub fn in_motion(seconds: f64) -> Self {
        Self::new().moving(seconds)
    }

    /// On its way to theta_desired for so long \[s\].
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
    /// The paper's two arms: left β at theta_desired, right α at theta_initial.
    pub fn two_arms() -> Self {
        Self::start(dual_parameters(), starts(&["theta_desired", "theta_initial"]))
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
        let command = vec![0.0; arms.joint_count()];
        let mut steepest = vec![0.0; arms.joint_count()];
        let mut invariants = Invariants::new(checked(&settings, &mut steepest), period);
        invariants.check(Duration::ZERO, &command, true).unwrap();
        Self {
            search: Some(Search::new(arms.clone())),
            search_time: Duration::ZERO,
            answer: None,
            command,
            output: None,
            truth: arms.clone(),
            gaps: settings.scene.clone().map(Gaps::new),
            least_gap: f64::INFINITY,
            invariants,
            steepest,
            cycles: 0,
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
            source: 0,
            allocations: 0,
            opinion: Opinion::default(),
            next_publisher: 100,
            frame_lost: false,
            restored_each: 0,
            sent: None,
            parameters: again,
            period,
            commands_under_way: VecDeque::new(),
            states_under_way: VecDeque::new(),
            next_state: Duration::ZERO,
        }
    }

    /// A goal of the stream of the publisher 0.
    pub fn stream(&mut self, pose: &UnitDualQuaternion) {
        self.take_goal(&reading(pose, 0)).unwrap();
    }

    /// A single goal of a publisher that sends no other.
    pub fn goal_pose(&mut self, pose: &UnitDualQuaternion) {
        self.take_single(&reading(pose, 0)).unwrap();
    }

    /// The same of a goal that may be refused.
    pub fn take_single(&mut self, goal: &GoalReading) -> Result<(), Rejection> {
        self.next_publisher += 1;
        let sent = Sent { by: self.next_publisher, ..goal.sent };
        self.take_goal(&GoalReading { sent, ..*goal })
    }

    pub fn take_goal(&mut self, goal: &GoalReading) -> Result<(), Rejection> {
        let taken = self.servo.take_stamped_goal(goal, self.now);
        let sent = (self.now - goal.waited - goal.sent.ago, self.now);
        // A malformed goal is not a request.
        if !is_none(&taken) {
            self.opinion.hear_goal(goal.sent.by, sent, taken.is_ok());
        }
        self.frame_lost &= taken.is_err();
        taken
    }

    /// A single goal at that point, in that frame.
    pub fn take_point(
        &mut self,
        position: [f64; 3],
        orientation_xyzw: [f64; 4],
        frame_id: &str,
    ) -> Result<(), Rejection> {
        let identity = reading(&UnitDualQuaternion::identity(), 0);
        self.take_single(&GoalReading { position, orientation_xyzw, frame_id, ..identity })
    }

    /// Decelerates and holds, or goes on.
    pub fn pause(&mut self, paused: bool) {
        self.servo.pause(paused);
        self.opinion.pause(paused, self.now);
    }

    /// Stops the servo: nothing moves from then on before somebody asks for it.
    pub fn stop(&mut self) {
        self.servo.stop();
        self.opinion.stop(self.now, self.servo.consent());
        self.frame_lost = false;
    }

    /// A twist of the publisher 0, in this frame.
    pub fn twist(&mut self, linear: [f64; 3], angular: [f64; 3], frame: &str) -> Result<(), Rejection> {
        self.take_twist(&twist(linear, angular, frame))
    }

    pub fn take_twist(&mut self, reading: &TwistReading) -> Result<(), Rejection> {
        let taken = self.servo.take_twist(reading, self.now);
        if !is_none(&taken) {
            let asks = reading.linear != [0.0; 3] || reading.angular != [0.0; 3];
            self.opinion.hear_twist(reading.sent.by, (self.now - reading.sent.ago, self.now), asks);
            self.opinion.revoke(self.servo.consent());
        }
        taken
    }

    /// What the goal's frame does with it.
    pub fn move_goal(&mut self, motion: &GoalMotion) -> Result<(), Rejection> {
        let taken = self.servo.move_goal(motion, self.now);
        let lost = *motion == GoalMotion::Lost && self.opinion.has_goal();
        self.frame_lost = lost || (self.frame_lost && taken.is_err());
        taken
    }

    pub fn change(&mut self, change: impl FnOnce(&mut Settings)) {
        let mut settings = self.servo.settings().clone();
        change(&mut settings);
        self.invariants.set_limits(checked(&settings, &mut self.steepest));
        self.opinion.silence = settings.rearm_timeout.max(STREAM);
        if settings.scene != self.servo.settings().scene {
            self.gaps = settings.scene.clone().map(Gaps::new);
        }
        self.servo.configure(settings).unwrap();
        self.opinion.revoke(self.servo.consent());
    }

    pub fn connect(&mut self, connected: bool) {
        self.connected.fill(connected);
    }

    /// One cycle of all, on time.
    pub fn cycle(&mut self) {
        self.cycle_late(0);
    }

    /// One cycle of all after `missed` in which the servo did not run, but its plants did.
    pub fn cycle_late(&mut self, missed: u32) {
        if self.restored_each > 0 && self.cycles.is_multiple_of(self.restored_each) {
            self.restore();
        }
        for _ in 0..missed {
            self.now += self.period;
            self.step_plants();
        }
        self.now += self.period;
        self.send_states();
        let rejected = self.servo.rejections().total();
        let arrived = self.arrived_states();
        let (names, source) = (&self.names, self.source);
        let readings = arrived.iter().map(|(arm, stamp_age, (positions, velocities))| {
            let velocities = if self.with_velocities { velocities.as_slice() } else { &[] };
            Event::JointState(
                *arm,
                JointReading { names, positions, velocities, source, stamp_age: *stamp_age },
            )
        });
        let mut events: Vec<_> = readings.collect();
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
        let command = self.servo.command().to_vec();
        assert_eq!(self.servo.rejections().total(), rejected, "{:?}", self.servo.rejections());
        // By count of cycles, not by the clock: what a late cycle may do is no more than another may.
        self.cycles += 1;
        let driving = self.state().is_driven();
        self.opinion.revoke(self.servo.consent());
        // A twist that is obeyed drops the goal.
        self.frame_lost &= self.opinion.has_goal();
        let of_stick = matches!(self.state(), State::Jogging | State::NotFollowing);
        let rests = of_stick && self.opinion.comes_to_rest(self.now);
        let may_move = rests || self.opinion.may_move(self.now);
        assert!(!driving || may_move, "nobody asks for it: {} {:?}", self.state(), self.opinion);
        let reason = self.servo.status().reason;
        assert!(!(self.frame_lost && driving), "the goal's frame is lost: {}", self.state());
        assert!(self.frame_lost || reason != Some(Reason::FrameLost), "where the goal is was heard since");
        // Nothing is sent after a gap until it is known what the arm did in it.
        let is_silent = self.output.is_some() && self.servo.output().is_none();
        if is_silent || self.servo.arm_figures().any(|arm| arm.came) {
            self.invariants.robot_came();
        }
        if self.check_commands {
            // The hold that balances a pull does not count as motion.
            let stands = !driving && self.servo.settings().integral == 0.0;
            self.invariants.check(self.period * self.cycles, &command, stands).unwrap();
        }
        if self.check_commands && self.check_tools {
            self.truth.evaluate(&self.positions());
            self.invariants.check_tool(&self.truth.tool_speed(&command)).unwrap();
        }
        let output = self.servo.output().map(<[f64]>::to_vec);
        if let Some(output) = &output {
            self.check_setpoint(output);
            self.commands_under_way.push_back((self.now + self.command_delay, output.clone()));
        }
        self.sent.iter_mut().for_each(|sent| sent.push(output.clone()));
        self.output = output;
        self.step_plants();
        self.command = command;
    }

    /// Another servo takes the place of this one, and knows what this one knows.
    fn restore(&mut self) {
        let saved = postcard::to_stdvec(&self.servo.saved()).unwrap();
        let settings = self.servo.settings().clone();
        let mut other = ServoParameters { settings, ..self.parameters.clone() }.build().unwrap();
        other.restore(&mut postcard::Deserializer::from_bytes(&saved)).unwrap();
        assert!(postcard::to_stdvec(&other.saved()).unwrap() == saved);
        self.servo = other;
    }

    /// No position that is sent is a step from the one before, nor is the first from where the arm is.
    fn check_setpoint(&self, output: &[f64]) {
        let settings = self.servo.settings();
        if !settings.interface.takes_positions() {
            return;
        }
        let positions = self.positions();
        // To be sent to where it is moves no arm.
        if output.iter().zip(&positions).all(|(sent, is)| (sent - is).abs() < 1e-3) {
            return;
        }
        let before = self.output.clone().unwrap_or(positions);
        for ((now, before), speed) in output.iter().zip(&before).zip(&settings.limits.joint_velocity) {
            let largest = speed * self.period.as_secs_f64() * (1.0 + 1e-9);
            assert!((now - before).abs() <= largest, "a step from {before} to {now} rad");
        }
    }

    fn send_states(&mut self) {
        if self.now < self.next_state {
            return;
        }
        self.next_state = self.now + self.state_interval;
        let state = |plant: &Plant| (plant.positions().to_vec(), plant.velocities().to_vec());
        self.states_under_way.push_back((self.now, self.plants.iter().map(state).collect()));
    }

    /// The states that have come by now, each with the number of its arm and its age.
    fn arrived_states(&mut self) -> Vec<(usize, Option<Duration>, ArmState)> {
        let mut arrived = Vec::new();
        while self.states_under_way.front().is_some_and(|(sent, _)| *sent + self.state_delay <= self.now) {
            let (sent, states) = self.states_under_way.pop_front().unwrap();
            let age = self.stamped.then_some(self.now - sent + self.stamp_error);
            let connected = states.into_iter().enumerate().filter(|(arm, _)| self.connected[*arm]);
            arrived.extend(connected.map(|(arm, state)| (arm, age, state)));
        }
        arrived
    }

    fn step_plants(&mut self) {
        while self.commands_under_way.front().is_some_and(|(due, _)| *due <= self.now) {
            let (_, mut command) = self.commands_under_way.pop_front().unwrap();
            let interface = self.servo.settings().interface;
            let stays = if interface.takes_positions() { self.positions() } else { vec![0.0; command.len()] };
            if !self.following {
                command.copy_from_slice(&stays);
            }
            (self.wires)(&mut command);
            if let Some(joint) = self.stuck_joint {
                command[joint] = stays[joint];
            }
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
            self.invariants.check_positions(&positions).unwrap();
        }
    }

    /// Where the joints are \[rad\], arm after arm.
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

    /// The arms, as they are.
    pub fn arms(&self) -> &Arms {
        &self.truth
    }

    pub fn state(&self) -> State {
        self.servo.status().state
    }

    /// What has revoked what was asked for.
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

/// Returns the limits to check. A joint that is held against a pull slows down towards its hold, which may be to another command, and faster.
/// It keeps the largest deceleration that was in force when it set out: `steepest` is the largest so far [rad/s²].
fn checked(settings: &Settings, steepest: &mut [f64]) -> Limits {
    let mut limits = settings.limits.clone();
    for (joint, steepest) in steepest.iter_mut().enumerate() {
        *steepest = steepest.max(settings.limits.deceleration(joint));
        if settings.integral > 0.0 {
            limits.joint_acceleration[joint] = limits.joint_acceleration[joint].max(*steepest);
        }
    }
    limits
}

/// A twist of the publisher 0, in this frame.
pub fn twist(linear: [f64; 3], angular: [f64; 3], frame_id: &str) -> TwistReading<'_> {
    TwistReading { linear, angular, frame_id, sent: Sent::default() }
}

/// A goal in the servo's own frame.
pub fn reading(pose: &UnitDualQuaternion, stamp: i64) -> GoalReading<'static> {
    let (t, r) = (pose.translation(), pose.rotation());
    let (orientation_xyzw, waited) = ([r.i, r.j, r.k, r.w], Duration::ZERO);
    GoalReading { position: t.into(), orientation_xyzw, frame_id: "", stamp, waited, sent: Sent::default() }
}

/// Joint angles of the reference work, by their names.
fn starts(names: &[&str]) -> Vec<Vec<f64>> {
    names.iter().map(|name| theta(name)).collect()
}

/// The joint state of an arm of six joints that stands at `positions` \[rad\].
pub fn at_rest<'a>(names: &'a [String], positions: &'a [f64]) -> JointReading<'a> {
    JointReading { velocities: &[0.0; 6], ..state_of(names, positions, 0) }
}

/// What a driver of that number says of where these joints are \[rad\], without speeds and without a stamp.
pub fn state_of<'a>(names: &'a [String], positions: &'a [f64], source: u32) -> JointReading<'a> {
    JointReading { names, positions, velocities: &[], source, stamp_age: None }
}

/// Whether what came was no goal and no twist at all.
fn is_none(taken: &Result<(), Rejection>) -> bool {
    matches!(taken, Err(Rejection::Number(_) | Rejection::UnknownFrame { .. } | Rejection::NotUnit(_)))
}
