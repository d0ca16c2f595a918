//! The extended Kalman filter of a drive: its steps, its pass over the rows, innovations, and their sensitivity to every coefficient.

pub(crate) mod agility;
pub(crate) mod effect_set;
pub(crate) mod filter;
pub(crate) mod filter_pass;
pub(crate) mod innovations;
pub(crate) mod lasting;
pub(crate) mod models;
pub(crate) mod noise;
pub(crate) mod sensitivity;
pub(crate) mod slopes;
pub(crate) mod unknown_input;
