//! The mark by which gyroid knows a file that it wrote, so that it may replace it unasked.
//!
//! | format | mark |
//! |---|---|
//! | configuration | `[provenance]` with a checksum that fits; without provenance, the digest in the last line |
//! | JSON | `schema` is a text that begins with `gyroid.` |
//! | Parquet | key `gyroid` in the file's metadata |
//! | PNG | text chunk `Software` |
//! | SVG, HTML and other text | [`text()`] near the beginning |
//! | MCAP of results | [`text()`] as the library of its header; a live recording is the user's |
//!
//! A configuration that was changed by hand has lost its mark: its checksum no longer fits. CSV has no place for one.

use crate::unwind;
use polars_parquet::parquet::read::read_metadata;
use polars_parquet::write::KeyValue;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{BufReader, Read};
use std::ops::Range;
use std::path::Path;

/// The key in the metadata of Parquet files.
const PARQUET_KEY: &str = "gyroid";
/// Keyword of the text chunk in PNG files, from the PNG specification's list.
const PNG_KEYWORD: &str = "Software";
/// Beginning of a mark in text; a version follows.
const TEXT: &str = "written by gyroid ";
/// The first bytes of a text, in which its mark must lie.
const HEAD_BYTES: usize = 4096;
/// The key that holds the checksum of a configuration with provenance.
const CHECKSUM: &str = "checksum = \"";
/// Begins the last line of a configuration without provenance.
const DIGEST: &str = "# written by gyroid, sha256 of the lines above: ";
/// A text that is larger holds no configuration, bytes.
const MOST_BYTES: u64 = 1 << 24;

/// The mark of a text, for a comment or another place that is not read as content: `written by gyroid 0.1.0`.
#[must_use]
pub fn text() -> String {
    format!("{TEXT}{}", env!("CARGO_PKG_VERSION"))
}

/// The value of the key `schema` of what `command` writes as JSON: `gyroid.fit/1`.
#[must_use]
pub(crate) fn json_schema(command: &str) -> String {
    format!("gyroid.{command}/1")
}

/// Keyword and text of the chunk in a PNG file.
pub(crate) fn png() -> (String, String) {
    (PNG_KEYWORD.into(), format!("gyroid {}", env!("CARGO_PKG_VERSION")))
}

/// The entry in the metadata of a Parquet file.
pub(super) fn parquet() -> KeyValue {
    KeyValue { key: PARQUET_KEY.into(), value: Some(env!("CARGO_PKG_VERSION").into()) }
}

/// Ends a configuration without provenance with the digest of its lines.
#[must_use]
pub(crate) fn with_digest(text: String) -> String {
    let digest = sha256_hex(&text);
    format!("{text}{DIGEST}{digest}\n")
}

/// Where the value of the last `checksum = "..."` line of a configuration stands.
pub(crate) fn checksum_value(text: &str) -> Option<Range<usize>> {
    let at = if text.starts_with(CHECKSUM) { 0 } else { text.rfind(&format!("\n{CHECKSUM}"))? + 1 };
    let start = at + CHECKSUM.len();
    let end = start + text[start..].find('"')?;
    Some(start..end)
}

/// SHA-256 of a text, as hexadecimal digits.
pub(crate) fn sha256_hex(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect()
}

/// Whether gyroid wrote the file at `path`, and nobody changed it where that can be told. A file that cannot be read is nobody's
/// but the user's.
#[must_use]
pub fn is_own(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let mut head = Vec::new();
    if file.take(HEAD_BYTES as u64).read_to_end(&mut head).is_err() {
        return false;
    }
    match head.as_slice() {
        [b'P', b'A', b'R', b'1', ..] => of_parquet(path),
        [0x89, b'P', b'N', b'G', ..] => of_png(path),
        head if head.trim_ascii_start().first() == Some(&b'{') => of_json(path),
        head => of_text(&String::from_utf8_lossy(head)) || of_configuration(path),
    }
}

fn of_parquet(path: &Path) -> bool {
    // the decoder may give up on a damaged file by a panic
    let read = || {
        let metadata = read_metadata(&mut File::open(path).ok()?).ok()?;
        Some(metadata.key_value_metadata().as_ref()?.iter().any(|entry| entry.key == PARQUET_KEY))
    };
    unwind::caught(read).flatten().unwrap_or(false)
}

fn of_png(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let Ok(reader) = png::Decoder::new(BufReader::new(file)).read_info() else { return false };
    let chunks = &reader.info().uncompressed_latin1_text;
    chunks.iter().any(|chunk| chunk.keyword == PNG_KEYWORD && chunk.text.starts_with("gyroid "))
}

fn of_json(path: &Path) -> bool {
    #[derive(Deserialize)]
    struct Marked {
        schema: String,
    }
    let Ok(file) = File::open(path) else { return false };
    serde_json::from_reader(BufReader::new(file)).is_ok_and(|m: Marked| m.schema.starts_with("gyroid."))
}

/// Whether a version follows the words of the mark.
fn of_text(head: &str) -> bool {
    let mut after = head.match_indices(TEXT).map(|(at, _)| &head[at + TEXT.len()..]);
    after.any(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
}

fn of_configuration(path: &Path) -> bool {
    if std::fs::metadata(path).is_ok_and(|m| m.len() > MOST_BYTES) {
        return false;
    }
    let Ok(text) = std::fs::read_to_string(path) else { return false };
    let text = text.replace("\r\n", "\n");
    if let Some(at) = text.rfind(DIGEST) {
        return sha256_hex(&text[..at]) == text[at + DIGEST.len()..].trim_end();
    }
    checksum_value(&text).is_some_and(|at| sha256_hex(&format!("{}{}", &text[..at.start], &text[at.end..])) == text[at])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(bytes: impl AsRef<[u8]>) -> bool {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file");
        std::fs::write(&path, bytes).unwrap();
        is_own(&path)
    }

    #[test]
    fn a_mark_is_found_in_each_kind_of_text_and_nothing_else_is_one() {
        assert!(own(r#"{"schema": "gyroid.fit/1", "a": [1]}"#) && own(r#"{"a": 1, "schema": "gyroid.noise/1"}"#));
        assert!(!own(r#"{"schema": 1}"#) && !own(r#"{"schema": "gyroid.fit/1""#) && !own("{}"));
        assert!(own(format!("<svg><metadata>{}</metadata></svg>", text())) && !own("<svg>gyroid</svg>"));
        assert!(!own("# this was written by gyroid and me\na = 1\n"));
        assert!(!own("") && !own([0xff, 0xfe, 0x00]) && !own("t_s,gyro_z_rad_s\n0,1\n"));
        assert!(!own("PAR1") && !own([0x89, b'P', b'N', b'G', 0, 0]));
    }

    #[test]
    fn a_configuration_that_was_changed_is_the_user_s() {
        let text = with_digest("schema = 1\n".into());
        assert!(own(&text) && own(text.replace('\n', "\r\n")));
        assert!(!own(text.replace("= 1", "= 2")) && !own(format!("{text}kind = \"driving\"\n")));
        let empty = "a = 1\n[provenance]\nchecksum = \"\"\n";
        let signed = empty.replace("\"\"", &format!("\"{}\"", sha256_hex(empty)));
        assert!(own(&signed) && !own(signed.replace("a = 1", "a = 2")) && !own(empty));
    }

    #[test]
    fn what_is_not_there_is_not_gyroid_s() {
        assert!(!is_own(Path::new("no/such/file.json")));
    }
}
