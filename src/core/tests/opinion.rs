//! A model of consent that is independent of the servo: it implements only the rules of the guide's safety page. The model receives
//! every message and the motion of the simulated robot. It never reads the servo's state.
//!
//! A request is *pushed* when its publisher sends the first message after a silence. Later messages continue the same request.
//!
//! The safety page leaves some times uncertain: by one cycle, by the age of a joint state, or by 50 ms if a joint has jumped. The model
//! therefore stores each time as a [`Span`] with two bounds. Each of its conclusions is a [`Truth`]: no, maybe or yes.

use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{GoalReading, STREAM, Sent, Settings, TwistReading};
use std::collections::HashMap;
use std::ops::Not;
use std::time::Duration;

/// Whether a statement follows from the guide's safety page. The minimum of two values is their logical "and", and the maximum is their
/// logical "or".
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Truth {
    No,
    Maybe,
    Yes,
}

use Truth::{Maybe, No, Yes};

impl Truth {
    /// Returns `Yes` if both arguments are true, `No` if both are false, and `Maybe` otherwise.
    pub fn between(one: bool, other: bool) -> Self {
        [No, Maybe, Yes][usize::from(one) + usize::from(other)]
    }
}

impl From<bool> for Truth {
    fn from(is: bool) -> Self {
        Self::between(is, is)
    }
}

impl Not for Truth {
    type Output = Self;

    fn not(self) -> Self {
        [Yes, Maybe, No][self as usize]
    }
}

/// A time that lies between two bounds.
#[derive(Clone, Copy, Debug, Default)]
struct Span {
    least: Duration,
    most: Duration,
}

impl Span {
    fn at(time: Duration) -> Self {
        Self { least: time, most: time }
    }

    fn is_after(self, other: Self) -> Truth {
        Truth::between(self.least > other.most, self.most >= other.least)
    }

    /// Returns the bounds of the later of two times.
    fn later(self, other: Self) -> Self {
        Self { least: self.least.max(other.least), most: self.most.max(other.most) }
    }
}

/// Returns the time from `then` to `now`; zero if the clock was set back.
fn age(now: Duration, then: Duration) -> Duration {
    now.saturating_sub(then)
}

/// The time added to the arrival of a message, because a message that arrives between two cycles is later than the first of them.
const AFTER_THE_CYCLE: Duration = Duration::from_nanos(1);

/// The kind of request that a publisher sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Kind {
    Goals,
    Twists,
}

/// The messages of one publisher since its last silence.
#[derive(Clone, Copy, Debug)]
struct Stream {
    /// When the first message was sent. The request counts as made at this time.
    pushed: Span,
    /// When the first message arrived.
    first: Duration,
    /// When the last message was sent.
    sent: Duration,
    /// When the last message arrived.
    came: Duration,
    /// Whether any message requests a motion. Invalid messages, and goals that still wait for their frames, request none.
    is_usable: bool,
}

/// The goal in force.
#[derive(Clone, Debug)]
struct Wanted {
    /// When the goal was requested.
    pushed: Span,
    came: Duration,
    /// The pose of the goal; `None` if it is uncertain which goal is in force, or whether any goal is.
    pose: Option<UnitDualQuaternion>,
    /// Whether the goal consists of joint positions.
    by_joints: bool,
}

/// The joint states that the servo has received for one arm.
#[derive(Clone, Debug, Default)]
struct DeliveredStates {
    came: Option<Duration>,
    measured: Duration,
    positions: Vec<f64>,
    /// The publishers of the arm's joint states: for each, its number, when it appeared, and when it was last heard.
    sources: Vec<(u32, Duration, Duration)>,
}

/// The time within which an arm comes to rest after its twists have ended, even under a limit on jerk.
pub const REST: Duration = Duration::from_millis(1300);

/// The servo may need this long after odd behavior of the robot to conclude that the robot does not obey. The servo compares motion
/// over up to 1 s, waits 0.4 s for a response, tries again, and revokes consent after `rearm_timeout` (1 s).
const DOUBT: Duration = Duration::from_millis(3500);

