//! The diagnosis: its intervals and false alarms, and `gyroid gap` and effects as a user meets them.

mod bad_input;
mod bench_command;
#[path = "../common/cases.rs"]
mod cases;
mod command;
mod coverage;
mod custom;
mod custom_drive;
mod drive_command;
mod effects_command;
mod false_alarms;
mod fleet;
mod hard_stops;
mod invariance;
mod loads;
#[path = "../common/place.rs"]
mod place;
mod plan;
mod power;
mod replay;
mod rest;
mod robots;
mod twin;
mod written_back;
