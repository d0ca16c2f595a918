//! PX4 flight logs (ULog): a header, the formats of the messages, and the messages.
//!
//! A damaged stretch ends at the next synchronisation message, as in PX4's own reader; a log that ends in a message
//! (power was cut) is read up to there. The crate `px4-ulog` is not used: it panics on damaged parameters.

use super::bytes::{Bytes, Little};
use super::fill::{Fill, Number, Ratio};
use super::format::{Format, Opened};
use super::head::Head;
use super::input::Input;
use super::px4;
use super::scalar::Scalar;
use super::source::{About, Facts, Source, Take};
use super::topics::{Container, Count, Listing, Stamp, Topic, has_gyro};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::columns::names::{Role, TimeKind};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::PathBuf;

/// Files that begin with ULog's magic number.
pub(crate) const FORMAT: Format = Format {
    name: "PX4 ULog",
    accepts: |head| head.starts_with(MAGIC),
    open: |input| Ok(Opened::Topics(Box::new(Ulog::open(input)?))),
};

const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// Magic, version and time.
const HEADER_BYTES: u64 = 16;
/// Every message begins with its size and type.
const MESSAGE_HEADER: u64 = 3;
/// A synchronisation message: its size, its type, its magic number.
const SYNC: &[u8] = &[8, 0, b'S', 0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];
/// Formats within formats beyond which they contain each other.
const DEEPEST: usize = 8;
const MOST_FIELDS: usize = 1024;
/// Fields of all messages that are logged: PX4 has some ten thousand.
const MOST_IN_ALL: usize = 1 << 17;

/// ULog's names of the numbers.
fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "int8_t" => Scalar::I8,
        "uint8_t" | "bool" | "char" => Scalar::U8,
        "int16_t" => Scalar::I16,
        "uint16_t" => Scalar::U16,
        "int32_t" => Scalar::I32,
        "uint32_t" => Scalar::U32,
        "int64_t" => Scalar::I64,
        "uint64_t" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => return None,
    })
}

/// The fields of a message in their places.
#[derive(Debug, Clone, Default)]
struct Layout {
    fields: Vec<(String, String, Scalar, usize)>,
    size: usize,
    /// Fields met so far, also those that hold nothing.
    met: usize,
}

/// A message that is logged under a number.
#[derive(Debug, Clone)]
struct Logged {
    topic: String,
    name: String,
    layout: std::result::Result<Layout, String>,
    count: Count,
}

impl Logged {
    fn columns(&self) -> (Vec<Head>, Vec<Ratio>) {
        let fields = self.layout.as_ref().map(|l| l.fields.as_slice()).unwrap_or_default();
        let mut heads: Vec<Head> = fields.iter().map(|(name, type_name, ..)| Head::number(name, type_name)).collect();
        let ratios = px4::dress(&self.name, &mut heads, true);
        (heads, ratios)
    }
}

struct Ulog {
    path: PathBuf,
    file: File,
    logged: BTreeMap<u16, Logged>,
    listing: Listing,
}

impl Ulog {
    fn open(input: Input) -> Result<Self> {
        let path = input.path.clone();
        let source = path.display().to_string();
        let (file, sha256) = input.into_file()?;
        let mut formats: BTreeMap<String, String> = BTreeMap::new();
        let mut logged: BTreeMap<u16, Logged> = BTreeMap::new();
        let mut in_all = 0;
        let notes = walk(&mut Bytes::open(&path, &file, 0)?, &mut |kind, body, _| {
            match kind {
                b'F' => {
                    let text = String::from_utf8_lossy(body);
                    if let Some((name, fields)) = text.split_once(':') {
                        formats.insert(name.to_string(), fields.to_string());
                    }
                }
                b'A' => {
                    let (Some(instance), Some(id), Some(name)) = (body.u8(0), body.u16(1), body.get(3..)) else {
                        return Ok(true);
                    };
                    let name = String::from_utf8_lossy(name).into_owned();
                    let topic = format!("{name}/{instance}");
                    if in_all > MOST_IN_ALL {
                        return Ok(false);
                    }
                    let layout = layout(&name, &formats);
                    in_all += layout.as_ref().map_or(1, |l| l.met);
                    logged.entry(id).or_insert(Logged { topic, name, layout, count: Count::default() });
                }
                b'D' => {
                    let known = body.u16(0).and_then(|id| logged.get_mut(&id));
                    let Some(known) = known else { return Ok(false) };
                    // the time is the first field, in µs
                    let time_us = body.u64(2).unwrap_or_default();
                    known.count.add(time_us.cast_signed().saturating_mul(1000));
                }
                _ => {}
            }
            Ok(true)
        })?;
        let topic = |l: &Logged| Topic {
            name: l.topic.clone(),
            type_name: l.name.clone(),
            messages: l.count.messages,
            rate_hz: l.count.rate_hz(),
            gyro: has_gyro(&l.columns().0),
        };
        let mut topics: Vec<Topic> = Vec::new();
        for one in logged.values().map(topic) {
            if topics.iter().all(|t| t.name != one.name) {
                topics.push(one);
            }
        }
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        let about = About { source, format: FORMAT.name, sha256, notes };
        Ok(Self { path, file, logged, listing: Listing { about, topics } })
    }
}

