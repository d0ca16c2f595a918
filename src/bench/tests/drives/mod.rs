//! The diagnosis of drives: every effect, what is known of it, and what resembles it.

mod correction;
mod effects;
mod known;
mod laws;
mod reference;
mod resemblance;
mod several;
mod sizes;
