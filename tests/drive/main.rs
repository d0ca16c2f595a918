//! The diagnosis of drives: every effect, what is known of it, what resembles it, and `gyroid gap diagnose` of a drive.

#[path = "../common/cases.rs"]
mod cases;
mod command;
mod correction;
mod effects;
mod known;
mod laws;
mod reference;
mod resemblance;
mod several;
mod sizes;
