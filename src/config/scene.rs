//! What the arm must keep out of, and its tool stay in, as parameters.

use dq_common::text::cut;
use dq_core::servo::{Arms, PositionLimits};
use dq_params::{Declarer, List, ParameterError};
use dq_space::space::{
    Body, CapsuleError, KeepOut, KeepOutError, MOST_CAPSULES, MOST_KEEP_OUTS, Scene, SceneError,
};
use std::sync::Arc;

/// The radius of what is around each link where nobody says what is \[m\].
pub(super) const RADIUS: f64 = 0.05;

/// What the arm must keep out of, by parameters.
pub(super) struct Given {
    /// None where constraints are off.
    pub scene: Option<Arc<Scene>>,
    /// How many keep-outs and keep-ins are given all the same then.
    pub idle: usize,
}

/// The scene of these arms, whose joints have these names in each. What is written wrongly is refused where constraints are off too.
pub(super) fn scene(
    p: &mut Declarer,
    joints: &[String],
    arms: &Arms,
    limits: &PositionLimits,
) -> Result<Given, ParameterError> {
    let constraints = p.boolean("constraints", false).live(
        "",
        "no link comes nearer than 1 cm to what is in keep_out, or to another link that it need not touch, and joints make up for those at their limits; false: the arm does not look where it goes",
    );
    let keep_out = p.strings("keep_out").live(
        "",
        "what the arm must keep out of, in base_frame [m], each a name, a shape and its numbers: half_space nx ny nz offset, sphere x y z radius, box x y z lx ly lz, cylinder or capsule x y z radius length along z; after the last three qx qy qz qw or nothing; or hull and x y z of 4 to 100 points",
    );
    let keep_in = p.strings("keep_in").live(
        "",
        "what the tool must stay in, of two arms each tool, all of it at once: written as keep_out is",
    );
    let body_texts = p.strings("body").live(
        "",
        "capsules around the links, each a joint or base, two points x y z in the frame that moves with it, z along the joint's axis, and a radius [m]; one number alone: the radius of one along each link; empty: 0.05; where nobody gives it: around the collision shapes of the robot description, if it has some",
    );
    let chains: Vec<_> = arms.chains().cloned().collect();
    let (keep_outs, keep_ins) = (solids(&keep_out)?, solids(&keep_in)?);
    let body = match body_texts.items() {
        [] => Body::along(&chains, RADIUS),
        [one] if !one.trim().contains(char::is_whitespace) => Body::along(&chains, radius(&body_texts, one)?),
        texts => Body::parse(texts, joints, chains.len())
            .map_err(|why| body_texts.invalid(format!("{:?}", why.text), CapsuleError::EXPECTED))?,
    };
    let (count, ranges): (_, Vec<_>) = (keep_outs.len() + keep_ins.len(), limits.ranges().collect());
    let refused = |why: SceneError| match &why {
        SceneError::Capsules(count) => {
            body_texts.invalid(format!("{count} of them"), format!("{MOST_CAPSULES} at most"))
        }
        SceneError::KeepOuts(_) => keep_out.invalid(
            format!("{count} of them"),
            format!("{MOST_KEEP_OUTS} at most, those of keep_in among them ({why})"),
        ),
    };
    let scene = Scene::new(body, keep_outs, &chains, &ranges)
        .and_then(|scene| scene.staying_in(keep_ins, &chains, &ranges))
        .map_err(refused)?;
    Ok(match constraints {
        true => Given { scene: Some(Arc::new(scene)), idle: 0 },
        false => Given { scene: None, idle: count },
    })
}

fn solids(list: &List<String>) -> Result<Vec<KeepOut>, ParameterError> {
    let mut all: Vec<KeepOut> = Vec::new();
    for text in list.items() {
        let invalid = |why: KeepOutError| list.invalid(format!("{:?}", cut(text)), why.expected());
        let next: KeepOut = text.parse().map_err(invalid)?;
        if all.iter().any(|other| other.name == next.name) {
            return Err(list.invalid(text, "names that are not there twice"));
        }
        all.push(next);
    }
    Ok(all)
}

fn radius(list: &List<String>, text: &str) -> Result<f64, ParameterError> {
    let radius = text.trim().parse().ok().filter(|radius| (1e-3..=10.0).contains(radius));
    radius.ok_or_else(|| list.invalid(text, "capsules, or a radius from 0.001 to 10 m"))
}
