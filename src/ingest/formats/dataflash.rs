//! ArduPilot's DataFlash logs (`.bin`): messages that begin with a3 95 and a type, and FMT messages that describe them.
//!
//! Bytes that are no message are skipped up to the next message, as ground stations do, and reported.

use super::bytes::{Bytes, Little};
use super::fill::{Fill, Number};
use super::format::{Format, Opened};
use super::head::{Head, Kind};
use super::input::Input;
use super::source::{About, Facts, Source, Take};
use super::topics::{Container, Count, Listing, Stamp, Topic, has_gyro};
use crate::error::{Error, ErrorKind, Result};
use crate::ingest::columns::names;
use crate::ingest::columns::names::{Role, TimeKind};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::PathBuf;

/// Files that begin with the description of a message.
pub(crate) const FORMAT: Format = Format {
    name: "ArduPilot DataFlash",
    accepts: |head| head.starts_with(&[MAGIC[0], MAGIC[1], DESCRIPTION]),
    open: |input| Ok(Opened::Topics(Box::new(DataFlash::open(input)?))),
};

const MAGIC: [u8; 2] = [0xa3, 0x95];
const HEADER: usize = 3;
/// Type and length of FMT.
const DESCRIPTION: u8 = 128;
const DESCRIPTION_BYTES: usize = 89;

/// One field: its name, the letter of its type, and its place after the header.
#[derive(Debug, Clone, PartialEq)]
struct Field {
    name: String,
    letter: u8,
    at: usize,
}

/// A message as FMT describes it.
#[derive(Debug, Clone, PartialEq)]
struct Described {
    name: String,
    /// Length with the header, bytes.
    length: usize,
    fields: Vec<Field>,
    /// Place of the number of the sensor, where several log the same message.
    instance: Option<usize>,
}

/// Bytes of a field; none if the letter is unknown.
fn size(letter: u8) -> Option<usize> {
    Some(match letter {
        b'b' | b'B' | b'M' => 1,
        b'h' | b'H' | b'c' | b'C' | b'g' => 2,
        b'i' | b'I' | b'e' | b'E' | b'L' | b'f' | b'n' => 4,
        b'q' | b'Q' | b'd' => 8,
        b'N' => 16,
        b'Z' | b'a' => 64,
        _ => return None,
    })
}

fn type_name(letter: u8) -> &'static str {
    match letter {
        b'b' => "int8",
        b'B' | b'M' => "uint8",
        b'h' => "int16",
        b'H' => "uint16",
        b'c' => "int16 / 100",
        b'C' => "uint16 / 100",
        b'i' => "int32",
        b'I' => "uint32",
        b'e' => "int32 / 100",
        b'E' => "uint32 / 100",
        b'L' => "int32 / 1e7",
        b'f' => "float32",
        b'q' => "int64",
        b'Q' => "uint64",
        b'd' => "float64",
        _ => "text",
    }
}

fn number(letter: u8, bytes: &[u8], at: usize) -> Number {
    let signed = |bytes: Option<[u8; 4]>| bytes.map(i32::from_le_bytes);
    let number = match letter {
        b'b' => bytes.u8(at).map(|x| Number::Whole(i64::from(x.cast_signed()))),
        b'B' | b'M' => bytes.u8(at).map(|x| Number::Whole(i64::from(x))),
        b'h' => bytes.u16(at).map(|x| Number::Whole(i64::from(x.cast_signed()))),
        b'H' => bytes.u16(at).map(|x| Number::Whole(i64::from(x))),
        b'c' => bytes.u16(at).map(|x| Number::Double(f64::from(x.cast_signed()) / 100.0)),
        b'C' => bytes.u16(at).map(|x| Number::Double(f64::from(x) / 100.0)),
        b'i' => signed(bytes.array(at)).map(|x| Number::Whole(i64::from(x))),
        b'I' => bytes.u32(at).map(|x| Number::Whole(i64::from(x))),
        b'e' => signed(bytes.array(at)).map(|x| Number::Double(f64::from(x) / 100.0)),
        b'E' => bytes.u32(at).map(|x| Number::Double(f64::from(x) / 100.0)),
        b'L' => signed(bytes.array(at)).map(|x| Number::Double(f64::from(x) / 1e7)),
        b'f' => bytes.array(at).map(|b| Number::Single(f32::from_le_bytes(b))),
        b'q' => bytes.u64(at).map(|x| Number::Whole(x.cast_signed())),
        b'Q' => bytes.u64(at).map(Number::unsigned),
        b'd' => bytes.array(at).map(|b| Number::Double(f64::from_le_bytes(b))),
        _ => None,
    };
    number.unwrap_or(Number::Missing)
}

