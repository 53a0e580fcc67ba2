//! The link to all arms of a servo.

use crate::arm::ArmLink;
use crate::command_history::CommandHistory;
use crate::lateness::Cycles;
use crate::pull::{Hold, Room};
use crate::{ArmFigures, Contact, Disobedience, JointOrder, JointReading, LinkSettings, Return, StateError};
use dq_kinematics::arm::JointKind;
use dq_limits::{Braking, Interface, Limits, ratio};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Duration;

/// The link between a servo and its arms. It takes joint states and predicts positions. It estimates the delay of each arm, and the
/// pull at each joint: by how much a payload or gravity slows the joint. It monitors whether the arms follow.
#[derive(Serialize, Deserialize)]
pub struct Link {
    arms: Vec<ArmLink>,
    history: CommandHistory,
    cycles: Cycles,
    measured: Vec<f64>,
    predicted: Vec<f64>,
    velocity: Vec<f64>,
    /// The hold of each joint [rad/s, prismatic: m/s]: the part of its command that keeps it still against a payload or gravity.
    hold: Vec<f64>,
    /// The part of each joint's `hold` that counts as tested, because the joint has responded to it [rad/s, prismatic: m/s].
    proven: Vec<f64>,
}

impl Link {
    /// Creates the link to one or several arms. `orders` has the joint names of each arm, and `kinds` has the kinds of all joints,
    /// arm after arm. The servo sends commands of the kind `interface` once per `period`.
    pub fn new(orders: Vec<JointOrder>, kinds: &[JointKind], period: Duration, interface: Interface) -> Self {
        let mut count = 0;
        let arms = orders.into_iter().map(|order| {
            let joints = count..count + order.names().len();
            count = joints.end;
            ArmLink::new(order, kinds[joints.clone()].to_vec(), joints, period)
        });
        let arms = arms.collect();
        let zeros = vec![0.0; count];
        let history = CommandHistory::new(count, period, interface);
        Self {
            arms,
            history,
            cycles: Cycles::new(period),
            measured: zeros.clone(),
            predicted: zeros.clone(),
            velocity: zeros.clone(),
            hold: zeros.clone(),
            proven: zeros,
        }
    }

    /// Takes the joint state `reading`, received at `now`, for the next cycle. If several joint states arrive before that cycle,
    /// the last valid one counts. Returns false if `reading` is ignored because another publisher is in use. A publisher takes over
    /// only after the publisher in use has been silent for `silence`.
    pub fn take(
        &mut self,
        arm: usize,
        reading: &JointReading,
        now: Duration,
        silence: Duration,
    ) -> Result<bool, StateError> {
        self.arms[arm].take(reading, now, silence)
    }

    /// Returns the joint names of `arm`, and their indices among the joints of all arms.
    pub fn order(&self, arm: usize) -> (JointOrder, Range<usize>) {
        self.arms[arm].order()
    }

    /// Sets whether anyone subscribes to the commands for `arm`.
    pub fn set_listeners(&mut self, arm: usize, listeners: bool) {
        self.arms[arm].listeners = listeners;
    }

    /// Sets whether another publisher sends commands to `arm`.
    pub fn set_rival(&mut self, arm: usize, rival: bool) {
        self.arms[arm].rival = rival;
    }

    /// Processes the joint states that arrived since the last cycle.
    pub fn advance(&mut self, now: Duration, settings: &LinkSettings) {
        self.cycles.note(now);
        let is_known = self.is_known();
        for arm in &mut self.arms {
            if self.cycles.has_gap() && arm.received.is_some() {
                arm.blind_since = Some(now);
            }
            arm.advance(settings, &mut self.measured, &mut self.velocity, &self.history, is_known);
            arm.sum_up(now, settings.latency, &self.cycles);
            if arm.returned.is_some_and(|it| it.is_of_newcomer()) {
                // A robot that has just appeared gets no hold yet.
                self.hold[arm.joints.clone()].fill(0.0);
            }
        }
        self.predict(now);
    }

