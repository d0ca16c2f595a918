//! The table: a section a task, a column a program, a row a quantity.

use crate::drive::Outcome;
use serde_json::{Map, Value, json};

/// A program's answer to one task, or why there is none.
pub struct Column {
    program: &'static str,
    answer: Result<Value, String>,
}

impl Column {
    pub fn new(program: &'static str, answer: Outcome<Value>) -> Self {
        Self { program, answer: answer.map_err(|why| why.to_string()) }
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.answer.as_ref().ok()?[key].as_f64()
    }

    fn curve(&self) -> Vec<(f64, f64)> {
        let points = self.answer.as_ref().ok().and_then(|a| a["curve"].as_array());
        points.into_iter().flatten().filter_map(|p| Some((p[0].as_f64()?, p[1].as_f64()?))).collect()
    }
}

/// The answers of all programs to one task; gyroid's is the first.
pub struct Section {
    pub task: &'static str,
    title: &'static str,
    truth: Map<String, Value>,
    columns: Vec<Column>,
}

impl Section {
    pub fn new(task: &'static str, title: &'static str, truth: Map<String, Value>, columns: Vec<Column>) -> Self {
        Self { task, title, truth, columns }
    }

    /// Name of the row that compares the curves, and whether their difference is relative.
    fn difference(&self) -> (&'static str, bool) {
        match self.task {
            "allan" => ("relative difference from gyroid, at most", true),
            "autocorrelation" => ("difference from gyroid, at most", false),
            _ => ("difference of x from gyroid, m, at most", false),
        }
    }

    /// Largest difference of a curve from gyroid's at the abscissas that both have; none without curves.
    fn apart(&self, column: &Column) -> Option<f64> {
        let (ours, relative) = (self.columns[0].curve(), self.difference().1);
        let theirs = column.curve();
        let pairs = ours.iter().filter_map(|(x, y)| Some((y, theirs.iter().find(|(at, _)| at == x)?.1)));
        pairs.map(|(y, other)| (other - y).abs() / if relative { y.abs() } else { 1.0 }).reduce(f64::max)
    }

    pub fn json(&self) -> Value {
        let program = |c: &Column| {
            let told = match &c.answer {
                Ok(a) => json!({
                    "version": a["version"], "seconds": a["seconds"], "peak_mib": a["peak_mib"], "answers": a["answers"],
                    "largest_difference": self.apart(c).filter(|_| c.program != "gyroid"),
                }),
                Err(why) => json!({ "left_out": why }),
            };
            (c.program.to_string(), told)
        };
        json!({ "truth": self.truth, "programs": self.columns.iter().map(program).collect::<Map<_, _>>() })
    }

    fn lines(&self, width: usize) -> Vec<String> {
        let mut out = Vec::new();
        let mut line = |name: &str, truth: String, cells: Vec<String>| {
            let filled = cells.into_iter().chain(std::iter::repeat(String::new())).take(width);
            out.push(format!("| {name} | {truth} | {} |", filled.collect::<Vec<_>>().join(" | ")).replace("|  ", "| "));
        };
        let all = |cell: &dyn Fn(&Column) -> String| self.columns.iter().map(cell).collect::<Vec<_>>();
        let named = |c: &Column| {
            let version = c.answer.as_ref().ok().and_then(|a| a["version"].as_str());
            version.map_or(format!("**{}**", c.program), |v| format!("**{}** {v}", c.program))
        };
        line(&format!("**{}**", self.title), String::new(), all(&named));
        let ours = self.columns[0].number("seconds");
        let time = |c: &Column| match (&c.answer, c.number("seconds"), ours) {
            (Err(why), _, _) => format!("left out: {why}"),
            (_, Some(s), Some(ours)) if c.program != "gyroid" => {
                format!("{} = {} times", significant(1e3 * s, 3), significant(s / ours, 2))
            }
            (_, s, _) => s.map_or(String::new(), |s| significant(1e3 * s, 3)),
        };
        line("time, ms", String::new(), all(&time));
        line(
            "peak memory, MiB",
            String::new(),
            all(&|c| c.number("peak_mib").map_or(String::new(), |m| format!("{m:.0}"))),
        );
        let first = self.columns[0].answer.as_ref().ok().and_then(|a| a["answers"].as_object());
        for quantity in first.into_iter().flat_map(Map::keys) {
            let truth = self.truth.get(quantity).and_then(Value::as_f64);
            let cell =
                |c: &Column| c.answer.as_ref().map_or(String::new(), |a| estimate(&a["answers"][quantity], truth));
            line(quantity, truth.map_or(String::new(), |t| significant(t, 4)), all(&cell));
        }
        if !self.columns[0].curve().is_empty() {
            let cell = |c: &Column| match self.apart(c) {
                Some(apart) if c.program != "gyroid" => significant(apart, 2),
                _ => String::new(),
            };
            line(self.difference().0, String::new(), all(&cell));
        }
        out
    }
}

/// All sections as one table of Markdown.
pub fn lines(sections: &[Section]) -> Vec<String> {
    let width = sections.iter().map(|s| s.columns.len()).max().unwrap_or(1);
    let mut out = vec![
        format!("| | truth | gyroid{} |", " | peer".repeat(width - 1)),
        format!("|---|---|---{}|", "|---".repeat(width - 1)),
    ];
    out.extend(sections.iter().flat_map(|s| s.lines(width)));
    out
}

/// An estimate with its standard deviation, and in brackets how far it is off the truth; a dash where there is none.
fn estimate(answer: &Value, truth: Option<f64>) -> String {
    let Some(value) = answer["estimate"].as_f64() else { return "-".into() };
    let off = |decimals: usize| truth.map_or(String::new(), |t| format!(" ({:+.decimals$})", value - t));
    match answer["std"].as_f64() {
        Some(std) if std > 0.0 => {
            let decimals = (1 - magnitude(std)).max(0) as usize;
            format!("{value:.decimals$} ± {std:.decimals$}{}", off(decimals))
        }
        _ if truth.is_some_and(|t| t != 0.0 && value != t) => {
            let decimals = (3 - magnitude(value)).max(0) as usize;
            format!("{value:.decimals$}{}", off(decimals))
        }
        _ => significant(value, 4),
    }
}

/// Power of ten of the first digit.
fn magnitude(x: f64) -> i32 {
    if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 }
}

/// With so many significant digits, whole numbers as they are; as a power of ten where it is very small.
fn significant(x: f64, digits: i32) -> String {
    let decimals = (digits - 1 - magnitude(x)).max(0) as usize;
    if x == 0.0 || (x.fract() == 0.0 && x.abs() < 1e15) {
        format!("{x:.0}")
    } else if x.abs() < 1e-3 {
        format!("{x:.*e}", digits as usize - 1)
    } else {
        format!("{x:.decimals$}")
    }
}
