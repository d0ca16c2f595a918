//! `--fit`, `--hold`, `--sim`, `--real`, `--run`: each time the option is given, a drive begins; the files behind it are the sensors
//! of that drive.

use crate::cli::log_args::ColumnArgs;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches, value_parser};
use gyroid::ErrorKind;
use gyroid::config::Config;
use gyroid::signal::Log;
use std::path::PathBuf;

fn logs(id: &'static str) -> Arg {
    Arg::new(id).long(id).value_name("LOG").num_args(1..).action(ArgAction::Append).value_parser(value_parser!(PathBuf))
}

fn given(matches: &ArgMatches, id: &str) -> Vec<Vec<PathBuf>> {
    let drives = matches.get_occurrences::<PathBuf>(id).into_iter().flatten();
    drives.map(|files| files.cloned().collect()).collect()
}

// written out: the derive lays the files of all occurrences together
macro_rules! recordings {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $id:ident: $required:literal, $help:literal;)+ }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Default)]
        pub(crate) struct $name {
            $($(#[$doc])* pub $id: Vec<Vec<PathBuf>>,)+
        }

        impl Args for $name {
            fn augment_args(command: Command) -> Command {
                command$(.arg(logs(stringify!($id)).required($required).help($help)))+
            }

            fn augment_args_for_update(command: Command) -> Command {
                Self::augment_args(command)
            }
        }

        impl FromArgMatches for $name {
            fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
                Ok(Self { $($id: given(matches, stringify!($id)),)+ })
            }

            fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
                *self = Self::from_arg_matches(matches)?;
                Ok(())
            }
        }
    };
}

recordings! {
    /// The recordings of a diagnosis.
    Recordings {
        /// To diagnose from: drives, each of its files.
        fit: true,
            "Recording to diagnose from, in any format that `gyroid inspect` reads; of a drive, several files on \
             one clock. Given again, another drive of the same robot: all are fitted together";
        /// Held out.
        hold: false,
            "Another recording of the same unit, only to measure how far the gap shrinks; of a drive, several files, \
             and given again, several drives";
    }
}

recordings! {
    /// Logs of a simulator and recordings.
    Sides {
        /// Runs of the simulator, each of its files.
        sim: true,
            "Log of the simulator, in any format that `gyroid inspect` reads; several files on one clock are sensors of one \
             run. Given again, another run: what varies between runs is what the simulator's own chance makes";
        /// Recordings, each of its files.
        real: true, "Recording of the robot, its files likewise. Given again, another drive of the same robot";
        /// Held out.
        hold: false, "Another recording of the same robot, only to measure how far the gap shrinks";
    }
}

recordings! {
    /// Further runs of a simulator.
    Runs {
        /// Each of its files.
        run: false, "Another run of the same simulator, its files behind it; may be given more than once";
    }
}

/// Reads the files of one drive as a log named by them; what the reader decided, and was not said before, goes to `notes`.
pub(super) fn read_drive(
    (columns, map): (&ColumnArgs, &[String]),
    (option, paths): (&str, &[PathBuf]),
    config: &Config,
    notes: &mut Vec<String>,
) -> gyroid::Result<Log> {
    let recording = columns.read_drive(map, paths, config)?;
    if let Some(file) = recording.repeats.first() {
        let found = "its channels are all in the files before it, and files after one option are sensors of one drive";
        return Err(gyroid::Error::new(ErrorKind::Usage, file, found)
            .hint(format!("if it is another drive, give the option again: {}", apart(option, paths))));
    }
    for note in recording.notes {
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    let mut log = recording.log;
    log.source = shown(paths);
    Ok(log)
}

/// As the command line has drives of one file each.
fn apart(option: &str, paths: &[PathBuf]) -> String {
    paths.iter().map(|p| format!("{option} {}", p.display())).collect::<Vec<_>>().join(" ")
}

pub(super) fn shown(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}
