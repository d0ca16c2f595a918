//! The house as a whole: its modules, and what holds of the command line whatever the command.

mod book;
#[cfg(unix)]
#[path = "../common/cases.rs"]
mod cases;
mod circles;
#[cfg(unix)]
mod faults;
mod floors;
#[cfg(unix)]
mod kills;
mod misplaced;
mod output_files;
#[path = "../common/place.rs"]
mod place;
mod study_command;
