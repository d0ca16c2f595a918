//! The house as a whole: its modules, and what holds of the command line whatever the command.

mod book;
mod circles;
mod floors;
mod misplaced;
mod output_files;
#[path = "../common/place.rs"]
mod place;
mod study_command;
