//! What a command was made from, recorded in the label of its layout: with it a bag can be replayed to the last bit.

use super::no_label::{NoLabel, parse};
use super::{FramedGoalLabel, FramedGoalOutcome, held_label};
use crate::servo::{ArmFigures, Contact, Found, GoalMotion, GoalReading, Held, Sent};
use crate::wire::messages::{Float64MultiArray, JointState, Time};
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// What the cycle had seen when it made a command. Counts are since the node's start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CycleLabel {
    /// The cycle's own clock.
    pub now: Duration,
    /// What it knew of each arm.
    pub arms: Vec<ArmLabel>,
    /// Goal messages seen.
    pub goals: u64,
    /// The parameters in force, by the stamp \[ns\] with which they were announced; in bags of earlier versions how many changes of
    /// them had been taken into force.
    pub settings: u64,
    /// Requests to pause or to go on.
    pub pauses: u64,
    /// Whether the servo is paused.
    pub paused: bool,
    /// How often it was stopped.
    pub stops: u64,
    /// Whether the arm was commanded to stand: of positions, one command does not say.
    pub rests: bool,
    /// Messages of twists seen.
    pub twists: u64,
    /// What TF has made of goals since the command before.
    pub framed: Vec<FramedGoalLabel>,
    /// Of the goal messages that came since the command before, the last ones: who sent them, and how long before they came.
    pub goal_senders: Vec<Sent>,
    /// The same of twists.
    pub twist_senders: Vec<Sent>,
    /// Which command since the node's start it is, counted from 1; 0 in bags of earlier versions.
    pub sent: u64,
    /// How many motions have begun; 0 in bags of earlier versions.
    pub motions: u64,
    /// Whether none of them is under way, and no twist in force: a goal that comes next begins as from rest.
    pub idle: bool,
    /// Whether there is neither a goal nor a twist.
    pub free: bool,
    /// The goal that an arm holds that stands.
    pub held: Option<Held>,
    /// The joint velocities [rad/s, prismatic: m/s] of an arm that is idle and takes positions; else empty.
    pub speeds: Vec<f64>,
    /// Requests to go to another configuration; 0 in bags of earlier versions.
    pub reconfigurations: u64,
    /// What a search has come to since the command before.
    pub found: FoundLabel,
    /// Whether the cycle before sent nothing, so that positions begin anew where the arm is; false in bags of earlier versions.
    pub anew: bool,
}

/// What a search has come to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundLabel {
    asked: Duration,
    /// From how many starts; 0 where no search has come to its end.
    starts: u32,
    /// One a joint; empty where none were found.
    positions: Vec<f64>,
}

impl FoundLabel {
    /// The same as the servo takes it; none where no search has come to its end.
    pub fn reading(&self) -> Option<Found<'_>> {
        let Self { asked, starts, positions } = self;
        let positions = (!positions.is_empty()).then_some(positions.as_slice());
        (*starts > 0).then_some(Found { asked: *asked, starts: *starts, positions })
    }
}

/// What the cycle knew of one arm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ArmLabel {
    /// How many joint states it has taken.
    pub count: u64,
    /// The stamp \[ns\] of the last.
    pub stamp: i64,
    /// The publishers that it heard in this cycle, in their order.
    pub sources: Vec<u32>,
    /// What it found out of the arm.
    pub figures: ArmFigures,
    /// A digest of the last one's numbers, as many may have one stamp; none in bags of earlier versions.
    pub digest: Option<u64>,
}

/// So many goals and twists are noted at most; those before them had no command.
const NOTED: usize = 16;

/// No arm has more joints: what is read of a label is bounded.
const MOST_JOINTS: usize = 64;

/// So many publishers are noted: two that speak in turn are enough to be rivals.
const SOURCES: usize = 4;

impl ArmLabel {
    /// Notes the joint state that was taken.
    pub fn take(&mut self, state: &JointState) {
        self.count += 1;
        (self.stamp, self.digest) = (state.header.stamp.nanoseconds(), Some(Self::digest_of(state)));
    }