/// The model of consent. It judges whether the arm may move, and whether the arm must move.
#[derive(Debug)]
pub struct Opinion {
    settings: Settings,
    period: Duration,
    streams: HashMap<(Kind, u32), Stream>,
    /// Requests that were made (pushed) before this time are revoked.
    revoked: Span,
    /// When a twist was last obeyed. Goals that were requested before this time are revoked.
    jogged: Span,
    goal: Option<Wanted>,
    /// When the goal's frame was lost, and whether the loss is certain.
    lost: Option<(Duration, Truth)>,
    paused: Truth,
    /// The time of the last twist that was zero or may have moved the arm.
    released: Duration,
    arms: Vec<DeliveredStates>,
    rival_of_commands: bool,
    /// Until this time, it is not certain that a request moves the arm.
    doubtful: Duration,
    /// The time since which the robot has not moved although it must; `None` if it moves or need not move.
    refuses: Option<Duration>,
    cycled: Duration,
    /// The largest velocity limits that were ever in force.
    fastest: Vec<f64>,
}

impl Opinion {
    pub fn new(settings: &Settings, arms: usize, period: Duration) -> Self {
        Self {
            settings: settings.clone(),
            period,
            streams: HashMap::new(),
            revoked: Span::default(),
            jogged: Span::default(),
            goal: None,
            lost: None,
            paused: No,
            released: Duration::ZERO,
            arms: vec![DeliveredStates::default(); arms],
            rival_of_commands: false,
            doubtful: Duration::ZERO,
            refuses: None,
            cycled: Duration::ZERO,
            fastest: settings.limits.joint_velocity.clone(),
        }
    }

    fn silence(&self) -> Duration {
        self.settings.rearm_timeout.max(STREAM)
    }

    /// Returns the largest error of a measured time between two events: the duration of two cycles. The error arises because each event
    /// gets the time of the cycle before it or of the cycle after it.
    fn slack(&self) -> Duration {
        2 * self.period
    }

    fn is_longer(&self, time: Duration, limit: Duration) -> Truth {
        Truth::between(time > limit + self.slack(), time + self.slack() > limit)
    }

    /// Returns whether a message that took `ago` to arrive is late.
    fn is_late(&self, ago: Duration, timeout: Duration) -> Truth {
        if ago.is_zero() { No } else { self.is_longer(ago, timeout) }
    }

    /// Revokes the requests that were made before `until`.
    fn revoke(&mut self, until: Span) {
        self.revoked = self.revoked.later(until);
    }

    /// Revokes the requests that were made before `now`. `is` says how certain this revocation is: `No` revokes nothing, and after
    /// `Maybe` it is uncertain whether these requests are revoked.
    fn revoke_if(&mut self, is: Truth, now: Duration) {
        match is {
            No => {}
            Maybe => self.revoke(Span { least: Duration::ZERO, most: now }),
            Yes => self.revoke(Span::at(now)),
        }
    }

    /// Notes that, for the time [`DOUBT`] from `now` on, it is not certain that a request moves the arm.
    pub fn doubt(&mut self, now: Duration) {
        self.doubtful = self.doubtful.max(now + DOUBT);
        self.revoke_if(Maybe, now);
    }

    /// Returns whether it is uncertain at `now` that a request moves the arm; see [`doubt`](Self::doubt).
    pub fn doubts(&self, now: Duration) -> bool {
        now <= self.doubtful
    }

    /// Takes a message of the publisher `by`, sent at `sent` and received at `came`. Returns the time at which the publisher made its
    /// request.
    fn hear(&mut self, by: (Kind, u32), sent: Duration, came: Duration, is_usable: bool) -> Span {
        let fresh = Stream { pushed: Span::at(sent), first: came, sent, came, is_usable };
        let stream = self.streams.get(&by).map_or(fresh, |before| {
            let gaps = [age(sent, before.sent), age(came, before.came)];
            let [one, other] = gaps.map(|gap| self.is_longer(gap, self.silence()));
            let goes_on = Stream {
                pushed: before.pushed,
                first: before.first,
                sent: before.sent.max(sent),
                came: before.came.max(came),
                is_usable: is_usable || before.is_usable,
            };
            let most = before.pushed.most.max(sent);
            match (one.min(other), one.max(other)) {
                (Yes, _) => fresh,
                (_, No) => goes_on,
                _ => Stream { pushed: Span { most, ..before.pushed }, ..goes_on },
            }
        });
        self.streams.insert(by, stream);
        self.refuses = None;
        stream.pushed
    }

