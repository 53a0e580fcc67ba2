//! Consent: the arm moves if and only if somebody asked for it later than everything that revoked it.
//!
//! Whoever asks *pushes*: a publisher of goals or of twists with its first message after a silence, or after a twist of zero; a client of
//! `~/pause` (false) with its request, which asks for the goal in force once more. What follows without a silence belongs to the same push,
//! so whoever goes on after a revocation asks for nothing. A single goal is a stream of one.
//!
//! A revocation revokes every push until a time: `~/stop` until now, a robot that came until `rearm_timeout` before that, a robot that has
//! jumped until the joint state before. Two publishers that push at the same time are rivals, and revoke each other.

use super::Rejection;
use super::revocation::{Contended, Revocation, Rivals};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A publisher that is silent for this time has let go, where `rearm_timeout` is not longer. `ros2 topic pub` sends once a second.
pub const STREAM: Duration = Duration::from_millis(1500);

/// So many publishers are told apart; while there are more, one that is not known has pushed before anything that revokes.
const MOST: usize = 16;

/// Who asks for motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Asker {
    /// The publisher of that number, by a goal.
    Goal(u32),
    /// The publisher of that number, by a twist.
    Twist(u32),
    /// A client of `~/pause`.
    Resume,
}

impl Asker {
    /// Whether it asks for a goal.
    fn is_for_goal(self) -> bool {
        !matches!(self, Self::Twist(_))
    }
}

/// What somebody asked, and what has become of it. Times are of the cycle's clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ask {
    /// Who asked.
    pub by: Asker,
    /// When the first message was sent.
    pub pushed: Duration,
    /// When the last message came.
    pub heard: Duration,
    /// What has revoked it since, if anything has.
    pub revoked: Option<Revocation>,
}

/// The latest revocation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Revoked {
    /// What was pushed until then is revoked.
    pub until: Duration,
    /// When it happened.
    pub at: Duration,
    /// What happened.
    pub why: Revocation,
}

impl Revoked {
    /// What happened to what was `pushed` then.
    fn why_of(&self, pushed: Duration) -> Revocation {
        match self.why {
            Revocation::CameLater(_) => Revocation::CameLater(self.at.saturating_sub(pushed).as_secs_f64()),
            why => why,
        }
    }

    /// Revokes what was pushed until then. The first revocation of a push stays its reason.
    fn apply(&self, ask: &mut Ask) {
        if ask.pushed <= self.until {
            ask.revoked.get_or_insert(self.why_of(ask.pushed));
        }
    }
}

/// Whether the arm may move: who asked for it last, and what has revoked that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Consent {
    ask: Option<Ask>,
    revoked: Option<Revoked>,
    paused: bool,
    stopping: bool,
}

impl Consent {
    /// Who asked last; none where nobody does any more.
    pub fn ask(&self) -> Option<&Ask> {
        self.ask.as_ref()
    }

    /// What revoked last.
    pub fn last_revocation(&self) -> Option<&Revoked> {
        self.revoked.as_ref()
    }

    /// Whether the servo is paused.
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// Whether a stop has not brought the arm to rest yet.
    pub fn is_stopping(&self) -> bool {
        self.stopping
    }

    /// Whether somebody asks for what nothing has revoked.
    pub(super) fn is_asked(&self) -> bool {
        self.ask.is_some_and(|ask| ask.revoked.is_none())
    }

    /// Whether the arm may move.
    pub fn is_given(&self) -> bool {
        self.is_asked() && !self.paused && !self.stopping
    }

    /// What has revoked the consent in force.
    pub fn revocation(&self) -> Option<Revocation> {
        self.ask.and_then(|ask| ask.revoked)
    }

    /// Whether a twist asked last.
    pub fn is_of_twist(&self) -> bool {
        self.ask.is_some_and(|ask| !ask.by.is_for_goal())
    }
}

/// What a publisher pushes, and when the first message of it came.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Push {
    ask: Ask,
    came: Duration,
    /// Until when its goals may have waited for a frame that was lost, unheard.
    waited: Duration,
}

impl Push {
    /// Whether its publisher has not been silent for longer than `silence` until `now`.
    fn goes_on(&self, now: Duration, silence: Duration) -> bool {
        now.saturating_sub(self.ask.heard) <= silence
    }

    /// The same, if its goals may have waited.
    fn may_go_on(&self, now: Duration, silence: Duration) -> bool {
        now.saturating_sub(self.ask.heard.max(self.waited)) <= silence
    }

