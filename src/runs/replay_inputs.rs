//! What a recorded servo had seen, cycle by cycle, given to a new one.

use super::replay_cycles::Cycle;
use super::timeline::{AnnouncedParameters, changed};
use super::{RunError, Timeline};
use crate::params::ParameterStore;
use crate::servo::{Event, GoalReading, Interface, Motion, Servo};
use crate::wire::messages::{JointState, PoseStamped, TwistStamped};
use crate::wire::{CycleLabel, MotionContext, MotionReport, ParameterEvent, ServoKind};
use std::time::Duration;

/// How far back a servo that goes on from a recorded one has to know what that commanded and heard: what its link remembers.
const HISTORY: Duration = Duration::from_secs(1);

/// Twice the delay and this much are enough, where the bag has no more.
const SHORTEST_HISTORY: Duration = Duration::from_millis(50);

/// A servo, as long as all is known that came to it.
pub(super) struct Replica<'a> {
    kind: ServoKind,
    announced: &'a AnnouncedParameters,
    interface: Interface,
    running: Option<Running>,
}

struct Running {
    kind: ServoKind,
    servo: Servo,
    store: ParameterStore,
    last: CycleLabel,
}

impl<'a> Replica<'a> {
    /// With the parameters of the node.
    pub fn new(kind: ServoKind, timeline: &'a Timeline, node: &str) -> Result<Self, RunError> {
        let nothing = || RunError::NotReplayable(format!("the parameters of {node} are not in it"));
        let announced = timeline.parameters(node).ok_or_else(nothing)?;
        let parameters = kind.from_store(&announced.initial(kind)?)?;
        Ok(Self { kind, announced, interface: parameters.settings.interface, running: None })
    }

    /// What kind of commands its robot takes.
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// Whether there is a servo that goes on with the next cycle.
    pub fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Begins with the cycle number `i`, where that is possible: whether it is. It was the first that sent a command, with a goal that is
    /// known; or the arm stands and has no goal, or one that is known; or a motion begins, and none was under way.
    pub fn begin_at(&mut self, cycles: &[Cycle], i: usize) -> Result<bool, RunError> {
        let cycle = &cycles[i];
        let asked = !cycle.goals.is_empty() || !cycle.twists.is_empty();
        // Goals that were rejected before it have left nothing.
        let all_known = cycle.goals.len() as u64 >= cycle.label.motions
            && cycle.twists.len() as u64 == cycle.label.twists;
        let is_first = cycle.is_first() && asked && all_known;
        let stands = cycle.rests(self.interface) && (cycle.label.free || cycle.label.held.is_some());
        if (is_first || stands) && cycle.has_its_joint_states() && self.misses_settings(&cycle.label) == 0 {
            self.begin(cycle)?;
            return Ok(true);
        }
        let Some(before) = i.checked_sub(1).map(|before| &cycles[before]) else { return Ok(false) };
        // A resumed servo moves on to a goal that was revoked before, which this one does not have.
        let goal_came = !cycle.goals.is_empty() || cycle.label.framed_goals().next().is_some();
        let begins = goal_came && before.label.idle && before.label.motions < cycle.label.motions;
        if !begins || self.misses_after(&before.label, cycle) > 0 {
            return Ok(false);
        }
        let Some(history) = self.history(&cycles[..i]) else { return Ok(false) };
        self.warm_up(history)?;
        Ok(true)
    }

