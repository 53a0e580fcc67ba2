//! Reproduces the results of the paper, and adds further results.

use super::claim::Claim;
use super::claims::{Evidence, claims};
use super::comparison::{Row, comparison};
use super::figures::Runs;
use super::gain_sweep::gain_sweep;
use super::{Laboratory, LogarithmEquations, PaperError, PoseEquations, base_shift, figures, wrong_sign};
use dq_figures::{DrawError, Figure, Width};
use serde_json::{Map, Value, json};
use std::path::Path;

/// The reproduced results.
pub struct Reproduction {
    /// The figures `fig1` to `fig9` and the joint angles of section 4, then further figures.
    pub figures: Vec<Figure>,
    /// The comparison of section 8 of the paper.
    pub comparison: [Row; 4],
    /// The claims of the paper, with their verdicts.
    pub claims: Vec<Claim>,
    /// All numbers, for `results.json`.
    pub results: Value,
}

/// Runs all simulations of the paper and the further ones, judges the paper's claims, and draws the figures.
///
/// # Errors
/// [`PaperError`] if a simulation fails.
pub fn reproduce(lab: &Laboratory) -> Result<Reproduction, PaperError> {
    let runs = Runs::new(lab)?;
    let mut drawn = figures::all(lab, &runs)?;
    let comparison = comparison(lab, &runs)?;
    let figure4 = runs.task_space_logc.metrics();
    let start = lab.chain.forward_kinematics(&lab.experiment.theta_initial)?;
    let equations = LogarithmEquations::new(&start, &lab.goal()?);
    let pose = PoseEquations::new(&start);
    let (swept, sweep) = gain_sweep(lab)?;
    let evidence = Evidence {
        lab,
        runs: &runs,
        comparison: &comparison,
        theirs: &figure4,
        logarithms: &equations,
        pose: &pose,
        swept: &swept,
    };
    let claims = claims(&evidence)?;
    let (shifted, figures) = base_shift::base_shift(lab)?;
    drawn.extend(figures);
    let (departures, figure) = wrong_sign::wrong_sign(lab)?;
    drawn.extend([figure, sweep]);
    let data: Map<_, _> = drawn.iter().map(|figure| (figure.name.clone(), figure.data.clone())).collect();
    let results = json!({
        "constants": lab.experiment,
        "comparison": comparison,
        "claims": claims,
        "figure4": figure4,
        "equations_33_to_36": equations,
        "equations_13_31_32": pose,
        "gain_sweep": swept,
        "base_shift": shifted,
        "wrong_sign": departures,
        "figures": data,
    });
    Ok(Reproduction { figures: drawn, comparison, claims, results })
}

impl Reproduction {
    /// Writes the figures and `results.json` into `folder`. Creates the folder if necessary.
    ///
    /// # Errors
    /// [`DrawError`] if a file cannot be written.
    pub fn save(&self, folder: &Path) -> Result<(), DrawError> {
        dq_figures::save(&self.figures, folder, Width::Screen)?;
        dq_figures::write(&folder.join("results.json"), format!("{}\n", self.results).as_bytes())
    }
}
