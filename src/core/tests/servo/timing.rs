//! Rule 11: late cycles.

use crate::rig::{PERIOD, Rig};
use dq_core::check::{CycleTiming, TimingFigures};
use dq_core::servo::State;
use std::time::Duration;

#[test]
fn rule_11_lateness_work_and_missed_cycles_are_counted() {
    let mut timing = CycleTiming::default();
    (0..989).for_each(|_| timing.add(Duration::from_micros(50), 0));
    (0..10).for_each(|_| timing.add(Duration::from_micros(700), 0));
    timing.add(Duration::from_millis(3), 2);
    (0..1000).for_each(|i| timing.add_work(Duration::from_micros(i + 1)));
    let TimingFigures { lateness, work, overruns } = timing.figures();
    let us = |time: Duration| time.as_secs_f64() * 1e6;
    assert!((50.0..50.51).contains(&us(lateness.median)), "{lateness:?}");
    assert!((700.0..707.1).contains(&us(lateness.p99)), "990 of 1000 were no later: {lateness:?}");
    assert!((700.0..707.1).contains(&us(lateness.p999)), "{lateness:?}");
    assert_eq!((lateness.max, overruns), (Duration::from_millis(3), 2));
    assert!(
        (500.0..505.1).contains(&us(work.median)) && (990.0..=1000.0).contains(&us(work.p99)),
        "{work:?}"
    );
    timing.restart();
    assert_eq!(timing.figures(), TimingFigures { overruns: 2, ..TimingFigures::default() });
}

#[test]
fn rule_11_a_machine_that_is_always_late_has_a_p99_of_its_own() {
    for (usual, worst) in [(6, 20), (40, 900), (1_000, 3_000_000)] {
        let mut timing = CycleTiming::default();
        (0..990).for_each(|_| timing.add(Duration::from_millis(usual), 0));
        (0..10).for_each(|_| timing.add(Duration::from_millis(worst), 0));
        let p99 = timing.figures().lateness.p99.as_secs_f64() * 1e3;
        assert!((usual as f64..1.01 * usual as f64).contains(&p99), "{p99} ms of {usual}");
        timing.add(Duration::from_secs(10_000), 0);
        let lateness = timing.figures().lateness;
        assert!(lateness.p999 <= lateness.max);
    }
}

#[test]
fn rule_11_while_cycles_are_missed_the_plant_stops_by_itself_and_then_the_motion_goes_on() {
    let mut rig = Rig::in_motion(0.5);
    let (before, speed) = (rig.plants[0].positions().to_vec(), rig.speed());
    rig.cycle_late(450);
    // Of the 0.9 s that was missed the plant has moved for its timeout of 0.1 s, and then for the late cycle itself.
    let moved = crate::reference::distance(&before, rig.plants[0].positions());
    let most = (speed + 0.1) * (0.1 + 2.0 * PERIOD.as_secs_f64());
    assert!(moved > 0.0 && moved <= most, "{moved} of {most}");
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_11_time_that_stands_still_or_goes_back_is_no_progress_and_no_harm() {
    let mut rig = Rig::in_motion(0.2);
    rig.now -= 50 * PERIOD;
    rig.cycle();
    assert_eq!(rig.state(), State::Tracking);
    rig.run_until(State::Settled, 30.0);
}
