//! The file of a target as it is filled: each number with its unit, meaning and interval above it in a comment, what is
//! left out with the reason and the hint; the same once more as JSON.

use super::about::{About, Comment, Key};
use super::number::{Known, digits, written};
use serde_json::{Value, json};

/// Width of comments, characters.
const WIDTH: usize = 110;

/// How a number of one axis stands in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Once.
    Scalar,
    /// Three times: all axes are taken to be alike.
    Alike,
    /// On the axis of this index, zero on the others.
    OnAxis(usize),
    /// On the diagonal of a matrix of three rows.
    Diagonal,
}

impl Shape {
    fn numbers(self, value: f64) -> Vec<f64> {
        match self {
            Self::Scalar => vec![value],
            Self::Alike => vec![value; 3],
            Self::OnAxis(axis) => (0..3).map(|i| if i == axis { value } else { 0.0 }).collect(),
            Self::Diagonal => (0..9).map(|i| if i % 4 == 0 { value } else { 0.0 }).collect(),
        }
    }
}

/// A number that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// The target's name of it.
    pub key: String,
    /// The numbers as the file holds them.
    pub values: Vec<f64>,
    /// Unit of the target.
    pub unit: &'static str,
    /// Meaning of the key.
    pub meaning: &'static str,
    /// 95 % interval of the number that is not zero, in the target's unit.
    pub ci95: Option<[f64; 2]>,
}

/// A key that the configuration does not support.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// The target's name of it.
    pub key: String,
    /// Why.
    pub why: String,
    /// Advice on how to supply it.
    pub hint: String,
}

/// A file being filled.
#[derive(Debug, Clone)]
pub struct Sheet {
    about: &'static About,
    text: String,
    indent: &'static str,
    written: Vec<Written>,
    left_out: Vec<LeftOut>,
    notes: Vec<String>,
}

impl Sheet {
    pub(super) fn new(about: &'static About) -> Self {
        Self { about, text: String::new(), indent: "", written: Vec::new(), left_out: Vec::new(), notes: Vec::new() }
    }

    /// Indents what follows.
    pub(crate) fn indent(&mut self, by: &'static str) {
        self.indent = by;
    }

    /// A line of the target's language.
    pub(crate) fn line(&mut self, line: &str) {
        if !line.is_empty() {
            self.text.push_str(self.indent);
            self.text.push_str(line);
        }
        self.text.push('\n');
    }

    /// A comment that is not worth repeating outside the file.
    pub(crate) fn comment(&mut self, text: &str) {
        let (open, close) = match self.about.comment {
            Comment::Hash => ("# ", ""),
            Comment::Percent => ("% ", ""),
            Comment::Xml => ("<!-- ", " -->"),
            Comment::Slashes => ("// ", ""),
        };
        let text = plain(text, self.about.comment);
        for line in wrapped(&text, WIDTH.saturating_sub(self.indent.len() + open.len() + close.len())) {
            self.line(&format!("{open}{line}{close}"));
        }
    }

    /// Adds a note for the user on the file as a whole: as a comment in the file, and to the notes of the export.
    pub(crate) fn note(&mut self, text: impl Into<String>) {
        let text = text.into();
        self.comment(&text);
        self.notes.push(text);
    }

    /// A number of the key that `about` describes as `key`: `line` makes the line out of the digits.
    pub(crate) fn put(&mut self, key: &'static str, number: Known, shape: Shape, line: impl Fn(&str) -> String) {
        self.put_named(key, key, number, shape, line);
    }

    /// As [`Sheet::put`], under a name of its own (where `about` describes a family of keys).
    pub(crate) fn put_named(
        &mut self,
        name: &str,
        key: &str,
        number: Known,
        shape: Shape,
        line: impl Fn(&str) -> String,
    ) {
        let Key { unit, meaning, .. } = *self.explain(name, key, number);
        let numbers = shape.numbers(number.value);
        let texts: Vec<String> = numbers.iter().map(|v| digits(*v)).collect();
        self.line(&line(&texts.join(", ")));
        let values = numbers.iter().map(|v| written(*v)).collect();
        let ci95 = number.ci95;
        self.written.push(Written { key: name.to_string(), values, unit, meaning, ci95 });
    }

