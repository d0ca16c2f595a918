//! Faults around a command: disks, permissions, pipes, others who write at the same time, and logs with holes. The
//! table in docs/src/faults.md says the same.

use crate::place::Place;
use gyroid::ingest::{GyroQuery, read_gyro, read_log, write_log};
use gyroid::math::random::Stream;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, Ordering};

const SIM: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\n\
                   time_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 2e-4\n";
const ROWS: usize = 2401;

fn place() -> Place {
    let place = Place::with(&[("sim.toml", SIM)]);
    place.ok("simulate sim.toml --duration 1200 --seed 1 -o log.csv");
    place
}

/// Runs a line of the shell, in which `gyroid` is the program.
fn shell(place: &Place, line: &str) -> Output {
    let line = line.replace("gyroid", env!("CARGO_BIN_EXE_gyroid"));
    Command::new("sh").args(["-c", &line]).current_dir(place.path("")).output().unwrap()
}

#[track_caller]
fn failed(output: &Output, parts: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(parts.iter().all(|part| text.contains(part)) && text.contains("hint: "), "{text}");
    assert!(text.lines().count() < 3, "{text}");
}

fn names(place: &Place) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(place.path("")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_full_disk_leaves_the_old_file_and_no_scraps() {
    let place = place();
    let before = (place.read("log.csv"), names(&place));
    for line in ["simulate sim.toml --duration 86400 -o log.csv --force", "fit log.csv --html log.csv.html --force"] {
        // the signal that would end the program is held back, as a full disk sends none
        let output = shell(&place, &format!("trap '' XFSZ; ulimit -f 2; exec gyroid {line}"));
        failed(&output, &["log.csv", "too large"]);
        assert_eq!((place.read("log.csv"), names(&place)), before, "{line}");
    }
    // a real disk, where a user may have one
    let full = "mount -t tmpfs -o size=64k none disk && gyroid simulate sim.toml --duration 86400 -o disk/a.parquet; \
                echo $? $(ls -A disk | wc -l)";
    fs::create_dir(place.path("disk")).unwrap();
    let output = shell(&place, &format!("unshare -rm sh -c '{full}'"));
    let text = String::from_utf8_lossy(&output.stderr);
    if text.contains("a.parquet") {
        assert!(text.contains("No space") && text.contains("hint: "), "{text}");
        assert_eq!(String::from_utf8_lossy(&output.stdout), "1 0\n");
    }
}

#[test]
fn folders_and_files_without_permission_are_named() {
    let place = place();
    if cfg!(target_os = "linux") {
        // nobody writes there, not even root
        failed(&shell(&place, "gyroid fit log.csv --no-plot -o /sys/a.toml"), &["/sys/a.toml", "cannot be written"]);
    }
    for (name, mode) in [("shut", 0o555), ("", 0o755)] {
        if !name.is_empty() {
            fs::create_dir(place.path(name)).unwrap();
        }
        fs::set_permissions(place.path(name), fs::Permissions::from_mode(mode)).unwrap();
    }
    fs::copy(place.path("log.csv"), place.path("secret.csv")).unwrap();
    fs::set_permissions(place.path("secret.csv"), fs::Permissions::from_mode(0o000)).unwrap();
    // root may do all, and is somebody else then
    let root = fs::write(place.path("shut/a"), "").is_ok();
    let run = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gyroid"));
        if root {
            command.uid(65_534).gid(65_534);
        }
        command.current_dir(place.path("")).args(line.split(' ')).output()
    };
    // the program itself may lie where others may not look
    let Ok(output) = run("fit log.csv --no-plot -o shut/a.toml") else { return };
    failed(&output, &["shut/a.toml", "cannot be written", "check its permissions"]);
    failed(&run("fit secret.csv --no-plot").unwrap(), &["secret.csv", "Permission denied", "check the permissions"]);
}

#[test]
fn a_reader_that_goes_away_is_no_fault() {
    let place = place();
    for line in ["inspect log.csv", "fit log.csv --no-plot", "noise log.csv --draws 199 --json -"] {
        let output = shell(&place, &format!("gyroid {line} | head -c 1; gyroid {line} | true"));
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.stdout.len() == 1 && !text.contains("panicked") && !text.contains("Broken pipe"), "{text}");
    }
}

