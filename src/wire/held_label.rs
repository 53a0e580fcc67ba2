//! What a label says of the goal that a standing arm holds.

use super::no_label::{NoLabel, parse};
use crate::dq::{DualQuaternion, UnitDualQuaternion, Vector8};
use crate::servo::{Asker, Goal, Held};
use std::fmt;
use std::time::Duration;

/// Who asked for it where that was `~/pause`, and the letters of a stall and of a revoked consent.
const RESUME: &str = "resume";
const STALLED: &str = "s";
const REVOKED: &str = "r";

/// Writes it: a shortest text of each number, which reads back to the last bit.
pub(super) fn write(f: &mut fmt::Formatter<'_>, held: &Held) -> fmt::Result {
    write!(f, "{}@", held.stamp)?;
    match held.asker {
        Asker::Goal(by) => write!(f, "{by}")?,
        Asker::Twist(_) | Asker::Resume => f.write_str(RESUME)?,
    }
    let (stalled, revoked) =
        (if held.stalled { STALLED } else { "" }, if held.revoked { REVOKED } else { "" });
    write!(f, "@{}@{}@{stalled}{revoked}", held.sent.as_nanos(), held.received.as_nanos())?;
    let numbers = held.goal.base_from_goal().to_vector8();
    numbers.iter().try_for_each(|number| write!(f, "@{number}"))
}

/// Reads it.
pub(super) fn read(text: &str) -> Result<Held, NoLabel> {
    let mut fields = text.split('@');
    let mut field = || fields.next().ok_or(NoLabel);
    let stamp = parse(field()?)?;
    let asker = match field()? {
        RESUME => Asker::Resume,
        by => Asker::Goal(parse(by)?),
    };
    let [sent, received] = [field()?, field()?].map(|time| parse(time).map(Duration::from_nanos));
    let letters = field()?;
    let mut numbers = Vector8::zeros();
    for number in numbers.iter_mut() {
        *number = parse(field()?)?;
    }
    let pose = UnitDualQuaternion::try_normalize(&DualQuaternion::from_vector8(&numbers));
    let goal = Goal::of(pose.map_err(|_| NoLabel)?);
    let [stalled, revoked] = [STALLED, REVOKED].map(|letter| letters.contains(letter));
    let held = Held { goal, stamp, asker, sent: sent?, received: received?, stalled, revoked };
    fields.next().is_none().then_some(held).ok_or(NoLabel)
}