    /// Whether it is of a stream of goals that was heard lately. One that may wait for its frame unheard keeps nobody from ending a pause.
    fn streams(&self, now: Duration, silence: Duration) -> bool {
        let is_heard = now.saturating_sub(self.ask.heard) <= silence;
        self.ask.by.is_for_goal() && self.came != self.ask.heard && is_heard
    }
}

/// Everybody who asks, and the consent that comes of it: the only writer of that.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Asks {
    consent: Consent,
    pushes: Vec<Push>,
    /// When a twist last moved the arm: that revokes every goal pushed until then.
    jogged: Option<Revoked>,
}

impl Default for Asks {
    fn default() -> Self {
        Self { consent: Consent::default(), pushes: Vec::with_capacity(MOST), jogged: None }
    }
}

impl Asks {
    /// The consent that comes of all.
    pub fn consent(&self) -> &Consent {
        &self.consent
    }

    /// Hears a message of `by`, which was sent so long `ago`, at `now`; a publisher that was silent for longer than `silence`
    /// pushes anew.
    pub fn hear(&mut self, by: Asker, ago: Duration, now: Duration, silence: Duration) -> Ask {
        self.pushes.retain(|push| push.ask.by != by || push.goes_on(now, silence));
        self.hear_found(by, ago, now, silence)
    }

    /// The same of a goal that has waited for its frame, before which others of its publisher may have waited in vain.
    pub fn hear_found(&mut self, by: Asker, ago: Duration, now: Duration, silence: Duration) -> Ask {
        self.pushes.retain(|push| push.may_go_on(now, silence));
        if let Some(push) = self.pushes.iter_mut().find(|push| push.ask.by == by) {
            push.ask.heard = now;
            return push.ask;
        }
        self.make_room();
        let has_room = self.pushes.len() < MOST;
        let pushed = if has_room { now.saturating_sub(ago) } else { Duration::ZERO };
        let ask = Ask { by, pushed, heard: now, revoked: self.revoked_before(by, pushed) };
        if has_room {
            self.pushes.push(Push { ask, came: now, waited: Duration::ZERO });
        }
        ask
    }

    /// Forgets the oldest publisher that was heard once only, where there is no room for another one: it is no stream.
    fn make_room(&mut self) {
        let singles = self.pushes.iter().enumerate().filter(|(_, push)| push.came == push.ask.heard);
        let oldest = singles.min_by_key(|(_, push)| push.came).map(|(place, _)| place);
        if let Some(place) = oldest.filter(|_| self.pushes.len() >= MOST) {
            self.pushes.swap_remove(place);
        }
    }

    /// What has revoked a push whose first message, sent then, comes only now. Of a push and a revocation at one time the later one to come
    /// is the later one.
    fn revoked_before(&self, by: Asker, pushed: Duration) -> Option<Revocation> {
        let jogged = self.jogged.filter(|jogged| by.is_for_goal() && pushed <= jogged.until);
        jogged.or(self.consent.revoked.filter(|last| pushed < last.until)).map(|last| last.why_of(pushed))
    }

    /// Hears no goals at `now`, as they wait for a frame that is lost.
    pub fn wait(&mut self, now: Duration) {
        self.pushes.iter_mut().filter(|push| push.ask.by.is_for_goal()).for_each(|push| push.waited = now);
    }

    /// Hears that a publisher asks for nothing.
    pub fn release(&mut self, by: Asker) {
        self.pushes.retain(|push| push.ask.by != by);
    }

    /// Whether a publisher still pushes what it pushed, without a silence longer than `silence` until `now`.
    pub fn is_pushed(&self, by: Asker, now: Duration, silence: Duration) -> bool {
        self.pushes.iter().any(|push| push.ask.by == by && push.goes_on(now, silence))
    }

    /// What a publisher asks for is taken; whether it asks anew. What is asked for while something newer is in force is not newer than that.
    pub fn take(&mut self, ask: Ask) -> bool {
        let newest = self.consent.ask.filter(|before| before.revoked.is_none() && ask.by.is_for_goal());
        let pushed = newest.map_or(ask.pushed, |before| before.pushed.max(ask.pushed));
        let before = self.consent.ask.replace(Ask { pushed, ..ask });
        before.is_none_or(|before| (before.by, before.pushed) != (ask.by, pushed))
    }