    /// A digest of a joint state's numbers: FNV-1a, a number at a time.
    pub fn digest_of(state: &JointState) -> u64 {
        const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
        const PRIME: u64 = 0x0100_0000_01b3;
        let numbers = state.position.iter().chain(&state.velocity);
        numbers.fold(BASIS, |digest, number| (digest ^ number.to_bits()).wrapping_mul(PRIME))
    }

    /// Notes that `source` was heard.
    pub fn hear(&mut self, source: u32) {
        if self.sources.len() < SOURCES && self.sources.last() != Some(&source) {
            self.sources.push(source);
        }
    }
}

/// Adds to the last ones.
fn push<V>(last: &mut Vec<V>, value: V) {
    if last.len() >= NOTED {
        last.remove(0);
    }
    last.push(value);
}

impl CycleLabel {
    /// Notes what TF has made of a goal. What it was moved to before, with no command since, counts no more.
    pub fn note(&mut self, goal: FramedGoalLabel) {
        self.forget_motions();
        push(&mut self.framed, goal);
    }

    /// Notes a goal message that came.
    pub fn hear_goal(&mut self, sent: Sent) {
        self.goals += 1;
        push(&mut self.goal_senders, sent);
    }

    /// Notes what a search has come to.
    pub fn find(&mut self, found: &Found) {
        (self.found.asked, self.found.starts) = (found.asked, found.starts);
        self.found.positions.clear();
        self.found.positions.extend_from_slice(found.positions.unwrap_or_default());
    }

    /// Notes a twist that came.
    pub fn hear_twist(&mut self, sent: Sent) {
        self.twists += 1;
        push(&mut self.twist_senders, sent);
    }

    /// Forgets what came: a command that was made from it is sent.
    pub fn go_on(&mut self) {
        self.framed.clear();
        self.goal_senders.clear();
        self.twist_senders.clear();
        self.found.starts = 0;
        self.anew = false;
    }

    /// Notes that another goal was taken: the one before is moved no more.
    pub fn forget_motions(&mut self) {
        self.framed.retain(|goal| matches!(goal.outcome, FramedGoalOutcome::Taken(..)));
    }

    /// The goals in frames of TF that were taken, each with its number.
    pub fn framed_goals(&self) -> impl Iterator<Item = (u64, GoalReading<'_>)> {
        self.framed.iter().filter_map(|goal| match &goal.outcome {
            FramedGoalOutcome::Taken(placed, waited) => {
                Some((goal.number, GoalReading { waited: *waited, ..placed.reading() }))
            }
            FramedGoalOutcome::Moved(_) | FramedGoalOutcome::Lost => None,
        })
    }

    /// What has become of the goal that moves with its frame.
    pub fn goal_motions(&self) -> impl Iterator<Item = GoalMotion<'static>> {
        self.framed.iter().filter_map(|goal| match &goal.outcome {
            FramedGoalOutcome::Taken(..) => None,
            FramedGoalOutcome::Moved(placed) => Some(GoalMotion::To(placed.reading())),
            FramedGoalOutcome::Lost => Some(GoalMotion::Lost),
        })
    }

    /// Whether the servo was started again between the command with the label `before` and this one: it counts from the beginning then;
    /// the cycle's clock does only where the host was started again.
    pub fn is_of_another_life(&self, before: &Self) -> bool {
        let counts =
            |label: &Self| [label.goals, label.stops, label.pauses, label.twists, label.reconfigurations];
        let goes_back = counts(self).iter().zip(counts(before)).any(|(now, before)| *now < before);
        goes_back || self.now < before.now || (1..=before.sent).contains(&self.sent)
    }

    /// Before the first cycle of a servo of so many arms.
    pub fn new(arm_count: usize) -> Self {
        // Where the cycle notes positions there is room for them.
        let found = FoundLabel { positions: Vec::with_capacity(MOST_JOINTS), ..FoundLabel::default() };
        Self { arms: vec![ArmLabel::default(); arm_count], found, ..Self::default() }
    }

    /// The parameters that were announced with that stamp, as [`settings`](Self::settings) names them.
    pub fn settings_of(announced: &Time) -> u64 {
        announced.nanoseconds().unsigned_abs()
    }

    /// The one that the command carries; none if it is from another program.
    pub fn of(command: &Float64MultiArray) -> Option<Self> {
        command.layout.dim.first()?.label.parse().ok()
    }
}

