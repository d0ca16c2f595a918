//! Output of every command: text on standard output, JSON to a file or standard output, errors on standard error.

use super::outcome::Answer;
use anstyle::AnsiColor;
use clap::Args;
use gyroid::files::{OutputFile, Plan, mark};
use gyroid::units::duration_text;
use gyroid::{Error, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::borrow::Cow;
use std::cell::RefCell;
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Options that every command takes.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Write the result as JSON to FILE, or to standard output with `-`
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,
    /// Print nothing but errors (and JSON, where asked for)
    #[arg(long, short)]
    pub quiet: bool,
    /// Replace also files that gyroid did not write, such as any CSV
    #[arg(long)]
    pub force: bool,
}

/// Where a command's words go; outputs are claimed before the work begins.
pub(crate) struct Output {
    command: &'static str,
    json: Json,
    silent: bool,
}

/// Clears its line when the work is done.
pub(crate) struct Working(ProgressBar);

impl Working {
    /// Says what is being done now.
    pub(super) fn show(&self, what: impl Into<Cow<'static, str>>) {
        self.0.set_message(what);
    }

    /// Counts what is done of all there is, and shows how long the rest will take.
    pub(super) fn counter(&self, what: String) -> impl Fn(usize, usize) + Sync + use<> {
        let (begun, bar) = (Instant::now(), self.0.clone());
        move |done, all| {
            let rest_s = begun.elapsed().as_secs_f64() / done.max(1) as f64 * all.saturating_sub(done) as f64;
            let rest = if done > 0 && done < all { format!(", {} left", duration_text(rest_s)) } else { String::new() };
            bar.set_message(format!("{what} {done} of {all}{rest}"));
        }
    }

