//! Prints the motions in a bag, and replays its run through the servo's cycle, without DDS.

use dq_bags::Bag;
use dq_config::{ForArm, ServoParameters};
use dq_runs::{recorded, replay};
use std::error::Error;
use std::path::Path;

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_demo").to_owned();
    let bag = std::env::var("BAG").unwrap_or(demo);
    let recorded = recorded(Path::new(&bag), "run", &ServoParameters::for_arm("puma560")?)?;
    for run in &recorded.runs {
        for motion in &run.motions {
            let figures = &motion.figures;
            println!(
                "{}: {} in {:.2} s over {:.3} m",
                motion.law, motion.outcome, figures.elapsed, figures.path_length
            );
        }
    }
    for servo in replay(&mut Bag::open(Path::new(&bag))?)? {
        println!("{}: of {} commands {} differ when replayed", servo.node, servo.commands, servo.different);
    }
    Ok(())
}
