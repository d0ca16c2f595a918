//! `gyroid gap bench`: what a user sees of making and scoring a bench.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;

fn gyroid(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let out = Command::cargo_bin("gyroid").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (out.status.code().unwrap(), text(&out.stdout), text(&out.stderr))
}

#[test]
fn a_bench_is_made_and_scored_and_its_seal_holds() {
    let root = tempfile::tempdir().unwrap();
    let at = root.path();
    let (code, said, error) =
        gyroid(at, &["gap", "bench", "make", "b", "--cases", "4", "--seed", "3", "--none", "0.5"]);
    assert_eq!(code, 0, "{error}");
    let committed = fs::read_to_string(at.join("b/commitment.txt")).unwrap();
    assert!(said.contains(committed.trim()), "{said}");
    let bench: Value = serde_json::from_slice(&fs::read(at.join("b/bench.json")).unwrap()).unwrap();
    assert_eq!((&bench["seed"], &bench["mix"]["cases"]), (&3.into(), &4.into()));
    // the key lies beside the folder, not in it
    assert!(at.join("b.key").is_file() && !at.join("b/b.key").exists());

    // no answers yet: all are missing, and count as wrong
    let arguments = ["gap", "bench", "score", "b", "--answers", "out", "--key", "b.key", "--json", "-"];
    let (code, said, error) = gyroid(at, &arguments);
    assert_eq!(code, 0, "{error}");
    let score: Value = serde_json::from_str(&said).unwrap();
    assert_eq!((&score["cases"], &score["missing"]), (&4.into(), &4.into()));

    fs::create_dir(at.join("out")).unwrap();
    for i in 0..4 {
        let answer = r#"{"verdict": "none", "none_probability": 0.6, "unknown_probability": 0.1, "effects": []}"#;
        fs::write(at.join(format!("out/stationary-{i:06}.json")), answer).unwrap();
    }
    let plots = ["--plots", "pictures"];
    let (code, said, _) =
        gyroid(at, &[&["gap", "bench", "score", "b", "--answers", "out", "--key", "b.key"][..], &plots].concat());
    assert_eq!(code, 0);
    let line = said.lines().find(|l| l.starts_with("no effect: said none")).unwrap();
    assert!(line.contains("2/2 = 1.000"), "{line}");
    assert!(at.join("pictures/reliability.svg").is_file() && at.join("pictures/confusion.png").is_file());

    // another key, another commitment, changed labels
    fs::write(at.join("other.key"), "ab".repeat(32)).unwrap();
    let with = |more: &[&str]| gyroid(at, &[&["gap", "bench", "score", "b", "--answers", "out"], more].concat());
    let (code, _, error) = with(&["--key", "other.key"]);
    assert!(code == 1 && error.contains("does not open"), "{error}");
    let (code, _, error) = with(&["--key", "b.key", "--commitment", &"0".repeat(64)]);
    assert!(code == 1 && error.contains("not the labels that were committed to"), "{error}");
    let mut sealed = fs::read(at.join("b/labels.sealed")).unwrap();
    sealed[100] ^= 4;
    fs::write(at.join("b/labels.sealed"), sealed).unwrap();
    assert_eq!(with(&["--key", "b.key"]).0, 1);
}

#[test]
fn a_folder_is_not_overwritten_and_shares_must_add_up() {
    let root = tempfile::tempdir().unwrap();
    let at = root.path();
    fs::create_dir(at.join("b")).unwrap();
    fs::write(at.join("b/mine.txt"), "mine").unwrap();
    let (code, _, error) = gyroid(at, &["gap", "bench", "make", "b", "--cases", "2"]);
    assert!(code == 2 && error.contains("not empty"), "{error}");
    let (code, _, error) =
        gyroid(at, &["gap", "bench", "make", "c", "--cases", "2", "--none", "0.6", "--pairs", "0.6"]);
    assert!(code == 2 && error.contains("add up"), "{error}");
    assert!(!at.join("c.key").exists(), "no key to what was not made");
}
