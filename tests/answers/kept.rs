//! Answers of the program, and what they were.

use crate::place::Place;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Relative difference up to which numbers are the same.
const SAME: f64 = 1e-6;
/// Below that a number is what rounding leaves of zero.
const ZERO: f64 = 1e-21;
/// Lists longer than this are kept as their sum, root mean square, first and last number.
const LONG: usize = 8;
/// Keys that tell when, where and by what an answer was made.
const PROVENANCE: [&str; 9] =
    ["path", "sha256", "modified", "gyroid_version", "options", "size_bytes", "files", "curves", "trace"];

/// A file of the repository's data folder.
pub fn data(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name).display().to_string()
}

/// Every target of `gyroid export`.
pub fn targets() -> Vec<String> {
    let listed = Place::with(&[]).ok("export --list");
    let names = listed.lines().filter(|l| !l.starts_with(' ')).filter_map(|l| l.split_once(':'));
    names.map(|(name, _)| name.to_string()).collect()
}

/// The answers of one test.
pub struct Kept<'a> {
    place: &'a Place,
    file: PathBuf,
    was: Map<String, Value>,
    is: Map<String, Value>,
    differ: Vec<String>,
}

impl<'a> Kept<'a> {
    pub fn of(place: &'a Place, name: &str) -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/answers/{name}.json"));
        let was =
            std::fs::read_to_string(&file).map_or_else(|_| Map::new(), |text| serde_json::from_str(&text).unwrap());
        Self { place, file, was, is: Map::new(), differ: Vec::new() }
    }

    /// The JSON that a command answers.
    pub fn same(&mut self, name: &str, line: &str) {
        let output = self.place.run(&format!("{} --json -", line.trim_end()));
        let answer: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|e| panic!("{line}: {e}: {}", String::from_utf8_lossy(&output.stderr)));
        self.keep(name, shortened(&answer));
    }

    /// The text that a command prints, or its error.
    pub fn text(&mut self, name: &str, line: &str) {
        let output = self.place.run(line);
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        let dir = self.place.path("").display().to_string();
        let lines: Vec<String> = text.lines().filter(|l| !of_today(l)).map(|l| l.replace(&dir, "")).collect();
        self.keep(name, json!(lines));
    }

    /// A file of JSON that a command wrote.
    pub fn file(&mut self, name: &str, file: &str) {
        self.keep(name, shortened(&serde_json::from_str(&self.place.read(file)).unwrap()));
    }

    /// Rows of tables, and keys with their values, of a text that a command wrote.
    pub fn text_file(&mut self, name: &str, file: &str) {
        let text = self.place.read(file);
        let told = |l: &&str| l.starts_with('|') || (l.contains(" = ") && !of_today(l));
        self.keep(name, json!(text.lines().filter(told).collect::<Vec<_>>()));
    }

    fn keep(&mut self, name: &str, answer: Value) {
        match self.was.get(name) {
            Some(was) => differences(was, &answer, name, &mut self.differ),
            None => self.differ.push(format!("{name}: not known yet")),
        }
        self.is.insert(name.into(), answer);
    }

    /// Fails where anything differs; writes the answers where that is asked for.
    pub fn end(self) {
        if std::env::var_os("GYROID_WRITE_ANSWERS").is_some() {
            std::fs::write(&self.file, lines(&self.is)).unwrap();
            return;
        }
        let gone: Vec<&String> = self.was.keys().filter(|name| !self.is.contains_key(*name)).collect();
        let first: Vec<&String> = self.differ.iter().take(20).collect();
        assert!(self.differ.is_empty() && gone.is_empty(), "{} differ, {gone:?} gone: {first:#?}", self.differ.len());
    }
}

/// Whether a line says when and by what something was made.
fn of_today(line: &str) -> bool {
    ["sha256", "generated", "gyroid 0", "by gyroid", "command", "version", "created"].iter().any(|w| line.contains(w))
}

/// One answer a line, so that a difference shows which one changed.
fn lines(answers: &Map<String, Value>) -> String {
    let each: Vec<String> = answers.iter().map(|(name, answer)| format!("{}: {answer}", json!(name))).collect();
    format!("{{\n{}\n}}\n", each.join(",\n"))
}

fn shortened(value: &Value) -> Value {
    match value {
        Value::Object(map) => {
            let told = map.iter().filter(|(key, _)| !PROVENANCE.contains(&key.as_str()));
            Value::Object(told.map(|(key, value)| (key.clone(), shortened(value))).collect())
        }
        Value::Array(list) if list.len() > LONG && list.iter().all(|v| v.is_number() || v.is_null()) => {
            let numbers: Vec<f64> = list.iter().filter_map(Value::as_f64).collect();
            let sum: f64 = numbers.iter().sum();
            let rms = (numbers.iter().map(|v| v * v).sum::<f64>() / numbers.len() as f64).sqrt();
            json!({ "count": numbers.len(), "mean": digits(sum / numbers.len() as f64), "rms": digits(rms),
                "first": numbers.first().map(|v| digits(*v)), "last": numbers.last().map(|v| digits(*v)) })
        }
        // of a long table every seventh row, whose columns are then lists
        Value::Array(list) if list.len() > LONG => Value::Array(list.iter().step_by(7).map(shortened).collect()),
        Value::Array(list) => Value::Array(list.iter().map(shortened).collect()),
        Value::Number(n) if n.is_f64() => n.as_f64().map_or(Value::Null, |v| json!(digits(v))),
        other => other.clone(),
    }
}

/// Nine digits.
fn digits(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap()
}

fn differences(was: &Value, is: &Value, at: &str, out: &mut Vec<String>) {
    match (was, is) {
        (Value::Object(a), Value::Object(b)) => {
            for key in a.keys().chain(b.keys().filter(|k| !a.contains_key(*k))) {
                let [a, b] = [a, b].map(|map| map.get(key).unwrap_or(&Value::Null));
                differences(a, b, &format!("{at}.{key}"), out);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().for_each(|(i, (a, b))| differences(a, b, &format!("{at}[{i}]"), out));
        }
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|n| n.as_f64().unwrap_or(f64::NAN));
            if (a - b).abs() > SAME * a.abs().max(b.abs()) + ZERO {
                out.push(format!("{at}: {a} became {b}"));
            }
        }
        (a, b) if a == b => {}
        (a, b) => out.push(format!("{at}: {a} became {b}")),
    }
}
