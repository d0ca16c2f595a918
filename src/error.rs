//! The one error of the library: which file or input, where in it, what was found, and the mend.

use std::fmt;

/// What kind of thing went wrong, for programs that react to it. The text for people is in [`Error`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The operating system refused to read or write.
    Io,
    /// The file is not of the format that it claims, or is truncated.
    Format,
    /// A column or channel is missing or ambiguous.
    Column,
    /// The unit is unknown, missing or contradicted by the data.
    Unit,
    /// The time axis cannot be used.
    Time,
    /// A value is not a finite number, or outside what is physically possible.
    Value,
    /// There are too few samples for what was asked.
    TooShort,
    /// A configuration key is missing, unknown or out of range.
    Config,
    /// The configuration was changed after it was written.
    Checksum,
    /// A computation did not lead to a usable number.
    Numeric,
    /// Options that contradict each other.
    Usage,
}

/// Names the input, the place in it, what was found there, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// What kind of thing went wrong.
    pub kind: ErrorKind,
    /// The file or argument that is at fault.
    pub input: String,
    /// Row, column, key or byte in it, where there is one.
    pub place: Option<String>,
    /// What was found.
    pub found: String,
    /// What to do about it.
    pub mend: Option<String>,
}

/// Result with the library's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error in `input`: `found` says what was met there.
    pub fn new(kind: ErrorKind, input: impl fmt::Display, found: impl fmt::Display) -> Self {
        Self { kind, input: input.to_string(), place: None, found: found.to_string(), mend: None }
    }

    /// Adds the row, column, key or byte.
    #[must_use]
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.place = Some(place.to_string());
        self
    }

    /// Adds what the user can do.
    #[must_use]
    pub fn mend(mut self, mend: impl fmt::Display) -> Self {
        self.mend = Some(mend.to_string());
        self
    }

    /// Replaces the input's name: inner layers that see only numbers say "log", the outer one knows the file.
    #[must_use]
    pub fn named(mut self, input: impl fmt::Display) -> Self {
        self.input = input.to_string();
        self
    }

    /// An operating system error on `path`, with the mend that fits its kind.
    pub fn io(path: impl AsRef<std::path::Path>, error: &std::io::Error) -> Self {
        use std::io::ErrorKind as K;
        let mend = match error.kind() {
            K::NotFound => "check the path",
            K::PermissionDenied => "check the permissions, or choose another place",
            K::IsADirectory => "name a file in it",
            K::StorageFull => "free some space, or choose another place",
            _ => "check the file and its disk",
        };
        Self::new(ErrorKind::Io, path.as_ref().display(), error).mend(mend)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.input)?;
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        write!(f, "{}", self.found)?;
        match &self.mend {
            Some(mend) => write!(f, " ({mend})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Error {}