    /// Takes a goal that requests nothing because it is invalid or waits for its frame.
    pub fn unusable_goal(&mut self, sent: Sent, now: Duration) {
        let now = now + AFTER_THE_CYCLE;
        self.hear((Kind::Goals, sent.by), now - sent.ago, now, false);
    }

    /// Takes an invalid twist.
    pub fn unusable_twist(&mut self, sent: Sent, now: Duration) {
        let now = now + AFTER_THE_CYCLE;
        self.hear((Kind::Twists, sent.by), now - sent.ago, now, false);
    }

    /// Returns whether a goal that was requested at `pushed` is in force: it is newer than every revocation and every obeyed twist.
    fn asks(&self, pushed: Span) -> Truth {
        pushed.is_after(self.revoked).min(pushed.is_after(self.jogged))
    }

    /// Takes a goal at `pose`, which the arm can reach if `reachable`.
    pub fn goal(&mut self, goal: &GoalReading, pose: UnitDualQuaternion, reachable: bool, now: Duration) {
        self.take_goal(goal.sent, goal.waited, pose, false, reachable, now);
    }

    /// Takes a joint goal, at which the tool has the pose `pose`. `is_whole` says whether the goal names all joints.
    pub fn joint_goal(&mut self, sent: Sent, pose: UnitDualQuaternion, is_whole: bool, now: Duration) {
        self.take_goal(sent, Duration::ZERO, pose, true, is_whole, now);
    }

    fn take_goal(
        &mut self,
        sent: Sent,
        waited: Duration,
        pose: UnitDualQuaternion,
        by_joints: bool,
        is_certain: bool,
        now: Duration,
    ) {
        let now = now + AFTER_THE_CYCLE;
        let is_late = self.is_late(sent.ago, self.settings.rearm_timeout);
        let came = now - waited;
        let pushed = self.hear((Kind::Goals, sent.by), came - sent.ago, came, true);
        let is_simple = is_certain && self.released + self.silence() <= now && self.stick_rules(now) == No;
        let before = self.goal.as_ref().map_or(pushed, |goal| goal.pushed);
        // The goal is at least as new as a request that was valid already.
        let most = before.most.max(pushed.most);
        match self.asks(pushed).min(!is_late) {
            No => {}
            Yes if is_simple => {
                let pushed = Span { most, ..pushed };
                self.goal = Some(Wanted { pushed, came: now, pose: Some(pose), by_joints });
                self.lost = None;
            }
            _ => {
                let least = before.least.min(pushed.least);
                self.goal = Some(Wanted { pushed: Span { least, most }, came: now, pose: None, by_joints });
                self.lost = self.lost.map(|(since, _)| (since, Maybe));
            }
        }
    }

    /// Moves the goal in force to `pose`, because its frame has moved.
    pub fn goal_moves(&mut self, pose: UnitDualQuaternion, now: Duration) {
        if self.is_of_joints() {
            return;
        }
        self.lost = None;
        self.goal.iter_mut().for_each(|goal| (goal.pose, goal.came) = (goal.pose.map(|_| pose), now));
    }

    /// Returns whether the goal in force certainly consists of joint positions. No frame moves such a goal.
    fn is_of_joints(&self) -> bool {
        self.goal.as_ref().is_some_and(|goal| goal.by_joints && goal.pose.is_some())
    }

    /// Notes that TF has lost the frame of the goal in force.
    pub fn frame_is_lost(&mut self, now: Duration) {
        if let Some(goal) = self.goal.as_ref().filter(|_| !self.is_of_joints()) {
            let is_sure = Truth::between(true, goal.pose.is_some());
            self.lost = Some(self.lost.unwrap_or((now, is_sure)));
        }
    }

    /// Takes a twist. A twist of zero ends the request of its publisher.
    pub fn twist(&mut self, twist: &TwistReading, now: Duration) {
        let (by, now) = ((Kind::Twists, twist.sent.by), now + AFTER_THE_CYCLE);
        if twist.linear == [0.0; 3] && twist.angular == [0.0; 3] {
            self.streams.remove(&by);
            self.released = now;
            return;
        }
        let sent = now - twist.sent.ago;
        let is_late = self.is_late(twist.sent.ago, self.settings.twist_timeout);
        let pushed = self.hear(by, sent, now, true);
        match pushed.is_after(self.revoked).min(!is_late) {
            No => return,
            Yes if self.is_held(now) == No => {
                (self.goal, self.lost) = (None, None);
                self.jogged = self.jogged.later(Span { least: sent, most: now });
            }
            _ => {
                self.jogged.most = now;
                self.goal.iter_mut().for_each(|goal| goal.pose = None);
            }
        }
        self.released = now;
    }