/// The places of a message's fields; the error says what is amiss with its format.
fn layout(name: &str, formats: &BTreeMap<String, String>) -> std::result::Result<Layout, String> {
    let mut out = Layout::default();
    append("", name, formats, 0, &mut out)?;
    // padding at the end is not logged
    while out.fields.last().is_some_and(|f| f.0.rsplit('.').next().is_some_and(|n| n.starts_with("_padding"))) {
        if let Some((.., place)) = out.fields.pop() {
            out.size = place;
        }
    }
    out.fields.retain(|f| !f.0.contains("_padding") && f.1 != "char");
    Ok(out)
}

fn append(
    prefix: &str,
    name: &str,
    formats: &BTreeMap<String, String>,
    depth: usize,
    out: &mut Layout,
) -> std::result::Result<(), String> {
    let fields = formats.get(name).ok_or_else(|| format!("the format of {name} is missing"))?;
    if depth > DEEPEST {
        return Err(format!("formats within formats {DEEPEST} deep, at {name}"));
    }
    for field in fields.split(';').map(str::trim).filter(|f| !f.is_empty()) {
        let (kind, field) = field.split_once(' ').ok_or_else(|| format!("{field:?} is no field, in {name}"))?;
        let (kind, count) = match kind.strip_suffix(']').and_then(|k| k.split_once('[')) {
            Some((kind, n)) => (kind, Some(n.parse::<usize>().map_err(|_| format!("{n:?} is no length, in {name}"))?)),
            None => (kind, None),
        };
        for i in 0..count.unwrap_or(1) {
            let index = if count.is_some() { format!("[{i}]") } else { String::new() };
            let full = format!("{prefix}{field}{index}");
            out.met += 1;
            if out.met > MOST_FIELDS {
                return Err(format!("more than {MOST_FIELDS} fields, at {name}"));
            }
            match scalar(kind) {
                Some(scalar) => {
                    out.fields.push((full, kind.to_string(), scalar, out.size));
                    out.size += scalar.size();
                }
                None => append(&format!("{full}."), kind, formats, depth + 1, out)?,
            }
        }
    }
    Ok(())
}

impl Container for Ulog {
    fn listing(&self) -> &Listing {
        &self.listing
    }

    fn open(self: Box<Self>, topic: usize, stamp: Stamp) -> Result<Box<dyn Source>> {
        let topic = self.listing.topics[topic].name.clone();
        let own: Vec<u16> = self.logged.iter().filter(|(_, l)| l.topic == topic).map(|(id, _)| *id).collect();
        let unreadable = |why: &str| {
            Error::new(ErrorKind::Format, &self.listing.about.source, why)
                .at(format!("topic {topic}"))
                .hint("name another topic with --topic")
        };
        let first = own.first().map(|id| &self.logged[id]).ok_or_else(|| unreadable("is not logged"))?;
        let layout = first.layout.clone().map_err(|why| unreadable(&why))?;
        let (mut heads, ratios) = first.columns();
        if stamp == Stamp::Receipt && heads.iter().any(|h| h.role == Some(Role::Time(TimeKind::Host))) {
            heads.iter_mut().filter(|h| h.name == "timestamp_sample").for_each(|h| h.role = Some(Role::Other));
        }
        Ok(Box::new(OneTopic { own, layout, heads, ratios, topic, file: *self }))
    }
}

struct OneTopic {
    own: Vec<u16>,
    layout: Layout,
    heads: Vec<Head>,
    ratios: Vec<Ratio>,
    topic: String,
    file: Ulog,
}

impl Source for OneTopic {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn rows(&self) -> Option<u64> {
        self.file.listing.messages(&self.topic)
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { own, layout, ratios, topic, file, .. } = *self;
        let mut fill = Fill::new(wanted).with_ratios(&ratios);
        let (mut rows, mut short) = (0u64, None);
        let mut notes = walk(&mut Bytes::open(&file.path, &file.file, 0)?, &mut |kind, body, at| {
            let Some(id) = body.u16(0).filter(|_| kind == b'D') else { return Ok(true) };
            if !own.contains(&id) {
                return Ok(file.logged.contains_key(&id));
            }
            let fields = &body[2..];
            if fields.len() < layout.size {
                short.get_or_insert((at, fields.len()));
                return Ok(false);
            }
            for (column, (.., scalar, place)) in layout.fields.iter().enumerate() {
                fill.put(column, scalar.read(fields, *place, false).unwrap_or(Number::Missing));
            }
            rows += 1;
            fill.end_row(take)?;
            Ok(true)
        })?;
        if let (0, Some((at, length))) = (rows, short) {
            let found = format!("messages of {length} bytes, their format has {}", layout.size);
            return Err(Error::new(ErrorKind::Format, &file.listing.about.source, found)
                .at(format!("byte {at}, topic {topic}"))
                .hint("copy the log again"));
        }
        if !notes.is_empty() {
            notes.push(format!("{rows} messages of {topic} are read"));
        }
        Ok(file.listing.about.facts(Some(&topic), fill.finish(take)?, notes))
    }
}