#[test]
fn a_file_that_others_write_while_it_is_read_is_read_or_refused() {
    let place = place();
    let log = read_log(place.path("log.csv")).unwrap();
    write_log(place.path("log.parquet"), &log).unwrap();
    for name in ["log.csv", "log.parquet"] {
        let (path, whole) = (place.path(name), fs::read(place.path(name)).unwrap());
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            // in its place: cut off, grown, whole
            scope.spawn(|| {
                for i in (0..).take_while(|_| !done.load(Ordering::Relaxed)) {
                    fs::write(&path, &whole[..whole.len() * (i % 5 + 1) / 5]).unwrap();
                }
            });
            for _ in 0..60 {
                match read_gyro(&path, &GyroQuery::default()) {
                    Ok(read) => assert!(read.audit.rows <= ROWS),
                    Err(error) => assert!(error.to_string().contains(name) && error.hint.is_some(), "{error}"),
                }
            }
            done.store(true, Ordering::Relaxed);
        });
        // put in its place: the old one is read to its end
        fs::write(&path, &whole).unwrap();
        std::thread::scope(|scope| {
            let writer = scope.spawn(|| (0..20).try_for_each(|_| write_log(&path, &log)));
            for _ in 0..20 {
                assert_eq!(read_gyro(&path, &GyroQuery::default()).unwrap().audit.rows, ROWS);
            }
            writer.join().unwrap().unwrap();
        });
    }
}

#[test]
fn a_decoder_that_gives_up_is_an_error_and_prints_nothing_else() {
    let place = place();
    write_log(place.path("log.parquet"), &read_log(place.path("log.csv")).unwrap()).unwrap();
    let mut bytes = fs::read(place.path("log.parquet")).unwrap();
    let at = |bytes: &[u8], what: &[u8]| bytes.windows(what.len()).position(|w| w == what).unwrap();
    // a number where the footer's decoder takes a yes or no for granted, and no checksum that would tell before
    let footer = at(&bytes, b"CRC-32 of footer");
    bytes[footer] ^= 1;
    let minimum = bytes[footer..].windows(12).position(|w| (w[0], w[1], w[10], w[11]) == (0x28, 8, 0x18, 8)).unwrap();
    bytes[footer + minimum + 10] = 0x26;
    fs::write(place.path("bad.parquet"), bytes).unwrap();
    let output = shell(&place, "RUST_BACKTRACE=1 gyroid inspect bad.parquet");
    failed(&output, &["bad.parquet: footer: ", "the decoder gave up on its content"]);
}

#[test]
fn logs_with_holes_and_jumps_say_so() {
    let place = place();
    let text = place.read("log.csv");
    let (head, body) = text.split_once('\n').unwrap();
    let rows: Vec<(f64, &str)> =
        body.lines().map(|l| l.split_once(',').unwrap()).map(|(t, x)| (t.parse().unwrap(), x)).collect();
    let mut draw = Stream::new(24, 1);
    let there: Vec<bool> = rows.iter().map(|_| draw.uniform() > 0.1).collect();
    let all = || rows.iter().copied().enumerate();
    let moved = |from: usize, by: f64| all().map(|(i, (t, x))| (if i < from { t } else { t + by }, x)).collect();
    let order = |parts: &[std::ops::Range<usize>]| parts.iter().flat_map(|p| rows[p.clone()].to_vec()).collect();
    let back = &["time goes back", "--sort-time"][..];
    // name, rows, what is said, and what with --sort-time where it is refused without
    type Case<'a> = (&'a str, Vec<(f64, &'a str)>, &'a [&'a str], &'a [&'a str]);
    let logs: [Case<'_>; 6] = [
        ("forward", moved(1200, 600.0), &["1 gap", "10 min"], &[]),
        ("back", moved(1200, -100.0), back, &["repeated time stamps", "sorted"]),
        ("doubled", order(&[0..1200, 1000..ROWS]), back, &["200 repeated time stamps", "left out"]),
        ("disordered", order(&[0..800, 1200..1400, 800..1200, 1400..ROWS]), back, &["go back in time: sorted"]),
        ("lost", all().filter(|(i, _)| there[*i]).map(|(_, r)| r).collect(), &["gaps", "missing"], &[]),
        (
            "nan",
            all().map(|(i, (t, x))| (t, if i % 500 < 20 { "nan" } else { x })).collect(),
            &["100 rows without"],
            &[],
        ),
    ];
    for (name, rows, parts, sorted) in logs {
        let lines: String = rows.iter().map(|(t, x)| format!("{t},{x}\n")).collect();
        place.write(&format!("{name}.csv"), &format!("{head}\n{lines}"));
        let run = |options: &str| place.run(&format!("fit {name}.csv --no-plot{options}"));
        let output = run("");
        if sorted.is_empty() {
            let text = String::from_utf8_lossy(&output.stdout);
            assert!(matches!(output.status.code(), Some(0 | 3)), "{name}: {output:?}");
            assert!(parts.iter().all(|p| text.contains(p)), "{name}: {text}");
            continue;
        }
        failed(&output, parts);
        let text = String::from_utf8(run(" --sort-time").stdout).unwrap();
        assert!(sorted.iter().all(|p| text.contains(p)), "{name}: {text}");
    }
}