/// Text up to its first zero byte.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

impl Described {
    /// Reads the body of an FMT; with the type that it describes. None if it contradicts itself.
    fn read(body: &[u8]) -> Option<(u8, Self)> {
        let (id, length) = (body.u8(0)?, usize::from(body.u8(1)?));
        let (name, letters, labels) = (text(body.get(2..6)?), text(body.get(6..22)?), text(body.get(22..86)?));
        let mut labels = labels.split(',').map(str::trim).filter(|l| !l.is_empty());
        let mut fields = Vec::new();
        let mut at = 0;
        for letter in letters.bytes() {
            fields.push(Field { name: labels.next()?.to_string(), letter, at });
            at += size(letter)?;
        }
        (at + HEADER == length && !name.is_empty()).then_some((id, Self { name, length, fields, instance: None }))
    }

    /// Messages of several sensors in turn carry its number in a field `I`.
    fn with_instance(mut self) -> Self {
        let counted =
            ["IMU", "GYR", "ACC", "VIBE", "MAG", "BARO", "GPS", "GPA", "BAT", "RFND"].contains(&self.name.as_str());
        let own = self.fields.iter().find(|f| counted && f.name == "I" && matches!(f.letter, b'B' | b'b' | b'M'));
        self.instance = own.map(|f| f.at);
        self
    }

    fn time(&self) -> Option<&Field> {
        self.fields.first().filter(|f| ["TimeUS", "TimeMS"].contains(&f.name.as_str()))
    }

    /// When a message was logged, ns.
    fn time_ns(&self, body: &[u8]) -> Option<i64> {
        let time = self.time()?;
        let factor = if time.name == "TimeMS" { 1e6 } else { 1e3 };
        Some((number(time.letter, body, time.at).to_f64() * factor) as i64)
    }

    fn heads(&self, stamp: Stamp) -> Vec<Head> {
        let gyro = self.name == "GYR" || self.name.trim_end_matches(|c: char| c.is_ascii_digit()) == "IMU";
        let sampled = self.fields.iter().any(|f| f.name == "SampleUS");
        let of = |f: &Field| {
            let kind = if type_name(f.letter) == "text" { Kind::Other } else { Kind::Number };
            let head = Head { kind, ..Head::number(&f.name, type_name(f.letter)) };
            let (role, unit) = match f.name.as_str() {
                "SampleUS" if stamp == Stamp::Header => (Role::Time(TimeKind::SincePowerOn), Some("us")),
                "TimeUS" if sampled => (Role::Time(TimeKind::Host), Some("us")),
                "TimeUS" => (Role::Time(TimeKind::SincePowerOn), Some("us")),
                "TimeMS" => (Role::Time(TimeKind::SincePowerOn), Some("ms")),
                "T" | "Temp" if gyro => (Role::Temperature, Some("degC")),
                "GyrX" | "GyrY" | "GyrZ" if gyro => (names::parse(&f.name).role, Some("rad/s")),
                // GX of the filter is a bias in °/s
                _ => (Role::Other, None),
            };
            match unit {
                Some(unit) => head.with_role(role).with_unit(unit),
                None => head.with_role(role),
            }
        };
        self.fields.iter().map(of).collect()
    }

    /// Name of the topic that a message belongs to.
    fn topic(&self, body: &[u8]) -> String {
        match self.instance.and_then(|at| body.u8(at)) {
            Some(n) => format!("{}/{n}", self.name),
            None => self.name.clone(),
        }
    }
}

struct DataFlash {
    path: PathBuf,
    file: File,
    described: BTreeMap<u8, Described>,
    listing: Listing,
}

