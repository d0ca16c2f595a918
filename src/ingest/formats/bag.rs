//! ROS 1 bags, format 2.0: records of a header with `name=value` fields and data; chunks of records may be packed.
//!
//! Read from front to back, so that a bag without its index (the recorder was killed) is read as far as it goes.

use super::bytes::{Bytes, Flaw, Little, Unpacked};
use super::format::{Format, Opened};
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

/// Files that begin with the bag's first line.
pub(crate) const FORMAT: Format = Format {
    name: "ROS 1 bag",
    accepts: |head| head.starts_with(b"#ROSBAG V"),
    open: |input| Ok(Opened::Topics(Box::new(Bag::open(input)?))),
};

const FIRST_LINE: &[u8] = b"#ROSBAG V2.0\n";
/// A header or a chunk larger than this is damage: recorders write kilobytes and megabytes.
const LARGEST_HEADER: u32 = 1 << 20;
const LARGEST_CHUNK: u32 = 1 << 29;

const MESSAGE: u8 = 2;
const BAG_HEADER: u8 = 3;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

/// A publisher's connection.
struct Connection {
    topic: String,
    type_name: String,
    message: std::result::Result<Message, String>,
}

struct Bag {
    path: PathBuf,
    file: File,
    connections: BTreeMap<u32, Connection>,
    listing: Listing,
}

/// An item that [`walk`] hands over.
enum Met<'a> {
    Connection {
        id: u32,
        topic: &'a str,
        header: &'a [u8],
    },
    /// `at`: byte of the record, or of the chunk that holds it.
    Message {
        connection: u32,
        time_ns: i64,
        data: &'a [u8],
        at: u64,
    },
}

/// The fields of a record's header.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    /// The value of `name`; none if it is not there, or what comes before it is damaged.
    fn get(&self, name: &[u8]) -> Option<&'a [u8]> {
        let mut rest = self.0;
        while rest.len() > 4 {
            let length = rest.u32(0)? as usize;
            let field = rest.get(4..length.checked_add(4)?)?;
            let equals = field.iter().position(|b| *b == b'=')?;
            if &field[..equals] == name {
                return Some(&field[equals + 1..]);
            }
            rest = &rest[length + 4..];
        }
        None
    }

    fn op(&self) -> Option<u8> {
        self.get(b"op")?.u8(0)
    }

    fn text(&self, name: &[u8]) -> Option<&'a str> {
        std::str::from_utf8(self.get(name)?).ok()
    }
}

impl Bag {
    fn open(input: Input) -> Result<Self> {
        let path = input.path.clone();
        let version = String::from_utf8_lossy(&input.head[..input.head.len().min(13)]).trim_end().to_string();
        let whole = input.head.starts_with(FIRST_LINE);
        if !whole {
            return Err(Error::new(
                ErrorKind::Format,
                path.display(),
                format!("begins with {version:?}, not with V2.0"),
            )
            .at("byte 0")
            .hint("convert an old bag with `rosbag fix`"));
        }
        let (file, sha256) = input.into_file()?;
        let mut connections = BTreeMap::new();
        let mut counts: BTreeMap<u32, Count> = BTreeMap::new();
        let mut bytes = Bytes::open(&path, &file, FIRST_LINE.len() as u64)?;
        let lost = walk(&mut bytes, &mut |met| {
            match met {
                Met::Connection { id, topic, header } => {
                    connections.entry(id).or_insert_with(|| connection(topic, header));
                }
                Met::Message { connection, time_ns, .. } => counts.entry(connection).or_default().add(time_ns),
            }
            Ok(())
        })?;
        let mut topics: Vec<Topic> = Vec::new();
        let mut several: BTreeMap<String, Count> = BTreeMap::new();
        for (id, connection) in &connections {
            let count = counts.get(id).copied().unwrap_or_default();
            several.entry(connection.topic.clone()).or_default().join(count);
            if topics.iter().all(|t| t.name != connection.topic) {
                topics.push(Topic {
                    name: connection.topic.clone(),
                    type_name: connection.type_name.clone(),
                    messages: 0,
                    rate_hz: None,
                    gyro: connection.message.as_ref().is_ok_and(|m| has_gyro(&m.heads(Stamp::Header))),
                });
            }
        }
        for topic in &mut topics {
            let count = several.get(&topic.name).copied().unwrap_or_default();
            (topic.messages, topic.rate_hz) = (count.messages, count.rate_hz());
        }
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        let source = path.display().to_string();
        let about = About { source, format: FORMAT.name, sha256, notes: lost.into_iter().collect() };
        Ok(Self { path, file, connections, listing: Listing { about, topics } })
    }
}

