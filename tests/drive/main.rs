//! The diagnosis of drives: every effect, what is known of it, what resembles it, and `gyroid gap diagnose` of a drive.

mod command;
mod correction;
mod effects;
mod known;
mod laws;
mod reference;
mod resemblance;
mod several;
mod sizes;