    /// Takes a request of `~/pause`, received at `now` and sent `ago` earlier. `paused` says whether to pause or to resume.
    pub fn pause(&mut self, paused: bool, ago: Duration, now: Duration) {
        let now = now + AFTER_THE_CYCLE;
        if paused {
            self.paused = Yes;
            return;
        }
        self.refuses = None;
        let sent = Span::at(now - ago);
        // The page describes the case that the goal in force is revoked. It says nothing about other cases.
        let is_revoked = self.goal.as_ref().map_or(Maybe, |goal| !goal.pushed.is_after(self.revoked));
        let overtaken = (!sent.is_after(self.revoked)).min(is_revoked.max(Maybe));
        let streams = self.streams_on(now).min(is_revoked);
        let refused = self.is_late(ago, self.settings.rearm_timeout).max(overtaken).max(streams);
        if refused != Yes {
            self.paused = self.paused.min(refused);
        }
        if let (Some(goal), No | Maybe) = (&mut self.goal, refused) {
            let later = goal.pushed.later(sent);
            goal.pushed = if refused == No { later } else { Span { least: goal.pushed.least, ..later } };
        }
    }

    /// Returns whether a publisher still sends goals of a revoked stream.
    fn streams_on(&self, now: Duration) -> Truth {
        let goals = self.streams.iter().filter(|((kind, _), _)| *kind == Kind::Goals);
        let streams = goals.map(|(_, it)| {
            let went_on = Truth::between(
                it.first <= self.revoked.least && it.came > self.revoked.most,
                it.came > it.first,
            );
            went_on
                .min(it.is_usable.into())
                .min(!it.pushed.is_after(self.revoked))
                .min(!self.is_longer(age(now, it.came), self.silence()))
        });
        streams.max().unwrap_or(No)
    }

    /// Takes a request of `~/stop`.
    pub fn stop(&mut self, now: Duration) {
        (self.goal, self.lost) = (None, None);
        self.revoke(Span::at(now + AFTER_THE_CYCLE));
    }

    /// Applies other settings.
    pub fn configure(&mut self, settings: &Settings, now: Duration) {
        let before = self.settings.clone();
        if before.controller.aim != settings.controller.aim || before.tool_offset != settings.tool_offset {
            self.revoke(Span { least: self.cycled, most: now + AFTER_THE_CYCLE });
        }
        if before.tool_offset != settings.tool_offset {
            // At the same joint positions, the tool now has another pose.
            self.goal.iter_mut().filter(|goal| goal.by_joints).for_each(|goal| goal.pose = None);
        }
        let speeds = self.fastest.iter_mut().zip(&settings.limits.joint_velocity);
        speeds.for_each(|(most, speed)| *most = most.max(*speed));
        self.settings = settings.clone();
    }

    /// Sets whether another publisher sends commands to the arm.
    pub fn set_rival_of_commands(&mut self, rival: bool) {
        self.rival_of_commands = rival;
    }

    /// Takes a joint state of the publisher `source`, measured at `measured` and received at `now`. Returns whether, before this joint
    /// state, the arm may have been without joint states for longer than `rearm_timeout`. Returns false while the arm has two
    /// publishers.
    pub fn state(
        &mut self,
        arm: usize,
        source: u32,
        positions: &[f64],
        measured: Duration,
        now: Duration,
    ) -> bool {
        let (rearm, slack, silence) = (self.settings.rearm_timeout, self.slack(), self.silence());
        let recent = self.settings.state_timeout / 2;
        let seen = &mut self.arms[arm];
        match seen.sources.iter_mut().find(|(by, ..)| *by == source) {
            Some((_, first, heard)) => {
                // A publisher that was silent has come back.
                let was_there = age(now, *heard) < recent;
                (*first, *heard) = (if was_there { *first } else { now }, now);
            }
            None => seen.sources.push((source, now, now)),
        }
        seen.sources.retain(|(.., heard)| age(now, *heard) <= silence);
        let is_sole = seen.sources.len() == 1;
        let before = seen.clone();
        (seen.came, seen.measured, seen.positions) = (Some(now), measured, positions.to_vec());
        if !is_sole {
            self.doubt(now);
            return false;
        }
        let was_away = before.came.map_or(Yes, |came| self.is_longer(age(now, came), rearm));
        let until = Span { least: now - rearm - slack, most: now - rearm + slack };
        match was_away {
            No => {}
            Maybe => self.revoke_if(Maybe, until.most),
            Yes => self.revoke(until),
        }
        self.watch_for_jumps(arm, &before, positions, measured, now);
        was_away != No
    }

