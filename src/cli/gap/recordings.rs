//! `--fit` and `--hold`: each time the option is given, a drive begins; the files behind it are the sensors of that drive.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches, value_parser};
use std::path::PathBuf;

const FIT: &str = "fit";
const HOLD: &str = "hold";

/// The recordings of a diagnosis.
#[derive(Debug, Clone, Default)]
pub(crate) struct Recordings {
    /// To diagnose from: drives, each of its files.
    pub fit: Vec<Vec<PathBuf>>,
    /// Kept back.
    pub hold: Vec<Vec<PathBuf>>,
}

fn logs(id: &'static str) -> Arg {
    Arg::new(id).long(id).value_name("LOG").num_args(1..).action(ArgAction::Append).value_parser(value_parser!(PathBuf))
}

// written out: the derive lays the files of all occurrences together
impl Args for Recordings {
    fn augment_args(command: Command) -> Command {
        command
            .arg(
                logs(FIT).required(true).help(
                    "Recording to diagnose from, in any format that `gyroid inspect` reads; of a drive, several files on \
                     one clock. Given again, another drive of the same robot: all are fitted together",
                ),
            )
            .arg(logs(HOLD).help(
                "Another recording of the same unit, only to measure how far the gap shrinks; of a drive, several files, \
                 and given again, several drives",
            ))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Recordings {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let of = |id: &str| {
            let drives = matches.get_occurrences::<PathBuf>(id).into_iter().flatten();
            drives.map(|files| files.cloned().collect()).collect()
        };
        Ok(Self { fit: of(FIT), hold: of(HOLD) })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