    /// The last of these cycles, as many as the servo looks back on; none where there are too few without a gap.
    fn history<'c, 'm>(&self, cycles: &'c [Cycle<'m>]) -> Option<&'c [Cycle<'m>]> {
        let last = cycles.last()?;
        let is_known = |cycle: &Cycle| {
            cycle.has_its_joint_states() && cycle.speeds(self.interface).is_some() && !cycle.label.anew
        };
        let mut from = cycles.len() - 1;
        while from > 0 && cycles[from].follows(&cycles[from - 1]) && is_known(&cycles[from - 1]) {
            from -= 1;
            if last.label.now.saturating_sub(cycles[from].label.now) > HISTORY {
                break;
            }
        }
        let delay = last.label.arms.iter().map(|arm| arm.figures.delay).max().unwrap_or_default();
        let lasts = last.label.now.saturating_sub(cycles[from].label.now);
        (is_known(last) && lasts >= 2 * delay + SHORTEST_HISTORY).then_some(&cycles[from..])
    }

    /// Goes through these cycles with the commands that the servo made in them.
    fn warm_up(&mut self, cycles: &[Cycle]) -> Result<(), RunError> {
        let Some(first) = cycles.first() else { return Ok(()) };
        self.begin(first)?;
        for cycle in cycles {
            self.cycle(cycle)?;
            if let (Some(running), Some(speeds)) = (&mut self.running, cycle.speeds(self.interface)) {
                running.servo.adopt(speeds, &cycle.command);
            }
        }
        Ok(())
    }

    /// Begins as the servo was before that cycle.
    pub fn begin(&mut self, cycle: &Cycle) -> Result<(), RunError> {
        let (kind, label) = (self.kind, &cycle.label);
        let mut store = self.announced.initial(kind)?;
        for change in
            self.announced.changes.iter().take(usize::try_from(label.settings).unwrap_or(usize::MAX))
        {
            store = store.with(&changed(change.clone())?)?;
        }
        let mut servo = kind.from_store(&store)?.build()?;
        label.held.iter().for_each(|held| servo.hold(held));
        if label.paused {
            servo.pause(true);
        }
        if !cycle.is_first() {
            servo.adopt(&vec![0.0; cycle.command.len()], &cycle.command);
        }
        let last = CycleLabel { arms: CycleLabel::new(kind.arms().len()).arms, ..label.clone() };
        self.running = Some(Running { kind, servo, store, last });
        Ok(())
    }

    /// Ends the servo: something has come to it that is not known.
    pub fn end(&mut self) {
        self.running = None;
    }

    /// How many inputs of this cycle, and how many cycles before it, are missing in the bag.
    pub fn misses(&self, cycle: &Cycle) -> u64 {
        self.running.as_ref().map_or(0, |running| self.misses_after(&running.last, cycle))
    }

    fn misses_after(&self, last: &CycleLabel, cycle: &Cycle) -> u64 {
        let label = &cycle.label;
        let goals = label.goals.saturating_sub(last.goals).saturating_sub(cycle.goals.len() as u64);
        let twists = label.twists.saturating_sub(last.twists).saturating_sub(cycle.twists.len() as u64);
        let arms = last.arms.iter().zip(&label.arms).zip(&cycle.joint_states);
        let states = arms.filter(|((last, now), state)| last.count != now.count && state.is_none()).count();
        let cycles = if last.sent > 0 { label.sent.saturating_sub(last.sent.saturating_add(1)) } else { 0 };
        [twists, states as u64, cycles, self.misses_settings(label)]
            .into_iter()
            .fold(goals, u64::saturating_add)
    }

    fn misses_settings(&self, label: &CycleLabel) -> u64 {
        label.settings.saturating_sub(self.announced.changes.len() as u64)
    }

    /// One cycle with the inputs that its label names.
    pub fn cycle(&mut self, cycle: &Cycle) -> Result<&[f64], RunError> {
        let Some(running) = &mut self.running else { return Ok(&[]) };
        let label = &cycle.label;
        let index =
            |count: u64| usize::try_from(count).unwrap_or(usize::MAX).min(self.announced.changes.len());
        let came = index(running.last.settings)..index(label.settings);
        let states = cycle.joint_states.iter().map(|state| state.and_then(|state| state.decode().ok()));
        let states: Vec<Option<JointState>> = states.collect();
        let goals: Vec<PoseStamped> = cycle.goals.iter().filter_map(|goal| goal.decode().ok()).collect();
        let twists: Vec<TwistStamped> = cycle.twists.iter().filter_map(|twist| twist.decode().ok()).collect();
        let goals = goals_in_order(&goals, label);
        let mut twists: Vec<_> = twists.iter().map(TwistStamped::reading).collect();
        let senders = label.twist_senders.iter().rev();
        twists.iter_mut().rev().zip(senders).for_each(|(twist, sent)| twist.sent = *sent);
        let mut events = running.requests(self.announced.changes.get(came).unwrap_or_default(), label)?;
        events.extend(label.found.reading().map(Event::Found));
        for (arm, (of_arm, state)) in label.arms.iter().zip(&states).enumerate() {
            // Of several in a cycle only the last that was believed counts, so they may all be like that one.
            let readings =
                |state| of_arm.sources.iter().map(move |source| JointState::reading(state, *source, None));
            events.extend(state.iter().flat_map(readings).map(|reading| Event::JointState(arm, reading)));
            events.push(Event::Recorded(arm, of_arm.figures));
        }
        events.extend(goals.into_iter().map(Event::Goal));
        for motion in label.goal_motions() {
            events.push(Event::GoalMotion(motion));
        }
        events.extend(twists.into_iter().map(Event::Twist));
        running.last.clone_from(label);
        if label.anew {
            running.servo.stand_anew();
        }
        running.servo.cycle_with(label.now, events);
        Ok(running.servo.output().unwrap_or_default())
    }
}

