//! A servo and its robot in simulated time, independent of `rig`. The robot may have a lag, delays, and faults of wires and encoders.
//! External forces may act on it. This simulation checks no invariant.

use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{
    Arms, Event, GoalReading, JointReading, Rejection, Sent, Servo, Settings, State, TwistReading,
};
use std::collections::VecDeque;
use std::time::Duration;

pub struct Random(pub u64);
impl Random {
    pub fn new(seed: u64) -> Self {
        let mut r = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1);
        (0..8).for_each(|_| {
            r.unit();
        });
        r
    }
    /// Returns a number from 0 to 1.
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize % n
    }
    pub fn is(&mut self, p: f64) -> bool {
        self.unit() < p
    }
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
    pub fn gauss(&mut self) -> f64 {
        let (u, v) = (self.unit().max(1e-12), self.unit());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

/// A function that changes one value per joint, such as the commands or the measured positions. Its arguments are the time \[s\] and
/// the values.
type Change = Box<dyn FnMut(f64, &mut [f64])>;

pub struct Sim {
    pub servo: Servo,
    pub truth: Arms,
    names: Vec<Vec<String>>,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub time: f64,
    pub period: f64,
    /// The robot's time constant \[s\].
    pub lag: f64,
    /// The delay of commands \[s\].
    pub command_delay: f64,
    /// The delay of joint states \[s\].
    pub state_delay: f64,
    pub state_interval: f64,
    pub with_velocities: bool,
    pub stamped: bool,
    pub obeys: bool,
    pub connected: bool,
    pub wires: Change,
    /// The speed that an external force subtracts from the commanded speed of each joint while the robot obeys [rad/s].
    pub pull: Vec<f64>,
    /// The speed at which an external force moves each joint while the robot does not obey [rad/s].
    pub push: Vec<f64>,
    /// Changes the positions that the encoders report.
    pub encoder: Change,
    pub timeout: f64,
    /// The source of a random time that is added to `state_delay`, and the largest such time \[s\]; `None`: no random time.
    pub jitter: Option<(Random, f64)>,
    commands: VecDeque<(f64, Vec<f64>)>,
    in_force: Option<(f64, Vec<f64>)>,
    states: VecDeque<(f64, f64, Vec<f64>, Vec<f64>)>,
    next_state: f64,
    pub source: u32,
    pub output: Option<Vec<f64>>,
    pub command: Vec<f64>,
}

pub fn at(time: f64) -> Duration {
    Duration::from_secs_f64(1000.0 + time)
}

impl Sim {
    pub fn new(parameters: &ServoParameters, start: Vec<f64>) -> Self {
        let servo = parameters.build().unwrap();
        let names = parameters.joints.iter().map(|arm| arm.names().to_vec()).collect();
        let n = start.len();
        Self {
            servo,
            truth: parameters.arms.clone(),
            names,
            v: vec![0.0; n],
            time: 0.0,
            period: parameters.period.as_secs_f64(),
            lag: 0.0,
            command_delay: 0.0,
            state_delay: 0.0,
            state_interval: 0.0,
            with_velocities: true,
            stamped: true,
            obeys: true,
            connected: true,
            wires: Box::new(|_, _| {}),
            pull: vec![0.0; n],
            push: vec![0.0; n],
            encoder: Box::new(|_, _| {}),
            timeout: 0.1,
            jitter: None,
            commands: VecDeque::new(),
            in_force: None,
            states: VecDeque::new(),
            next_state: 0.0,
            source: 0,
            output: None,
            command: vec![0.0; n],
            q: start,
        }
    }

    pub fn now(&self) -> Duration {
        at(self.time)
    }

    pub fn change(&mut self, change: impl FnOnce(&mut Settings)) {
        let mut settings = self.servo.settings().clone();
        change(&mut settings);
        self.servo.configure(settings).unwrap();
    }

    pub fn goal(&mut self, by: u32, pose: &UnitDualQuaternion) -> Result<(), Rejection> {
        self.goal_ago(by, pose, 0.0, 0.0)
    }

    pub fn goal_ago(
        &mut self,
        by: u32,
        pose: &UnitDualQuaternion,
        ago: f64,
        waited: f64,
    ) -> Result<(), Rejection> {
        let (t, r) = (pose.translation(), pose.rotation());
        let goal = GoalReading {
            position: t.into(),
            orientation_xyzw: [r.i, r.j, r.k, r.w],
            frame_id: "",
            stamp: 0,
            waited: Duration::from_secs_f64(waited),
            sent: Sent { by, ago: Duration::from_secs_f64(ago) },
        };
        self.servo.take_stamped_goal(&goal, self.now())
    }

    pub fn twist(&mut self, by: u32, linear: [f64; 3], angular: [f64; 3], ago: f64) -> Result<(), Rejection> {
        let sent = Sent { by, ago: Duration::from_secs_f64(ago) };
        self.servo.take_twist(&TwistReading { linear, angular, frame_id: "", sent }, self.now())
    }

    pub fn state(&self) -> State {
        self.servo.status().state
    }

    pub fn speed(&self) -> f64 {
        self.command.iter().fold(0.0, |m, s| s.abs().max(m))
    }

    /// Returns the speed of the fastest joint of the simulated robot [rad/s].
    pub fn robot_speed(&self) -> f64 {
        self.v.iter().fold(0.0, |m, s| s.abs().max(m))
    }

    pub fn tool(&self) -> UnitDualQuaternion {
        self.truth.chain().forward_kinematics(&self.q[..self.truth.chain().joint_count()]).unwrap()
    }

    fn plant(&mut self, dt: f64) {
        let steps = (dt / 0.001).round().max(1.0);
        let h = dt / steps;
        let positions = self.servo.settings().interface.takes_positions();
        for _ in 0..steps as usize {
            let t = self.time;
            while self.commands.front().is_some_and(|(due, _)| *due <= t + 1e-9) {
                self.in_force = self.commands.pop_front();
            }
            let n = self.q.len();
            let mut wanted = vec![0.0; n];
            if positions {
                let mut target = self.in_force.as_ref().map_or(self.q.clone(), |(_, p)| p.clone());
                (self.wires)(t, &mut target);
                for (i, target) in target.iter().enumerate() {
                    let next = if self.obeys { *target } else { self.q[i] + h * self.push[i] };
                    let tau = if self.lag > 0.0 && self.obeys { 1.0 - (-h / self.lag).exp() } else { 1.0 };
                    let step = tau * (next - self.q[i]);
                    self.v[i] = step / h;
                    self.q[i] += step;
                }
            } else {
                if let Some((since, speeds)) = &self.in_force
                    && t - since <= self.timeout
                {
                    wanted.clone_from(speeds);
                }
                (self.wires)(t, &mut wanted);
                for (i, wanted) in wanted.iter().enumerate() {
                    let u = if self.obeys { wanted - self.pull[i] } else { self.push[i] };
                    self.v[i] = if self.lag > 0.0 && self.obeys {
                        u + (self.v[i] - u) * (-h / self.lag).exp()
                    } else {
                        u
                    };
                    self.q[i] += h * self.v[i];
                }
            }
            self.time += h;
        }
    }

    pub fn cycle(&mut self) {
        self.advance(self.period, true);
    }

    /// Moves the robot for `dt` \[s\], then runs one cycle of the servo. If `fed`, the cycle receives the joint states that have
    /// arrived; otherwise they are lost.
    pub fn advance(&mut self, dt: f64, fed: bool) {
        let end = self.time + dt;
        // The robot publishes joint states even while the servo misses cycles.
        while self.time < end - 1e-9 {
            let step = self.period.min(end - self.time);
            self.plant(step);
            if self.time + 1e-9 >= self.next_state {
                self.next_state = self.time + self.state_interval;
                let mut q = self.q.clone();
                (self.encoder)(self.time, &mut q);
                let late = self.jitter.as_mut().map_or(0.0, |(r, most)| r.between(0.0, *most));
                self.states.push_back((self.time + self.state_delay + late, self.time, q, self.v.clone()));
            }
        }
        self.time = end;
        let now = self.now();
        self.servo.begin(now);
        let due: Vec<_> = self.states.iter().filter(|s| s.0 <= self.time + 1e-9).cloned().collect();
        self.states.retain(|s| s.0 > self.time + 1e-9);
        for (_, made, q, v) in due {
            if !(fed && self.connected) {
                continue;
            }
            let age = self.stamped.then(|| Duration::from_secs_f64((self.time - made).max(0.0)));
            let mut first = 0;
            for (arm, names) in self.names.iter().enumerate() {
                let joints = first..first + names.len();
                first = joints.end;
                let reading = JointReading {
                    names,
                    positions: &q[joints.clone()],
                    velocities: if self.with_velocities { &v[joints] } else { &[] },
                    source: self.source,
                    stamp_age: age,
                };
                let _ = self.servo.take(Event::JointState(arm, reading));
            }
        }
        self.servo.step(now);
        self.command = self.servo.command().to_vec();
        self.output = self.servo.output().map(<[f64]>::to_vec);
        if let Some(output) = &self.output {
            self.commands.push_back((self.time + self.command_delay, output.clone()));
        }
    }

    pub fn run(&mut self, seconds: f64) {
        let end = self.time + seconds;
        while self.time < end - 1e-9 {
            self.cycle();
        }
    }

    pub fn other_states(&mut self, source: u32) {
        let q = self.q.clone();
        let names = self.names[0].clone();
        let reading = JointReading {
            names: &names,
            positions: &q[..names.len()],
            velocities: &[],
            source,
            stamp_age: None,
        };
        let now = self.now();
        self.servo.begin(now);
        let _ = self.servo.take(Event::JointState(0, reading));
    }
}
