//! The width of figures on the command line.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use dq_figures::Width;

/// The option `--width`.
#[derive(clap::Args)]
pub(super) struct FigureWidth {
    /// Width of the figures: for a screen, or for one column (3.4 in) or both columns (7.16 in) of a paper
    #[arg(long, default_value_t = Width::Screen, value_parser = PossibleValuesParser::new(Width::NAMES).try_map(|name| name.parse::<Width>()))]
    pub width: Width,
}