    /// Revokes the requests that were made before a jump. A joint has jumped if it has moved farther since the joint state `before`
    /// than its velocity limit allows.
    fn watch_for_jumps(
        &mut self,
        arm: usize,
        before: &DeliveredStates,
        positions: &[f64],
        measured: Duration,
        now: Duration,
    ) {
        let Some(came) = before.came else { return };
        let first: usize = self.arms[..arm].iter().map(|arm| arm.positions.len()).sum();
        // The time between two joint states is the time between their arrivals or between their measurements.
        let times = [age(now, came), age(measured, before.measured)].map(|time| time.as_secs_f64() + 0.05);
        // The limit may have been lowered just now; motion that was commanded earlier is not a jump.
        let (shortest, longest) = (times[0].min(times[1]), times[0].max(times[1]));
        let limits = self.settings.limits.joint_velocity[first..].iter().zip(&self.fastest[first..]);
        let steps = positions.iter().zip(&before.positions).map(|(is, was)| (is - was).abs());
        let jumps = steps.zip(limits).map(|(step, (limit, fastest))| {
            let is_alone = came < now;
            Truth::between(is_alone && step > 2.1 * fastest * longest, step > 0.95 * limit * shortest)
        });
        let jumped = jumps.max().unwrap_or(No);
        if jumped != No {
            let least = if jumped == Yes { before.measured } else { Duration::ZERO };
            self.revoke(Span { least, most: came + self.slack() });
            self.doubtful = self.doubtful.max(now + Duration::from_millis(500));
        }
    }

    /// Notes that the servo receives joint states of arm `arm` from outside the rig. This model does not see those joint states.
    pub fn hears_elsewhere(&mut self, arm: usize, now: Duration) {
        self.arms[arm].came = Some(now);
        self.doubt(now);
    }

    /// Notes whether the robot obeys its commands. `altered` is `None` if it obeys, true if it stands despite a command to move, and false
    /// if it moves differently. `must` says whether the arm had to move until now.
    pub fn robot(&mut self, altered: Option<bool>, must: bool, now: Duration) {
        if altered.is_some() {
            self.doubt(now);
        }
        let refuses = altered == Some(true) && (must || self.refuses.is_some());
        self.refuses = refuses.then(|| self.refuses.unwrap_or(now));
        if self.refuses.is_some_and(|since| age(now, since) > self.settings.rearm_timeout + DOUBT) {
            self.revoke_if(Yes, now);
        }
    }

    /// Returns whether two publishers of this kind are rivals: their messages alternate, and both request a motion.
    fn rivals(&self, kind: Kind, now: Duration) -> Truth {
        let streams = || self.streams.iter().filter(|((of, _), _)| *of == kind);
        let is_there = |it: &Stream| !self.is_longer(age(now, it.came), self.silence());
        let asks = |it: &Stream| it.pushed.is_after(self.revoked) == Yes && it.is_usable;
        let pairs = streams().flat_map(|one| streams().map(move |other| (one, other)));
        let pairs = pairs.filter(|((by, _), (other, _))| by != other);
        let rivals = pairs.map(|((_, one), (_, other))| {
            let alternate = Truth::between(
                other.first > one.first && one.came > other.first,
                other.first >= one.first && one.came >= other.first,
            );
            let ask = Truth::between(asks(one) && asks(other), true);
            alternate.min(ask).min(is_there(one)).min(is_there(other))
        });
        rivals.max().unwrap_or(No)
    }

    /// Returns whether two publishers send joint states of one arm in alternation, or a second publisher sends commands to the arm.
    fn two_publishers(&self, now: Duration) -> bool {
        let recent = |heard: Duration| age(now, heard) < self.settings.state_timeout / 2;
        let two = |arm: &DeliveredStates| {
            arm.sources.iter().any(|(by, first, heard)| {
                let mut others = arm.sources.iter().filter(|(other, ..)| other != by);
                recent(*heard) && others.any(|(_, came, last)| came > first && heard > came && recent(*last))
            })
        };
        self.rival_of_commands || self.arms.iter().any(two)
    }