/// Takes a message: its type, its body, and where it begins. False if it cannot be one.
type Meet<'a> = &'a mut dyn FnMut(u8, &[u8], u64) -> Result<bool>;

/// Hands every message to `meet`; says what was damaged, and where the log is cut off.
fn walk(bytes: &mut Bytes, meet: Meet<'_>) -> Result<Vec<String>> {
    const SHOWN: usize = 3;
    let mut notes = Vec::new();
    let mut body = Vec::new();
    let (mut stretches, mut skipped) = (0usize, 0u64);
    if !bytes.next(HEADER_BYTES, &mut body)? {
        return Err(bytes
            .damaged(bytes.at(), format!("the log is cut off in its header of {HEADER_BYTES} bytes"))
            .hint("copy the log again"));
    }
    let mut seen = 0u64;
    while bytes.left() > 0 {
        let at = bytes.at();
        let mut head = Vec::new();
        let whole = bytes.next(MESSAGE_HEADER, &mut head)?;
        let size = head.u16(0).unwrap_or_default();
        let kind = head.u8(2).unwrap_or_default();
        let known = whole && b"BFIMPQAROSDLC".contains(&kind) && size > 0;
        if known || !whole {
            if !whole || !bytes.next(u64::from(size), &mut body)? {
                let cut = bytes.len() - at;
                // a size that a flipped bit made reaches beyond the end as well: there is more behind it
                if resume(bytes, at + 1)?.is_none() {
                    notes
                        .push(format!("the log is cut off in the message at byte {at}: its last {cut} bytes are lost"));
                    break;
                }
            } else if meet(kind, &body, at)? {
                seen += 1;
                continue;
            }
        }
        let to = resume(bytes, at + 1)?;
        let Some(to) = to.filter(|_| seen > 0) else {
            return Err(bytes
                .damaged(at, "the log is damaged: this is no message, and there is no synchronisation after it")
                .hint("copy the log again"));
        };
        bytes.seek(to)?;
        stretches += 1;
        skipped += to - at;
        if stretches <= SHOWN {
            notes.push(format!(
                "the log is damaged at byte {at}: {} bytes are left out, up to the next synchronisation",
                to - at
            ));
        }
    }
    if stretches > SHOWN {
        notes.push(format!("the log is damaged in {stretches} places: {skipped} bytes are left out in all"));
    }
    Ok(notes)
}

/// Where the next synchronisation message begins.
fn resume(bytes: &mut Bytes, from: u64) -> Result<Option<u64>> {
    const WINDOW: u64 = 1 << 16;
    let mut window = Vec::new();
    let mut at = from;
    while at < bytes.len() {
        bytes.seek(at)?;
        bytes.next(WINDOW, &mut window)?;
        if let Some(i) = window.windows(SYNC.len()).position(|w| w == SYNC) {
            return Ok(Some(at + i as u64));
        }
        // the next window begins early enough to hold one that straddles the border
        if window.len() < SYNC.len() || bytes.left() == 0 {
            break;
        }
        at += (window.len() - SYNC.len() + 1) as u64;
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formats(all: &[(&str, &str)]) -> BTreeMap<String, String> {
        all.iter().map(|(n, f)| (n.to_string(), f.to_string())).collect()
    }

    #[test]
    fn fields_have_their_places() {
        let all = formats(&[
            ("a", "uint64_t timestamp;float[3] gyro_rad;b inner;uint8_t n;uint8_t[3] _padding0;"),
            ("b", "int16_t x;char[2] c;uint8_t[2] _padding0;double y;"),
        ]);
        let layout = layout("a", &all).unwrap();
        let places: Vec<(&str, usize)> = layout.fields.iter().map(|f| (f.0.as_str(), f.3)).collect();
        let expected = [
            ("timestamp", 0),
            ("gyro_rad[0]", 8),
            ("gyro_rad[1]", 12),
            ("gyro_rad[2]", 16),
            ("inner.x", 20),
            ("inner.y", 26),
            ("n", 34),
        ];
        assert_eq!((places.as_slice(), layout.size), (&expected[..], 35));
    }

    #[test]
    fn formats_that_never_end_are_refused() {
        assert!(layout("a", &formats(&[("a", "a x;")])).unwrap_err().contains("deep"));
        assert!(layout("a", &formats(&[("a", "uint8_t[99999999] x;")])).unwrap_err().contains("fields"));
        assert!(layout("a", &formats(&[("a", "b x;")])).unwrap_err().contains("missing"));
        assert!(layout("a", &formats(&[("a", "x")])).is_err());
    }
}
