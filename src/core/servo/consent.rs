//! Consent: the arm moves only while someone's request is newer than the last event that revoked consent.
//!
//! A request begins with one of these inputs:
//!
//! - the first goal or twist that a publisher sends after a silence,
//! - the first twist after a zero twist,
//! - a call of `~/pause` (false), which requests the current goal again.
//!
//! Later messages of the publisher belong to the same request until the next silence. So a publisher that only continues after a
//! revocation does not give consent again. Every message ends a silence, even an invalid message or a goal that waits for its frame.
//! A single goal is a stream of one message.
//!
//! A revocation revokes every request that began up to a certain time:
//!
//! - after `~/stop`: up to the stop,
//! - after a robot has appeared: up to `rearm_timeout` before its appearance,
//! - after a robot has jumped: up to the last joint state before the jump.
//!
//! Two publishers that send requests at the same time are rivals. Each revokes the requests of the other.

use super::Rejection;
use super::revocation::{Contended, Revocation, Rivals};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// How long a publisher may be silent before its request lapses, unless `rearm_timeout` is longer. `ros2 topic pub` sends once a
/// second, so its request does not lapse.
pub const STREAM: Duration = Duration::from_millis(1500);

/// Largest number of publishers whose requests the servo stores. While all of these publishers stream, the servo cannot store when
/// a further publisher began. It then treats every message of the further publisher as if it had been sent before every revocation.
pub(super) const MOST: usize = 16;

/// The sender of a request for motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Requester {
    /// The publisher with this number sent a goal.
    Goal(u32),
    /// The publisher with this number sent a twist.
    Twist(u32),
    /// A client called `~/pause` (false).
    Resume,
}

impl Requester {
    /// Returns whether the request is for a goal.
    fn is_for_goal(self) -> bool {
        !matches!(self, Self::Twist(_))
    }
}

/// A request for motion, and the event that revoked it, if any. All times are by the cycle's clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionRequest {
    /// The sender of the request.
    pub by: Requester,
    /// When the first message of the request was sent. Later messages of the same publisher belong to the same request, until the
    /// publisher falls silent.
    pub pushed: Duration,
    /// When the last message of the request arrived.
    pub heard: Duration,
    /// The event that has revoked the request, if any.
    pub revoked: Option<Revocation>,
}

/// The latest revocation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Revoked {
    /// Every request whose first message was sent at or before this time is revoked.
    pub until: Duration,
    /// When the revoking event happened.
    pub at: Duration,
    /// The revoking event.
    pub why: Revocation,
}

impl Revoked {
    /// Returns the reason of this revocation for a request whose first message was sent at `pushed`. Only [`Revocation::CameLater`]
    /// depends on that time.
    fn why_of(&self, pushed: Duration) -> Revocation {
        match self.why {
            Revocation::CameLater(_) => Revocation::CameLater(self.at.saturating_sub(pushed).as_secs_f64()),
            why => why,
        }
    }

    /// Revokes `request` if its first message was sent at or before `until`. A request that is already revoked keeps its reason.
    fn apply(&self, request: &mut MotionRequest) {
        if request.pushed <= self.until {
            request.revoked.get_or_insert(self.why_of(request.pushed));
        }
    }
}

/// The consent to move: the last request, the last revocation, and whether the servo is paused or stopping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Consent {
    request: Option<MotionRequest>,
    revoked: Option<Revoked>,
    paused: bool,
    stopping: bool,
}

impl Consent {
    /// Returns the last request; `None` if there has been none, or if the last request was withdrawn.
    pub fn request(&self) -> Option<&MotionRequest> {
        self.request.as_ref()
    }

    /// Returns the last revocation, or `None` if there was none.
    pub fn last_revocation(&self) -> Option<&Revoked> {
        self.revoked.as_ref()
    }

    /// Returns whether the servo is paused.
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// Returns whether a stop is still bringing the arm to rest.
    pub fn is_stopping(&self) -> bool {
        self.stopping
    }

    /// Returns whether there is a request that nothing has revoked.
    pub(super) fn is_asked(&self) -> bool {
        self.request.is_some_and(|request| request.revoked.is_none())
    }

    /// Returns whether the arm may move.
    pub fn is_given(&self) -> bool {
        self.is_asked() && !self.paused && !self.stopping
    }

    /// Returns the event that has revoked the current request, if any.
    pub fn revocation(&self) -> Option<Revocation> {
        self.request.and_then(|request| request.revoked)
    }

    /// Returns whether the last request was a twist.
    pub fn is_of_twist(&self) -> bool {
        self.request.is_some_and(|request| !request.by.is_for_goal())
    }
}

