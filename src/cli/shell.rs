//! `dq_servo completions` and `dq_servo man`: prints files for the user's shell, generated from the command line's definition.

use super::Cli;
use clap::CommandFactory;
use clap_complete::Shell;
use std::io::Write;

#[derive(clap::Args)]
pub(super) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Prints the completions of every subcommand.
    pub fn run(&self) -> super::Result<()> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "dq_servo", &mut text);
        print(&text)
    }
}

/// Prints the manual page, in roff.
pub(super) fn man() -> super::Result<()> {
    let mut text = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut text)?;
    print(&text)
}

fn print(text: &[u8]) -> super::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text).and_then(|()| out.flush()).map_err(super::print::StdoutError::from)?;
    Ok(())
}
