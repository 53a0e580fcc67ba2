//! A servo that is given what another one heard, and found out of the arm, commands the same.

use crate::reference::{json, numbers, parameters, puma};
use crate::rig;
use dq_servo::dq::UnitDualQuaternion;
use dq_servo::servo::{ArmFigures, Event, JointReading, Servo, Settings};
use std::time::Duration;

/// One cycle as a bag has it: the joint state that came, what the servo found out of the arm, and its command.
struct Recorded {
    positions: Option<Vec<f64>>,
    figures: ArmFigures,
    command: Vec<f64>,
}

/// A servo and its cycles.
struct Bench {
    servo: Servo,
    names: Vec<String>,
    period: Duration,
}

/// What comes for a cycle besides a joint state.
type Others = Option<Event<'static>>;

impl Bench {
    fn new(change: impl Fn(&mut Settings)) -> Self {
        let parameters = parameters().with(change);
        let names = parameters.joints[0].names().to_vec();
        Self { servo: parameters.build().unwrap(), names, period: parameters.period }
    }

    /// The cycle of that number, with a joint state without velocities, of that age by its stamp.
    fn cycle(
        &mut self,
        number: u32,
        positions: Option<Vec<f64>>,
        stamp_age: Option<Duration>,
        (recorded, others): (Option<ArmFigures>, Others),
    ) -> Recorded {
        let reading = positions.as_ref().map(|positions| JointReading {
            names: &self.names,
            positions,
            velocities: &[],
            source: 0,
            stamp_age,
        });
        let state = reading.map(|reading| Event::JointState(0, reading)).into_iter();
        let events = state.chain(recorded.map(|figures| Event::Recorded(0, figures))).chain(others);
        let command = self.servo.cycle_with(self.period * (number + 1), events).to_vec();
        Recorded { positions, figures: *self.servo.arm_figures().next().unwrap(), command }
    }
}

fn goal(theta: &[f64]) -> Others {
    let pose: UnitDualQuaternion = puma().forward_kinematics(theta).unwrap();
    Some(Event::Goal(rig::reading(&pose, 0)))
}

/// Moves an arm that obeys at once for a period.
fn follow(positions: &mut [f64], command: &[f64], period: Duration) {
    positions.iter_mut().zip(command).for_each(|(angle, speed)| *angle += speed * period.as_secs_f64());
}

#[test]
fn a_recording_is_repeated_through_an_absence_of_the_robot() {
    let mut positions: Vec<f64> = numbers(&json()["theta_initial"]);
    let mut run = |recording: Option<&[Recorded]>| {
        let mut bench = Bench::new(|_| {});
        let cycle = |number: u32| {
            // Without velocities, so that after the absence it takes some states to know how fast the arm is.
            let came = number.is_multiple_of(2) && !(1000..1700).contains(&number);
            let before = recording.map(|recording| &recording[number as usize]);
            let state = match before {
                Some(before) => before.positions.clone(),
                None => came.then(|| positions.clone()),
            };
            let others = match number {
                100 | 2000 => goal(&numbers(&json()["theta_desired"])),
                _ => None,
            };
            let recorded = before.map(|before| before.figures);
            let cycle = bench.cycle(number, state, None, (recorded, others));
            follow(&mut positions, &cycle.command, bench.period);
            cycle
        };
        (0..2500).map(cycle).collect::<Vec<_>>()
    };
    let recording = run(None);
    let moves = |part: std::ops::Range<usize>| {
        recording[part].iter().any(|cycle| cycle.command.iter().any(|speed| *speed != 0.0))
    };
    assert!(
        moves(200..900) && !moves(1100..2000) && moves(2000..2500),
        "it was away, and needed its goal again"
    );
    for (number, (before, again)) in recording.iter().zip(run(Some(&recording))).enumerate() {
        assert_eq!(again.command, before.command, "cycle {number}");
    }
}

/// Cycles by which a command, and a joint state, is late.
const LATE: usize = 5;

/// In the second motion, the only one that is repeated, a position limit is near; how late the robot is was found out in the first.
#[test]
fn the_second_motion_alone_is_repeated_where_the_robot_is_late_and_a_position_limit_is_near() {
    const SECOND: u32 = 2500;
    let lowest = 1.6;
    let limited = |settings: &mut Settings| settings.limits.position.lower[2] = lowest;
    let start: Vec<f64> = numbers(&json()["theta_initial"]);
    let beside: Vec<f64> = start.iter().map(|angle| angle + 0.2).collect();
    let desired: Vec<f64> = numbers(&json()["theta_desired"]);
    let others = |number: u32| match number {
        100 => goal(&beside),
        2000 => Some(Event::Stop),
        2600 => goal(&desired),
        _ => None,
    };
    let mut live = Bench::new(limited);
    let (mut places, mut recording) = (vec![start; LATE + 1], Vec::<Recorded>::new());
    for number in 0..4500 {
        let age = live.period * LATE as u32;
        let seen = places[places.len() - 1 - LATE].clone();
        recording.push(live.cycle(number, Some(seen), Some(age), (None, others(number))));
        let mut place = places[places.len() - 1].clone();
        if let Some(obeyed) = recording.len().checked_sub(1 + LATE) {
            follow(&mut place, &recording[obeyed].command, live.period);
        }
        places.push(place);
    }
    let least = places.iter().map(|place| place[2]).fold(f64::INFINITY, f64::min);
    assert!((lowest - 1e-3..lowest + 0.05).contains(&least), "the limit is reached: {least}");
    let mut again = Bench::new(limited);
    for number in SECOND..4500 {
        let before = &recording[number as usize];
        let inputs = (Some(before.figures), others(number));
        let repeated = again.cycle(number, before.positions.clone(), None, inputs);
        assert_eq!(repeated.command, before.command, "cycle {number}");
    }
}
