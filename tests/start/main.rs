//! How one begins: a configuration, a demonstration, what the shell needs, and pages.

mod demo;
mod init;
mod pages;
#[path = "../common/place.rs"]
mod place;
mod shell;