    /// Prints something else meanwhile.
    pub(super) fn aside(&self, print: impl FnOnce()) {
        self.0.suspend(print);
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

thread_local! {
    /// Answer of the command of this thread so far, where a caller wants it.
    static HEARD: RefCell<Option<Answer>> = const { RefCell::new(None) };
    /// The command of this thread.
    static TYPED: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Runs a command, and keeps what it says.
pub(super) fn captured<T>(command: impl FnOnce() -> T) -> (T, Answer) {
    let nothing = Answer { json: serde_json::Value::Null, text: String::new(), fit_for_use: false };
    let outer = HEARD.replace(Some(nothing.clone()));
    let done = command();
    (done, HEARD.replace(outer).unwrap_or(nothing))
}

/// Whether somebody keeps what the command says; then `keep` is given it.
fn heard(keep: impl FnOnce(&mut Answer)) -> bool {
    HEARD.with_borrow_mut(|heard| heard.as_mut().map(keep).is_some())
}

/// Runs a command that was typed as `typed`.
pub(super) fn as_typed<T>(typed: String, command: impl FnOnce() -> T) -> T {
    let outer = TYPED.replace(typed);
    let done = command();
    TYPED.set(outer);
    done
}

enum Json {
    No,
    Stdout,
    File(OutputFile),
}

impl Output {
    /// Checks what `command` is to read and write (the JSON file is added to that), before anything is read, and claims the
    /// JSON file, if there is to be one.
    pub(super) fn open(common: &Common, command: &'static str, plan: Plan) -> Result<Self> {
        let json_file = common.json.as_ref().filter(|path| path.as_os_str() != "-");
        plan.writes("--json", json_file).check(common.force)?;
        let json = match &common.json {
            None => Json::No,
            Some(path) if path.as_os_str() == "-" => Json::Stdout,
            Some(path) => Json::File(OutputFile::claim(path)?),
        };
        // JSON on standard output must stay parseable: the text then gives way
        let silent = common.quiet || matches!(json, Json::Stdout);
        Ok(Self { command, json, silent })
    }

    /// The command, as its JSON's schema names it.
    pub(super) fn command(&self) -> &'static str {
        self.command
    }

    /// Whether text is wanted.
    pub(super) fn talks(&self) -> bool {
        !self.silent
    }

    /// Whether somebody wants the JSON.
    pub(super) fn answers(&self) -> bool {
        !matches!(self.json, Json::No) || heard(|_| {})
    }

    /// Shows on a terminal what is being done, from the second second on, until the guard is dropped.
    pub(super) fn working(&self, what: &'static str) -> Working {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if self.silent || heard(|_| {}) {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
            bar.set_style(style);
        }
        bar.set_message(what);
        // the first tick comes after this pause: what is done by then never shows
        bar.enable_steady_tick(Duration::from_secs(1));
        Working(bar)
    }

    /// Prints a text for people, unless silent. A closed pipe (`| head`) is not an error.
    pub(super) fn say(&self, text: impl AsRef<str>) {
        if self.silent || heard(|answer| answer.text += &format!("{}\n", text.as_ref())) {
            return;
        }
        let mut out = anstream::stdout().lock();
        let _ = writeln!(out, "{}", painted(text.as_ref()));
    }

    /// Writes the JSON where it was asked for, the schema before all else.
    pub(super) fn finish(self, value: &serde_json::Value) -> Result<()> {
        let value = with_schema(self.command, value);
        let text = if matches!(self.json, Json::No) { String::new() } else { format!("{value:#}\n") };
        heard(|answer| answer.json = value);
        match self.json {
            Json::No => Ok(()),
            Json::Stdout => {
                let _ = std::io::stdout().lock().write_all(text.as_bytes());
                Ok(())
            }
            Json::File(mut file) => {
                file.write_all(text.as_bytes())?;
                file.commit()
            }
        }
    }
}

/// A command's JSON with the key by which its kind is known.
pub(crate) fn with_schema(command: &str, value: &serde_json::Value) -> serde_json::Value {
    let mut marked = serde_json::json!({ "schema": mark::json_schema(command) });
    if let (Some(all), Some(own)) = (marked.as_object_mut(), value.as_object()) {
        all.extend(own.clone());
    }
    marked
}

/// Prints an error: what and where on the first line, the hint on the second.
pub(crate) fn report(error: &Error) {
    let place = error.place.as_ref().map(|p| format!("{p}: ")).unwrap_or_default();
    let mut err = anstream::stderr().lock();
    let (red, cyan) = (AnsiColor::Red.on_default().bold(), AnsiColor::Cyan.on_default());
    let _ = writeln!(err, "{red}error:{red:#} {}: {place}{}", error.input, error.found);
    if let Some(hint) = &error.hint {
        let _ = writeln!(err, "  {cyan}hint:{cyan:#} {hint}");
    }
}

/// Beginnings of lines that stand out, with whether they are good news. Those before others that they begin with.
const VERDICTS: [(&str, bool); 8] = [
    ("NOT FIT FOR USE", false),
    ("FIT FOR USE", true),
    ("NOT EXPLAINED", false),
    ("EXPLAINED", true),
    ("IDENTIFIED", true),
    ("NO GAP", true),
    ("UNKNOWN", false),
    ("CANNOT TELL", false),
];

/// A text with its verdicts in colour; what is no terminal, and NO_COLOR, take that away again.
fn painted(text: &str) -> Cow<'_, str> {
    let verdict = |line: &str| VERDICTS.iter().find(|(start, _)| line.starts_with(start)).copied();
    if !text.lines().any(|line| verdict(line).is_some()) {
        return text.into();
    }
    let paint = |line: &str| match verdict(line) {
        Some((start, good)) => {
            let style = if good { AnsiColor::Green } else { AnsiColor::Yellow }.on_default().bold();
            format!("{style}{start}{style:#}{}", &line[start.len()..])
        }
        None => line.to_string(),
    };
    text.split('\n').map(paint).collect::<Vec<_>>().join("\n").into()
}

/// The command as it was typed, for provenance.
pub(crate) fn command_line() -> String {
    TYPED.with_borrow(Clone::clone)
}

/// Arguments, of which the first is the program's name, as they are typed in a shell.
pub(super) fn typed(args: &[OsString]) -> String {
    let quote = |arg: String| if arg.contains(char::is_whitespace) { format!("'{arg}'") } else { arg };
    let arguments = args.iter().skip(1).map(|a| quote(a.to_string_lossy().into_owned()));
    std::iter::once("gyroid".to_string()).chain(arguments).collect::<Vec<_>>().join(" ")
}
