//! The command line `gyroid`. All talking happens in `cli`; the library is silent.
#![forbid(unsafe_code)]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
