//! How one begins: a configuration, a demonstration, and what the shell needs.

mod demo;
mod init;
#[path = "../common/place.rs"]
mod place;
mod shell;
