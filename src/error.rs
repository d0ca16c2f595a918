//! The library's error type: file or input, place in it, fault, and advice.

use std::fmt;

/// Kind of error, for programs that react to it. The text for people is in [`Error`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The operating system refused to read or write.
    Io,
    /// A file of the user's is in the place of an output.
    Exists,
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

/// An error with the input, the place in it, the fault that was found, and advice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// Kind of error.
    pub kind: ErrorKind,
    /// The file or argument that is at fault.
    pub input: String,
    /// Row, column, key or byte in it, where there is one.
    pub place: Option<String>,
    /// Description of the fault.
    pub found: String,
    /// Advice on how to correct it.
    pub hint: Option<String>,
}

/// Names longer than this, in bytes, are not compared.
const LONGEST_NAME: usize = 200;

/// The name in `known` that `name` was probably meant for. It is the one with the fewest letters left out, put in,
/// replaced or swapped, but no more than a third of its letters; case does not count, and whole names as well as the
/// parts after the last point are compared. Else it is the first one that continues `name` with a unit or the like
/// (`gyro_z` for `gyro_z_rad_s`).
#[must_use]
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.trim().to_lowercase();
    let known: Vec<&str> = known.into_iter().collect();
    let goes_on = |known: &&&str| name.len() > 2 && known.strip_prefix(&name).is_some_and(|rest| rest.starts_with('_'));
    let most = (name.chars().count() / 3).max(1);
    let near = |word: &str| {
        // the distance takes the product of both lengths, and what stands in a file may be of any length
        if name.len().max(word.len()) > LONGEST_NAME {
            return None;
        }
        let far = strsim::damerau_levenshtein(&name, &word.to_lowercase());
        (far <= most && far < word.chars().count()).then_some(far)
    };
    let distance = |known: &'a str| {
        let tail = known.rsplit('.').next().unwrap_or(known);
        Some((near(known).into_iter().chain(near(tail)).min()?, known))
    };
    let near = known.iter().copied().filter_map(distance).min_by_key(|(far, _)| *far).map(|(_, known)| known);
    near.or_else(|| known.iter().find(goes_on).copied())
}

/// The hint for a `name` that is none of `known`: the nearest one, and all there are.
#[must_use]
pub(crate) fn one_of(name: &str, known: &[&str]) -> String {
    let all = format!("there are {}", known.join(", "));
    nearest(name, known.iter().copied()).map_or_else(|| all.clone(), |meant| format!("did you mean {meant}? {all}"))
}

/// Most characters of a part of an error.
const LONGEST: usize = 2000;

/// A part of an error as it can be shown on one line: names in a file may be of any length, and hold line ends and what
/// steers a terminal.
fn shown(part: impl fmt::Display) -> String {
    let text = part.to_string();
    let end = text.char_indices().nth(LONGEST).map_or(text.len(), |(end, _)| end);
    if end == text.len() && !text.contains(char::is_control) {
        return text;
    }
    let more = if end < text.len() { " ..." } else { "" };
    text[..end].replace(char::is_control, " ") + more
}

/// Result with the library's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error in `input`; `found` describes the fault.
    pub fn new(kind: ErrorKind, input: impl fmt::Display, found: impl fmt::Display) -> Self {
        Self { kind, input: shown(input), place: None, found: shown(found), hint: None }
    }

    /// Adds the row, column, key or byte.
    #[must_use]
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.place = Some(shown(place));
        self
    }

    /// Adds the advice.
    #[must_use]
    pub fn hint(mut self, hint: impl fmt::Display) -> Self {
        self.hint = Some(shown(hint));
        self
    }

    /// Puts the name that was probably meant before the advice.
    #[must_use]
    pub(crate) fn meant(mut self, name: Option<&str>) -> Self {
        if let Some(name) = name {
            let question = format!("did you mean {name:?}?");
            self.hint = Some(self.hint.map_or(question.clone(), |hint| format!("{question} {hint}")));
        }
        self
    }

    /// Replaces the input's name: inner layers that see only numbers say "log", the outer one knows the file.
    #[must_use]
    pub fn named(mut self, input: impl fmt::Display) -> Self {
        self.input = shown(input);
        self
    }

    /// An operating system error on `path`, with the hint that fits its kind.
    pub fn io(path: impl AsRef<std::path::Path>, error: &std::io::Error) -> Self {
        use std::io::ErrorKind as K;
        let hint = match error.kind() {
            K::NotFound => "check the path",
            K::PermissionDenied => "check the permissions, or choose another place",
            K::IsADirectory => "name a file in it",
            K::StorageFull => "free some space, or choose another place",
            _ => "check the file and its disk",
        };
        Self::new(ErrorKind::Io, path.as_ref().display(), error).hint(hint)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.input)?;
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        write!(f, "{}", self.found)?;
        match &self.hint {
            Some(hint) => write!(f, " ({hint})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_pen_is_seen_through_and_nonsense_is_not() {
        let known = ["gyro.tone", "gyro.bias_step", "wheel.slip", "vehicle.payload"];
        for (name, meant) in [
            ("gyro.tome", "gyro.tone"),
            ("bias_step", "gyro.bias_step"),
            ("weel.slip", "wheel.slip"),
            ("paylaod", "vehicle.payload"),
        ] {
            assert_eq!(nearest(name, known), Some(meant), "{name}");
        }
        for name in ["", "x", "temperature", "quux"] {
            assert_eq!(nearest(name, known), None, "{name}");
        }
        assert_eq!(nearest("gyro.tone", []), None);
        let long = "x".repeat(1 << 20);
        assert_eq!(nearest(&long, [long.as_str(), "x"]), None);
        assert!(one_of("gyro.tome", &known).starts_with("did you mean gyro.tone? there are gyro.tone, "));
        assert!(one_of("quux", &known).starts_with("there are gyro.tone"));
    }

    #[test]
    fn whatever_stands_in_a_file_is_told_on_one_line() {
        let error = Error::new(ErrorKind::Column, "a\tb.csv", format!("{}\n\u{1b}[31mred", "x".repeat(9))).at("a\r\nb");
        assert_eq!(error.to_string(), "a b.csv: a  b: xxxxxxxxx  [31mred");
        let long = Error::new(ErrorKind::Column, "a.csv", "y").hint("\u{e9}".repeat(LONGEST + 1)).hint.unwrap();
        assert_eq!(long, "\u{e9}".repeat(LONGEST) + " ...");
    }

    #[test]
    fn slips_of_the_finger_are_recognised_and_other_words_are_not() {
        let names = ["gyro_z_rad_s", "gyro_x_rad_s", "t_s", "wheel_left_rad_s"];
        for (name, meant) in [
            ("gyro_z_rads", Some("gyro_z_rad_s")),
            ("GYRO_Z_RAD_S", Some("gyro_z_rad_s")),
            ("wehel_left_rad_s", Some("wheel_left_rad_s")),
            ("gyro_z", Some("gyro_z_rad_s")),
            ("gyro_zz", None),
            ("t", None),
            ("temperature", None),
        ] {
            assert_eq!(nearest(name, names), meant, "{name}");
        }
        let error = Error::new(ErrorKind::Column, "a.csv", "no column").hint("name one").meant(Some("t_s"));
        assert_eq!(error.to_string(), "a.csv: no column (did you mean \"t_s\"? name one)");
    }
}