fn connection(topic: &str, header: &[u8]) -> Connection {
    let fields = Fields(header);
    let type_name = fields.text(b"type").unwrap_or("unknown").to_string();
    let definition = fields.get(b"message_definition").map(String::from_utf8_lossy);
    let message = Message::new(&type_name, definition.as_deref(), Encoding::Packed);
    Connection { topic: topic.to_string(), type_name, message }
}

impl Container for Bag {
    fn listing(&self) -> &Listing {
        &self.listing
    }

    fn open(self: Box<Self>, topic: usize, stamp: Stamp) -> Result<Box<dyn Source>> {
        let topic = &self.listing.topics[topic];
        let own: Vec<u32> = self.connections.iter().filter(|(_, c)| c.topic == topic.name).map(|(id, _)| *id).collect();
        let unreadable = |why: &str| {
            Error::new(ErrorKind::Format, &self.listing.about.source, format!("{}: {why}", topic.type_name))
                .at(format!("topic {}", topic.name))
                .hint("name another topic with --topic")
        };
        let mut message: Option<&Message> = None;
        for id in &own {
            let connection = &self.connections[id];
            if connection.type_name != topic.type_name {
                return Err(unreadable(&format!("is also published as {}", connection.type_name)));
            }
            message = Some(connection.message.as_ref().map_err(|why| unreadable(why))?);
        }
        let message = message.ok_or_else(|| unreadable("has no connection"))?.clone();
        let name = topic.name.clone();
        Ok(Box::new(OneTopic::new(*self, own, message, stamp, name)))
    }
}

impl MessageFile for Bag {
    type Id = u32;
    const MEND: &'static str = "copy the bag again";

    fn walk(&self, own: &[u32], _: &str, meet: MeetMessage<'_>) -> Result<Option<String>> {
        let mut bytes = Bytes::open(&self.path, &self.file, FIRST_LINE.len() as u64)?;
        walk(&mut bytes, &mut |met| match met {
            Met::Message { connection, time_ns, data, at } if own.contains(&connection) => {
                meet(data, time_ns, Place::Byte(at))
            }
            _ => Ok(()),
        })
    }
}

