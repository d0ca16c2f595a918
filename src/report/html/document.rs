//! A page in the making: blocks in their order, all text escaped, written as one file.

use super::panel;
use super::text::escape;
use crate::error::Result;
use crate::files::mark;
use crate::report::plot::Panel;
use std::fmt::Write;

const CSS: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Most bytes of a page.
pub(super) const MOST_BYTES: usize = 2_000_000;
/// Points of a series that the script gets; fewer where the page would be too large.
const POINTS: usize = 4000;

/// The command that made a page.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Origin {
    /// The command as it was typed.
    pub command: String,
    /// Files that were read: name and SHA-256 in hexadecimal digits.
    pub files: Vec<(String, String)>,
}

/// Tone of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Good,
    Bad,
    Open,
}

/// A table whose first row is its head.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn new(head: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { head: head.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    pub(super) fn row(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    fn html(&self) -> String {
        let mut out = String::from("<div class=\"table\"><table><thead><tr>");
        for cell in &self.head {
            let _ = write!(out, "<th scope=\"col\">{}</th>", escape(cell));
        }
        out.push_str("</tr></thead><tbody>");
        for row in &self.rows {
            out.push_str("<tr>");
            for (i, cell) in row.iter().enumerate() {
                // the first cell names the row; numbers are laid right
                let number = cell.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '−' | '+' | '[' | '<'));
                let _ = match (i, number) {
                    (0, _) => write!(out, "<th scope=\"row\">{}</th>", escape(cell)),
                    (_, true) => write!(out, "<td class=\"number\">{}</td>", escape(cell)),
                    (_, false) => write!(out, "<td>{}</td>", escape(cell)),
                };
            }
            out.push_str("</tr>");
        }
        out + "</tbody></table></div>"
    }
}

enum Block {
    Html(String),
    Figure { panel: Box<Panel>, good: String },
}

/// A page in the making.
pub(super) struct Document {
    title: String,
    blocks: Vec<Block>,
}

impl Document {
    /// A page that begins with its verdict: `headline` in capitals, what it means, and of which recording.
    pub(super) fn new(title: &str, tone: Tone, verdict: &str, of: &str) -> Self {
        let (headline, meaning) = verdict.split_once(": ").unwrap_or((verdict, ""));
        let class = match tone {
            Tone::Good => "good",
            Tone::Bad => "bad",
            Tone::Open => "open",
        };
        let mut page = Self { title: title.into(), blocks: Vec::new() };
        page.push(format!(
            "<header><p class=\"of\">{}</p><h1 class=\"{class}\"><span>{}</span> {}</h1></header>",
            escape(of),
            escape(headline),
            escape(meaning)
        ));
        page
    }

    fn push(&mut self, html: String) {
        self.blocks.push(Block::Html(html));
    }

    /// Begins a section.
    pub(super) fn section(&mut self, title: &str) {
        self.push(format!("<h2>{}</h2>", escape(title)));
    }

    pub(super) fn paragraph(&mut self, text: &str) {
        if !text.trim().is_empty() {
            self.push(format!("<p>{}</p>", escape(text)));
        }
    }

    pub(super) fn list<T: AsRef<str>>(&mut self, items: impl IntoIterator<Item = T>) {
        let items: String =
            items.into_iter().map(|item| format!("<li>{}</li>", escape(item.as_ref()))).collect::<Vec<_>>().concat();
        if !items.is_empty() {
            self.push(format!("<ul>{items}</ul>"));
        }
    }

    /// Numbers that matter most: name, value, what is to be known beside it.
    pub(super) fn numbers<T: AsRef<str>>(&mut self, all: impl IntoIterator<Item = [T; 3]>) {
        let mut out = String::from("<dl class=\"numbers\">");
        for one in all {
            let [name, value, beside] = one.each_ref().map(|t| escape(t.as_ref()));
            let _ = write!(out, "<div><dt>{name}</dt><dd>{value}</dd><dd class=\"beside\">{beside}</dd></div>");
        }
        self.push(out + "</dl>");
    }

    pub(super) fn table(&mut self, table: &Table) {
        if !table.is_empty() {
            self.push(table.html());
        }
    }

    /// A figure, with a sentence on what a good one looks like.
    pub(super) fn figure(&mut self, panel: Panel, good: &str) {
        self.blocks.push(Block::Figure { panel: panel.into(), good: good.into() });
    }

    /// Text as it stands on a terminal, folded up.
    pub(super) fn folded(&mut self, summary: &str, text: &str) {
        self.push(format!(
            "<details><summary>{}</summary><pre>{}</pre></details>",
            escape(summary),
            escape(text.trim_end())
        ));
    }

    /// A table, folded up.
    pub(super) fn folded_table(&mut self, summary: &str, table: &Table) {
        if !table.is_empty() {
            self.push(format!("<details><summary>{}</summary>{}</details>", escape(summary), table.html()));
        }
    }

    /// The file, of at most [`MOST_BYTES`]: charts carry as many points as that allows.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if a figure holds a value that cannot be shown.
    pub(super) fn finish(mut self, origin: &Origin) -> Result<String> {
        self.origin(origin);
        let mut points = POINTS;
        loop {
            let page = self.page(points)?;
            if page.len() <= MOST_BYTES || points < 100 {
                return Ok(page);
            }
            points /= 2;
        }
    }

    fn origin(&mut self, origin: &Origin) {
        let mut out = String::from("<footer><h2>How this page was made</h2><dl>");
        let version = env!("CARGO_PKG_VERSION");
        let _ = write!(out, "<dt>command</dt><dd><code>{}</code></dd>", escape(&origin.command));
        let _ = write!(out, "<dt>version</dt><dd>gyroid {version}</dd>");
        for (name, hash) in &origin.files {
            let (name, hash) = (escape(name), escape(hash));
            let _ = write!(out, "<dt>{name}</dt><dd>SHA-256 <code>{hash}</code></dd>");
        }
        self.push(out + "</dl></footer>");
    }

    fn page(&self, points: usize) -> Result<String> {
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"generator\" content=\"{}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" \
             content=\"light dark\">\n<title>{}</title>\n<style>\n{CSS}</style>\n</head>\n<body>\n<main>\n",
            mark::text(),
            escape(&self.title)
        );
        let mut figures = 0;
        for block in &self.blocks {
            match block {
                Block::Html(html) => out += html,
                Block::Figure { panel, good } => {
                    figures += 1;
                    let title = escape(panel::title(panel));
                    let content = panel::html(panel, points, &format!("f{figures}"))?;
                    let _ = write!(out, "<figure><h3>{title}</h3>{content}<figcaption>");
                    let _ = write!(out, "<b>Good looks like this:</b> {}</figcaption></figure>", escape(good));
                }
            }
            out.push('\n');
        }
        let _ = write!(out, "</main>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n");
        Ok(out)
    }
}
