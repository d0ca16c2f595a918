//! MCAP, the bags of ROS 2: records of an opcode, a length and a content; chunks of records may be packed.
//!
//! Read from front to back, so that a file without its footer (the recorder was killed) is read as far as it goes.
//! (Foxglove, *MCAP File Format Specification*.) Of the format, five kinds of records matter here; the crate `mcap` brings
//! twenty others along and tells no place of an error.

use super::bytes::{Bytes, Flaw, Little, Unpacked};
use super::format::{Format, Opened};
use super::head::Head;
use super::input::Input;
use super::ros::Message;
use super::ros::decode::Encoding;
use super::ros::topic::{MeetMessage, MessageFile, OneTopic, Place};
use super::source::{About, Source};
use super::topics::{Container, Count, Listing, Stamp, Topic, has_gyro};
use crate::error::{Error, ErrorKind, Result};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::PathBuf;

/// Files that begin with MCAP's magic number.
pub(crate) const FORMAT: Format = Format {
    name: "MCAP",
    accepts: |head| head.starts_with(MAGIC),
    open: |input| Ok(Opened::Topics(Box::new(Mcap::open(input)?))),
};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// A chunk, unpacked, or a record larger than this is damage: recorders write megabytes.
const LARGEST: u64 = 1 << 30;

const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// The definition of a message.
#[derive(Debug, Clone)]
struct Schema {
    name: String,
    encoding: String,
    text: String,
}

/// A publisher's channel.
#[derive(Debug, Clone)]
struct Channel {
    schema: u16,
    topic: String,
    encoding: String,
}

struct Mcap {
    path: PathBuf,
    file: File,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    listing: Listing,
}

/// An item that [`walk`] hands over.
enum Met<'a> {
    Schema(u16, Schema),
    Channel(u16, Channel),
    /// `at`: byte of the record, or of the chunk that holds it.
    Message {
        channel: u16,
        log_ns: i64,
        data: &'a [u8],
        at: u64,
    },
}

impl Mcap {
    fn open(input: Input) -> Result<Self> {
        let path = input.path.clone();
        let (file, sha256) = input.into_file()?;
        let mut schemas = BTreeMap::new();
        let mut channels: BTreeMap<u16, Channel> = BTreeMap::new();
        let mut counts: BTreeMap<u16, Count> = BTreeMap::new();
        let lost = walk(&mut Bytes::open(&path, &file, MAGIC.len() as u64)?, &mut |met| {
            match met {
                Met::Schema(id, schema) => drop(schemas.entry(id).or_insert(schema)),
                Met::Channel(id, channel) => drop(channels.entry(id).or_insert(channel)),
                Met::Message { channel, log_ns, .. } => counts.entry(channel).or_default().add(log_ns),
            }
            Ok(())
        })?;
        let source = path.display().to_string();
        let about = About { source, format: FORMAT.name, sha256, notes: lost.into_iter().collect() };
        let mut file = Self { path, file, schemas, channels, listing: Listing { about, topics: Vec::new() } };
        let mut several: BTreeMap<&str, (&Channel, Count)> = BTreeMap::new();
        for (id, channel) in &file.channels {
            let count = counts.get(id).copied().unwrap_or_default();
            several.entry(&channel.topic).or_insert((channel, Count::default())).1.join(count);
        }
        let topic = |(name, (channel, count)): (&str, (&Channel, Count))| Topic {
            name: name.to_string(),
            type_name: file.schemas.get(&channel.schema).map_or("unknown", |s| s.name.as_str()).to_string(),
            messages: count.messages,
            rate_hz: count.rate_hz(),
            gyro: file.message(channel).is_ok_and(|m| has_gyro(&m.heads(Stamp::Header))),
        };
        file.listing.topics = several.into_iter().map(topic).collect();
        Ok(file)
    }

    /// The type of a channel's messages; the error says why they cannot be read.
    fn message(&self, channel: &Channel) -> std::result::Result<Message, String> {
        let encoding = match channel.encoding.as_str() {
            "cdr" => Encoding::Cdr,
            "ros1" => Encoding::Packed,
            other => return Err(format!("its messages are in {other:?}, not in CDR")),
        };
        let schema = self.schemas.get(&channel.schema).ok_or("its definition is not in the file")?;
        // a common type is known without its definition
        let written = matches!(schema.encoding.as_str(), "ros2msg" | "ros1msg") && !schema.text.trim().is_empty();
        let known = Message::new(&schema.name, written.then_some(schema.text.as_str()), encoding);
        known.map_err(|why| match written {
            true => why,
            false => format!("its definition is written in {:?}, not as .msg, and {why}", schema.encoding),
        })
    }
}

impl Container for Mcap {
    fn listing(&self) -> &Listing {
        &self.listing
    }