/// The present request of one publisher: all its messages since its last silence.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Push {
    request: MotionRequest,
    /// When the first message of the request arrived.
    came: Duration,
    /// Whether at least one message of the request is valid. A publisher that sends only invalid messages is not a rival of others.
    is_usable: bool,
}

impl Push {
    /// Returns whether the publisher has been silent for at most `silence` at `now`.
    fn goes_on(&self, now: Duration, silence: Duration) -> bool {
        now.saturating_sub(self.request.heard) <= silence
    }

    /// Returns whether the publisher sends a stream of goals that still continues at `now`.
    fn streams(&self, now: Duration, silence: Duration) -> bool {
        let is_stream = self.request.by.is_for_goal() && self.is_usable && self.came != self.request.heard;
        is_stream && self.goes_on(now, silence)
    }
}

/// All requests, and the consent that follows from them. No other code changes the consent.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct MotionRequests {
    consent: Consent,
    pub(super) pushes: Vec<Push>,
    /// The revocation by the last twist that moved the arm; `None` if no twist has. It revokes every goal whose stream began before
    /// that twist.
    jogged: Option<Revoked>,
}

impl Default for MotionRequests {
    fn default() -> Self {
        Self { consent: Consent::default(), pushes: Vec::with_capacity(MOST), jogged: None }
    }
}

impl MotionRequests {
    /// Returns the consent that follows from the requests.
    pub fn consent(&self) -> &Consent {
        &self.consent
    }

    /// Notes a message from the publisher `by`, and returns the request to which the message belongs. The message arrived at `came`,
    /// and was sent `ago` before that.
    ///
    /// A publisher that was silent for longer than `silence` begins a new request. Unusable messages end a silence, too. For a goal
    /// that waits for its frame, call this on arrival, and again with the same times when the frame is found.
    pub fn hear(
        &mut self,
        by: Requester,
        ago: Duration,
        came: Duration,
        silence: Duration,
        is_usable: bool,
    ) -> MotionRequest {
        self.pushes.retain(|push| push.goes_on(came, silence));
        if let Some(push) = self.pushes.iter_mut().find(|push| push.request.by == by) {
            push.request.heard = push.request.heard.max(came);
            push.is_usable |= is_usable;
            return push.request;
        }
        self.make_room();
        let has_room = self.pushes.len() < MOST;
        let pushed = if has_room { came.saturating_sub(ago) } else { Duration::ZERO };
        let request = MotionRequest { by, pushed, heard: came, revoked: self.revoked_before(by, pushed) };
        if has_room {
            self.pushes.push(Push { request, came, is_usable });
        }
        request
    }

    /// If `pushes` is full, removes the oldest request that consists of a single message, because its publisher does not stream.
    /// Removes nothing if all requests have several messages.
    fn make_room(&mut self) {
        let singles = self.pushes.iter().enumerate().filter(|(_, push)| push.came == push.request.heard);
        let oldest = singles.min_by_key(|(_, push)| push.came).map(|(place, _)| place);
        if let Some(place) = oldest.filter(|_| self.pushes.len() >= MOST) {
            self.pushes.swap_remove(place);
        }
    }

    /// Returns the event that has already revoked a new request by `by`, whose first message was sent at `pushed`. Returns `None` if
    /// no event has. A twist also revokes a request that was sent exactly at the time of the twist. Other events do not.
    fn revoked_before(&self, by: Requester, pushed: Duration) -> Option<Revocation> {
        let jogged = self.jogged.filter(|jogged| by.is_for_goal() && pushed <= jogged.until);
        jogged.or(self.consent.revoked.filter(|last| pushed < last.until)).map(|last| last.why_of(pushed))
    }

    /// Notes that a publisher no longer requests motion.
    pub fn release(&mut self, by: Requester) {
        self.pushes.retain(|push| push.request.by != by);
    }

    /// Returns whether the publisher `by` still requests motion at `now`: it has not been silent for longer than `silence`, and its
    /// request has not been [released](Self::release).
    pub fn is_pushed(&self, by: Requester, now: Duration, silence: Duration) -> bool {
        self.pushes.iter().any(|push| push.request.by == by && push.goes_on(now, silence))
    }

