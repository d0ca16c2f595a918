//! The pages of the book that are made from the library and the benches say what those say.
//!
//! `GYROID_WRITE_BOOK=1 cargo test --test house book::` writes them anew.

#[path = "constants.rs"]
mod constants;

use gyroid::effects::drive::Driving;
use gyroid::effects::{About, Effect, Parameter, drive, registry};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// What a bench found of one kind of recordings.
struct Bench {
    score: Value,
    folder: &'static str,
}

impl Bench {
    fn read(name: &str, folder: &'static str) -> Self {
        let text = fs::read_to_string(repository().join("data").join(name)).unwrap();
        Self { score: serde_json::from_str(&text).unwrap(), folder }
    }

    fn of(&self, id: &str) -> Option<&Value> {
        self.score["by_effect"].as_array().unwrap().iter().find(|e| e["id"] == id)
    }

    /// How often the effect was named, by strength.
    fn named(&self, id: &str) -> String {
        let Some(effect) = self.of(id) else {
            return "it was in no case of the bench".into();
        };
        let strengths = ["strong", "medium", "weak"].into_iter().filter_map(|strength| {
            let rate = &effect["strengths"][strength];
            (rate["of"] != 0).then(|| format!("{} of {} {strength}", rate["right"], rate["of"]))
        });
        format!("named in {} cases", strengths.collect::<Vec<_>>().join(", "))
    }

    /// Median errors of its parameters where it was named.
    fn errors(&self, id: &str) -> String {
        let Some(errors) = self.of(id).and_then(|e| e["parameter_errors"].as_object()) else { return String::new() };
        let errors = errors.iter().filter_map(|(name, error)| {
            let median = 100.0 * error["median"].as_f64()?;
            Some(format!("`{name}` {} %", two_digits(median)))
        });
        errors.collect::<Vec<_>>().join(", ")
    }

    /// What it was taken for, most often first.
    fn taken_for(&self, id: &str) -> String {
        let confusion = &self.score["confusion"];
        let names = |key: &str| -> Vec<String> {
            confusion[key].as_array().unwrap().iter().map(|n| n.as_str().unwrap().to_owned()).collect()
        };
        let (truths, answers) = (names("truths"), names("answers"));
        let Some(row) = truths.iter().position(|t| t == id) else { return String::new() };
        let count = |column: usize| confusion["counts"][row * answers.len() + column].as_u64().unwrap();
        let mut others: Vec<_> = (0..answers.len()).filter(|c| answers[*c] != id && count(*c) > 0).collect();
        others.sort_by_key(|c| std::cmp::Reverse(count(*c)));
        let others = others.into_iter().map(|c| format!("`{}` {}", answers[c], count(c)));
        others.collect::<Vec<_>>().join(", ")
    }
}

fn two_digits(x: f64) -> String {
    let digits = if x > 0.0 { (1.0 - x.log10().floor()).max(0.0) as usize } else { 0 };
    format!("{x:.digits$}")
}

/// A row of the table of parameters.
fn parameter(p: &Parameter) -> String {
    let [low, high] = p.bounds;
    let null = p.null.map_or("–".to_owned(), |n| n.to_string());
    let must = if p.required { "yes" } else { "no" };
    format!("| `{}` | {} | {} to {} | {null} | {must} |\n", p.name, p.meaning, short(low), short(high))
}

/// A bound as people write it.
fn short(x: f64) -> String {
    let size = x.abs();
    if size > 0.0 && !(1e-3..1e4).contains(&size) { format!("{x:e}") } else { format!("{}", (x * 1e4).round() / 1e4) }
}

