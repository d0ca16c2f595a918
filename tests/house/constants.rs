//! The page of the book that lists the constants by which the diagnosis decides is that of the code.
//!
//! `GYROID_WRITE_BOOK=1 cargo test --test house book::` writes it anew.

use crate::floors::rust_files;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A stage of the diagnosis: its folder in `src/gap`, and its heading.
const STAGES: [(&str, &str); 16] = [
    ("rest/prepare", "At rest: preparation"),
    ("rest/whittle", "At rest: Gaussian sets, by their Whittle likelihood"),
    ("rest/nongaussian", "At rest: quantization, tails, two levels, events"),
    ("rest/state_space", "At rest: hidden states"),
    ("rest/predictive", "At rest: predictive check"),
    ("rest/", "At rest: sets, their explanation"),
    ("drive/record", "Drives: preparation"),
    ("drive/preprocess", "Drives: clocks, lost ticks, outliers, noise levels"),
    ("drive/ekf", "Drives: the filter and its sensitivity"),
    ("drive/regressors", "Drives: candidates"),
    ("drive/screening", "Drives: screening"),
    ("drive/fit", "Drives: sets"),
    ("drive/", "Drives: hold-out, explanation"),
    ("twin/", "The twin of a simulator"),
    ("power/", "Power"),
    ("", "Both: selection, hold-out, answer"),
];

/// Numeric constants that share one docstring, as they stand in a file.
#[derive(Default)]
struct Group {
    constants: Vec<(String, String)>,
    meaning: String,
}

/// Name and value of a numeric constant that begins in `line`; `rest` are the lines after it.
fn constant(line: &str, rest: &[&str]) -> Option<(String, String)> {
    let (before, from) = line.split_once("const ")?;
    let visible = before.trim();
    if !(visible.is_empty() || visible.starts_with("pub")) {
        return None;
    }
    let (name, typed) = from.split_once(": ")?;
    let (kind, value) = typed.split_once(" = ").or_else(|| typed.split_once(" ="))?;
    let number =
        ["f64", "usize", "u8", "u32", "u64", "i32", "Policy"].iter().any(|n| kind.contains(n)) && !kind.contains('&');
    if !number || !name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_') {
        return None;
    }
    let mut value = value.to_owned();
    let mut next = rest.iter();
    while !value.ends_with(';') {
        write!(value, " {}", next.next()?.trim()).unwrap();
    }
    Some((name.to_owned(), value.trim_end_matches(';').trim().to_owned()))
}

/// The groups of one file, tests left out, and the names of constants without a docstring.
fn groups(text: &str) -> (Vec<Group>, Vec<String>) {
    let all: Vec<&str> = text.lines().collect();
    let tests = |w: &[&str]| w[0] == "#[cfg(test)]" && w[1].contains("mod ") && w[1].ends_with('{');
    let lines = &all[..all.windows(2).position(tests).unwrap_or(all.len())];
    let (mut found, mut bare): (Vec<Group>, Vec<String>) = (Vec::new(), Vec::new());
    let (mut said, mut beside) = (String::new(), false);
    for (k, line) in lines.iter().enumerate() {
        if let Some(doc) = line.trim().strip_prefix("///") {
            if beside {
                said.clear();
            }
            said = format!("{said} {}", doc.trim()).trim().to_owned();
            beside = false;
            continue;
        }
        let Some(one) = constant(line, &lines[k + 1..]) else {
            if !line.trim_start().starts_with(['(', ']', '[']) {
                said.clear();
                beside = false;
            }
            continue;
        };
        match found.last_mut().filter(|_| beside) {
            Some(group) => group.constants.push(one),
            None if said.is_empty() => bare.push(one.0),
            None => found.push(Group { constants: vec![one], meaning: said.clone() }),
        }
        beside = !said.is_empty();
    }
    (found, bare)
}

const HEAD: &str = "\
# The constants

Every number by which the diagnosis decides, with its meaning, as it stands in the code. Times are in seconds, angles in radians, evidence in nats where nothing else is said.
Priors and sizes that are known of a sensor or a robot stand with their source in each [effect](effects.md). `--why` tells of each decision which of these it was.
";

#[test]
fn the_page_of_constants_is_that_of_the_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let gap = root.join("src/gap");
    let mut paths = Vec::new();
    rust_files(&gap, &mut paths);
    let of_tests = |name: &str| name.ends_with("tests.rs") || name.contains("/tests/");
    let inside = |path: std::path::PathBuf| path.strip_prefix(&gap).unwrap().to_string_lossy().replace('\\', "/");
    let mut names: Vec<String> = paths.into_iter().map(inside).filter(|name| !of_tests(name)).collect();
    names.sort();
    let mut sections: Vec<String> = STAGES.iter().map(|_| String::new()).collect();
    let mut bare = Vec::new();
    for name in names {
        let (found, without) = groups(&fs::read_to_string(gap.join(&name)).unwrap());
        bare.extend(without.into_iter().map(|constant| format!("{name}: {constant}")));
        let stage = STAGES.iter().position(|(folder, _)| name.starts_with(folder)).unwrap();
        for group in found {
            let of = |part: fn(&(String, String)) -> &String| {
                let parts: Vec<_> =
                    group.constants.iter().map(|c| format!("`{}`", part(c).replace('|', "\\|"))).collect();
                parts.join(", ")
            };
            let meaning = group.meaning.replace('|', "\\|").replace("[`", "`").replace("`]", "`");
            writeln!(sections[stage], "| {} | {} | {meaning} | `{name}` |", of(|c| &c.0), of(|c| &c.1)).unwrap();
        }
    }
    assert!(bare.is_empty(), "constants without a docstring: {bare:?}");
    let tables = STAGES.iter().zip(&sections).filter(|(_, rows)| !rows.is_empty());
    let tables: Vec<String> = tables
        .map(|((_, heading), rows)| {
            format!("## {heading}\n\n| constant | value | meaning | file |\n|---|---|---|---|\n{rows}")
        })
        .collect();
    assert!(tables.len() > 10 && tables.concat().lines().count() > 200, "constants were not found");
    super::compare("constants.md", HEAD, &[tables.join("\n")]);
}
