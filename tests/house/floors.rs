//! The house: a module uses the floors below it and its own, never one above, and no two modules import each other.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Floor of each module. A new module needs its line here.
const FLOORS: [(&str, u8); 27] = [
    ("error", 0),
    ("files", 0),
    ("progress", 0),
    ("units", 0),
    ("unwind", 0),
    ("math", 0),
    ("signal", 1),
    ("ingest", 2),
    ("bias", 2),
    ("noise", 2),
    ("traction", 2),
    ("vehicle", 2),
    ("config", 2),
    ("robot", 2),
    ("model", 2),
    ("identify", 3),
    ("validate", 3),
    ("navigate", 3),
    ("simulate", 3),
    ("population", 4),
    ("study", 4),
    ("live", 4),
    ("effects", 4),
    ("gap", 5),
    ("bench", 5),
    ("fleet", 6),
    ("export", 6),
];
/// These lie on the sixth floor too, and the roof is the command line.
const UPPER: [(&str, u8); 4] = [("report", 6), ("ros", 6), ("cli", 7), ("python", 7)];

fn floors() -> BTreeMap<&'static str, u8> {
    FLOORS.iter().chain(&UPPER).copied().collect()
}

pub(crate) fn rust_files(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Modules of the crate that a source text names after `crate::` (or, in the command line, `gyroid::`).
fn named(text: &str, root: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in text.match_indices(root) {
        // another identifier that ends like the root is none
        if text[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
            continue;
        }
        let rest = &text[at + root.len()..];
        if let Some(list) = rest.strip_prefix('{') {
            // use crate::{a::b, c::{d, e}}: the names at depth one
            let (mut depth, mut word, mut fresh) = (1, String::new(), true);
            for c in list.chars() {
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    ',' if depth == 1 => fresh = true,
                    c if depth == 1 && fresh && (c.is_alphanumeric() || c == '_') => word.push(c),
                    _ if !word.is_empty() => {
                        found.insert(std::mem::take(&mut word));
                        fresh = false;
                    }
                    _ => {}
                }
                if depth == 0 {
                    break;
                }
            }
            if !word.is_empty() {
                found.insert(word);
            }
        } else {
            found.insert(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect());
        }
    }
    found
}

/// Who names whom, by module of the first level.
fn edges() -> BTreeSet<(String, String)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    let floors = floors();
    let mut edges = BTreeSet::new();
    for file in files {
        let inside = file.strip_prefix(&src).unwrap();
        let module = inside.components().next().unwrap().as_os_str().to_string_lossy().replace(".rs", "");
        if module == "lib" || module == "main" {
            continue;
        }
        assert!(
            floors.contains_key(module.as_str()),
            "{} has no floor: add it in tests/house/floors.rs",
            file.display()
        );
        let text = fs::read_to_string(&file).unwrap();
        let code: String = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
        let root = if module == "cli" { "gyroid::" } else { "crate::" };
        for target in named(&code, root) {
            if floors.contains_key(target.as_str()) && target != module {
                edges.insert((module.clone(), target));
            }
        }
    }
    edges
}

#[test]
fn no_module_imports_from_above() {
    let floors = floors();
    for (from, to) in edges() {
        assert!(
            floors[to.as_str()] <= floors[from.as_str()],
            "{from} (floor {}) uses {to} (floor {})",
            floors[from.as_str()],
            floors[to.as_str()]
        );
    }
}

#[test]
fn no_two_modules_import_each_other_even_by_a_detour() {
    let edges = edges();
    let reach = |start: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start.to_string()]);
        while let Some(at) = open.pop() {
            for (_, to) in edges.iter().filter(|(from, _)| *from == at) {
                if seen.insert(to.clone()) {
                    open.push(to.clone());
                }
            }
        }
        seen
    };
    for (module, _) in floors() {
        assert!(!reach(module).contains(module), "{module} reaches itself");
    }
}

#[test]
fn the_scan_sees_what_it_should() {
    let text =
        "use crate::signal::Log;\nuse crate::{bias::WarmUp, math::{a, b}, Error};\nlet x = crate::config::read();";
    let found: Vec<String> = named(text, "crate::").into_iter().collect();
    assert_eq!(found, ["Error", "bias", "config", "math", "signal"]);
    assert!(!edges().is_empty());
}

#[test]
fn files_stay_short_and_the_library_silent() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for dir in ["src", "tests", "benches"] {
        rust_files(&root.join(dir), &mut files);
    }
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.lines().count() <= 500, "{} has {} lines", file.display(), text.lines().count());
        let library = file.starts_with(root.join("src")) && !file.starts_with(root.join("src/cli"));
        if library {
            for word in ["println!", "eprint", "process::exit", "panic!(", "todo!(", "unimplemented!("] {
                let code = text.split("#[cfg(test)]").next().unwrap_or("");
                let code: String = code.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
                let tests = file.components().any(|c| ["tests", "tests.rs"].iter().any(|name| c.as_os_str() == *name));
                assert!(tests || !code.contains(word), "{} has {word}", file.display());
            }
        }
    }
}

/// Whether `id` stands in `text` and is no part of a longer name.
fn stands_in(text: &str, id: &str) -> bool {
    let of_name = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(id).any(|(at, _)| {
        let (before, after) = (text[..at].chars().next_back(), text[at + id.len()..].chars().next());
        !before.is_some_and(of_name) && !after.is_some_and(of_name)
    })
}

/// An effect is one file and one line in its registry: what the diagnosis must know of it, the effect's own file says.
/// Tests inside the diagnosis spell no id either, nor does its documentation.
#[test]
fn the_diagnosis_knows_no_effect_by_its_id() {
    use gyroid::effects::{drive, registry};
    let of_drives = drive::registry().iter().map(|e| e.about().id);
    let ids: BTreeSet<&str> = registry().iter().map(|e| e.about().id).chain(of_drives).collect();
    let mut files = Vec::new();
    rust_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/gap"), &mut files);
    let mut found = Vec::new();
    for path in &files {
        let text = fs::read_to_string(path).unwrap();
        found.extend(ids.iter().filter(|id| stands_in(&text, id)).map(|id| format!("{}: {id}", path.display())));
    }
    assert!(ids.len() >= 40 && files.len() > 100 && found.is_empty(), "{found:#?}");
    assert!(stands_in("[\"gyro.tone\"]", "gyro.tone") && stands_in("free.varying.gyro.tone`", "gyro.tone"));
    assert!(!stands_in("gyro.tones", "gyro.tone") && !stands_in("the_gyro.tone", "gyro.tone"));
}
