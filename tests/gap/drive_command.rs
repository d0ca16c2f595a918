//! `gyroid gap diagnose` of a drive, as a user runs it.

use assert_cmd::Command;
use gyroid::config::Config;
use gyroid::gap::Answer;
use gyroid::gap::answer::Verdict;
use std::path::Path;

const ROBOT: &str = include_str!("../common/robot.toml");
const SCALE: &str = "[[effect]]\nid = \"gyro.scale_factor\"\nrelative = 0.012\n";

fn gyroid() -> Command {
    Command::cargo_bin("gyroid").unwrap()
}

/// Exit code, standard output, standard error.
fn run(command: &mut Command) -> (i32, String, String) {
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

fn drives(dir: &Path, effects: &str) {
    std::fs::write(dir.join("sim.toml"), ROBOT).unwrap();
    std::fs::write(dir.join("real.toml"), format!("{ROBOT}{effects}")).unwrap();
    for (name, seed) in [("fit", "21"), ("hold", "22")] {
        let out = format!("{name}.parquet");
        let line = ["simulate", "real.toml", "--course", "random", "--duration", "80", "--seed", seed, "-o", &out];
        let (code, _, error) = run(gyroid().current_dir(dir).args(line));
        assert_eq!(code, 0, "{error}");
    }
}

fn diagnose(dir: &Path, line: &[&str]) -> (i32, String, String) {
    run(gyroid().current_dir(dir).args(["gap", "diagnose"]).args(line))
}

fn read(path: &Path) -> Answer {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_scale_factor_is_pinpointed_named_measured_written_and_drawn() {
    let dir = tempfile::tempdir().unwrap();
    drives(dir.path(), SCALE);
    let line = "sim.toml --fit fit.parquet --hold hold.parquet --json a.json --write-sim augmented.toml --plot a.png --why why.md";
    let (code, text, error) = diagnose(dir.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!(code, 0, "{error}");
    let parts = [
        "IDENTIFIED: gyro scale factor",
        "1. Where",
        "2. Which",
        "3. How far",
        "filter: heading off after 5 s, rms, deg",
        "4. What to do",
    ];
    let mut from = 0;
    for part in parts {
        from += text[from..].find(part).unwrap_or_else(|| panic!("{part:?} is missing or too early in\n{text}"));
    }
    let answer = read(&dir.path().join("a.json"));
    assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Identified, Some("gyro.scale_factor")));
    // the trail leads from the drive to the same verdict
    let why = std::fs::read_to_string(dir.path().join("why.md")).unwrap();
    for heading in ["Screening", "Preprocessing", "Sets", "Leaving one out", "Probabilities", "Hold-out"] {
        let own = why.split("\n## ").find(|part| part.lines().next().is_some_and(|line| line.ends_with(heading)));
        let own = own.unwrap_or_else(|| panic!("{heading:?} is missing in\n{why}"));
        let row = match heading {
            "Preprocessing" => "\n| taken | as recorded |",
            "Screening" => "\n| estimated | gyro.scale_factor |",
            _ => "\n| taken | gyro.scale_factor |",
        };
        assert!(own.contains(row), "{own}");
    }
    let effect = &answer.effects[0];
    let (estimate, std) = (effect.parameters["relative"], effect.std["relative"]);
    assert!((estimate - 0.012).abs() < 4.0 * std, "{estimate} ± {std}");
    let [low, high] = effect.gap_closed_ci95.unwrap();
    assert!(low <= 1.0 && high > 0.9 && effect.gap_closed.unwrap() > 0.9, "{effect:?}");
    let place = answer.place.unwrap();
    assert_eq!((place.channel.as_str(), place.condition.as_deref()), ("gyro", Some("yaw_rate")));
    // before any name: a correction that follows the yaw rate
    assert_eq!(answer.equations[0].follows, "yaw_rate");
    let score = &answer.gap[0];
    assert!(score.metric == "log_score" && score.after > score.before, "{score:?}");
    let augmented = Config::read(dir.path().join("augmented.toml")).unwrap();
    assert_eq!(augmented.effects[0].id, "gyro.scale_factor");
    assert!(std::fs::read(dir.path().join("a.png")).unwrap().starts_with(b"\x89PNG"));
    let replay = ["simulate", "augmented.toml", "--inputs", "hold.parquet", "--seed", "1", "-o", "predicted.parquet"];
    assert_eq!(run(gyroid().current_dir(dir.path()).args(replay)).0, 0);

    // an effect that the library does not know is no excuse for naming another
    let line = "sim.toml --fit fit.parquet --without gyro.scale_factor gyro.scale_asymmetry --json b.json --quiet";
    assert_eq!(diagnose(dir.path(), &line.split(' ').collect::<Vec<_>>()).0, 0);
    let answer = read(&dir.path().join("b.json"));
    assert!(answer.main.as_deref() != Some("gyro.scale_factor"));
}

#[test]
fn a_drive_without_a_gap_and_columns_by_other_names() {
    let dir = tempfile::tempdir().unwrap();
    drives(dir.path(), "");
    let (code, text, error) = diagnose(dir.path(), &["sim.toml", "--fit", "fit.parquet", "--json", "a.json"]);
    assert_eq!(code, 0, "{error}");
    assert!(text.contains("NO GAP") && text.contains("No recording was held out"), "{text}");
    let answer = read(&dir.path().join("a.json"));
    assert!(answer.place.is_none() && answer.together.is_empty());

    let (code, _, error) = diagnose(dir.path(), &["sim.toml", "--fit", "fit.parquet", "--map", "wheel_left_rad_s=wl"]);
    assert!(code == 1 && error.contains("wl") && error.contains("fit.parquet"), "{error}");
    std::fs::write(
        dir.path().join("few.csv"),
        "t_s,gyro_z_rad_s,wheel_left_rad_s,wheel_right_rad_s\n0,0,0,0\n0.01,0,0,0\n",
    )
    .unwrap();
    let (code, _, error) = diagnose(dir.path(), &["sim.toml", "--fit", "few.csv"]);
    assert!(code == 1 && error.contains("few.csv") && error.contains("2 rows"), "{error}");
}
