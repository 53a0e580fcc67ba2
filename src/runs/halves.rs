//! Commands to several arms, put together cycle by cycle.

use std::collections::VecDeque;
use std::time::Duration;

/// Cycles whose commands to some of the arms are still to come, at most; of older ones they are lost.
const WAITING: usize = 64;

/// The commands of each cycle to the arms, as they come: of two cycles those to one arm may come before those to the other.
pub(super) struct Halves {
    /// What each arm was commanded last.
    last: Vec<Vec<f64>>,
    /// The cycles, by their own clock, of which not all is there.
    waiting: VecDeque<(Duration, Vec<Option<Vec<f64>>>)>,
}

impl Halves {
    /// For arms with so many joints each, which were commanded nothing yet.
    pub fn new(joints: impl Iterator<Item = usize>) -> Self {
        Self { last: joints.map(|count| vec![0.0; count]).collect(), waiting: VecDeque::new() }
    }

    /// A command to `arm` from the cycle at `now`: that to all arms, arm after arm, once all of it is there. One that does not say
    /// of which cycle it is goes with the last ones to the arms before; one without a number for each joint of its arm is none.
    pub fn add(&mut self, arm: usize, numbers: &[f64], now: Option<Duration>) -> Option<Vec<f64>> {
        if numbers.len() != self.last.get(arm)?.len() {
            return None;
        }
        let Some(now) = now else {
            self.last[arm].copy_from_slice(numbers);
            return (arm + 1 == self.last.len()).then(|| self.last.concat());
        };
        let place = self.waiting.iter().position(|(cycle, _)| *cycle == now).unwrap_or_else(|| {
            self.waiting.push_back((now, vec![None; self.last.len()]));
            self.waiting.len() - 1
        });
        let (_, parts) = &mut self.waiting[place];
        parts[arm] = Some(numbers.to_vec());
        if let Some(whole) = parts.iter().cloned().collect::<Option<Vec<_>>>() {
            self.waiting.remove(place);
            return Some(whole.concat());
        }
        if self.waiting.len() > WAITING {
            self.waiting.pop_front();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_belong_to_those_of_their_cycle() {
        let mut halves = Halves::new([1, 2].into_iter());
        let at = |milliseconds| Some(Duration::from_millis(milliseconds));
        assert_eq!(halves.add(0, &[1.0], at(2)), None);
        assert_eq!(halves.add(0, &[2.0], at(4)), None, "the other arm's come later");
        assert_eq!(halves.add(1, &[1.5, 1.7], at(2)), Some(vec![1.0, 1.5, 1.7]));
        assert_eq!(halves.add(1, &[2.5, 2.7], at(4)), Some(vec![2.0, 2.5, 2.7]));
        assert_eq!(halves.add(1, &[3.5], at(6)), None, "of another arm");
        (10..1000).for_each(|lost| assert_eq!(halves.add(0, &[0.0], at(lost)), None));
        assert!(halves.waiting.len() <= WAITING);
    }

    #[test]
    fn without_a_cycle_the_last_arm_s_make_them_whole() {
        let mut halves = Halves::new([1, 1].into_iter());
        assert_eq!(halves.add(0, &[1.0], None), None);
        assert_eq!(halves.add(1, &[2.0], None), Some(vec![1.0, 2.0]));
        assert_eq!(Halves::new([1].into_iter()).add(0, &[3.0], None), Some(vec![3.0]));
    }
}