    /// Returns the events of this cycle that revoke consent: a robot appeared, came back or jumped.
    pub fn returns(&self) -> impl Iterator<Item = Return> + '_ {
        self.arms.iter().filter_map(|arm| arm.returned)
    }

    /// Returns how an arm has disobeyed its commands, if it has disobeyed for longer than `timeout` or too often; otherwise `None`.
    pub fn disobedience(&self, now: Duration, timeout: Duration) -> Option<Disobedience> {
        self.arms.iter().find_map(|arm| {
            let first = arm.joints.start;
            Some(match arm.following.disobedience(now, timeout)? {
                Disobedience::For(joint, time) => Disobedience::For(first + joint, time),
                Disobedience::Again(joint) => Disobedience::Again(first + joint),
            })
        })
    }

    /// Notes that consent has been revoked. Forgets the times at which arms stopped following, because each of them counts for one
    /// revocation only. If an arm does not follow, its [hold](Self::hold()) returns to 0 until the servo drives the arm again.
    pub fn tell(&mut self) {
        for arm in &mut self.arms {
            if arm.following.is_lost() {
                arm.pull.release();
            }
            arm.following.tell();
        }
    }

    /// Returns whether an arm is known not to follow.
    pub fn is_lost(&self) -> bool {
        self.arms.iter().any(|arm| arm.following.is_lost())
    }

    /// Notes the speed scaling `factor`, from 0 to 1, that `arm` reported at `now`.
    pub fn set_factor(&mut self, arm: usize, factor: f64, now: Duration) {
        self.arms[arm].told_factor = factor.is_finite().then_some((factor.clamp(0.0, 1.0), now));
    }

    /// Returns the fraction of the commanded speed at which the slowest arm moves.
    pub fn factor(&self) -> f64 {
        self.figures().map(|figures| figures.factor).fold(1.0, f64::min)
    }

    /// Returns whether the state of an arm is unknown because the cycles had a gap. Then the servo must send nothing.
    pub fn is_blind(&self) -> bool {
        self.arms.iter().any(|arm| arm.blind_since.is_some())
    }

    /// Returns whether the states of all arms are known.
    fn is_known(&self) -> bool {
        self.received().is_some() && !self.is_blind()
    }

    /// Yields the index and the present speed [rad/s, prismatic: m/s] of each joint whose next command must start at its present
    /// speed.
    pub fn coasting(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let came = self.arms.iter().filter(|arm| arm.figures.came && self.is_known());
        came.flat_map(|arm| arm.joints.clone()).map(|joint| (joint, self.velocity[joint]))
    }

    fn predict(&mut self, now: Duration) {
        for arm in &self.arms {
            let since = arm.received.unwrap_or(now).saturating_sub(arm.figures.lag);
            let slots = &mut self.predicted[arm.joints.clone()];
            self.history.travel(arm.joints.clone(), since, now, slots);
            let passed = now.saturating_sub(since).as_secs_f64();
            let joints = self.measured[arm.joints.clone()].iter().zip(&self.hold[arm.joints.clone()]);
            slots.iter_mut().zip(joints).for_each(|(slot, (measured, hold))| {
                *slot = measured + arm.figures.factor * (*slot - passed * hold);
            });
        }
    }

    /// Records that `command` is in force from `now` on [rad/s, prismatic: m/s]. Its part [`hold`](Self::hold()) only keeps the
    /// joints still against a payload or gravity, so this part does not count as motion.
    pub fn command(&mut self, now: Duration, command: &[f64]) {
        self.history.note(now, command, &self.hold);
        for arm in &mut self.arms {
            let joints = arm.joints.clone();
            let parts = command[joints.clone()].iter().zip(&self.hold[joints]);
            arm.following.command(now, parts.map(|(command, hold)| command - hold));
        }
    }

    /// Moves the [hold](Self::hold()) of each joint toward the estimated [pull](Self::pulls), or toward 0 if `what` is
    /// [`Hold::Nothing`]. `jerks` are the joints' jerk limits [rad/s³, prismatic: m/s³], and `period` is the control period \[s\].
    pub fn balance(&mut self, what: Hold, limits: &Limits, jerks: &[f64], period: f64) {
        let room = Room { limits, positions: &self.predicted, jerks, period };
        for arm in &mut self.arms {
            let range = arm.joints.clone();
            arm.balance(what, &room, &mut self.proven[range.clone()], &mut self.hold[range]);
        }
    }

    /// Returns the hold of each joint: the part of its command that keeps it still against a payload or gravity [rad/s, prismatic:
    /// m/s].
    pub fn hold(&self) -> &[f64] {
        &self.hold
    }

    /// Returns the pull at each joint: by how much a payload or gravity reduces the joint's speed below the command [rad/s,
    /// prismatic: m/s].
    pub fn pulls(&self) -> impl Iterator<Item = f64> + '_ {
        self.arms.iter().flat_map(|arm| arm.pull.speeds().iter().copied())
    }

    /// Returns whether no command has moved a joint since `time`.
    pub fn stood_after(&self, time: Duration) -> bool {
        self.history.stood_after(time)
    }

    /// Returns the joint positions as last measured \[rad, prismatic: m\], arm after arm.
    pub fn measured(&self) -> &[f64] {
        &self.measured
    }

    /// Returns the joint positions predicted for the time at which the next command takes effect \[rad, prismatic: m\].
    pub fn predicted(&self) -> &[f64] {
        &self.predicted
    }

    /// Returns when the last joint state arrived; for two arms, the earlier of their two times. Returns `None` until each arm has
    /// sent a joint state.
    pub fn received(&self) -> Option<Duration> {
        self.arms.iter().map(|arm| arm.received).min().flatten()
    }

    /// Returns the time between the joint states of an arm if they arrive too rarely for `state_timeout`. If both arms have this fault,
    /// returns the longer time. Returns `None` if no arm has it.
    pub fn rare_states(&self) -> Option<Duration> {
        self.arms.iter().filter_map(|arm| arm.rarity.interval).max()
    }

    /// Returns the number of the arm that has sent no joint state for the longest time. An arm that has never sent one comes first.
    pub fn quietest(&self) -> usize {
        let arms = self.arms.iter().enumerate();
        arms.min_by_key(|(_, arm)| arm.received).map_or(0, |(arm, _)| arm)
    }

    /// Returns the number of an arm with two publishers of joint states, and the numbers of the publisher in use and of the other
    /// one. Returns `None` if there is no such arm.
    pub fn rivals(&mut self, now: Duration) -> Option<(usize, [u32; 2])> {
        let mut arms = self.arms.iter_mut().enumerate();
        arms.find_map(|(arm, link)| Some((arm, link.sources.rivals(now)?)))
    }

    /// Returns the estimates about each arm in the last cycle.
    pub fn figures(&self) -> impl Iterator<Item = &ArmFigures> {
        self.arms.iter().map(|arm| &arm.figures)
    }

    /// Returns the number of the first arm whose [`ArmFigures::contact`] is one of `contacts`; `None` if there is no such arm.
    pub fn find(&self, contacts: &[Contact]) -> Option<usize> {
        self.figures().position(|figures| contacts.contains(&figures.contact))
    }

    /// Returns the number of a joint that does not follow (from 1, arm after arm); `None` if all joints follow.
    pub fn lost(&self) -> Option<usize> {
        self.arms.iter().find_map(|arm| Some(arm.joints.start + arm.following.lost()? + 1))
    }

    /// Returns the number of a joint that moves too far, and the joint's distance divided by the commanded distance. Joints are
    /// numbered from 1, arm after arm. `None` if no joint moves too far.
    pub fn too_far(&self, now: Duration) -> Option<(usize, f64)> {
        self.arms.iter().find_map(|arm| {
            let (joint, factor) = arm.following.too_far(now)?;
            Some((arm.joints.start + joint + 1, factor))
        })
    }

    /// Ends the time in which the servo sends only zeros to an arm that does not follow. The servo then drives this arm again at
    /// once.
    pub fn try_again(&mut self) {
        self.arms.iter_mut().for_each(|arm| arm.following.try_again());
    }

    /// Returns the factor, at most 1, by which to scale the speeds `target` [rad/s, prismatic: m/s]. The factor limits the command of
    /// each joint that has not yet responded. `accelerations` are the joints' acceleration limits [rad/s², prismatic: m/s²].
    pub fn probing_factor(&self, target: &[f64], accelerations: &[f64]) -> f64 {
        let factors = self.arms.iter().flat_map(|arm| {
            arm.joints.clone().map(|joint| {
                let probe = arm.following.probe(joint - arm.joints.start, accelerations[joint]);
                // The hold takes up a part of the allowed change.
                let left = (probe - (self.hold[joint] - self.proven[joint]).abs()).max(0.0);
                ratio(left, target[joint].abs())
            })
        });
        factors.fold(1.0, f64::min)
    }

    /// Returns the time from a command to the joint state that shows its effect \[s\]: `fixed`, or the estimate for the slowest arm
    /// if `fixed` is `None`.
    pub fn latency(&self, fixed: Option<Duration>) -> f64 {
        let estimated = self.arms.iter().map(|arm| arm.latency.total()).fold(0.0, f64::max);
        fixed.map_or(estimated, |latency| latency.as_secs_f64())
    }

    /// Returns the data from which the braking before a position limit is computed. The first argument has three lists with one
    /// number per joint: the decelerations [rad/s², prismatic: m/s²], the jerk limits [rad/s³, prismatic: m/s³], and the changes of
    /// speed by the last command [rad/s, prismatic: m/s]. `period` is the control period \[s\].
    ///
    /// The delay in the result includes the largest recent lateness, because the next command may be just as late. The delay that
    /// limits the law's gain does not include this lateness.
    pub fn braking<'a>(&self, [decelerations, jerks, steps]: [&'a [f64]; 3], period: f64) -> Braking<'a> {
        let slowest = |of: fn(&ArmFigures) -> Duration| self.figures().map(of).max().unwrap_or_default();
        let delay = slowest(|figures| figures.delay + figures.lateness).as_secs_f64();
        let cycle = slowest(|figures| figures.cycle).as_secs_f64().max(period);
        Braking { decelerations, jerks, steps, period, cycle, delay }
    }

    /// Returns the delay that limits the law's gain \[s\], for the slowest arm.
    pub fn delay(&self) -> f64 {
        self.figures().map(|figures| figures.delay).max().unwrap_or_default().as_secs_f64()
    }
}
