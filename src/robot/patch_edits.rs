//! Changes of numbers in a text of XML, by their places, under comments.

use roxmltree::Node;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;

/// Digits that a number is written with.
const DIGITS: usize = 9;

/// Edits of one text. Of two changes in one place the last holds, for each begins from what the last one made of it.
#[derive(Debug, Clone, Default)]
pub(super) struct Edits {
    /// By their beginning: the place, the new text, and what the change is called.
    changes: BTreeMap<(usize, String), (Range<usize>, String, String)>,
    /// By the beginning of an element: why it was changed, and what was there before.
    comments: BTreeMap<usize, Vec<(String, Vec<String>)>>,
    /// The comment of the changes that come now.
    says: String,
    source: String,
}

impl Edits {
    /// The changes that follow are made for this reason.
    pub(super) fn begin(&mut self, source: &str, says: &str) {
        self.source = source.to_owned();
        // a comment holds no two hyphens
        self.says = says.replace("--", "- -").replace("--", "- -").trim_end_matches('-').to_owned();
    }

    /// The numbers of an attribute, as changed so far; `None` where it is not there.
    pub(super) fn attribute(&self, node: Node, name: &str) -> Option<Vec<f64>> {
        if let Some((_, text, _)) = self.changes.get(&(node.range().start, name.to_owned())) {
            return numbers(text);
        }
        numbers(node.attribute(name)?)
    }

    /// Sets an attribute, which is added where it is not there.
    pub(super) fn set_attribute(&mut self, node: Node, name: &str, values: &[f64]) {
        let value = rewritten(values, node.attribute(name));
        let place = match node.attribute_node(name) {
            Some(found) => found.range_value(),
            None => {
                let start = node.range().start;
                let tag = self.source[start + 1..].find(|c: char| c.is_whitespace() || c == '/' || c == '>');
                let at = start + 1 + tag.unwrap_or(0);
                at..at
            }
        };
        let before = node.attribute(name).map_or("not stated".to_string(), |v| v.trim().to_owned());
        if value == before {
            return;
        }
        let told = format!("{} {name}: {before} -> {value}", called(node));
        self.comment(node, format!("{name} was {before}"));
        self.changes.insert((node.range().start, name.to_owned()), (place, value, told));
    }

    /// The numbers of an element's text, as changed so far.
    pub(super) fn text(&self, node: Node) -> Option<Vec<f64>> {
        if let Some((_, text, _)) = self.changes.get(&(node.range().start, String::new())) {
            return numbers(text);
        }
        numbers(node.text()?)
    }

    /// Sets the text of an element that has one; `false` where it has none.
    pub(super) fn set_text(&mut self, node: Node, values: &[f64]) -> bool {
        let Some(place) = node.first_child().filter(|c| c.is_text()).map(|c| c.range()) else { return false };
        let (before, value) = (node.text().unwrap_or_default().trim().to_owned(), rewritten(values, node.text()));
        if value == before {
            return true;
        }
        self.comment(node, format!("was {before}"));
        let told = format!("{}: {before} -> {value}", called(node));
        self.changes.insert((node.range().start, String::new()), (place, value, told));
        true
    }

    /// Adds an element as the last child of one that has an end tag; `false` where it has none. `what` tells it from others.
    pub(super) fn add_child(&mut self, node: Node, what: &str, element: &str) -> bool {
        let range = node.range();
        let Some(end) = self.source[range.clone()].rfind("</").filter(|_| !self.source[..range.end].ends_with("/>"))
        else {
            return false;
        };
        let at = range.start + end;
        let line = self.source[..at].rfind('\n').map_or(at, |l| l + 1);
        // an end tag on a line of its own: the element gets one too
        let own = self.source[line..at].trim().is_empty();
        let at = if own { line } else { at };
        let indent = if own { format!("{}  ", &self.source[line..range.start + end]) } else { String::new() };
        let comment = format!("<!-- gyroid: {} -->", self.says);
        let end = line_end(&self.source);
        let text =
            if own { format!("{indent}{comment}{end}{indent}{element}{end}") } else { format!("{comment}{element}") };
        let told = format!("{}: {element} is new", called(node));
        self.changes.insert((range.start, format!("+{what}")), (at..at, text, told));
        true
    }

    fn comment(&mut self, node: Node, before: String) {
        let comments = self.comments.entry(node.range().start).or_default();
        let at = comments.iter().position(|(says, _)| *says == self.says).unwrap_or_else(|| {
            comments.push((self.says.clone(), Vec::new()));
            comments.len() - 1
        });
        if !comments[at].1.contains(&before) {
            comments[at].1.push(before);
        }
    }

    /// The changed text, and its changes.
    pub(super) fn applied(&self, source: &str) -> (String, Vec<String>) {
        let mut pieces: Vec<(Range<usize>, String)> = Vec::new();
        for ((_, name), (place, value, _)) in &self.changes {
            let new = place.is_empty() && !name.starts_with('+');
            pieces.push((place.clone(), if new { format!(" {name}=\"{value}\"") } else { value.clone() }));
        }
        for (start, says) in &self.comments {
            let line = source[..*start].rfind('\n').map_or(0, |l| l + 1);
            let indent = &source[line..*start];
            let mut text = String::new();
            for (why, before) in says {
                let _ = write!(text, "<!-- gyroid: {why}: {} -->", before.join(", "));
                if indent.trim().is_empty() {
                    let _ = write!(text, "{}{indent}", line_end(source));
                }
            }
            pieces.push((*start..*start, text));
        }
        pieces.sort_by_key(|(place, _)| (place.start, place.end));
        let mut out = String::with_capacity(source.len() + 200 * pieces.len());
        let mut at = 0;
        for (place, text) in pieces {
            out.push_str(&source[at..place.start]);
            out.push_str(&text);
            at = place.end;
        }
        out.push_str(&source[at..]);
        (out, self.changes.values().map(|(.., told)| told.clone()).collect())
    }
}

/// An element by its tag and its name, or that of the element around it.
fn called(node: Node) -> String {
    let tag = node.tag_name().name();
    match node.ancestors().find_map(|n| n.attribute("name")) {
        Some(name) => format!("<{tag}> of {name}"),
        None => format!("<{tag}>"),
    }
}

/// The line end of a text.
fn line_end(source: &str) -> &'static str {
    if source.contains("\r\n") { "\r\n" } else { "\n" }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|word| word.parse().ok()).collect()
}

/// Numbers apart by spaces; those that did not change stay as they were written.
fn rewritten(values: &[f64], before: Option<&str>) -> String {
    let words: Vec<&str> = before.unwrap_or_default().split_whitespace().collect();
    let one = |(i, x): (usize, &f64)| {
        let same = words.get(i).filter(|word| word.parse() == Ok(*x));
        same.map_or_else(|| rounded(*x).to_string(), |word| (*word).to_owned())
    };
    values.iter().enumerate().map(one).collect::<Vec<_>>().join(" ")
}

/// A number as it is written into a description: to nine digits.
pub(super) fn rounded(x: f64) -> f64 {
    let to: f64 = format!("{x:.*e}", DIGITS - 1).parse().unwrap_or(x);
    if to == 0.0 { 0.0 } else { to }
}