    /// Meaning, unit and interval of a number, as a comment.
    fn explain(&mut self, name: &str, key: &str, number: Known) -> &'static Key {
        let described = self.key(key);
        let interval = number.ci95.map_or_else(String::new, |ci| format!("; 95 %: {}", interval_text(ci)));
        self.comment(&format!("{name}: {}, {}{interval}", described.meaning, described.unit));
        described
    }

    /// A number with as many digits as bring all of it back.
    pub(crate) fn put_double(&mut self, name: &'static str, number: Known, line: impl Fn(&str) -> String) {
        let (Key { unit, meaning, .. }, ci95) = (*self.explain(name, name, number), number.ci95);
        self.line(&line(&format!("{:e}", number.value)));
        self.written.push(Written { key: name.to_string(), values: vec![number.value], unit, meaning, ci95 });
    }

    /// A whole number, which the target would not take with a decimal point.
    pub(crate) fn put_integer(&mut self, key: &'static str, value: u32, line: impl Fn(&str) -> String) {
        let Key { unit, meaning, .. } = *self.key(key);
        self.comment(&format!("{key}: {meaning}{}{unit}", if unit.is_empty() { "" } else { ", " }));
        self.line(&line(&value.to_string()));
        let values = vec![f64::from(value)];
        self.written.push(Written { key: key.to_string(), values, unit, meaning, ci95: None });
    }

    /// A key that the configuration does not support.
    pub(crate) fn leave_out(&mut self, key: &str, why: &str, hint: &str) {
        self.comment(&format!("left out: {key}: {why}. Hint: {hint}."));
        self.left_out.push(LeftOut { key: key.to_string(), why: why.to_string(), hint: hint.to_string() });
    }

    /// The keys of the accelerometer, which no gyro log can give.
    pub(crate) fn leave_out_accelerometer(&mut self, keys: &str) {
        self.leave_out(
            keys,
            "a log of a gyro says nothing of the accelerometer",
            "take them from the accelerometer's datasheet or its own log at rest",
        );
    }

    /// K, or why it is not there.
    pub(crate) fn put_walk(
        &mut self,
        key: &'static str,
        walk: Option<Known>,
        shape: Shape,
        without: &str,
        line: impl Fn(&str) -> String,
    ) {
        match walk {
            Some(walk) => self.put(key, walk, shape, line),
            None => self.leave_out(
                key,
                &format!("no rate random walk was identified{}{without}", if without.is_empty() { "" } else { "; " }),
                "record some hours at a steady temperature and run gyroid noise LOG --write CONFIG, or state \
                 rate_random_walk_rad_s_sqrt_s under [gyro.noise]; a number without evidence helps nobody",
            ),
        }
    }

    fn key(&self, name: &str) -> &'static Key {
        const UNKNOWN: Key = Key { name: "", unit: "", meaning: "" };
        self.about.keys.iter().find(|k| k.name == name).unwrap_or(&UNKNOWN)
    }

    pub(super) fn into_parts(self) -> (String, Vec<Written>, Vec<LeftOut>, Vec<String>) {
        (self.text, self.written, self.left_out, self.notes)
    }
}

impl Written {
    /// The stable form of a number.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        let value = if let [one] = self.values[..] { json!(one) } else { json!(self.values) };
        json!({ "key": self.key, "value": value, "unit": self.unit, "meaning": self.meaning, "ci95": self.ci95 })
    }
}

impl LeftOut {
    /// The stable form of an omission.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        json!({ "key": self.key, "why": self.why, "hint": self.hint })
    }
}

fn interval_text([low, high]: [f64; 2]) -> String {
    let end = |x: f64| if x.is_finite() { format!("{x:.3e}") } else { "unbounded".to_string() };
    format!("{} to {}", end(low), end(high))
}

/// `text` without characters that would end a comment or begin a new line: names of logs and commands may hold any.
fn plain(text: &str, comment: Comment) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    match comment {
        // two hyphens end an XML comment, and one must not stand before its end
        Comment::Xml => text.replace("--", "- -").replace("--", "- -").replace("->", "- >"),
        // a backslash at the end of a line carries the comment into the next one
        Comment::Slashes => text.replace('\\', "/"),
        Comment::Hash | Comment::Percent => text,
    }
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split(' ').filter(|w| !w.is_empty()) {
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > width {
            lines.push(std::mem::take(&mut line));
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines.push(line);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_s_text_leaves_its_comment() {
        for text in ["a\nrm: -rf", "x --> <evil/> <!-- ---> ----", "tab\tand\u{7f}"] {
            let xml = plain(text, Comment::Xml);
            assert!(!xml.contains("--") && !xml.contains("->"), "{xml}");
            assert!(!plain(text, Comment::Hash).contains(char::is_control));
        }
    }

    #[test]
    fn long_comments_are_wrapped_between_words() {
        let lines = wrapped("one two three four", 9);
        assert_eq!(lines, ["one two", "three", "four"]);
        assert_eq!(wrapped("", 9), [""]);
    }
}
