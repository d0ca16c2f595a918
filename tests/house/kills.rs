//! Commands that are killed at any moment: each of their outputs is the old file or the new one, whole, and the next run of the
//! same command leaves nothing else in the folder.

use crate::cases::cases;
use crate::place::Place;
use gyroid::math::random::Stream;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SIM: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\n\
                   time_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 2e-4\n";
const OLD: &[u8] = b"old\n";

/// A command, and its outputs.
type Line = (&'static str, &'static [&'static str]);

const LINES: [Line; 10] = [
    ("simulate sim.toml --duration 20000 --seed 2 -o a.parquet --json a.json", &["a.parquet", "a.json"]),
    ("fit log.csv -o a.toml --plot a.svg --json a.json --html a.html", &["a.toml", "a.svg", "a.json", "a.html"]),
    ("noise log.csv --draws 199 --json a.json --plot a.png", &["a.json", "a.png"]),
    ("validate g.toml log.csv --json a.json", &["a.json"]),
    ("export g.toml --to kalibr -o a.yaml", &["a.yaml"]),
    ("navigate robot.toml drive.parquet -o a.csv --json a.json", &["a.csv", "a.json"]),
    ("inspect log.csv --json a.json", &["a.json"]),
    ("merge part.parquet -o a.csv --json a.json", &["a.csv", "a.json"]),
    ("init --kind driving -o a.toml", &["a.toml"]),
    ("gap explain robot.toml --fit drive.parquet --effect wheel.radius_scale --json a.json", &["a.json"]),
];

fn place() -> Place {
    let place = Place::with(&[("sim.toml", SIM), ("robot.toml", include_str!("../common/robot.toml"))]);
    place.ok("simulate sim.toml --duration 1200 --seed 1 -o log.csv");
    place.ok("simulate robot.toml --course square --duration 30 -o drive.parquet");
    place.ok("fit log.csv --no-plot -o g.toml");
    place.ok("fit . --results part.parquet --accept");
    place
}

fn names(folder: &Path) -> Vec<std::ffi::OsString> {
    let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    names
}

/// Kills `line` this many times; returns how often it had not ended by itself.
fn killed(place: &Place, (line, outputs): &Line, kills: u64, draw: &mut Stream) -> u64 {
    let start = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gyroid"));
        command.current_dir(place.path("")).args(line.split(' ')).arg("--force");
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let begun = Instant::now();
    let code = start().wait().unwrap().code();
    let most_s = begun.elapsed().as_secs_f64();
    assert!(matches!(code, Some(0 | 3)), "{line}: {code:?}");
    let new: Vec<Vec<u8>> = outputs.iter().map(|o| fs::read(place.path(o)).unwrap()).collect();
    let sound = names(&place.path(""));
    let mut before_its_end = 0;
    for kill in 0..kills {
        let there = kill % 2 == 0;
        for output in *outputs {
            let path = place.path(output);
            if there { fs::write(path, OLD).unwrap() } else { fs::remove_file(path).unwrap_or_default() }
        }
        let mut child = start();
        std::thread::sleep(Duration::from_secs_f64(most_s * draw.uniform()));
        child.kill().unwrap();
        before_its_end += u64::from(child.wait().unwrap().code().is_none());
        for (output, new) in outputs.iter().zip(&new) {
            match fs::read(place.path(output)) {
                Ok(found) => assert!(found == *new || (there && found == OLD), "{line}: {output} after kill {kill}"),
                Err(_) => assert!(!there, "{line}: {output} is lost after kill {kill}"),
            }
        }
    }
    start().wait().unwrap();
    assert_eq!(names(&place.path("")), sound, "{line}");
    before_its_end
}

#[test]
fn a_killed_command_leaves_the_old_file_or_the_new_one() {
    let place = place();
    let mut draw = Stream::new(24, 0);
    let died: u64 = [&LINES[0], &LINES[1]].iter().map(|line| killed(&place, line, 6, &mut draw)).sum();
    // each with a chance of about one half or more: none in 12 would be a test that tests nothing
    assert!(died > 0);
}

#[test]
#[ignore = "minutes; cargo test battery -- --ignored"]
fn battery_of_kills() {
    let place = place();
    for (stream, line) in LINES.iter().enumerate() {
        let kills = cases(200);
        let died = killed(&place, line, kills, &mut Stream::new(24, stream as u64));
        println!("{died} of {kills} killed before the end: {}", line.0);
    }
}

#[test]
fn what_a_killed_command_left_is_cleared_by_the_next() {
    let place = place();
    place.write(".gyroid-Ab3xYz.tmp", "half");
    place.write(".gyroid-mine.tmp", "mine");
    place.ok("inspect log.csv --json a.json");
    assert!(!place.has(".gyroid-Ab3xYz.tmp") && place.has(".gyroid-mine.tmp") && place.has("a.json"));
}
