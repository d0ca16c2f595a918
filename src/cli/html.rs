//! `--html FILE`: the result as a page.

use super::output::{Output, command_line};
use clap::Args;
use gyroid::files::{OutputFile, Plan, sha256};
use gyroid::report::html::Origin;
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Option of the commands that write a page.
#[derive(Debug, Clone, Args)]
pub(crate) struct HtmlArgs {
    /// Write the result as a page here (.html): one file with figures that zoom, to be passed on
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

impl HtmlArgs {
    /// Adds the page to what the command writes.
    pub(super) fn planned(&self, plan: Plan) -> Plan {
        plan.writes("--html", &self.html)
    }

    /// Whether a page is wanted.
    pub(super) fn wanted(&self) -> bool {
        self.html.is_some()
    }

    /// Claims the page, before the work begins.
    pub(super) fn claim(&self) -> Result<Option<OutputFile>> {
        let Some(path) = &self.html else { return Ok(None) };
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if !matches!(ending.as_deref(), Some("html" | "htm")) {
            return Err(Error::new(ErrorKind::Usage, path.display(), "is not the name of a page")
                .at("--html")
                .hint("let the name end in .html"));
        }
        OutputFile::claim(path).map(Some)
    }
}

/// The command as it was typed, and the hashes of the files at `paths`; a folder has none.
pub(crate) fn origin<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Result<Origin> {
    let hashed = |path: P| Ok((path.as_ref().display().to_string(), sha256(path.as_ref())?));
    let files = paths.into_iter().filter(|path| path.as_ref().is_file());
    Ok(Origin { command: command_line(), files: files.map(hashed).collect::<Result<_>>()? })
}

/// Writes a page into the file that was claimed for it, and says so.
pub(crate) fn write(mut file: OutputFile, page: &str, output: &Output) -> Result<()> {
    file.write_all(page.as_bytes())?;
    let target = file.target().display().to_string();
    file.commit()?;
    output.say(format!("wrote {target}: open it in a browser"));
    Ok(())
}
