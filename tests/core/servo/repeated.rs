//! A servo that is given what another one heard, and found out of the arm, commands the same.

use crate::reference::{json, numbers, parameters, puma};
use crate::rig;
use dq_servo::config::ServoParameters;
use dq_servo::servo::{ArmFigures, Inputs, JointReading, Servo};

/// One cycle as a bag has it: the joint state that came, what the servo found out of the arm, and its command.
struct Recorded {
    positions: Option<Vec<f64>>,
    figures: ArmFigures,
    command: Vec<f64>,
}

#[test]
fn a_recording_is_repeated_through_an_absence_of_the_robot() {
    let goal = puma().forward_kinematics(&numbers(&json()["theta_desired"])).unwrap();
    let mut positions: Vec<f64> = numbers(&json()["theta_initial"]);
    let mut run = |recording: Option<&[Recorded]>| {
        let ServoParameters { task, joints, goal_frame, settings, period, .. } = parameters();
        let names = joints[0].names().to_vec();
        let mut servo = Servo::new(task, joints, &goal_frame, settings, period).unwrap();
        let cycle = |number: u32| {
            // Without velocities, so that after the absence it takes some states to know how fast the arm is.
            let came = number.is_multiple_of(2) && !(1000..1700).contains(&number);
            let state = match recording {
                Some(recording) => recording[number as usize].positions.clone(),
                None => came.then(|| positions.clone()),
            };
            let reading = state.as_ref().map(|positions| JointReading {
                names: &names,
                positions,
                velocities: &[],
                source: 0,
                stamp_age: None,
            });
            let goals = if matches!(number, 100 | 2000) { vec![rig::reading(&goal, 0)] } else { Vec::new() };
            let recorded = recording.map(|recording| vec![recording[number as usize].figures]);
            let joint_states = reading.into_iter().map(|reading| (0, reading)).collect();
            let mut inputs =
                Inputs { joint_states, goals, recorded: recorded.unwrap_or_default(), ..Inputs::default() };
            let command = servo.cycle(period * (number + 1), &mut inputs).unwrap().to_vec();
            positions
                .iter_mut()
                .zip(&command)
                .for_each(|(angle, speed)| *angle += speed * period.as_secs_f64());
            Recorded { positions: state, figures: *servo.arm_figures().next().unwrap(), command }
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