/// The section of one effect: what all effects have, and `more` of the kind.
fn section(about: &About, bench: &Bench, more: &[(&str, String)]) -> String {
    let mut out = format!("## {}\n\n`{}`\n\n> {}\n\n", capital(about.title), about.id, about.equation);
    let picture = format!("pictures/effects/{}_{}.svg", bench.folder, about.id);
    if repository().join("docs/src").join(&picture).exists() {
        writeln!(out, "![Trace of {}]({picture})\n", about.title).unwrap();
    }
    out += "| parameter | is | from, to | without effect at | must be given |\n|---|---|---|---|---|\n";
    out.extend(about.parameters.iter().map(parameter));
    out += "\n";
    let condition = about.condition.map_or(String::new(), |c| format!("; follows {}", c.replace('_', " ")));
    let mut lines = vec![("Changes", format!("{}; channel {}{condition}", about.deficient, about.channel))];
    lines.extend(more.iter().cloned());
    lines.push(("How sure", bench.named(about.id)));
    lines.push(("Parameters, median error", bench.errors(about.id)));
    lines.push(("Missed as", bench.taken_for(about.id)));
    lines.push(("What to do", about.remedy.to_owned()));
    lines.push(("Source", about.source.to_owned()));
    for (name, text) in lines.iter().filter(|(_, text)| !text.is_empty()) {
        writeln!(out, "- **{name}**: {}", text.trim_end_matches('.')).unwrap();
    }
    out + "\n"
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn at_rest(effect: &dyn Effect, bench: &Bench) -> String {
    let apart = effect.separated_by().unwrap_or("a longer recording").to_owned();
    section(effect.about(), bench, &[("Told from what looks alike by", apart)])
}

fn of_drives(effect: &dyn Driving, bench: &Bench) -> String {
    let change = effect.change();
    let needs = change.map(|c| c.needs()).map_or(String::new(), |n| {
        let channels = [
            (n.torques, "torques"),
            (n.gyro, "gyro"),
            (n.pose, "position and heading"),
            (n.length, "torques, gyro or pose beside the wheels"),
        ];
        channels.iter().filter(|(needed, _)| *needed).map(|(_, name)| *name).collect::<Vec<_>>().join(", ")
    });
    let sizes = change.map_or(String::new(), |c| c.sizes().to_owned());
    let equal = change.map_or(String::new(), |c| {
        let equal = c.equivalents().iter().map(|e| {
            let within = match e.within {
                drive::Within::GyroAndWheels => "with gyro and wheels alone",
                drive::Within::NoTorques => "without torques",
            };
            format!("`{}` {within}", e.effect.about().id)
        });
        let mut equal: Vec<_> = equal.collect();
        equal.dedup();
        equal.join(", ")
    });
    section(
        effect.about(),
        bench,
        &[("Needs in the log", needs), ("Usual size", sizes), ("Cannot be told from", equal)],
    )
}

/// The page `name`, whose sections follow its head.
fn compare(name: &str, head: &str, sections: &[String]) {
    let made = "<!-- Made from the library and the benches: GYROID_WRITE_BOOK=1 cargo test --test house book:: -->\n";
    let text = format!("{head}\n{made}\n{}\n", sections.concat().trim_end());
    let path: PathBuf = repository().join("docs/src").join(name);
    if std::env::var_os("GYROID_WRITE_BOOK").is_some() {
        fs::write(&path, text).unwrap();
        return;
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    let differs = kept.lines().zip(text.lines()).find(|(a, b)| a != b);
    assert!(
        kept == text,
        "{} is old, first at {differs:?}: GYROID_WRITE_BOOK=1 cargo test --test house book::",
        path.display()
    );
}

const HOW_TO_READ: &str = "\
Each effect has its equation, a trace, its parameters, and what the sealed bench says of it. The trace is simulated twice with the same random numbers, with the effect and without it.
A configuration holds an effect as a table `[[effect]]` with `id` and these parameters.

*How sure* counts the bench's cases in which this effect was the truth and was named: strong is a log-likelihood ratio of 100 nats and more, medium 12 to 100, weak below 12
([what that means](reading.md#nats)). *Missed as* counts what was said instead; `none` is mostly right for a weak effect. The cases of one effect are few: read them with the whole
[evidence](evidence.md).
";

#[test]
fn the_page_of_effects_at_rest_is_that_of_the_library() {
    let bench = Bench::read("gap_bench.json", "rest");
    let head = format!(
        "# Effects at rest\n\nWhat a gyro at rest may have and its nominal simulator lacks: {} effects.\n{HOW_TO_READ}",
        registry().len()
    );
    let sections: Vec<_> = registry().iter().map(|e| at_rest(*e, &bench)).collect();
    compare("effects_rest.md", &head, &sections);
}

#[test]
fn the_page_of_effects_of_drives_is_that_of_the_library() {
    let bench = Bench::read("gap_drive_bench.json", "drive");
    let count = drive::registry().len();
    let head = format!(
        "# Effects of drives\n\nWhat a robot that moves may have and its nominal simulator lacks: {count} effects.\n{HOW_TO_READ}"
    );
    let sections: Vec<_> = drive::registry().iter().map(|e| of_drives(*e, &bench)).collect();
    compare("effects_drives.md", &head, &sections);
}