    /// Returns whether a twist, and not a goal, determines the arm's motion.
    fn stick_rules(&self, now: Duration) -> Truth {
        let sticks = self.streams.iter().filter(|((kind, _), _)| *kind == Kind::Twists);
        let rules = sticks.map(|(_, stick)| {
            let is_over = self.is_longer(age(now, stick.came), self.settings.twist_timeout);
            stick.pushed.is_after(self.revoked).min(!is_over)
        });
        rules.max().unwrap_or(No)
    }

    /// Returns whether the arm must stand for a reason other than missing consent.
    fn is_held(&self, now: Duration) -> Truth {
        let ages = self.arms.iter().map(|arm| age(now, arm.came.unwrap_or_default()));
        let is_stale = self.is_longer(ages.max().unwrap_or(now), self.settings.state_timeout);
        let has_rivals = self.rivals(Kind::Goals, now).max(self.rivals(Kind::Twists, now));
        let is_doubtful = Truth::between(false, has_rivals != No || self.doubts(now));
        is_stale.max(self.paused).max(self.two_publishers(now).into()).max(is_doubtful)
    }

    /// Judges the cycle at `now`: returns whether the servo must move the arm in this cycle. The arm moves to the
    /// [`goal`](Self::goal_pose) unless a twist moves it.
    pub fn cycle(&mut self, now: Duration) -> Truth {
        let late_by = age(now, self.cycled + self.period);
        let was = std::mem::replace(&mut self.cycled, now);
        if was > Duration::ZERO && late_by > self.settings.state_timeout / 2 {
            self.doubt(now);
        }
        for kind in [Kind::Goals, Kind::Twists] {
            self.revoke_if(self.rivals(kind, now), now);
        }
        self.revoke_if(self.two_publishers(now).into(), now);
        if let Some((since, is_sure)) = self.lost {
            let ends = since + self.settings.rearm_timeout;
            let until = Span { least: ends, most: ends + 2 * self.slack() };
            match is_sure.min(self.is_longer(age(now, since), self.settings.rearm_timeout)) {
                No => {}
                Maybe => self.revoke_if(Maybe, until.most),
                Yes => self.revoke(until),
            }
        }
        match self.is_held(now) {
            Yes => No,
            _ if self.stick_rules(now) != No || self.released + REST >= now => Maybe,
            held => self.goal_asks(now).min(!held),
        }
    }

    /// Returns whether the goal in force requests motion.
    fn goal_asks(&self, now: Duration) -> Truth {
        let Some(goal) = &self.goal else { return No };
        let timeout = self.settings.goal_timeout;
        let is_stale = timeout.map_or(No, |timeout| self.is_longer(age(now, goal.came), timeout));
        let is_lost =
            self.lost.map_or(No, |(since, sure)| sure.min(Truth::between(now > since + self.slack(), true)));
        let is_sure = Truth::between(goal.pose.is_some(), true);
        self.asks(goal.pushed).min(is_sure).min(!is_stale).min(!is_lost)
    }

    /// Returns a short text of the state of this model.
    pub fn explain(&self) -> String {
        let Self { goal, revoked, jogged, lost, paused, released, doubtful, rival_of_commands, .. } = self;
        let goal = goal.as_ref().map(|goal| (goal.pushed, goal.pose.is_some()));
        let states: Vec<_> = self.arms.iter().map(|arm| (arm.came, &arm.sources)).collect();
        format!(
            "goal {goal:?}, revoked {revoked:?}, jogged {jogged:?}, lost {lost:?}, paused {paused:?}, released {released:?}, doubtful {doubtful:?}, \
             rival {rival_of_commands}, states {states:?}, {:?}",
            self.streams
        )
    }

    /// Returns the pose of the goal in force; `None` if there is no goal, or if it is uncertain which goal is in force.
    pub fn goal_pose(&self) -> Option<&UnitDualQuaternion> {
        self.goal.as_ref()?.pose.as_ref()
    }

    /// Returns whether TF certainly has the frame of the goal in force.
    pub fn knows_frame(&self) -> bool {
        self.lost.is_none() && self.goal_pose().is_some()
    }
}
