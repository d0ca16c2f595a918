//! Files for firmware: compiled as strictly as they are said to be, and run beside the library.

use super::*;
use assert_cmd::Command;
use gyroid::bias::{Discrete, Scheme};

/// Samples after which the error is compared; `SKIPPED` more are then skipped.
const SAMPLES: [usize; 4] = [1, 1000, 60_000, 300_000];
const SKIPPED: u64 = 12_345;

/// Writes the file for `target`; the recursion of the library.
fn written(folder: &Path, target: &str, file: &str) -> Discrete {
    let out = folder.join(file);
    let config = fixture("full.toml");
    let (code, _, err) = run(gyroid().arg("export").arg(config).args(["--to", target, "-o"]).arg(&out));
    assert_eq!(code, 0, "{err}");
    let gyro = full().gyro.unwrap();
    Discrete::new(&gyro.warm_up(), 1.0 / RATE_HZ, gyro.discrete.map_or(Scheme::Exact, |d| d.scheme)).unwrap()
}

/// Standard output of a program that succeeds and complains of nothing.
fn output(command: &mut Command) -> String {
    let (code, text, said) = run(command);
    assert_eq!((code, &*said), (0, ""), "{command:?}: {text}");
    text
}

fn printed(program: impl AsRef<std::ffi::OsStr>) -> Vec<f64> {
    output(&mut Command::new(program)).lines().map(|line| line.parse().unwrap()).collect()
}

/// `told`: the error after each of [`SAMPLES`], after [`SKIPPED`] more, and a corrected rate.
fn agree(told: &[f64], discrete: &Discrete) {
    let mut error = discrete.initial;
    let mut after = 0;
    for (k, told) in SAMPLES.iter().zip(told) {
        (after..*k).for_each(|_| error = discrete.step(error));
        after = *k;
        assert!((told - error).abs() <= f64::EPSILON * error.abs(), "{told} {error} after {k}");
    }
    let begin = discrete.initial;
    let stepped = (0..SKIPPED).fold(begin, |e, _| discrete.step(e));
    // each of so many steps rounds twice
    let rounding = 2.0 * f64::EPSILON * begin.abs().max(stepped.abs()) * SKIPPED as f64;
    assert!((told[SAMPLES.len()] - stepped).abs() < rounding, "{} {stepped}", told[SAMPLES.len()]);
    assert_eq!(told[SAMPLES.len() + 1], 0.25 - begin);
    assert_eq!(told.len(), SAMPLES.len() + 2);
}

#[test]
fn c_does_as_the_library_does_to_the_last_bit() {
    let place = tempfile::tempdir().unwrap();
    let discrete = written(place.path(), "c", "gyro_bias.h");
    let main = format!(
        "#include <stdio.h>\n#include \"gyro_bias.h\"\nint main(void) {{\n\
         const unsigned long at[] = {{{}}};\ngyro_bias b = gyro_bias_cold();\nunsigned long k = 0;\n\
         for (int i = 0; i < {}; i++) {{\nfor (; k < at[i]; k++) gyro_bias_correct(&b, 0.0);\n\
         printf(\"%.17g\\n\", b.error_rad_s);\n}}\n\
         b = gyro_bias_at(GYRO_BIAS_INITIAL_RAD_S);\ngyro_bias_skip(&b, {SKIPPED});\nprintf(\"%.17g\\n\", b.error_rad_s);\n\
         b = gyro_bias_cold();\nprintf(\"%.17g\\n\", gyro_bias_correct(&b, 0.25));\nreturn 0;\n}}\n",
        SAMPLES.map(|k| k.to_string()).join(", "),
        SAMPLES.len(),
    );
    fs::write(place.path().join("main.c"), main).unwrap();
    let program = place.path().join("main");
    let mut compile = Command::new("cc");
    compile.args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "main.c", "-o", "main"]);
    output(compile.current_dir(place.path()));
    agree(&printed(program), &discrete);
}

#[test]
fn rust_without_std_does_as_the_library_does_to_the_last_bit() {
    let place = tempfile::tempdir().unwrap();
    let discrete = written(place.path(), "rust", "gyro_bias.rs");
    let rustc = |arguments: &[&str]| {
        let mut compile = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into()));
        compile.args(["--edition", "2024", "-D", "warnings", "-O"]).args(arguments).current_dir(place.path());
        output(&mut compile);
    };
    fs::write(place.path().join("bare.rs"), "#![no_std]\npub mod gyro_bias;\n").unwrap();
    rustc(&["--crate-type", "lib", "bare.rs"]);
    let main = format!(
        "mod gyro_bias;\nuse gyro_bias::GyroBias;\nfn main() {{\n\
         let mut b = GyroBias::COLD;\nlet mut k = 0;\nfor at in {SAMPLES:?} {{\n\
         while k < at {{\nb.correct(0.0);\nk += 1;\n}}\nprintln!(\"{{:e}}\", b.error_rad_s);\n}}\n\
         let mut b = GyroBias::at(gyro_bias::INITIAL_RAD_S);\nb.skip({SKIPPED});\nprintln!(\"{{:e}}\", b.error_rad_s);\n\
         let mut b = GyroBias::COLD;\nprintln!(\"{{:e}}\", b.correct(0.25));\n}}\n"
    );
    fs::write(place.path().join("main.rs"), main).unwrap();
    rustc(&["main.rs"]);
    agree(&printed(place.path().join("main")), &discrete);
}