    fn open(self: Box<Self>, topic: usize, stamp: Stamp) -> Result<Box<dyn Source>> {
        let topic = &self.listing.topics[topic];
        let unreadable = |why: &str| {
            Error::new(ErrorKind::Format, &self.listing.about.source, format!("{}: {why}", topic.type_name))
                .at(format!("topic {}", topic.name))
                .hint("name another topic with --topic, or record it anew with `ros2 bag record`")
        };
        let mut own = BTreeMap::new();
        for (id, channel) in self.channels.iter().filter(|(_, c)| c.topic == topic.name) {
            own.insert(*id, self.message(channel).map_err(|why| unreadable(&why))?);
        }
        let Some(message) = own.first_entry().map(|e| e.get().clone()) else {
            return Err(unreadable("has no channel"));
        };
        let heads = message.heads(stamp);
        let names = |heads: &[Head]| heads.iter().map(|h| h.name.clone()).collect::<Vec<_>>();
        if own.values().any(|m| names(&m.heads(stamp)) != names(&heads)) {
            return Err(unreadable("is published as several types"));
        }
        let (own, name) = (own.into_keys().collect(), topic.name.clone());
        Ok(Box::new(OneTopic::new(*self, own, message, stamp, name)))
    }
}

impl MessageFile for Mcap {
    type Id = u16;
    const MEND: &'static str = "copy the file again";

    fn walk(&self, own: &[u16], _: &str, meet: MeetMessage<'_>) -> Result<Option<String>> {
        let mut bytes = Bytes::open(&self.path, &self.file, MAGIC.len() as u64)?;
        walk(&mut bytes, &mut |met| match met {
            Met::Message { channel, log_ns, data, at } if own.contains(&channel) => meet(data, log_ns, Place::Byte(at)),
            _ => Ok(()),
        })
    }
}

type Meet<'a> = &'a mut dyn FnMut(Met<'_>) -> Result<()>;

/// Hands every definition and message to `meet`. Says what was lost where the file ends before its footer; anything else
/// that is no record is an error.
fn walk(bytes: &mut Bytes, meet: Meet<'_>) -> Result<Option<String>> {
    let closed = ends_well(bytes)?;
    let (mut body, mut most) = (Vec::new(), Unpacked::of(bytes.len()));
    loop {
        let at = bytes.at();
        let what = match step(bytes, at, (&mut body, &mut most), meet) {
            Ok(true) => continue,
            Ok(false) => return Ok(None),
            Err(Flaw::Error(e)) => return Err(e),
            Err(Flaw::Cut) if closed => "a record is longer than the file".to_string(),
            Err(Flaw::Damaged(what)) if closed => what,
            Err(Flaw::Cut | Flaw::Damaged(_)) => {
                let lost = bytes.len() - at;
                return Ok(Some(format!(
                    "the file has no footer: its recorder was killed, or it is cut off; of its last {lost} bytes, from byte \
                     {at} on, what is not whole is lost"
                )));
            }
        };
        return Err(bytes
            .damaged(at, format!("the file is damaged: {what}"))
            .hint("copy the file again; `mcap recover` saves what can be read of it"));
    }
}

/// Whether the file's last bytes are those of a file that was closed.
fn ends_well(bytes: &mut Bytes) -> Result<bool> {
    let at = bytes.at();
    let mut last = Vec::new();
    bytes.seek(bytes.len().saturating_sub(MAGIC.len() as u64).max(at))?;
    bytes.next(MAGIC.len() as u64, &mut last)?;
    bytes.seek(at)?;
    Ok(last == MAGIC)
}

/// Reads a record; false after the last one with data.
fn step(
    bytes: &mut Bytes,
    at: u64,
    (body, most): (&mut Vec<u8>, &mut Unpacked),
    meet: Meet<'_>,
) -> std::result::Result<bool, Flaw> {
    if !bytes.next(9, body)? {
        return Err(Flaw::Cut);
    }
    let opcode = body.u8(0).unwrap_or_default();
    let length = body.u64(1).unwrap_or_default();
    if opcode == DATA_END {
        return Ok(false);
    }
    if !matches!(opcode, SCHEMA | CHANNEL | MESSAGE | CHUNK) {
        return if opcode == 0 {
            Err(Flaw::Damaged("a record of no kind".into()))
        } else if bytes.skip(length)? {
            Ok(true)
        } else {
            Err(Flaw::Cut)
        };
    }
    if length > LARGEST {
        return Err(Flaw::Damaged(format!("a record of {length} bytes")));
    }
    let whole = bytes.next(length, body)?;
    if opcode != CHUNK {
        return if whole { record(opcode, body, at, meet).map(|()| true) } else { Err(Flaw::Cut) };
    }
    let (records, sound) = unpack(body, whole, most)?;
    if whole && !sound {
        return Err(Flaw::Damaged("a chunk cannot be unpacked, or its checksum does not agree".into()));
    }
    match (chunk(&records, at, meet), whole) {
        // of a chunk that is cut off, the records before the cut count
        (Ok(()) | Err(Flaw::Cut), false) => Err(Flaw::Cut),
        (Err(Flaw::Cut), true) => Err(Flaw::Damaged("a record is longer than its chunk".into())),
        (done, _) => done.map(|()| true),
    }
}

/// A chunk's records, and whether they are all there as they were written.
fn unpack<'a>(body: &'a [u8], whole: bool, most: &mut Unpacked) -> std::result::Result<(Cow<'a, [u8]>, bool), Flaw> {
    let mut fields = Fields { rest: body.get(16..).ok_or(Flaw::Cut)? };
    let header = |fields: &mut Fields<'_>| Some((fields.u64()?, fields.u32()?, fields.text()?, fields.u64()?));
    let lacking = || if whole { Flaw::Damaged("a chunk without its fields".into()) } else { Flaw::Cut };
    let (size, crc, packing, packed_bytes) = header(&mut fields).ok_or_else(lacking)?;
    if size > LARGEST {
        return Err(Flaw::Damaged(format!("a chunk of {size} bytes")));
    }
    if !packing.is_empty() && !most.take(size) {
        return Err(Flaw::Damaged(Unpacked::BEYOND.into()));
    }
    let there = usize::try_from(packed_bytes).map_or(fields.rest.len(), |n| n.min(fields.rest.len()));
    let packed = &fields.rest[..there];
    let mut out = Vec::new();
    let end = match packing.as_str() {
        "" => {
            let sound = packed.len() as u64 == size && agrees(crc, packed);
            return Ok((Cow::Borrowed(packed), sound));
        }
        "lz4" => lz4::Decoder::new(packed).and_then(|d| d.take(size + 1).read_to_end(&mut out)),
        "zstd" => zstd::Decoder::new(packed).and_then(|d| d.take(size + 1).read_to_end(&mut out)),
        other => return Err(Flaw::Damaged(format!("a chunk is packed by {other:?}"))),
    };
    let sound = end.is_ok() && out.len() as u64 == size && agrees(crc, &out);
    Ok((Cow::Owned(out), sound))
}