impl fmt::Display for CycleLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "now={} joint_states=", self.now.as_nanos())?;
        for (i, arm) in self.arms.iter().enumerate() {
            write!(f, "{}{arm}", if i > 0 { "," } else { "" })?;
        }
        let Self { goals, settings, pauses, stops, sent, .. } = self;
        let (paused, rests) = (u8::from(self.paused), u8::from(self.rests));
        write!(f, " goals={goals} settings={settings} pauses={pauses} paused={paused} stops={stops}")?;
        write!(f, " twists={} rests={rests} sent={sent}", self.twists)?;
        write!(f, " motions={}", self.motions)?;
        if self.reconfigurations > 0 {
            write!(f, " reconfigurations={}", self.reconfigurations)?;
        }
        if let Some(Found { asked, starts, positions }) = self.found.reading() {
            write!(f, " found={}@{starts}@", asked.as_nanos())?;
            for (i, position) in positions.unwrap_or_default().iter().enumerate() {
                write!(f, "{}{position}", if i > 0 { "," } else { "" })?;
            }
        }
        for (flag, name) in [(self.anew, "anew"), (self.idle, "idle"), (self.free, "free")] {
            if flag {
                write!(f, " {name}=1")?;
            }
        }
        for (i, speed) in self.speeds.iter().enumerate() {
            write!(f, "{}{speed}", if i > 0 { "," } else { " speeds=" })?;
        }
        if let Some(held) = &self.held {
            f.write_str(" held=")?;
            held_label::write(f, held)?;
        }
        for (i, goal) in self.framed.iter().enumerate() {
            write!(f, "{}{goal}", if i > 0 { ";" } else { " framed=" })?;
        }
        for (name, senders) in [("goal_senders", &self.goal_senders), ("twist_senders", &self.twist_senders)]
        {
            for (i, Sent { by, ago }) in senders.iter().enumerate() {
                match i {
                    0 => write!(f, " {name}={by}@{}", ago.as_nanos())?,
                    _ => write!(f, ",{by}@{}", ago.as_nanos())?,
                }
            }
        }
        Ok(())
    }
}

fn senders(text: &str) -> Result<Vec<Sent>, NoLabel> {
    let sender = |text: &str| {
        let (by, ago) = text.split_once('@').ok_or(NoLabel)?;
        Ok(Sent { by: parse(by)?, ago: Duration::from_nanos(parse(ago)?) })
    };
    text.split(',').take(NOTED).map(sender).collect()
}

/// The letters that stand in a label for how an arm follows.
const CONTACTS: [(Contact, &str); 7] = [
    (Contact::Following, "f"),
    (Contact::Unseen, "u"),
    (Contact::Lost, "l"),
    (Contact::Resting, "r"),
    (Contact::KeepsLosing, "k"),
    (Contact::Nobody, "n"),
    (Contact::Contended, "c"),
];

/// What stands after the letter where the robot has come in this cycle.
const CAME: &str = "!";

impl fmt::Display for ArmLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}@", self.count, self.stamp)?;
        for (i, source) in self.sources.iter().enumerate() {
            write!(f, "{}{source}", if i > 0 { "+" } else { "" })?;
        }
        let ArmFigures { lag, delay, lateness, cycle, contact, came } = self.figures;
        let letter = CONTACTS.iter().find(|(each, _)| *each == contact).map_or("u", |(_, letter)| letter);
        write!(f, "@{}@{}+{}+{}", lag.as_nanos(), delay.as_nanos(), lateness.as_nanos(), cycle.as_nanos())?;
        write!(f, "@{letter}{}", if came { CAME } else { "" })?;
        self.digest.map_or(Ok(()), |digest| write!(f, "@{digest}"))
    }
}

