//! The diagnosis of drives: every effect, what is known of it, and what resembles it.

#[path = "../../../../tests/common/cases.rs"]
pub(super) mod cases;
mod correction;
mod effects;
mod known;
mod laws;
mod reference;
mod resemblance;
mod several;
mod sizes;
