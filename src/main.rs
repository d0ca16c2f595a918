//! The command line `gyroid`, which is in [`gyroid::cli`].
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    gyroid::cli::run(std::env::args_os()).into()
}