type Meet<'a> = &'a mut dyn FnMut(Met<'_>) -> Result<()>;

/// Hands every connection and message to `meet`, from the first record on. Says what was lost where the recorder was
/// killed or the file was cut off; anything else that is no record is an error.
fn walk(bytes: &mut Bytes, meet: Meet<'_>) -> Result<Option<String>> {
    let most = Unpacked::of(bytes.len());
    let mut walker = Walker { header: Vec::new(), data: Vec::new(), index_at: None, most };
    while bytes.left() > 0 {
        let at = bytes.at();
        let flaw = match walker.step(bytes, at, meet) {
            Ok(()) if walker.indexed(bytes).is_some_and(|index_at| bytes.at() >= index_at) => return Ok(None),
            Ok(()) => continue,
            Err(flaw) => flaw,
        };
        let killed = walker.index_at == Some(0);
        let what = match flaw {
            Flaw::Error(e) => return Err(e),
            // an index behind this record shows that the file is not cut off
            Flaw::Cut if walker.indexed(bytes).is_some() => "a record is longer than the file".to_string(),
            Flaw::Damaged(what) if !killed => what,
            Flaw::Cut | Flaw::Damaged(_) => {
                let lost = bytes.len() - at;
                let why = if killed { "has no index, its recorder was killed" } else { "is cut off" };
                return Ok(Some(format!(
                    "the bag {why}; of its last {lost} bytes, from byte {at} on, what is not whole is lost"
                )));
            }
        };
        return Err(bytes
            .damaged(at, format!("the bag is damaged: {what}"))
            .hint("copy the bag again; `rosbag reindex` saves what can be read of it"));
    }
    Ok(None)
}

struct Walker {
    header: Vec<u8>,
    data: Vec<u8>,
    /// Where the bag's header says that the index begins; 0 until the recorder ends well.
    index_at: Option<u64>,
    most: Unpacked,
}

impl Walker {
    /// Where the index begins, if the file goes that far.
    fn indexed(&self, bytes: &Bytes) -> Option<u64> {
        self.index_at.filter(|at| (1..bytes.len()).contains(at))
    }

    fn step(&mut self, bytes: &mut Bytes, at: u64, meet: Meet<'_>) -> std::result::Result<(), Flaw> {
        let length = length(bytes)?;
        if length > LARGEST_HEADER {
            return Err(Flaw::Damaged(format!("a header of {length} bytes")));
        }
        if !bytes.next(u64::from(length), &mut self.header)? {
            return Err(Flaw::Cut);
        }
        let fields = Fields(&self.header);
        let op = fields.op().ok_or_else(|| Flaw::Damaged("a record's header has no op".into()))?;
        if op == BAG_HEADER {
            self.index_at = fields.get(b"index_pos").and_then(|v| v.u64(0));
        }
        let size = u64::from(self::length(bytes)?);
        if !matches!(op, MESSAGE | CHUNK | CONNECTION) {
            return if bytes.skip(size)? { Ok(()) } else { Err(Flaw::Cut) };
        }
        if size > u64::from(LARGEST_CHUNK) {
            return Err(Flaw::Damaged(format!("a record of {size} bytes")));
        }
        let whole = bytes.next(size, &mut self.data)?;
        if op != CHUNK {
            return if whole { record(op, &fields, &self.data, at, meet) } else { Err(Flaw::Cut) };
        }
        let (records, sound) = unpack(&fields, &self.data, &mut self.most).map_err(Flaw::Damaged)?;
        if whole && !sound {
            return Err(Flaw::Damaged("a chunk cannot be unpacked".into()));
        }
        match (chunk(&records, at, meet), whole) {
            // of a chunk that is cut off, the records before the cut count
            (Ok(()) | Err(Flaw::Cut), false) => Err(Flaw::Cut),
            (Err(Flaw::Cut), true) => Err(Flaw::Damaged("a record is longer than its chunk".into())),
            (done, _) => done,
        }
    }
}

fn length(bytes: &mut Bytes) -> std::result::Result<u32, Flaw> {
    let mut four = Vec::new();
    if bytes.next(4, &mut four)? { four.u32(0).ok_or(Flaw::Cut) } else { Err(Flaw::Cut) }
}

/// A chunk's records, and whether they are all there.
fn unpack<'a>(
    fields: &Fields<'_>,
    data: &'a [u8],
    most: &mut Unpacked,
) -> std::result::Result<(Cow<'a, [u8]>, bool), String> {
    let size = fields.get(b"size").and_then(|v| v.u32(0)).ok_or("a chunk does not tell its size")?;
    if size > LARGEST_CHUNK {
        return Err(format!("a chunk of {size} bytes"));
    }
    let mut out = Vec::new();
    let compression = fields.get(b"compression");
    if compression != Some(b"none".as_slice()) && !most.take(u64::from(size)) {
        return Err(Unpacked::BEYOND.into());
    }
    // a byte more than there should be: the checksums stand behind the last one
    let most = u64::from(size) + 1;
    let end = match compression {
        Some(b"none") => return Ok((Cow::Borrowed(data), data.len() == size as usize)),
        Some(b"bz2") => bzip2::read::BzDecoder::new(data).take(most).read_to_end(&mut out),
        Some(b"lz4") => lz4::Decoder::new(data).and_then(|d| d.take(most).read_to_end(&mut out)),
        Some(other) => return Err(format!("a chunk is packed by {:?}", String::from_utf8_lossy(other))),
        None => return Err("a chunk does not tell how it is packed".into()),
    };
    let sound = end.is_ok() && out.len() == size as usize;
    Ok((Cow::Owned(out), sound))
}

/// The records of a chunk that begins at byte `at`.
fn chunk(mut rest: &[u8], at: u64, meet: Meet<'_>) -> std::result::Result<(), Flaw> {
    while !rest.is_empty() {
        let header = sized(&mut rest).ok_or(Flaw::Cut)?;
        let data = sized(&mut rest).ok_or(Flaw::Cut)?;
        let fields = Fields(header);
        let op = fields.op().ok_or_else(|| Flaw::Damaged("in a chunk, a record's header has no op".into()))?;
        if matches!(op, MESSAGE | CONNECTION) {
            record(op, &fields, data, at, meet)?;
        }
    }
    Ok(())
}

/// Takes a length and as many bytes off the front.
fn sized<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let end = (rest.u32(0)? as usize).checked_add(4)?;
    let (part, after) = (rest.get(4..end)?, &rest[end..]);
    *rest = after;
    Some(part)
}

fn record(op: u8, fields: &Fields<'_>, data: &[u8], at: u64, meet: Meet<'_>) -> std::result::Result<(), Flaw> {
    let lacks = |what: &str| Flaw::Damaged(format!("a record lacks its {what}"));
    let connection = fields.get(b"conn").and_then(|v| v.u32(0)).ok_or_else(|| lacks("connection"))?;
    if op == CONNECTION {
        let topic = fields.text(b"topic").ok_or_else(|| lacks("topic"))?;
        return Ok(meet(Met::Connection { id: connection, topic, header: data })?);
    }
    let time = fields.get(b"time").and_then(|v| Some((v.u32(0)?, v.u32(4)?)));
    let (seconds, nanoseconds) = time.ok_or_else(|| lacks("time"))?;
    let time_ns = i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds);
    Ok(meet(Met::Message { connection, time_ns, data, at })?)
}