impl DataFlash {
    fn open(input: Input) -> Result<Self> {
        let path = input.path.clone();
        let source = path.display().to_string();
        let (file, sha256) = input.into_file()?;
        let mut counts: BTreeMap<(u8, Option<u8>), Count> = BTreeMap::new();
        let mut bytes = Bytes::open(&path, &file, 0)?;
        let (described, notes) = walk(&mut bytes, &mut |id, described, body, _| {
            let instance = described.instance.and_then(|at| body.u8(at));
            counts.entry((id, instance)).or_default().add(described.time_ns(body).unwrap_or_default());
            Ok(())
        })?;
        let mut topics: Vec<Topic> = Vec::new();
        for ((id, instance), count) in &counts {
            let Some(one) = described.get(id) else { continue };
            let name = instance.map_or(one.name.clone(), |n| format!("{}/{n}", one.name));
            topics.push(Topic {
                name,
                type_name: one.name.clone(),
                messages: count.messages,
                rate_hz: one.time().and_then(|_| count.rate_hz()),
                gyro: has_gyro(&one.heads(Stamp::Header)),
            });
        }
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        topics.dedup_by(|a, b| a.name == b.name);
        let about = About { source, format: FORMAT.name, sha256, notes };
        Ok(Self { path, file, described, listing: Listing { about, topics } })
    }
}

impl Container for DataFlash {
    fn listing(&self) -> &Listing {
        &self.listing
    }

    fn open(self: Box<Self>, topic: usize, stamp: Stamp) -> Result<Box<dyn Source>> {
        let Topic { name: topic, type_name, .. } = self.listing.topics[topic].clone();
        let described = self.described.values().find(|d| d.name == type_name).cloned().ok_or_else(|| {
            Error::new(ErrorKind::Format, &self.listing.about.source, "is not described")
                .at(format!("topic {topic}"))
                .hint("name another topic with --topic")
        })?;
        let heads = described.heads(stamp);
        Ok(Box::new(OneTopic { described, heads, topic, file: *self }))
    }
}

struct OneTopic {
    described: Described,
    heads: Vec<Head>,
    topic: String,
    file: DataFlash,
}

impl Source for OneTopic {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn rows(&self) -> Option<u64> {
        self.file.listing.messages(&self.topic)
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { described, topic, file, .. } = *self;
        let mut fill = Fill::new(wanted);
        let mut rows = 0u64;
        let mut bytes = Bytes::open(&file.path, &file.file, 0)?;
        let (_, mut notes) = walk(&mut bytes, &mut |_, met, body, _| {
            if *met != described || met.topic(body) != topic {
                return Ok(());
            }
            for (column, field) in described.fields.iter().enumerate() {
                fill.put(column, number(field.letter, body, field.at));
            }
            rows += 1;
            fill.end_row(take)
        })?;
        if !notes.is_empty() {
            notes.push(format!("{rows} messages of {topic} are read"));
        }
        Ok(file.listing.about.facts(Some(&topic), fill.finish(take)?, notes))
    }
}

/// Takes a message: its type, its description, its body, and where it begins.
type Meet<'a> = &'a mut dyn FnMut(u8, &Described, &[u8], u64) -> Result<()>;

/// Hands every message that was described before it to `meet`; returns the descriptions, and what was passed over.
fn walk(bytes: &mut Bytes, meet: Meet<'_>) -> Result<(BTreeMap<u8, Described>, Vec<String>)> {
    const SHOWN: usize = 3;
    let mut described: BTreeMap<u8, Described> = BTreeMap::new();
    let mut notes = Vec::new();
    let (mut stretches, mut skipped) = (0usize, 0u64);
    let (mut head, mut body) = (Vec::new(), Vec::new());
    while bytes.left() > 0 {
        let at = bytes.at();
        let whole = bytes.next(HEADER as u64, &mut head)?;
        let length = match head[..] {
            [a, b, DESCRIPTION] if [a, b] == MAGIC => Some(DESCRIPTION_BYTES),
            [a, b, id] if [a, b] == MAGIC => described.get(&id).map(|d| d.length),
            _ => None,
        };
        if let Some(length) = length {
            if bytes.next((length - HEADER) as u64, &mut body)? {
                match head[2] {
                    DESCRIPTION => {
                        if let Some((id, one)) = Described::read(&body).filter(|(id, _)| *id != DESCRIPTION) {
                            described.insert(id, one.with_instance());
                        }
                    }
                    id => {
                        if let Some(one) = described.get(&id) {
                            meet(id, one, &body, at)?;
                        }
                    }
                }
                continue;
            }
            notes.push(format!(
                "the log is cut off in the message at byte {at}: its last {} bytes are lost",
                bytes.len() - at
            ));
            break;
        }
        let to = if whole { resume(bytes, at + 1, &described)? } else { None };
        // the zeros after the last message of a log on a chip are not damage
        let to = to.unwrap_or_else(|| bytes.len());
        bytes.seek(to)?;
        stretches += 1;
        skipped += to - at;
        if stretches <= SHOWN {
            notes.push(format!("no message at byte {at}: {} bytes are left out", to - at));
        }
    }
    if stretches > SHOWN {
        notes.push(format!("no messages in {stretches} places: {skipped} bytes are left out in all"));
    }
    if described.is_empty() {
        return Err(bytes
            .damaged(0, "the log is damaged or cut off: it describes no message")
            .hint("copy the log again"));
    }
    Ok((described, notes))
}