impl FromStr for ArmLabel {
    type Err = NoLabel;
    fn from_str(text: &str) -> Result<Self, NoLabel> {
        let mut fields = text.split('@');
        let mut field = || fields.next().ok_or(NoLabel);
        let (count, stamp) = (parse(field()?)?, parse(field()?)?);
        let sources = field()?
            .split('+')
            .filter(|source| !source.is_empty())
            .take(SOURCES)
            .map(parse)
            .collect::<Result<_, _>>()?;
        let (lag, delay, last) = (parse(field()?)?, field()?, field()?);
        let mut times = delay.split('+').map(|time| parse(time).map(Duration::from_nanos));
        // Labels of earlier versions have the first alone.
        let mut time = || times.next().unwrap_or(Ok(Duration::ZERO));
        let letter = last.trim_end_matches(CAME);
        let (contact, _) = CONTACTS.iter().find(|(_, each)| *each == letter).ok_or(NoLabel)?;
        let figures = ArmFigures {
            lag: Duration::from_nanos(lag),
            delay: time()?,
            lateness: time()?,
            cycle: time()?,
            contact: *contact,
            came: last != letter,
        };
        let digest = fields.next().map(parse).transpose()?;
        fields.next().is_none().then_some(Self { count, stamp, sources, figures, digest }).ok_or(NoLabel)
    }
}

impl FromStr for FoundLabel {
    type Err = NoLabel;
    fn from_str(text: &str) -> Result<Self, NoLabel> {
        let (asked, rest) = text.split_once('@').ok_or(NoLabel)?;
        let (starts, positions) = rest.split_once('@').ok_or(NoLabel)?;
        let positions = positions.split(',').filter(|position| !position.is_empty()).take(MOST_JOINTS);
        Ok(Self {
            asked: Duration::from_nanos(parse(asked)?),
            starts: parse(starts)?,
            positions: positions.map(parse).collect::<Result<_, _>>()?,
        })
    }
}