    /// Two publishers of one kind that push at the same time: the one that was there first was heard again since the other is there.
    pub fn rivals(&self, now: Duration, silence: Duration) -> Option<Rivals> {
        let is_asking = |push: &&Push| {
            push.goes_on(now, silence) && matches!(push.ask.revoked, None | Some(Revocation::Rivals(_)))
        };
        let mut pushes = self.pushes.iter().filter(is_asking);
        pushes.find_map(|one| {
            let others = self.pushes.iter().filter(is_asking);
            let mut later = others.filter(|other| other.came > one.came && one.ask.heard > other.came);
            later.find_map(|other| match (one.ask.by, other.ask.by) {
                (Asker::Goal(first), Asker::Goal(second)) => {
                    Some(Rivals { of: Contended::Goals, first, second })
                }
                (Asker::Twist(first), Asker::Twist(second)) => {
                    Some(Rivals { of: Contended::Twists, first, second })
                }
                _ => None,
            })
        })
    }

    /// Revokes at `now` what was pushed until then.
    pub fn revoke(&mut self, until: Duration, now: Duration, why: Revocation) {
        let revoked = Revoked { until, at: now, why };
        self.pushes.iter_mut().for_each(|push| revoked.apply(&mut push.ask));
        self.consent.ask.iter_mut().for_each(|ask| revoked.apply(ask));
        if self.consent.revoked.is_none_or(|before| before.until <= until) {
            self.consent.revoked = Some(revoked);
        }
    }

    /// A twist moves the arm at `now`: every goal until then is revoked.
    pub fn jog(&mut self, now: Duration) {
        let jogged = Revoked { until: now, at: now, why: Revocation::Jogged };
        let goals = self.pushes.iter_mut().map(|push| &mut push.ask).filter(|ask| ask.by.is_for_goal());
        goals.for_each(|ask| jogged.apply(ask));
        self.jogged = Some(jogged);
    }

    /// Holds the arm until [`resume`](Self::resume).
    pub fn pause(&mut self) {
        self.consent.paused = true;
    }

    /// Ends a pause, and asks once more for the goal in force, if there is one, by a request that was `sent` then and came at `now`; true if
    /// that had been revoked.
    ///
    /// # Errors
    /// [`Rejection::Overtaken`] if something was revoked since it was sent, [`Rejection::StreamsOn`] if a publisher goes on with goals that
    /// are revoked, without a `silence`. Then nothing changes.
    pub fn resume(&mut self, sent: Duration, now: Duration, silence: Duration) -> Result<bool, Rejection> {
        if let Some(last) = self.consent.revoked.filter(|last| sent < last.until) {
            return Err(Rejection::Overtaken(last.why_of(sent)));
        }
        let before = self.consent.ask.filter(|ask| ask.by.is_for_goal());
        let was_revoked = before.is_some_and(|ask| ask.revoked.is_some());
        let mut streams = self.pushes.iter().filter(|push| was_revoked && push.streams(now, silence));
        if let Some(why) = streams.find_map(|push| push.ask.revoked) {
            return Err(Rejection::StreamsOn(why));
        }
        self.consent.paused = false;
        if let Some(before) = before {
            let pushed = if was_revoked { sent } else { before.pushed.max(sent) };
            self.consent.ask = Some(Ask { by: Asker::Resume, pushed, heard: now, revoked: None });
        }
        Ok(was_revoked)
    }

    /// Stops the arm at `now`: nothing moves it before it stands, and nobody asks for a goal any more.
    pub fn stop(&mut self, now: Duration) {
        self.revoke(now, now, Revocation::Stopped);
        self.consent.stopping = true;
        // A stick that is held asks on, in vain.
        self.consent.ask = self.consent.ask.filter(|ask| !ask.by.is_for_goal());
    }

    /// The arm stands.
    pub fn stand(&mut self) {
        self.consent.stopping = false;
    }