    /// Makes `request` the current request. Returns true if it is a new request, and false if it is another message of the previous
    /// request. If `request` is for a goal and the previous request is not revoked, stores the later `pushed` of the two requests.
    pub fn take(&mut self, request: MotionRequest) -> bool {
        let newest =
            self.consent.request.filter(|before| before.revoked.is_none() && request.by.is_for_goal());
        let pushed = newest.map_or(request.pushed, |before| before.pushed.max(request.pushed));
        let before = self.consent.request.replace(MotionRequest { pushed, ..request });
        before.is_none_or(|before| (before.by, before.pushed) != (request.by, pushed))
    }

    /// Returns two rivals, or `None` if there are none. Rivals are two publishers, both of goals or both of twists, that request motion
    /// at the same time: a message of one publisher has arrived after the first message of the other.
    pub fn rivals(&self, now: Duration, silence: Duration) -> Option<Rivals> {
        let is_asking = |push: &&Push| {
            let is_valid = matches!(push.request.revoked, None | Some(Revocation::Rivals(_)));
            is_valid && push.is_usable && push.goes_on(now, silence)
        };
        let mut pushes = self.pushes.iter().filter(is_asking);
        pushes.find_map(|one| {
            let others = self.pushes.iter().filter(is_asking);
            let mut later = others.filter(|other| other.came > one.came && one.request.heard > other.came);
            later.find_map(|other| match (one.request.by, other.request.by) {
                (Requester::Goal(first), Requester::Goal(second)) => {
                    Some(Rivals { of: Contended::Goals, first, second })
                }
                (Requester::Twist(first), Requester::Twist(second)) => {
                    Some(Rivals { of: Contended::Twists, first, second })
                }
                _ => None,
            })
        })
    }

    /// Notes a revocation at `now`. It revokes every request whose first message was sent at or before `until`.
    pub fn revoke(&mut self, until: Duration, now: Duration, why: Revocation) {
        let revoked = Revoked { until, at: now, why };
        self.pushes.iter_mut().for_each(|push| revoked.apply(&mut push.request));
        self.consent.request.iter_mut().for_each(|request| revoked.apply(request));
        if self.consent.revoked.is_none_or(|before| before.until <= until) {
            self.consent.revoked = Some(revoked);
        }
    }

    /// Notes that a twist moves the arm at `now`. The twist revokes every goal whose stream began before then.
    pub fn jog(&mut self, now: Duration) {
        let jogged = Revoked { until: now, at: now, why: Revocation::Jogged };
        let goals =
            self.pushes.iter_mut().map(|push| &mut push.request).filter(|request| request.by.is_for_goal());
        goals.for_each(|request| jogged.apply(request));
        self.jogged = Some(jogged);
    }

    /// Holds the arm until [`resume`](Self::resume).
    pub fn pause(&mut self) {
        self.consent.paused = true;
    }

    /// Ends a pause, and requests the current goal again, if there is one. The request was sent at `sent` and arrived at `now`.
    /// Returns whether the goal had been revoked.
    ///
    /// # Errors
    /// [`Rejection::Overtaken`] if a revocation is newer than the request, [`Rejection::StreamsOn`] if a publisher still sends
    /// revoked goals without a silence longer than `silence`. Nothing changes then.
    pub fn resume(&mut self, sent: Duration, now: Duration, silence: Duration) -> Result<bool, Rejection> {
        if let Some(last) = self.consent.revoked.filter(|last| sent < last.until) {
            return Err(Rejection::Overtaken(last.why_of(sent)));
        }
        let before = self.consent.request.filter(|request| request.by.is_for_goal());
        let was_revoked = before.is_some_and(|request| request.revoked.is_some());
        let mut streams = self.pushes.iter().filter(|push| was_revoked && push.streams(now, silence));
        if let Some(why) = streams.find_map(|push| push.request.revoked) {
            return Err(Rejection::StreamsOn(why));
        }
        self.consent.paused = false;
        if let Some(before) = before {
            let pushed = if was_revoked { sent } else { before.pushed.max(sent) };
            self.consent.request =
                Some(MotionRequest { by: Requester::Resume, pushed, heard: now, revoked: None });
        }
        Ok(was_revoked)
    }

    /// Stops the arm at `now`. Drops the goal, and lets nothing move the arm until it has come to rest.
    pub fn stop(&mut self, now: Duration) {
        self.revoke(now, now, Revocation::Stopped);
        self.consent.stopping = true;
        // A request by a twist remains, as a revoked request: the user may still hold the joystick.
        self.consent.request = self.consent.request.filter(|request| !request.by.is_for_goal());
    }

    /// Ends a stop, because the arm has come to rest.
    pub fn stand(&mut self) {
        self.consent.stopping = false;
    }

    /// Drops the current request.
    pub fn withdraw(&mut self) {
        self.consent.request = None;
    }
}
