//! The keep-outs, keep-ins and body of an arm as parameters.

use dq_algebra::UnitDualQuaternion;
use dq_common::text::cut;
use dq_core::servo::{Arms, PositionLimits};
use dq_description::LIMB_RADIUS;
use dq_kinematics::arm::Chain;
use dq_params::{ParameterError, Parameters};
use dq_space::space::{
    Body, CapsuleError, KeepOut, KeepOutError, MOST_CAPSULES, MOST_KEEP_OUTS, Scene, SceneError,
};
use std::sync::Arc;

/// The keep-outs of the arm, the keep-ins of its tool, and its body.
#[derive(Parameters)]
pub(super) struct SceneParameters {
    /// keeps each link at least 1 cm away from keep-outs and from other links, except links that always touch; if a joint is at its
    /// limit, other joints compensate for it. false: the arm ignores its surroundings
    #[parameter()]
    constraints: bool,
    /// keep-outs of the arm, in base_frame \[m\]. Each text is a name, a shape and its numbers. half_space: nx ny nz offset;
    /// sphere: x y z radius; box: x y z lx ly lz; cylinder, capsule: x y z radius length; hull: x y z of each of 4 to 100 points.
    /// An orientation qx qy qz qw may follow a box, cylinder or capsule
    #[parameter()]
    keep_out: Vec<String>,
    /// keep-ins: the tool must stay inside all of them (both tools, if there are two arms). Written as in keep_out
    #[parameter()]
    keep_in: Vec<String>,
    /// capsules around the links \[m\]. Each text is a joint's name or base, two points x y z in the frame that moves with that
    /// joint (z along its axis), and a radius. A single number instead: the radius of a capsule along each link. Empty: 0.05. Not
    /// set: capsules around the collision shapes of the robot description, if it has any
    #[parameter()]
    body: Vec<String>,
}

/// The body of the right one of two arms, if it is not like the left arm's.
pub(super) struct RightBody {
    /// The texts of its capsules, as in the parameter `body`.
    pub texts: Vec<String>,
    /// The names of the joints that move the links.
    pub joints: Vec<String>,
    /// The pose of the right arm's base in the left arm's base frame.
    pub base: UnitDualQuaternion,
}

/// The scene that parameters describe.
pub(super) struct GivenScene {
    /// The scene; `None` if constraints are off.
    pub in_force: Option<Arc<Scene>>,
    /// Number of keep-outs and keep-ins that have no effect, because constraints are off.
    pub idle: usize,
}

impl SceneParameters {
    /// Builds the scene of these arms. `joints` are the names of the joints that move the links of the left arm. If the right arm
    /// has no body of its own, its body is like the left arm's. The function rejects invalid texts even if constraints are off.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`] for the first invalid text.
    pub fn build(
        &self,
        joints: &[String],
        right: Option<&RightBody>,
        arms: &Arms,
        limits: &PositionLimits,
    ) -> Result<GivenScene, ParameterError> {
        let chains: Vec<_> = arms.chains().cloned().collect();
        let (keep_outs, keep_ins) = (solids("keep_out", &self.keep_out)?, solids("keep_in", &self.keep_in)?);
        let (count, ranges): (_, Vec<_>) = (keep_outs.len() + keep_ins.len(), limits.ranges().collect());
        let refused = |why: SceneError| match &why {
            SceneError::Capsules(count) => ParameterError::invalid(
                "body",
                format!("{count} of them"),
                format!("{MOST_CAPSULES} at most"),
            ),
            SceneError::KeepOuts(_) => ParameterError::invalid(
                "keep_out",
                format!("{count} of them"),
                format!("at most {MOST_KEEP_OUTS}, including those of keep_in ({why})"),
            ),
        };
        let scene = Scene::new(self.body(joints, right, &chains)?, keep_outs, &chains, &ranges)
            .and_then(|scene| scene.staying_in(keep_ins, &chains, &ranges))
            .map_err(refused)?;
        let in_force = self.constraints.then(|| Arc::new(scene));
        Ok(GivenScene { idle: if in_force.is_none() { count } else { 0 }, in_force })
    }

    fn body(
        &self,
        joints: &[String],
        right: Option<&RightBody>,
        chains: &[Chain],
    ) -> Result<Body, ParameterError> {
        let left = UnitDualQuaternion::identity();
        let bodies = chains.iter().enumerate().map(|(number, chain)| match right {
            Some(RightBody { texts, joints, base }) if number > 0 => {
                body("right_body", texts, joints, base, chain)
            }
            _ => body("body", &self.body, joints, &left, chain),
        });
        Ok(Body::of_arms(bodies.collect::<Result<Vec<_>, _>>()?, chains))
    }
}

/// Returns the body of one arm from `texts`, the value of the parameter `parameter`. The arm's base is at `base`.
fn body(
    parameter: &'static str,
    texts: &[String],
    joints: &[String],
    base: &UnitDualQuaternion,
    chain: &Chain,
) -> Result<Body, ParameterError> {
    let along = |radius| Body::along(std::slice::from_ref(chain), radius);
    match texts {
        [] => Ok(along(LIMB_RADIUS)),
        [one] if !one.trim().contains(char::is_whitespace) => {
            let radius = one.trim().parse().ok().filter(|radius| (1e-3..=10.0).contains(radius));
            let expected = "capsules, or a radius from 0.001 to 10 m";
            radius.map(along).ok_or_else(|| ParameterError::invalid(parameter, one, expected))
        }
        texts => match Body::parse(texts, joints) {
            Ok(body) => Ok(body.standing_at(base)),
            Err(why) => {
                Err(ParameterError::invalid(parameter, format!("{:?}", why.text), CapsuleError::EXPECTED))
            }
        },
    }
}

/// Parses the texts of a parameter as keep-outs.
fn solids(parameter: &'static str, texts: &[String]) -> Result<Vec<KeepOut>, ParameterError> {
    let mut all: Vec<KeepOut> = Vec::new();
    for text in texts {
        let invalid = |why: KeepOutError| {
            ParameterError::invalid(parameter, format!("{:?}", cut(text)), why.expected())
        };
        let next: KeepOut = text.parse().map_err(invalid)?;
        if all.iter().any(|other| other.name == next.name) {
            return Err(ParameterError::invalid(parameter, text, "names that are not repeated"));
        }
        all.push(next);
    }
    Ok(all)
}