impl Replica<'_> {
    /// What the servo has said of its motions since this was last asked.
    pub fn motions(&mut self) -> Vec<MotionReport> {
        let (kind, Some(running)) = (self.kind, &mut self.running) else { return Vec::new() };
        let report = |motion: Motion| {
            let why = motion.why(|joint| format!("joint {joint}"));
            let (law, gains) = (kind.law(&motion.controller), kind.gains(&motion.controller));
            MotionReport::new(&motion, MotionContext { law, gains, why, ..MotionContext::default() })
        };
        running.servo.take_motions().map(report).collect()
    }
}

/// The messages of a cycle and the goals whose frames were found in it, in the order in which they were sent. The messages in other
/// frames are rejected once more, which changes no command.
fn goals_in_order<'a>(messages: &'a [PoseStamped], label: &'a CycleLabel) -> Vec<GoalReading<'a>> {
    let first = label.goals.saturating_sub(messages.len() as u64).saturating_add(1);
    let mut goals: Vec<_> =
        messages.iter().zip(first..).map(|(message, number)| (number, message.reading())).collect();
    goals
        .iter_mut()
        .rev()
        .zip(label.goal_senders.iter().rev())
        .for_each(|((_, goal), sent)| goal.sent = *sent);
    goals.extend(label.framed_goals());
    goals.sort_by_key(|(number, _)| *number);
    goals.into_iter().map(|(_, goal)| goal).collect()
}

impl Running {
    /// What was asked of the servo since its last cycle: these changes of its parameters, and what the label counts.
    fn requests<'a>(
        &mut self,
        changes: &[ParameterEvent],
        label: &CycleLabel,
    ) -> Result<Vec<Event<'a>>, RunError> {
        let mut requests = Vec::new();
        let ago = Duration::ZERO;
        // Taken after any other of the same cycle, the recorded one would have been refused, and not counted.
        let reconfigures = label.reconfigurations > self.last.reconfigurations;
        requests.extend(reconfigures.then_some(Event::Reconfigure { ago }));
        for change in changes {
            self.store = self.store.with(&changed(change.clone())?)?;
            let settings = self.kind.from_store(&self.store)?.settings;
            requests.push(Event::Configure(Box::new(settings)));
        }
        requests.extend((label.stops > self.last.stops).then_some(Event::Stop));
        let paused = label.paused;
        requests.extend((label.pauses > self.last.pauses).then_some(Event::Pause { paused, ago }));
        Ok(requests)
    }
}
