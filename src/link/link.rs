//! The arms together: what a cycle of the servo asks of the link.

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

/// The joints of all arms: as measured, and as they should be by now.
#[derive(Serialize, Deserialize)]
pub struct Link {
    arms: Vec<ArmLink>,
    history: CommandHistory,
    cycles: Cycles,
    measured: Vec<f64>,
    predicted: Vec<f64>,
    velocity: Vec<f64>,
    /// The part of the command that holds each joint against what pulls at it, and what of it the joint was seen to respond to [rad/s].
    hold: Vec<f64>,
    proven: Vec<f64>,
}

impl Link {
    /// Nothing heard yet of these arms, whose joints are of these kinds and take these commands, by a cycle of `period`.
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

    /// Takes a joint state received at `now`, for the next cycle; the last good one before it counts. True where it is of the
    /// publisher that is believed.
    pub fn take(
        &mut self,
        arm: usize,
        reading: &JointReading,
        now: Duration,
        silence: Duration,
    ) -> Result<bool, StateError> {
        self.arms[arm].take(reading, now, silence)
    }

    /// The joint names of `arm`, and which of all joints they are.
    pub fn order(&self, arm: usize) -> (JointOrder, Range<usize>) {
        self.arms[arm].order()
    }

    /// Whether anyone subscribes to the commands for `arm`.
    pub fn set_listeners(&mut self, arm: usize, listeners: bool) {
        self.arms[arm].listeners = listeners;
    }

    /// Whether anyone else sends commands to `arm`.
    pub fn set_rival(&mut self, arm: usize, rival: bool) {
        self.arms[arm].rival = rival;
    }

    /// Looks at what has come since the last cycle.
    pub fn advance(&mut self, now: Duration, settings: &LinkSettings) {
        self.cycles.note(now);
        for arm in &mut self.arms {
            if self.cycles.has_gap() && arm.received.is_some() {
                arm.blind_since = Some(now);
            }
            arm.advance(settings, &mut self.measured, &mut self.velocity, &self.history);
            arm.sum_up(now, settings.latency, &self.cycles);
            if arm.returned.is_some_and(|it| it.is_of_newcomer()) {
                // Nobody holds a robot that has just come.
                self.hold[arm.joints.clone()].fill(0.0);
            }
        }
        self.predict(now);
    }

