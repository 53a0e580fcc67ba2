//! A second opinion on consent, written from the page on safety alone: what each publisher has sent, and what has revoked it.

use dq_core::servo::{Consent, Requester, Revoked, STREAM};
use std::collections::HashMap;
use std::time::Duration;

/// What one publisher asks for.
#[derive(Clone, Copy, Debug)]
struct Stream {
    /// When its first message was sent, and came; when the last came.
    pushed: Duration,
    came: Duration,
    heard: Duration,
}

/// The sender of a request for motion. A publisher is of goals or of twists, and has a number.
#[derive(Clone, Debug, Default)]
pub struct Opinion {
    streams: HashMap<(bool, u32), Stream>,
    /// A publisher that is silent for longer has let go.
    pub silence: Duration,
    /// What was pushed until then is revoked, and goals until a twist moved the arm.
    revoked: Duration,
    jogged: Duration,
    /// The last revocation that was seen; two may happen at one time.
    seen: Option<Revoked>,
    /// When the goal in force was pushed, if there is one.
    goal: Option<Duration>,
    paused: bool,
    /// When a stick was last let go of: the arm comes to rest within a moment.
    released: Duration,
}

/// Within this time an arm whose stick was let go of is at rest, under a limit on jerk too.
const REST: Duration = Duration::from_millis(1300);

impl Opinion {
    /// Hears a message that was sent and came then; since when its publisher pushes.
    fn hear(&mut self, by: (bool, u32), (sent, now): (Duration, Duration)) -> Stream {
        let silence = self.silence.max(STREAM);
        let fresh = Stream { pushed: sent, came: now, heard: now };
        let before = self.streams.get(&by).filter(|stream| now - stream.heard <= silence);
        let stream = before.map_or(fresh, |stream| Stream { heard: now, ..*stream });
        self.streams.insert(by, stream);
        stream
    }

    /// Hears a goal; the servo says whether it is taken.
    pub fn hear_goal(&mut self, by: u32, sent: (Duration, Duration), taken: bool) {
        let Stream { pushed, .. } = self.hear((true, by), sent);
        if taken {
            assert!(pushed >= self.revoked && pushed > self.jogged, "{pushed:?} is not newer than {self:?}");
            self.goal = Some(self.goal.map_or(pushed, |before| before.max(pushed)));
        }
    }

    /// Hears a twist; one of zero lets go.
    pub fn hear_twist(&mut self, by: u32, sent: (Duration, Duration), asks: bool) {
        if asks {
            self.hear((false, by), sent);
        } else {
            self.streams.remove(&(false, by));
            self.released = sent.1;
        }
    }

    pub fn pause(&mut self, paused: bool, now: Duration) {
        self.paused = paused;
        if !paused {
            self.goal = self.goal.map(|_| now);
        }
    }

    pub fn stop(&mut self, now: Duration, consent: &Consent) {
        self.goal = None;
        self.end(now, |_| true);
        (self.revoked, self.seen) = (self.revoked.max(now), consent.last_revocation().copied());
    }

    /// Ends what was pushed until then by publishers of these kinds.
    fn end(&mut self, until: Duration, of: impl Fn(bool) -> bool) {
        let streams = self.streams.iter_mut().filter(|((of_goals, _), _)| of(*of_goals));
        streams.filter(|(_, it)| it.pushed <= until).for_each(|(_, it)| it.pushed = Duration::ZERO);
    }

    /// What the servo says that it has seen of its robot revokes too, and a twist that it obeys revokes goals.
    pub fn revoke(&mut self, consent: &Consent) {
        if let Some(last) = consent.last_revocation().filter(|last| self.seen != Some(**last)) {
            self.seen = Some(*last);
            self.end(last.until, |_| true);
            self.revoked = self.revoked.max(last.until);
        }
        let jogged =
            consent.request().filter(|ask| matches!(ask.by, Requester::Twist(_)) && ask.revoked.is_none());
        if let Some(heard) = jogged.map(|ask| ask.heard).filter(|heard| *heard > self.jogged) {
            self.end(heard, |of_goals| of_goals);
            (self.jogged, self.goal) = (heard, None);
        }
    }

    /// Whether a goal is in force.
    pub fn has_goal(&self) -> bool {
        self.goal.is_some()
    }

    /// Whether two publishers push the same at once.
    fn has_rivals(&self, now: Duration) -> bool {
        let silence = self.silence.max(STREAM);
        let there = |stream: &Stream| now - stream.heard <= silence && stream.pushed >= self.revoked;
        self.streams.iter().any(|(by, one)| {
            let mut others =
                self.streams.iter().filter(|(other, it)| *other != by && other.0 == by.0 && there(it));
            there(one) && others.any(|(_, other)| other.came > one.came && one.heard > other.came)
        })
    }

    /// Whether a stick was let go of a moment before `now`.
    pub fn comes_to_rest(&self, now: Duration) -> bool {
        now - self.released <= REST
    }

    /// Whether anybody asks at `now` for what nothing has revoked.
    pub fn may_move(&self, now: Duration) -> bool {
        let silence = self.silence.max(STREAM);
        let holds = |stream: &Stream| stream.pushed >= self.revoked && now - stream.heard <= silence;
        let mut sticks = self.streams.iter().filter(|((of_goals, _), _)| !of_goals);
        let by_goal = self.goal.is_some_and(|pushed| pushed >= self.revoked);
        !self.paused && !self.has_rivals(now) && (by_goal || sticks.any(|(_, stick)| holds(stick)))
    }
}
