//! Nothing of the user's is overwritten: an output is no input, and what gyroid did not write stays unless --force says so.

use crate::place::Place;

const SIM: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\n\
                   time_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 2e-4\n";

fn place() -> Place {
    let place = Place::with(&[("hand.toml", SIM)]);
    place.ok("simulate hand.toml --duration 1200 --seed 1 -o log.csv");
    place
}

#[test]
fn an_output_is_never_an_input_under_any_name() {
    let place = place();
    let log = place.read("log.csv");
    std::fs::create_dir(place.path("sub")).unwrap();
    let lines = [
        "fit log.csv -o log.csv",
        "fit log.csv -o sub/../log.csv",
        "fit log.csv --force -o ./log.csv",
        "fit log.csv --plot log.csv",
        "fit log.csv --json log.csv",
        "fit log.csv --base hand.toml -o hand.toml --force",
        "fit log.csv --results log.csv --force",
        "noise log.csv --json log.csv",
        "noise log.csv --config hand.toml --json hand.toml",
        "validate hand.toml log.csv --json log.csv",
        "validate hand.toml log.csv --json hand.toml",
        "export hand.toml --to kalibr -o hand.toml",
        "simulate hand.toml -o new.csv --json hand.toml",
        "simulate hand.toml --inputs log.csv -o log.csv",
        "navigate hand.toml log.csv -o log.csv",
        "study hand.toml --json hand.toml",
        "study --rest log.csv --json log.csv",
        "gap diagnose hand.toml --fit log.csv --write-sim hand.toml",
        "gap diagnose hand.toml --fit log.csv --hold log.csv --plot log.csv",
        "gap explain hand.toml --fit log.csv --effect gyro.tone --json log.csv",
        "inspect log.csv --json log.csv",
        "gap diagnose hand.toml --fit log.csv --why log.csv",
        "gap diagnose hand.toml --fit log.csv --json hand.toml",
        "navigate hand.toml log.csv --plot log.csv",
        "simulate hand.toml --truth hand.toml -o new.csv",
        "init --urdf log.csv -o log.csv",
        "init --sdf log.csv -o new.toml --json ./log.csv",
    ];
    for line in lines {
        place.refused(line, 2, &["is an input of this command", "hint: name another file"]);
        assert_eq!((place.read("log.csv"), place.read("hand.toml")), (log.clone(), SIM.to_string()), "{line}");
    }
}

#[cfg(unix)]
#[test]
fn links_are_seen_through() {
    let place = place();
    std::os::unix::fs::symlink(place.path("log.csv"), place.path("soft.csv")).unwrap();
    std::fs::hard_link(place.path("log.csv"), place.path("hard.csv")).unwrap();
    for name in ["soft.csv", "hard.csv"] {
        place.refused(&format!("fit log.csv --force -o {name}"), 2, &[name, "input of this command, as log.csv"]);
        place.refused(&format!("fit {name} --force -o log.csv"), 2, &["log.csv", &format!("as {name}")]);
    }
    // what is written through a link leaves the link where it is
    std::os::unix::fs::symlink(place.path("real.toml"), place.path("link.toml")).unwrap();
    place.ok("fit log.csv --no-plot -o real.toml");
    place.ok("fit log.csv --no-plot -o link.toml");
    assert!(place.path("link.toml").is_symlink() && !place.path("real.toml").is_symlink());
}

#[test]
fn two_outputs_are_two_files() {
    let place = place();
    place.refused("fit log.csv -o a.toml --json ./a.toml", 2, &["is written by --out too, as a.toml"]);
    place.refused("simulate hand.toml -o a.csv --truth a.csv", 2, &["--truth", "is written by --out too"]);
    assert!(!place.has("a.toml") && !place.has("a.csv"));
}

#[test]
fn a_file_of_the_user_stays_unless_force_says_so() {
    let place = place();
    place.write("notes.json", "{\"schema\": 1}\n");
    for line in ["fit log.csv --no-plot -o hand.toml", "fit log.csv --json notes.json", "simulate hand.toml -o log.csv"]
    {
        let (hand, notes, log) = (place.read("hand.toml"), place.read("notes.json"), place.read("log.csv"));
        // the log does not exist for a command that has not read it yet
        let line = line.replace("fit log.csv", "fit no.csv");
        place.refused(&line, 1, &["gyroid did not write it", "--force"]);
        assert_eq!((place.read("hand.toml"), place.read("notes.json"), place.read("log.csv")), (hand, notes, log));
    }
    // the picture beside the configuration too
    place.write("g.png", "mine");
    place.refused("fit log.csv -o g.toml", 1, &["g.png", "--plot", "--force"]);
    assert!(!place.has("g.toml"));
    place.ok("fit log.csv -o g.toml --force");
    assert!(place.has("g.toml") && std::fs::read(place.path("g.png")).unwrap().starts_with(b"\x89PNG"));
    place.ok("simulate hand.toml --duration 60 -o log.csv --force");
}

#[test]
fn what_gyroid_wrote_it_replaces_unasked_until_somebody_changes_it() {
    let place = place();
    let lines = [
        "fit log.csv --plot a.svg --plot a.png --json a.json -o a.toml",
        "simulate hand.toml --duration 60 -o a.parquet",
        "export a.toml --to kalibr -o a.yaml",
        "export a.toml --to gazebo -o a.sdf",
        "fit log.csv --results r.parquet",
        "noise log.csv --draws 199 --write a.toml",
    ];
    for line in lines.iter().chain(&lines) {
        place.ok(line);
    }
    for name in ["a.toml", "a.svg", "a.json", "a.yaml"] {
        assert!(gyroid::files::mark::is_own(&place.path(name)), "{name}");
    }
    let changed = place.read("a.toml").replacen("c1_rad_s = ", "c1_rad_s = 1", 1);
    place.write("a.toml", &changed);
    place.refused("fit log.csv --no-plot -o a.toml", 1, &["a.toml", "changed since"]);
    assert_eq!(place.read("a.toml"), changed);
    // a table of results goes on where it stopped, also as CSV, which has no mark
    place.ok("fit log.csv --results r.csv");
    place.refused("fit log.csv --results r.csv", 1, &["r.csv", "--force"]);
    place.ok("fit log.csv --results r.csv --resume");
}

#[test]
fn json_says_what_it_is() {
    let place = place();
    for (line, schema) in [
        ("fit log.csv --json -", "gyroid.fit/1"),
        ("inspect log.csv --json -", "gyroid.inspect/1"),
        ("validate hand.toml log.csv --level 0.0011 --json -", "gyroid.validate/1"),
        ("simulate hand.toml --duration 60 -o a.parquet --json -", "gyroid.simulate/1"),
    ] {
        let out = place.run(line).stdout;
        let json: serde_json::Value = serde_json::from_slice(&out).unwrap();
        assert_eq!(json["schema"], schema, "{line}");
        assert!(json.as_object().unwrap().len() > 1);
    }
}

#[cfg(unix)]
#[test]
fn a_device_is_no_file_to_write() {
    let place = place();
    place.refused("fit log.csv --json /dev/null", 1, &["/dev/null", "device"]);
}