/// Where the next message of a known type begins.
fn resume(bytes: &mut Bytes, from: u64, described: &BTreeMap<u8, Described>) -> Result<Option<u64>> {
    const WINDOW: u64 = 1 << 16;
    let mut window = Vec::new();
    let mut at = from;
    while at < bytes.len() {
        bytes.seek(at)?;
        bytes.next(WINDOW, &mut window)?;
        let begins = |w: &[u8]| w[..2] == MAGIC && (w[2] == DESCRIPTION || described.contains_key(&w[2]));
        if let Some(i) = window.windows(HEADER).position(begins) {
            return Ok(Some(at + i as u64));
        }
        if window.len() < HEADER || bytes.left() == 0 {
            break;
        }
        at += (window.len() - HEADER + 1) as u64;
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fmt(id: u8, length: u8, name: &str, letters: &str, labels: &str) -> Vec<u8> {
        let mut body = vec![0; DESCRIPTION_BYTES - HEADER];
        (body[0], body[1]) = (id, length);
        for (at, text) in [(2, name), (6, letters), (22, labels)] {
            body[at..at + text.len()].copy_from_slice(text.as_bytes());
        }
        body
    }

    #[test]
    fn descriptions_are_read_and_doubtful_ones_refused() {
        let (id, one) = Described::read(&fmt(5, 16, "IMU", "QBf", "TimeUS,I,GyrX")).unwrap();
        let one = one.with_instance();
        assert_eq!((id, one.length, one.fields[2].at, one.instance), (5, 16, 9, Some(8)));
        assert!(has_gyro(&one.heads(Stamp::Header)));
        assert!(Described::read(&fmt(5, 17, "IMU", "QBf", "TimeUS,I,GyrX")).is_none());
        assert!(Described::read(&fmt(5, 16, "IMU", "QBf", "TimeUS,I")).is_none());
        assert!(Described::read(&fmt(5, 16, "IMU", "QB?", "TimeUS,I,GyrX")).is_none());
        assert!(Described::read(&[1, 2]).is_none());
    }

    #[test]
    fn only_the_sensors_messages_hold_a_gyro() {
        let (_, filter) = Described::read(&fmt(6, 15, "XKF1", "Qf", "TimeUS,GX")).unwrap();
        assert!(!has_gyro(&filter.heads(Stamp::Header)));
        let (_, gyr) = Described::read(&fmt(7, 23, "GYR", "QQf", "TimeUS,SampleUS,GyrZ")).unwrap();
        let roles = |stamp| gyr.heads(stamp).iter().map(|h| h.named().role).collect::<Vec<_>>();
        assert_eq!(roles(Stamp::Header)[..2], [Role::Time(TimeKind::Host), Role::Time(TimeKind::SincePowerOn)]);
        assert_eq!(roles(Stamp::Receipt)[..2], [Role::Time(TimeKind::Host), Role::Other]);
    }

    #[test]
    fn hundredths_are_hundredths() {
        assert_eq!(number(b'c', &(-150i16).to_le_bytes(), 0), Number::Double(-1.5));
        assert_eq!(number(b'L', &10_000_000i32.to_le_bytes(), 0), Number::Double(1.0));
        assert_eq!(number(b'f', &[0, 0], 0), Number::Missing);
    }
}
