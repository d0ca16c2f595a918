//! The rooms: inside a room no files import each other in circles, so that each can be read before those that use it.
//!
//! An edge leads from a file to each file whose names it uses. Re-exports of a module's own children are no uses, and tests are left out.

use crate::floors::rust_files;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

type Graph = BTreeMap<String, BTreeSet<String>>;

/// Module of a file inside `src`: `a/b.rs` and `a/b/mod.rs` are `a::b`.
fn module(inside: &Path) -> String {
    let path = inside.with_extension("");
    let parts = path.components().map(|c| c.as_os_str().to_string_lossy().into_owned());
    parts.filter(|part| part != "mod").collect::<Vec<_>>().join("::")
}

/// Every path of an import: `a::{b, c::{d, e as f}}` has `a::b`, `a::c::d` and `a::c::e`.
fn leaves(tree: &str, prefix: &str, out: &mut Vec<String>) {
    let (mut depth, mut from) = (0, 0);
    for (at, c) in tree.char_indices().chain([(tree.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let part = tree[from..at].trim();
                from = at + 1;
                match part.split_once('{') {
                    Some((head, rest)) => leaves(rest.strip_suffix('}').unwrap(), &format!("{prefix}{head}"), out),
                    None if part.is_empty() => {}
                    None => out.push(format!("{prefix}{}", part.split(" as ").next().unwrap())),
                }
            }
            _ => {}
        }
    }
}

/// Paths that a file uses, each with whether it is re-exported, and the modules that it declares for tests.
fn uses(text: &str) -> (Vec<(String, bool)>, Vec<String>) {
    let (mut found, mut tests) = (Vec::new(), Vec::new());
    let (mut statement, mut of_tests, mut inside_tests) = (String::new(), false, false);
    for line in text.lines().filter(|l| !l.trim_start().starts_with("//")) {
        let code = line.trim();
        if inside_tests {
            inside_tests = line != "}";
        } else if !statement.is_empty()
            || code.starts_with("use ")
            || (code.starts_with("pub") && code.contains(" use "))
        {
            statement += code;
            if let Some(whole) = statement.strip_suffix(';') {
                let (public, tree) = whole.split_once("use ").unwrap();
                let mut paths = Vec::new();
                leaves(tree, "", &mut paths);
                found.extend(paths.into_iter().filter(|_| !of_tests).map(|path| (path, !public.is_empty())));
                (statement, of_tests) = (String::new(), false);
            }
        } else if code.starts_with("#[") {
            of_tests |= code == "#[cfg(test)]";
        } else {
            match code.split_once("mod ").filter(|_| of_tests) {
                Some((_, name)) if name.ends_with(';') => tests.push(name.trim_end_matches(';').to_owned()),
                Some((_, name)) if name.ends_with('{') => inside_tests = true,
                // `pub(in crate::a)` imports nothing
                _ => {
                    let code = code.split_once("pub(in ").map_or(code, |(_, rest)| rest.split_once(')').unwrap().1);
                    let words = code.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
                    found.extend(words.filter(|w| w.contains("::")).map(|w| (w.to_owned(), false)));
                }
            }
            of_tests = false;
        }
    }
    (found, tests)
}

/// The file that `path` leads to from `module`; none outside the crate.
fn target(module: &str, path: &str, files: &BTreeMap<String, String>) -> Option<String> {
    let mut at: Vec<&str> = module.split("::").collect();
    let mut parts = path.split("::").filter(|p| !p.is_empty()).peekable();
    match *parts.peek()? {
        "crate" => at.clear(),
        "self" | "super" => {}
        child if files.contains_key(&format!("{module}::{child}")) => {}
        _ => return None,
    }
    for part in parts {
        match part {
            "crate" | "self" => {}
            "super" => drop(at.pop()),
            name => at.push(name),
        }
    }
    (1..=at.len()).rev().map(|n| at[..n].join("::")).find(|to| files.contains_key(to))
}

fn graph(files: &BTreeMap<String, String>) -> Graph {
    let read: Vec<_> = files.iter().map(|(module, text)| (module, uses(text))).collect();
    let declared = |(module, (_, tests)): &(&String, (_, Vec<String>))| -> Vec<String> {
        tests.iter().map(|name| format!("{module}::{name}")).collect()
    };
    let tests: Vec<String> = read.iter().flat_map(declared).collect();
    let of_tests =
        |m: &str| tests.iter().any(|t| m.strip_prefix(t.as_str()).is_some_and(|r| r.is_empty() || r.starts_with("::")));
    let mut graph = Graph::new();
    for (module, (paths, _)) in read.into_iter().filter(|(module, _)| !of_tests(module)) {
        let own = format!("{module}::");
        let to = paths.iter().filter_map(|(path, public)| Some((target(module, path, files)?, *public)));
        let to = to.filter(|(to, public)| to != module && !of_tests(to) && !(*public && to.starts_with(&own)));
        graph.insert(module.clone(), to.map(|(to, _)| to).collect());
    }
    graph
}

/// Sets of files that reach each other, by room.
fn circles(graph: &Graph) -> BTreeMap<String, BTreeSet<Vec<String>>> {
    let reach = |start: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(at) = open.pop() {
            open.extend(graph.get(at).into_iter().flatten().filter(|to| seen.insert((*to).clone())));
        }
        seen
    };
    let reached: BTreeMap<&String, BTreeSet<String>> = graph.keys().map(|m| (m, reach(m))).collect();
    let mut found: BTreeMap<String, BTreeSet<Vec<String>>> = BTreeMap::new();
    for (module, to) in reached.iter().filter(|(module, to)| to.contains(**module)) {
        let circle = to.iter().filter(|other| reached[other].contains(*module)).cloned().collect();
        found.entry(module.split("::").next().unwrap().to_owned()).or_default().insert(circle);
    }
    found
}

#[test]
fn no_files_of_a_room_import_each_other_in_circles() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    rust_files(&src, &mut paths);
    let files = paths.iter().map(|p| (module(p.strip_prefix(&src).unwrap()), fs::read_to_string(p).unwrap())).collect();
    let found = circles(&graph(&files));
    assert!(found.is_empty(), "files import each other in circles: {found:#?}");
}

#[test]
fn an_invented_circle_is_found() {
    let of = |parent: &str, child: &str| {
        let files =
            [("room", parent), ("room::a", child), ("room::b", "pub struct B;"), ("room::tests", "use super::*;")];
        circles(&graph(&files.map(|(module, text)| (module.to_owned(), text.to_owned())).into()))
    };
    let exports = "mod a;\npub use a::A;\n#[cfg(test)]\nmod tests;";
    // a parent that exports its child does not use it, and a sibling is not the parent
    assert!(of(exports, "use super::Parent;").is_empty());
    assert!(of("use a::{A, self as other};", "use super::b::B;\npub(in crate::room) struct A;").is_empty());
    assert!(
        of("fn f() -> a::A {}", "#[cfg(test)]\nuse super::Parent;\n#[cfg(test)]\nmod x {\n    use super::Parent;\n}")
            .is_empty()
    );
    // by an import, by a path in the code
    for parent in ["use a::{\n    A,\n};", "fn f(x: &a::A) {}"] {
        for child in ["use crate::room::{b::B, Parent};", "fn f() -> Vec<super::Parent> {}"] {
            let circle = vec!["room".to_owned(), "room::a".to_owned()];
            assert_eq!(of(parent, child), [("room".to_owned(), [circle].into())].into(), "{parent} {child}");
        }
    }
}
