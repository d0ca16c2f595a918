//! `gyroid man`: manual pages, made of the help.

use super::outcome::Outcome;
use super::output::{Common, Output};
use clap::{Args, Command};
use clap_mangen::Man;
use gyroid::files::{OutputFile, Plan, mark};
use gyroid::{Error, Result};
use std::io::Write;
use std::path::PathBuf;

/// Print the manual page, or write those of all commands into a folder
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid man | man -l -\n  \
    gyroid man -o ~/.local/share/man/man1\n  \
    man gyroid-gap-diagnose")]
pub(crate) struct ManArgs {
    /// Write a page for each command into this folder, which must be there
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// Prints or writes the pages of `root`.
pub(crate) fn run(args: &ManArgs, mut root: Command) -> Result<Outcome> {
    root.build();
    let Some(folder) = &args.out else {
        let output = Output::open(&args.common, "man", Plan::new())?;
        if output.talks() {
            let _ = std::io::stdout().lock().write_all(&page(root)?);
        }
        output.finish(&serde_json::json!({ "pages": [] }))?;
        return Ok(Outcome::Done);
    };
    let mut commands = Vec::new();
    collect(&root, &mut commands);
    let pages: Vec<(PathBuf, Command)> =
        commands.into_iter().map(|c| (folder.join(format!("{}.1", name(&c))), c)).collect();
    let plan = Plan::new().writes("--out", pages.iter().map(|(path, _)| path));
    let output = Output::open(&args.common, "man", plan)?;
    let claimed = pages.into_iter().map(|(path, command)| Ok((OutputFile::claim(path)?, command)));
    let claimed = claimed.collect::<Result<Vec<_>>>()?;
    let names: Vec<String> = claimed.iter().map(|(file, _)| file.target().display().to_string()).collect();
    for (mut file, command) in claimed {
        file.write_all(&page(command)?)?;
        file.commit()?;
    }
    output.say(format!("wrote {} pages: man -l {}", names.len(), names.first().map_or("", String::as_str)));
    output.finish(&serde_json::json!({ "pages": names }))?;
    Ok(Outcome::Done)
}

/// A command and those below it, without the one that clap adds to explain the others.
fn collect(command: &Command, into: &mut Vec<Command>) {
    into.push(command.clone());
    command.get_subcommands().filter(|c| c.get_name() != "help").for_each(|c| collect(c, into));
}

/// `gyroid-gap-diagnose`
fn name(command: &Command) -> String {
    command.get_display_name().unwrap_or(command.get_name()).to_string()
}

/// The page, with the mark by which gyroid knows it.
fn page(command: Command) -> Result<Vec<u8>> {
    let title = name(&command);
    let mut page = format!(".\\\" {}\n", mark::text()).into_bytes();
    let io = |e: std::io::Error| Error::io(format!("{title}.1"), &e);
    Man::new(command).title(title.to_uppercase()).render(&mut page).map_err(io)?;
    // a command's examples are all that its help has beside the options
    let page = String::from_utf8_lossy(&page).replace(".SH EXTRA\nExamples:\n", ".SH EXAMPLES\n");
    Ok(page.replace(".SH EXTRA\nExample:\n", ".SH EXAMPLES\n").into_bytes())
}
