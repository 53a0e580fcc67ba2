//! Tests of the largest latency at which each law is stable. The laws run alone, without the rest of the servo. The measured latency
//! must equal the latency by the formula of [`largest_rate`]. The test also checks that the table in the guide's page on timing is up
//! to date, and prints the rows that are missing.

use crate::reference::{parameters, theta};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Arms, largest_rate};
use dq_kinematics::control::{Controller, Law, LawMemory};
use std::collections::VecDeque;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(2);

/// The arm of the reference work (Sathuluri 2018) near the goal of that work. A law alone, without the rest of the servo, moves the arm.
struct Loop {
    arm: Arms,
    controller: Controller,
    goal: UnitDualQuaternion,
    theta: Vec<f64>,
}

impl Loop {
    fn new(law: Law) -> Self {
        let mut arm = parameters().arms;
        let theta = theta("theta_desired");
        arm.evaluate(&theta);
        let controller = Controller { law, ..parameters().settings.controller };
        Self { goal: arm.pose(), arm, controller, theta }
    }

    fn rate(&self) -> f64 {
        self.controller.fastest_rates(self.arm.state(), &self.goal).into_iter().fold(0.0, f64::max)
    }

    /// Returns whether a small error decays if the joint states that the law receives are `latency` cycles old.
    fn is_stable(&mut self, latency: usize) -> bool {
        let mut theta: Vec<_> =
            self.theta.iter().enumerate().map(|(i, angle)| angle + 1e-6 * (i as f64 - 2.0)).collect();
        let mut late: VecDeque<_> = std::iter::repeat_n(theta.clone(), latency).collect();
        let (mut speeds, mut last, mut memory) =
            (vec![0.0; theta.len()], vec![0.0; theta.len()], LawMemory::default());
        // Enough cycles for several oscillations at the limit of stability, each of which takes about four times the delay.
        let cycles = 120 * (latency + 1) + (20.0 / (self.rate() * PERIOD.as_secs_f64())) as usize;
        let mut largest = [0.0_f64; 2];
        for cycle in 0..cycles {
            late.push_back(theta.clone());
            self.arm.evaluate(&late.pop_front().unwrap());
            let before = (&*last, PERIOD.as_secs_f64());
            memory.joint_velocity(&self.controller, self.arm.state(), &self.goal, before, &mut speeds);
            last.copy_from_slice(&speeds);
            theta.iter_mut().zip(&speeds).for_each(|(angle, speed)| *angle += PERIOD.as_secs_f64() * speed);
            let speed = speeds.iter().fold(0.0_f64, |most, speed| most.max(speed.abs()));
            match cycle * 6 / cycles {
                2 => largest[0] = largest[0].max(speed),
                5 => largest[1] = largest[1].max(speed),
                _ => {}
            }
        }
        largest[1] < largest[0]
    }

    /// Returns the largest latency at which the loop is stable, in cycles.
    fn largest_latency(&mut self) -> usize {
        let (mut stable, mut unstable) = (0, (2.0 / (self.rate() * PERIOD.as_secs_f64())) as usize + 2);
        while unstable - stable > 1 {
            let middle = (stable + unstable) / 2;
            if self.is_stable(middle) { stable = middle } else { unstable = middle }
        }
        stable
    }
}

/// Returns the largest latency \[cycles\] at which a law of rate `rate` [1/s] is stable by the formula of [`largest_rate`].
fn by_formula(rate: f64) -> usize {
    (0..2000).take_while(|cycles| rate < largest_rate(PERIOD * *cycles, PERIOD)).count().saturating_sub(1)
}

#[test]
fn each_law_is_stable_up_to_the_latency_that_the_formula_says_as_the_guide_has_it() {
    let guide = include_str!("../../../guide/timing.md");
    let mut missing = String::new();
    for law in Law::ALL {
        let mut measured = Loop::new(law);
        let (rate, latency) = (measured.rate(), measured.largest_latency());
        let formula = by_formula(rate);
        assert!(
            latency.abs_diff(formula) <= 1 + formula / 50,
            "{}: {latency} and {formula} cycles",
            law.name()
        );
        let row = format!("| {} | {rate:.3} | {} | {} |\n", law.name(), 2 * latency, 2 * formula);
        if !guide.contains(&row) {
            missing.push_str(&row);
        }
    }
    assert_eq!(missing, "", "rows that the guide has not");
}