/// Zero says that no checksum was written.
fn agrees(crc: u32, records: &[u8]) -> bool {
    if crc == 0 {
        return true;
    }
    let mut sum = flate2::Crc::new();
    sum.update(records);
    sum.sum() == crc
}

/// The records of a chunk that begins at byte `at`.
fn chunk(mut rest: &[u8], at: u64, meet: Meet<'_>) -> std::result::Result<(), Flaw> {
    while !rest.is_empty() {
        let length = rest.u64(1).and_then(|n| usize::try_from(n).ok()).ok_or(Flaw::Cut)?;
        let end = length.checked_add(9).ok_or(Flaw::Cut)?;
        record(rest[0], rest.get(9..end).ok_or(Flaw::Cut)?, at, meet)?;
        rest = &rest[end..];
    }
    Ok(())
}

fn record(opcode: u8, body: &[u8], at: u64, meet: Meet<'_>) -> std::result::Result<(), Flaw> {
    let mut fields = Fields { rest: body };
    let met = match opcode {
        SCHEMA => fields.schema(),
        CHANNEL => fields.channel(),
        MESSAGE => fields.message(at),
        _ => return Ok(()),
    };
    Ok(meet(met.ok_or_else(|| Flaw::Damaged("a record without its fields".into()))?)?)
}

/// The fields of a record, one after the other.
struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    fn bytes(&mut self, n: usize) -> Option<&'a [u8]> {
        let (bytes, rest) = self.rest.split_at_checked(n)?;
        self.rest = rest;
        Some(bytes)
    }

    fn u16(&mut self) -> Option<u16> {
        self.bytes(2)?.u16(0)
    }

    fn u32(&mut self) -> Option<u32> {
        self.bytes(4)?.u32(0)
    }

    fn u64(&mut self) -> Option<u64> {
        self.bytes(8)?.u64(0)
    }

    fn text(&mut self) -> Option<String> {
        let n = self.u32()? as usize;
        Some(String::from_utf8_lossy(self.bytes(n)?).into_owned())
    }

    fn schema(&mut self) -> Option<Met<'a>> {
        let id = self.u16()?;
        Some(Met::Schema(id, Schema { name: self.text()?, encoding: self.text()?, text: self.text()? }))
    }

    fn channel(&mut self) -> Option<Met<'a>> {
        let (id, schema) = (self.u16()?, self.u16()?);
        Some(Met::Channel(id, Channel { schema, topic: self.text()?, encoding: self.text()? }))
    }

    fn message(&mut self, at: u64) -> Option<Met<'a>> {
        let channel = self.u16()?;
        let _sequence = self.u32()?;
        let log_ns = self.u64()?.cast_signed();
        let _publish_ns = self.u64()?;
        Some(Met::Message { channel, log_ns, data: self.rest, at })
    }
}
