//! A column before its cells are read: its name, the type of its cells, its unit and meaning.

use crate::ingest::columns::names;
use crate::ingest::columns::names::{Named, Role};

/// Type of the cells of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Numbers.
    Number,
    /// Dates with time of day; read as nanoseconds since 1970-01-01 UTC.
    Instant,
    /// Anything else: listed, never read.
    Other,
}

/// A column before its cells are read.
#[derive(Debug, Clone)]
pub(crate) struct Head {
    /// Name as in the file.
    pub name: String,
    /// Type of its cells.
    pub kind: Kind,
    /// The format's own word for the type.
    pub type_name: String,
    /// Unit that the file states beside the name (a units row), or that the format lays down.
    pub unit: Option<String>,
    /// Meaning of the column where the format states it; otherwise its name tells.
    pub role: Option<Role>,
}

impl Head {
    /// A column of numbers.
    pub(crate) fn number(name: impl Into<String>, type_name: impl Into<String>) -> Self {
        Self { name: name.into(), kind: Kind::Number, type_name: type_name.into(), unit: None, role: None }
    }

    /// The same column, in `unit`.
    pub(crate) fn with_unit(mut self, unit: &str) -> Self {
        self.unit = Some(unit.to_string());
        self
    }

    /// The same column, which is `role` whatever its name says.
    pub(crate) fn with_role(mut self, role: Role) -> Self {
        self.role = Some(role);
        self
    }

    /// Meaning of the column, and its unit.
    pub(crate) fn named(&self) -> Named {
        match self.role {
            Some(role) => Named { role, unit: self.unit.clone() },
            None => names::parse(&self.name),
        }
    }
}

/// A cell that should be a number and is not.
#[derive(Debug, Clone)]
pub(crate) struct BadCell {
    pub row: usize,
    pub text: String,
}

/// Column names for a message: all of them, or the first of very many.
pub(crate) fn list(heads: &[Head]) -> String {
    const MOST: usize = 40;
    let mut names: Vec<_> = heads.iter().take(MOST).map(|h| h.name.clone()).collect();
    if heads.len() > MOST {
        names.push(format!("and {} more", heads.len() - MOST));
    }
    names.join(", ")
}
