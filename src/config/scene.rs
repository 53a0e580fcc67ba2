//! What the arm must keep out of, and its tool stay in, as parameters.

use dq_common::text::cut;
use dq_core::servo::{Arms, PositionLimits};
use dq_description::LIMB_RADIUS;
use dq_kinematics::arm::Chain;
use dq_params::{ParameterError, Parameters};
use dq_space::space::{
    Body, CapsuleError, KeepOut, KeepOutError, MOST_CAPSULES, MOST_KEEP_OUTS, Scene, SceneError,
};
use std::sync::Arc;

/// What the arm must keep out of, its tool stay in, and its body.
#[derive(Parameters)]
pub(super) struct SceneParameters {
    /// no link comes nearer than 1 cm to what is in keep_out, or to another link that it need not touch, and joints make up for those at
    /// their limits; false: the arm does not look where it goes
    #[parameter()]
    constraints: bool,
    /// what the arm must keep out of, in base_frame \[m\], each a name, a shape and its numbers: half_space nx ny nz offset, sphere x y z
    /// radius, box x y z lx ly lz, cylinder or capsule x y z radius length along z; after the last three qx qy qz qw or nothing; or hull and
    /// x y z of 4 to 100 points
    #[parameter()]
    keep_out: Vec<String>,
    /// what the tool must stay in, of two arms each tool, all of it at once: written as keep_out is
    #[parameter()]
    keep_in: Vec<String>,
    /// capsules around the links, each a joint or base, two points x y z in the frame that moves with it, z along the joint's axis, and a
    /// radius \[m\]; one number alone: the radius of one along each link; empty: 0.05; where nobody gives it: around the collision shapes of
    /// the robot description, if it has some
    #[parameter()]
    body: Vec<String>,
}

/// A scene that parameters give.
pub(super) struct GivenScene {
    /// The scene; none where constraints are off.
    pub in_force: Option<Arc<Scene>>,
    /// How many keep-outs and keep-ins are given although constraints are off.
    pub idle: usize,
}

impl SceneParameters {
    /// The scene of these arms, whose joints have these names in each. What is written wrongly is refused where constraints are off too.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`].
    pub fn build(
        &self,
        joints: &[String],
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
                format!("{MOST_KEEP_OUTS} at most, those of keep_in among them ({why})"),
            ),
        };
        let scene = Scene::new(self.body(joints, &chains)?, keep_outs, &chains, &ranges)
            .and_then(|scene| scene.staying_in(keep_ins, &chains, &ranges))
            .map_err(refused)?;
        let in_force = self.constraints.then(|| Arc::new(scene));
        Ok(GivenScene { idle: if in_force.is_none() { count } else { 0 }, in_force })
    }

    fn body(&self, joints: &[String], chains: &[Chain]) -> Result<Body, ParameterError> {
        match &self.body[..] {
            [] => Ok(Body::along(chains, LIMB_RADIUS)),
            [one] if !one.trim().contains(char::is_whitespace) => {
                let radius = one.trim().parse().ok().filter(|radius| (1e-3..=10.0).contains(radius));
                let expected = "capsules, or a radius from 0.001 to 10 m";
                let radius = radius.ok_or_else(|| ParameterError::invalid("body", one, expected))?;
                Ok(Body::along(chains, radius))
            }
            texts => Body::parse(texts, joints, chains.len()).map_err(|why| {
                ParameterError::invalid("body", format!("{:?}", why.text), CapsuleError::EXPECTED)
            }),
        }
    }
}

/// The keep-outs that the texts of a parameter give.
fn solids(parameter: &'static str, texts: &[String]) -> Result<Vec<KeepOut>, ParameterError> {
    let mut all: Vec<KeepOut> = Vec::new();
    for text in texts {
        let invalid = |why: KeepOutError| {
            ParameterError::invalid(parameter, format!("{:?}", cut(text)), why.expected())
        };
        let next: KeepOut = text.parse().map_err(invalid)?;
        if all.iter().any(|other| other.name == next.name) {
            return Err(ParameterError::invalid(parameter, text, "names that are not there twice"));
        }
        all.push(next);
    }
    Ok(all)
}