    /// Nobody asks any more.
    pub fn withdraw(&mut self) {
        self.consent.ask = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Hears a goal of that publisher at that time \[ms\], and takes it where nothing has revoked it.
    fn goal(asks: &mut Asks, by: u32, at: u32) -> Option<Revocation> {
        let ask = asks.hear(Asker::Goal(by), Duration::ZERO, at * MS, STREAM);
        if ask.revoked.is_none() {
            asks.take(ask);
        }
        ask.revoked
    }

    /// Resumes at that time \[ms\]; true if the goal in force had been revoked.
    fn resume(asks: &mut Asks, at: u32) -> bool {
        asks.resume(at * MS, at * MS, STREAM).unwrap()
    }

    #[test]
    fn who_streams_on_after_a_revocation_asks_for_nothing_until_it_has_paused() {
        let mut asks = Asks::default();
        assert!(!asks.consent().is_given(), "nobody has asked");
        assert_eq!(goal(&mut asks, 0, 10), None);
        asks.stop(10 * MS);
        asks.stand();
        assert_eq!(goal(&mut asks, 0, 1500), Some(Revocation::Stopped), "a hole is no pause");
        assert_eq!(goal(&mut asks, 0, 3000), Some(Revocation::Stopped));
        assert_eq!(goal(&mut asks, 0, 4501), None);
        assert!(asks.consent().is_given());
    }

    #[test]
    fn what_is_pushed_counts_where_it_was_sent_after_what_revokes() {
        let mut asks = Asks::default();
        goal(&mut asks, 0, 10);
        asks.revoke(9 * MS, 20 * MS, Revocation::WasAway(1.0));
        assert!(asks.consent().is_given(), "it was sent later");
        asks.revoke(10 * MS, 20 * MS, Revocation::CameLater(0.0));
        assert_eq!(asks.consent().revocation(), Some(Revocation::CameLater(0.01)));
        let late = asks.hear(Asker::Goal(1), 12 * MS, 21 * MS, STREAM);
        assert_eq!(late.revoked, Some(Revocation::CameLater(0.011)));
        assert_eq!(goal(&mut asks, 2, 21), None);
        asks.revoke(21 * MS, 21 * MS, Revocation::AnotherTool);
        assert_eq!(asks.consent().revocation(), Some(Revocation::AnotherTool), "what comes later revokes");
    }

    #[test]
    fn a_pause_holds_what_is_asked_and_its_end_asks_for_the_goal_once_more() {
        let mut asks = Asks::default();
        asks.pause();
        goal(&mut asks, 0, 12);
        assert!(!asks.consent().is_given(), "a goal ends no pause");
        assert!(!resume(&mut asks, 13) && asks.consent().is_given());
        asks.revoke(20 * MS, 20 * MS, Revocation::FrameWasAway(2.0));
        assert!(resume(&mut asks, 30) && asks.consent().is_given());
        assert_eq!(asks.consent().ask().map(|ask| ask.by), Some(Asker::Resume));
        assert!(!resume(&mut Asks::default(), 30), "there is no goal");
    }

    #[test]
    fn a_twist_revokes_goals_and_a_stick_that_is_held_asks_once() {
        let mut asks = Asks::default();
        let twist = |asks: &mut Asks, by, at: u32| {
            let ask = asks.hear(Asker::Twist(by), Duration::ZERO, at * MS, STREAM);
            asks.jog(at * MS);
            asks.take(ask);
            ask.revoked
        };
        goal(&mut asks, 0, 5);
        assert_eq!(twist(&mut asks, 3, 10), None);
        assert_eq!(goal(&mut asks, 0, 20), Some(Revocation::Jogged));
        asks.stop(50 * MS);
        asks.stand();
        assert_eq!(twist(&mut asks, 3, 60), Some(Revocation::Stopped));
        assert!(!resume(&mut asks, 70) && !asks.consent().is_given(), "~/pause (false) releases no stick");
        asks.release(Asker::Twist(3));
        assert_eq!(twist(&mut asks, 3, 80), None);
        assert!(asks.is_pushed(Asker::Twist(3), 81 * MS, STREAM));
    }

    #[test]
    fn two_that_push_in_turn_are_rivals_and_one_that_follows_another_is_none() {
        let mut asks = Asks::default();
        goal(&mut asks, 0, 0);
        goal(&mut asks, 1, 500);
        goal(&mut asks, 1, 900);
        assert_eq!(asks.rivals(900 * MS, STREAM), None, "the first may have gone");
        goal(&mut asks, 0, 1000);
        let rivals = Rivals { of: Contended::Goals, first: 0, second: 1 };
        assert_eq!(asks.rivals(1000 * MS, STREAM), Some(rivals));
        asks.revoke(1000 * MS, 1000 * MS, Revocation::Rivals(Contended::Goals));
        goal(&mut asks, 0, 2000);
        assert_eq!(asks.rivals(2400 * MS, STREAM), Some(rivals), "as long as both are there");
        assert_eq!(asks.rivals(2401 * MS, STREAM), None);
    }

    #[test]
    fn of_too_many_publishers_none_pushes_after_a_revocation() {
        let mut asks = Asks::default();
        asks.stop(MS);
        for by in 0..100 {
            assert_eq!(goal(&mut asks, by, 2), None, "single goals are no streams");
        }
        for at in [3, 4] {
            for by in 200..216 {
                goal(&mut asks, by, at);
            }
        }
        assert_eq!(asks.pushes.len(), MOST);
        assert_eq!(goal(&mut asks, 300, 5), Some(Revocation::Stopped));
    }
}
