//! How much of a scene is measured in a cycle.

use super::*;
use crate::config::{NodeParameters, ServoParameters};
use crate::space::{Body, MEASURED};

const PERIOD: f64 = 0.01;

/// A cycle of the built-in arm, at rest, with 1 rad/s and 10 rad/s² for each joint, and so little deceleration that a stop goes far.
struct Cycle {
    settings: Settings,
    arms: Arms,
    positions: [f64; 6],
    link: Link,
    held_limits: HeldLimits,
}

impl Cycle {
    fn new() -> Self {
        let (parameters, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
        let ServoParameters { mut arms, joints, mut settings, period, .. } =
            ServoParameters::from_store(&parameters).unwrap();
        let limits = &mut settings.limits;
        limits.joint_velocity.fill(1.0);
        limits.joint_acceleration.fill(10.0);
        limits.joint_deceleration.fill(1.5);
        let positions = [0.0, 0.4, -0.8, 0.0, 0.6, 0.0];
        arms.evaluate(&positions);
        let link = Link::new(joints, &arms.joint_kinds(), period, settings.interface);
        let held_limits = HeldLimits::new(&settings.limits);
        Self { settings, arms, positions, link, held_limits }
    }

    /// Applies the filter to `velocity`, with a goal where the tool is.
    fn apply(&self, filter: &mut dyn Filter, mut velocity: [f64; 6]) {
        let given = Given {
            settings: &self.settings,
            arms: &self.arms,
            positions: &self.positions,
            by_tool: true,
            goal: Some(Towards { pose: self.arms.pose(), moving: None, gain_factor: 1.0, escape: None }),
            link: &self.link,
            before: &[0.0; 6],
            braking: self.link.braking(self.held_limits.each(), PERIOD),
            period: PERIOD,
        };
        filter.apply(&given, &mut velocity);
    }
}

/// Sixty hulls of a hundred points on a circle of that radius about the arm's base, and the built-in arm in capsules.
fn among_hulls(cycle: &Cycle, away: f64) -> Scene {
    let hull = |i: u32| {
        let (sin, cos) = (0.7 * f64::from(i)).sin_cos();
        let point = |k: u32| {
            let (up, turn) = (1.0 - (f64::from(k) + 0.5) / 50.0, 2.4 * f64::from(k));
            let across = 0.05 * (1.0 - up * up).sqrt();
            let z = 0.1 * f64::from(i % 6) - 0.2 + 0.05 * up;
            format!(" {} {} {z}", away * cos + across * turn.cos(), away * sin + across * turn.sin())
        };
        format!("hull{i} hull{}", (0..100).map(point).collect::<String>()).parse().unwrap()
    };
    let chains: Vec<_> = cycle.arms.chains().cloned().collect();
    Scene::new(Body::along(&chains, 0.05), (0..60).map(hull).collect(), &chains, &[(-3.0, 3.0); 6]).unwrap()
}

#[test]
fn what_is_far_is_not_measured_and_what_is_near_not_at_every_place_of_a_stop() {
    let mut counts = Vec::new();
    for away in [3.0, 0.75] {
        let mut cycle = Cycle::new();
        let scene = among_hulls(&cycle, away);
        let (mut constraints, mut stoppable) = (Constraints::new(6), Stoppable::new(6, PERIOD));
        constraints.set_scene(Some(&scene));
        stoppable.set_scene(Some(&scene));
        cycle.settings.scene = Some(std::sync::Arc::new(scene));
        for _ in 0..2 {
            let measured = |filter: &mut dyn Filter| {
                let before = MEASURED.get();
                cycle.apply(filter, [0.9, 0.4, -0.4, 0.3, 0.2, 0.1]);
                MEASURED.get() - before
            };
            counts.push((measured(&mut constraints), measured(&mut stoppable)));
        }
    }
    assert_eq!(counts[..2], [(0, 0); 2]);
    let (constraints, stoppable) = counts[3];
    // Once each pair was measured that a ball does not part.
    assert!((1..=25).contains(&constraints) && (1..=10).contains(&stoppable), "{counts:?}");
}
