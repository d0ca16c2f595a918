//! What the tests of the command line share.

use assert_cmd::Command;
use gyroid::math::random::Stream;
use std::path::{Path, PathBuf};

/// The program under test.
pub fn gyroid() -> Command {
    Command::new(env!("CARGO_BIN_EXE_gyroid"))
}

/// A file of the repository's data folder.
pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name)
}

/// Exit code, standard output, standard error.
pub fn run(command: &mut Command) -> (i32, String, String) {
    let out = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (out.status.code().unwrap(), text(out.stdout), text(out.stderr))
}

/// A CSV of a gyro warming up (C1 2e-3, C2 -5e-3 rad/s, T 200 s) at 2 Hz.
pub fn warm_up_csv(seed: u64, samples: usize) -> String {
    let mut draw = Stream::new(seed, 0);
    let mut text = String::from("t_s,gyro_z_rad_s\n");
    for i in 0..samples {
        let t = 0.5 * i as f64;
        let rate = -5e-3 - 2e-3 * (-t / 200.0).exp_m1() + 3e-4 * draw.normal();
        text += &format!("{t},{rate}\n");
    }
    text
}