    /// What each arm has done in this cycle that needs consent anew: what was asked for before is revoked.
    pub fn returns(&self) -> impl Iterator<Item = Return> + '_ {
        self.arms.iter().filter_map(|arm| arm.returned)
    }

    /// Why what was asked for longer than `timeout` ago is not obeyed, if it is not.
    pub fn disobedience(&self, now: Duration, timeout: Duration) -> Option<Disobedience> {
        self.arms.iter().find_map(|arm| {
            let first = arm.joints.start;
            Some(match arm.following.disobedience(now, timeout)? {
                Disobedience::For(joint, time) => Disobedience::For(first + joint, time),
                Disobedience::Again(joint) => Disobedience::Again(first + joint),
            })
        })
    }

    /// What was asked for was revoked.
    pub fn tell(&mut self) {
        for arm in &mut self.arms {
            if arm.following.is_lost() {
                arm.pull.release();
            }
            arm.following.tell();
        }
    }

    /// Whether an arm does not follow, as far as is known.
    pub fn is_lost(&self) -> bool {
        self.arms.iter().any(|arm| arm.following.is_lost())
    }

    /// Notes at which part of its speed `arm` says at `now` that it moves.
    pub fn set_factor(&mut self, arm: usize, factor: f64, now: Duration) {
        self.arms[arm].told_factor = factor.is_finite().then_some((factor.clamp(0.0, 1.0), now));
    }

    /// The part of the commanded speed at which the slowest arm moves.
    pub fn factor(&self) -> f64 {
        self.figures().map(|figures| figures.factor).fold(1.0, f64::min)
    }

    /// Whether the cycles had a gap, and it is not known of each arm yet what it has done in it: nothing may be sent.
    pub fn is_blind(&self) -> bool {
        self.arms.iter().any(|arm| arm.blind_since.is_some())
    }

    /// Of the arms whose next command begins with the speed that they have: which joints, and how fast these are [rad/s].
    pub fn coasting(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let came = self.arms.iter().filter(|arm| arm.figures.came && self.received().is_some());
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

    /// The joints are commanded to move at `command` [rad/s] from `now` on, of which the hold moves nothing.
    pub fn command(&mut self, now: Duration, command: &[f64]) {
        self.history.note(now, command, &self.hold);
        for arm in &mut self.arms {
            let joints = arm.joints.clone();
            let parts = command[joints.clone()].iter().zip(&self.hold[joints]);
            arm.following.command(now, parts.map(|(command, hold)| command - hold));
        }
    }

    /// Moves what holds the joints against what pulls at them towards what it should be, or towards 0 if nothing is to be held.
    /// The joints have these `jerks` [rad/s³] in cycles of `period` \[s\].
    pub fn balance(&mut self, what: Hold, limits: &Limits, jerks: &[f64], period: f64) {
        let room = Room { limits, positions: &self.predicted, jerks, period };
        for arm in &mut self.arms {
            let range = arm.joints.clone();
            arm.balance(what, &room, &mut self.proven[range.clone()], &mut self.hold[range]);
        }
    }

    /// The part of the command that holds each joint against what pulls at it [rad/s, prismatic: m/s].
    pub fn hold(&self) -> &[f64] {
        &self.hold
    }

    /// How much slower each joint moves than it is commanded [rad/s, prismatic: m/s].
    pub fn pulls(&self) -> impl Iterator<Item = f64> + '_ {
        self.arms.iter().flat_map(|arm| arm.pull.speeds().iter().copied())
    }

    /// Whether no joint was commanded to move since `time`.
    pub fn stood_after(&self, time: Duration) -> bool {
        self.history.stood_after(time)
    }

    /// The positions as last measured \[rad\], arm after arm.
    pub fn measured(&self) -> &[f64] {
        &self.measured
    }

    /// Where the joints should be when the next command reaches them \[rad\]: as last measured, moved on by the commands since.
    pub fn predicted(&self) -> &[f64] {
        &self.predicted
    }

    /// When the arm that has been silent longest was last heard; none where it is not known of each where it is and how fast.
    pub fn received(&self) -> Option<Duration> {
        self.arms.iter().map(|arm| arm.received).min().flatten()
    }

    /// The arm that has been silent longest.
    pub fn quietest(&self) -> usize {
        let arms = self.arms.iter().enumerate();
        arms.min_by_key(|(_, arm)| arm.received).map_or(0, |(arm, _)| arm)
    }

    /// The number of an arm of which two publishers both give joint states, and theirs, the one that was there first before the other.
    pub fn rivals(&mut self, now: Duration) -> Option<(usize, [u32; 2])> {
        let mut arms = self.arms.iter_mut().enumerate();
        arms.find_map(|(arm, link)| Some((arm, link.sources.rivals(now)?)))
    }

    /// What the last cycle found out of each arm.
    pub fn figures(&self) -> impl Iterator<Item = &ArmFigures> {
        self.arms.iter().map(|arm| &arm.figures)
    }

    /// The first arm that is one of `contacts`.
    pub fn find(&self, contacts: &[Contact]) -> Option<usize> {
        self.figures().position(|figures| contacts.contains(&figures.contact))
    }

    /// The joint, counted from 1 arm after arm, that does not follow.
    pub fn lost(&self) -> Option<usize> {
        self.arms.iter().find_map(|arm| Some(arm.joints.start + arm.following.lost()? + 1))
    }

    /// The joint, counted from 1 arm after arm, that goes too far, and how many times as far as commanded.
    pub fn too_far(&self, now: Duration) -> Option<(usize, f64)> {
        self.arms.iter().find_map(|arm| {
            let (joint, factor) = arm.following.too_far(now)?;
            Some((arm.joints.start + joint + 1, factor))
        })
    }

    /// Tries an arm that did not follow at once.
    pub fn try_again(&mut self) {
        self.arms.iter_mut().for_each(|arm| arm.following.try_again());
    }

    /// The factor for `target` [rad/s] so that joints that have not been seen to follow are driven gently.
    pub fn probing_factor(&self, target: &[f64], accelerations: &[f64]) -> f64 {
        let factors = self.arms.iter().flat_map(|arm| {
            arm.joints.clone().map(|joint| {
                let probe = arm.following.probe(joint - arm.joints.start, accelerations[joint]);
                // What the hold takes of the change is not left for the motion.
                let left = (probe - (self.hold[joint] - self.proven[joint]).abs()).max(0.0);
                ratio(left, target[joint].abs())
            })
        });
        factors.fold(1.0, f64::min)
    }

    /// From a command to the joint state that shows it \[s\], of the slowest arm.
    pub fn latency(&self, fixed: Option<Duration>) -> f64 {
        let estimated = self.arms.iter().map(|arm| arm.latency.total()).fold(0.0, f64::max);
        fixed.map_or(estimated, |latency| latency.as_secs_f64())
    }

    /// What braking before a position limit depends on, by a servo of `period` \[s\] whose joints have these `decelerations` [rad/s²]
    /// and jerks [rad/s³], and were changed by these steps [rad/s].
    /// A command may stay in force for as long as the latest of the last seconds did. That does not bound the law's gain: what is late
    /// once makes no law unstable.
    pub fn braking<'a>(&self, [decelerations, jerks, steps]: [&'a [f64]; 3], period: f64) -> Braking<'a> {
        let slowest = |of: fn(&ArmFigures) -> Duration| self.figures().map(of).max().unwrap_or_default();
        let delay = slowest(|figures| figures.delay + figures.lateness).as_secs_f64();
        let cycle = slowest(|figures| figures.cycle).as_secs_f64().max(period);
        Braking { decelerations, jerks, steps, period, cycle, delay }
    }

    /// What bounds the law's gain \[s\], of the slowest arm.
    pub fn delay(&self) -> f64 {
        self.figures().map(|figures| figures.delay).max().unwrap_or_default().as_secs_f64()
    }
}
