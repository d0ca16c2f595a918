//! `gyroid completions`: what a shell needs to complete commands and options.

use super::outcome::Outcome;
use clap::{Args, Command};
use clap_complete::Shell;
use gyroid::Result;
use std::io::Write;

/// Print the completions of commands, options and their values for a shell
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid completions bash > ~/.local/share/bash-completion/completions/gyroid\n  \
    gyroid completions zsh > ~/.zfunc/_gyroid        (with fpath+=~/.zfunc before compinit in .zshrc)\n  \
    gyroid completions fish > ~/.config/fish/completions/gyroid.fish")]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: ShellName,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ShellName {
    Bash,
    Zsh,
    Fish,
}

/// Prints the completions of `program`.
pub(crate) fn run(args: &CompletionsArgs, mut program: Command) -> Result<Outcome> {
    let shell = match args.shell {
        ShellName::Bash => Shell::Bash,
        ShellName::Zsh => Shell::Zsh,
        ShellName::Fish => Shell::Fish,
    };
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut program, "gyroid", &mut text);
    let _ = std::io::stdout().lock().write_all(&text);
    Ok(Outcome::Done)
}
