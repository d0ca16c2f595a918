//! `gyroid demo`: what it shows is what its commands do.

use crate::place::Place;
use serde_json::Value;

#[test]
fn its_commands_do_what_it_shows_and_close_the_gap() {
    let place = Place::with(&[]);
    let said = place.ok("demo -o shown --json demo.json");
    let json: Value = serde_json::from_str(&place.read("demo.json")).unwrap();
    let steps = json["steps"].as_array().unwrap();
    let codes: Vec<i64> = steps.iter().map(|s| s["exit_code"].as_i64().unwrap()).collect();
    // before the finding the filter is not fit for use
    assert_eq!(codes, [0, 0, 0, 0, 3, 0, 0]);
    for name in ["gyroid.toml", "before.png", "gap.png", "gap.html", "why.md", "augmented.toml", "after.png"] {
        assert!(place.has(&format!("shown/{name}")), "{name}");
    }
    let gap: Value = serde_json::from_str(&place.read("shown/gap.json")).unwrap();
    assert_eq!(gap["schema"], "gyroid.gap.diagnose/1");
    for part in [
        "FIT FOR USE",
        "IDENTIFIED: gyro scale factor",
        "on the recording held out",
        "without the effects",
        "(exit code 3)",
        "gyroid inspect LOG",
        "All files are in",
    ] {
        assert!(said.contains(part), "{part} in\n{said}");
    }

    // typed one by one, they write the same files
    let typed = Place::with(&[]);
    for name in ["robot.toml", "real.toml", "withheld.toml"] {
        typed.write(name, &place.read(&format!("shown/{name}")));
    }
    let shown: Vec<&str> = said.lines().filter_map(|l| l.strip_prefix("$ gyroid ")).collect();
    assert_eq!(shown.len(), steps.len());
    for (line, code) in shown.iter().zip(codes) {
        let output = typed.run(line);
        assert_eq!(i64::from(output.status.code().unwrap()), code, "{line}");
        let text = String::from_utf8(output.stdout).unwrap();
        // what is shown of it was printed
        let from = said.split(&format!("$ gyroid {line}\n")).nth(1).unwrap();
        let of_it: Vec<&str> = from
            .lines()
            .take_while(|l| !l.is_empty())
            .filter(|l| !l.contains("[...]") && !l.starts_with("(exit"))
            .collect();
        assert!(!of_it.is_empty(), "{line}");
        of_it.iter().for_each(|l| assert!(text.lines().any(|own| own == *l), "{l:?} is not in\n{text}"));
    }
    for name in ["gyroid.toml", "augmented.toml", "gap.json"] {
        assert_eq!(typed.read(name), place.read(&format!("shown/{name}")), "{name}");
    }

    // what it wrote it may replace; a file of the user's stays
    for entry in std::fs::read_dir(place.path("shown")).unwrap() {
        let path = entry.unwrap().path();
        assert!(gyroid::files::mark::is_own(&path), "{}", path.display());
    }
    place.write("shown/robot.toml", "mine");
    place.refused("demo -o shown", 1, &["robot.toml", "gyroid did not write it"]);
    place.refused("demo -o demo.json", 1, &["demo.json", "needs a folder"]);
    assert_eq!(place.read("shown/robot.toml"), "mine");
}