impl FromStr for CycleLabel {
    type Err = NoLabel;
    fn from_str(text: &str) -> Result<Self, NoLabel> {
        let mut fields = text.split(' ');
        let mut field = |name: &str| {
            let (key, value) = fields.next().and_then(|field| field.split_once('=')).ok_or(NoLabel)?;
            if key == name { Ok(value) } else { Err(NoLabel) }
        };
        let number = |text: &str| parse::<u64>(text);
        let mut label = Self {
            now: Duration::from_nanos(number(field("now")?)?),
            arms: field("joint_states")?.split(',').map(str::parse).collect::<Result<_, _>>()?,
            goals: number(field("goals")?)?,
            settings: number(field("settings")?)?,
            pauses: number(field("pauses")?)?,
            paused: number(field("paused")?)? > 0,
            stops: number(field("stops")?)?,
            ..Self::default()
        };
        // Labels of earlier versions end here.
        for (key, value) in fields.map(|field| field.split_once('=').unwrap_or_default()) {
            match key {
                "twists" => label.twists = number(value)?,
                "rests" => label.rests = number(value)? > 0,
                "sent" => label.sent = number(value)?,
                "motions" => label.motions = number(value)?,
                "reconfigurations" => label.reconfigurations = number(value)?,
                "found" => label.found = value.parse()?,
                "anew" => label.anew = number(value)? > 0,
                "idle" => label.idle = number(value)? > 0,
                "free" => label.free = number(value)? > 0,
                "speeds" => {
                    label.speeds = value.split(',').take(MOST_JOINTS).map(parse).collect::<Result<_, _>>()?
                }
                "held" => label.held = Some(held_label::read(value)?),
                "framed" => {
                    label.framed = value.split(';').take(NOTED).map(str::parse).collect::<Result<_, _>>()?
                }
                "goal_senders" => label.goal_senders = senders(value)?,
                "twist_senders" => label.twist_senders = senders(value)?,
                _ => return Err(NoLabel),
            }
        }
        Ok(label)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::{Asker, Goal};
    use crate::wire::PlacedGoal;
    use proptest::prelude::*;

    #[test]
    fn a_label_reads_back_as_it_was() {
        let pose = [0.1, -0.0, 1e-300, 0.6, 0.0, 1.0 / 3.0, 0.8];
        let waited = Duration::from_nanos(490_000_001);
        let label = CycleLabel {
            now: Duration::from_nanos(1_234_567_890_123),
            arms: vec![
                ArmLabel {
                    count: 7,
                    stamp: 1_795_242_920_633_002_124,
                    sources: vec![0, 12, 0],
                    figures: ArmFigures {
                        lag: Duration::from_micros(1500),
                        delay: Duration::from_nanos(3_000_001),
                        lateness: Duration::from_nanos(40_000_007),
                        cycle: Duration::from_nanos(2_000_003),
                        contact: Contact::Lost,
                        came: true,
                    },
                    digest: Some(u64::MAX),
                },
                ArmLabel { count: 9, stamp: -5, ..ArmLabel::default() },
            ],
            goals: 3,
            settings: 1_795_242_920_633_002_124,
            pauses: 3,
            paused: true,
            stops: 2,
            twists: 12,
            rests: true,
            goal_senders: vec![Sent { by: 2, ago: Duration::from_nanos(77) }, Sent::default()],
            twist_senders: vec![Sent { by: 1, ago: Duration::from_nanos(7) }],
            sent: 77,
            motions: 5,
            idle: true,
            free: true,
            held: Some(Held {
                goal: Goal::new(
                    [0.1, -0.2, 1.0 / 3.0],
                    [0.1, 0.2, 0.3, 0.86_f64.sqrt() * (1.0 - 1e-9)],
                    "",
                    "",
                )
                .unwrap(),
                stamp: -7,
                asker: Asker::Goal(3),
                sent: Duration::from_nanos(11),
                received: Duration::from_nanos(12),
                stalled: true,
                revoked: false,
            }),
            speeds: vec![1e-7, -0.0, 1.0 / 3.0],
            reconfigurations: 2,
            found: FoundLabel {
                asked: Duration::from_nanos(1_234_000_000_123),
                starts: 256,
                positions: vec![-0.0, 1.0 / 3.0],
            },
            anew: true,
            framed: vec![
                FramedGoalLabel {
                    number: 3,
                    outcome: FramedGoalOutcome::Taken(PlacedGoal { stamp: -5, pose }, waited),
                },
                FramedGoalLabel {
                    number: 3,
                    outcome: FramedGoalOutcome::Moved(PlacedGoal { stamp: 0, pose }),
                },
                FramedGoalLabel { number: 3, outcome: FramedGoalOutcome::Lost },
            ],
        };
        let text = label.to_string();
        assert_eq!(text.parse(), Ok(label.clone()));
        let again = text.parse::<CycleLabel>().unwrap().held.unwrap();
        let bits = |held: &Held| held.goal.base_from_goal().to_vector8().map(f64::to_bits);
        assert_eq!(bits(&again), bits(&label.held.unwrap()));
        let earlier = CycleLabel {
            arms: label.arms,
            goals: 3,
            settings: label.settings,
            pauses: 3,
            paused: true,
            stops: 2,
            now: label.now,
            ..CycleLabel::default()
        };
        assert_eq!(text.split(" twists").next().unwrap().parse(), Ok(earlier));
        let before_waits = text.replace("@490000001", "").parse::<CycleLabel>().unwrap();
        assert_eq!(before_waits.framed_goals().next().map(|(_, goal)| goal.waited), Some(Duration::ZERO));
        assert_eq!(format!("{text} more=1").parse::<CycleLabel>(), Err(NoLabel));
        for text in
            ["", "joint", "now=1", "now=1 joint_states=5@6 goals=0 settings=0 pauses=0 paused=0 stops=0"]
        {
            assert_eq!(text.parse::<CycleLabel>(), Err(NoLabel), "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(text in ".{0,60}") {
            let _ = text.parse::<CycleLabel>();
        }
    }
}
