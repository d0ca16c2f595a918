//! ROS 2 bags in SQLite (`.db3`): a table of topics and one of messages in CDR.

use super::format::{Format, Opened};
use super::input::Input;
use super::ros::Message;
use super::ros::decode::Encoding;
use super::ros::definition::plain;
use super::ros::topic::{MeetMessage, MessageFile, OneTopic, Place};
use super::source::{About, Source};
use super::topics::{Container, Count, Listing, Stamp, Topic, has_gyro};
use crate::error::{Error, ErrorKind, Result};
use rusqlite::{Connection, OpenFlags};
use std::collections::BTreeMap;
use std::path::Path;

/// Files that begin with SQLite's magic number.
pub(crate) const FORMAT: Format = Format {
    name: "ROS 2 bag in SQLite",
    accepts: |head| head.starts_with(b"SQLite format 3\0"),
    open: |input| Ok(Opened::Topics(Box::new(Db3::open(input)?))),
};

struct Channel {
    /// Rows of the table of topics: one a publisher's type, usually one.
    ids: Vec<i64>,
    message: std::result::Result<Message, String>,
}

struct Db3 {
    database: Connection,
    channels: Vec<Channel>,
    listing: Listing,
}

impl Db3 {
    fn open(input: Input) -> Result<Self> {
        let path = input.path.clone();
        let name = path.display().to_string();
        let (_, sha256) = input.into_file()?;
        let database = connect(&path).map_err(|e| damaged(&name, "the header", &e))?;
        let tables = names(&database, "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name")
            .map_err(|e| damaged(&name, "the list of tables", &e))?;
        if !["topics", "messages"].iter().all(|t| tables.iter().any(|n| n == t)) {
            let there = if tables.is_empty() { "none".to_string() } else { tables.join(", ") };
            let found = format!(
                "is an SQLite file and no ROS 2 bag: it needs the tables topics and messages; there are {there}"
            );
            return Err(Error::new(ErrorKind::Format, &name, found).hint("export the gyro's table as CSV or Parquet"));
        }
        // a column that is computed can be of any size
        for table in ["topics", "messages", "message_definitions"] {
            let query = format!("SELECT name FROM pragma_table_xinfo('{table}') WHERE hidden <> 0");
            let made = names(&database, &query).map_err(|e| damaged(&name, &format!("table {table}"), &e))?;
            if let Some(column) = made.first() {
                return Err(Error::new(ErrorKind::Format, &name, "is no ROS 2 bag: a column is computed")
                    .at(format!("table {table}, column {column:?}"))
                    .hint("record the bag again, or export the gyro's table as CSV or Parquet"));
            }
        }
        let definitions = match tables.iter().any(|t| t == "message_definitions") {
            true => definitions(&database).map_err(|e| damaged(&name, "table message_definitions", &e))?,
            false => BTreeMap::new(),
        };
        let counts = counts(&database).map_err(|e| damaged(&name, "table messages", &e))?;
        let rows = listed(&database).map_err(|e| damaged(&name, "table topics", &e))?;
        let mut found: BTreeMap<String, (Topic, Channel, Count)> = BTreeMap::new();
        for (id, topic, type_name, format) in rows {
            let count = counts.get(&id).copied().unwrap_or_default();
            let entry = found.entry(topic.clone()).or_insert_with(|| {
                let text = definitions.get(&plain(&type_name)).map(String::as_str);
                let message = match format.as_str() {
                    "cdr" => Message::new(&type_name, text, Encoding::Cdr),
                    other => Err(format!("messages in {other:?}, not in CDR")),
                };
                let gyro = message.as_ref().is_ok_and(|m| has_gyro(&m.heads(Stamp::Header)));
                let topic = Topic { name: topic, type_name, messages: 0, rate_hz: None, gyro };
                (topic, Channel { ids: Vec::new(), message }, Count::default())
            });
            entry.1.ids.push(id);
            entry.2.join(count);
        }
        let (mut topics, mut channels) = (Vec::new(), Vec::new());
        for (mut topic, channel, count) in found.into_values() {
            (topic.messages, topic.rate_hz) = (count.messages, count.rate_hz());
            topics.push(topic);
            channels.push(channel);
        }
        let about = About { source: name, format: FORMAT.name, sha256, notes: Vec::new() };
        Ok(Self { database, channels, listing: Listing { about, topics } })
    }
}

/// Opens for reading; a bag on a read-only disk, or whose recorder was killed, is taken as it stands.
fn connect(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let usable = |database: Connection| {
        database.query_row("SELECT count(*) FROM sqlite_master", [], |_| Ok(()))?;
        Ok(database)
    };
    Connection::open_with_flags(path, flags).and_then(usable).or_else(|error| {
        let text = path.to_string_lossy();
        // what has a meaning in a URI
        let escaped = text.replace('%', "%25").replace('?', "%3f").replace('#', "%23");
        let address = format!("file:{escaped}?immutable=1");
        Connection::open_with_flags(address, flags | OpenFlags::SQLITE_OPEN_URI).and_then(usable).map_err(|_| error)
    })
}

fn names(database: &Connection, query: &str) -> rusqlite::Result<Vec<String>> {
    database.prepare(query)?.query_map([], |row| row.get(0))?.collect()
}

fn definitions(database: &Connection) -> rusqlite::Result<BTreeMap<String, String>> {
    // the encoding of a definition is .msg or .idl; an empty one was not found when the bag was recorded
    let query = "SELECT topic_type, encoded_message_definition FROM message_definitions \
                 WHERE encoding = 'ros2msg' AND encoded_message_definition <> ''";
    let mut statement = database.prepare(query)?;
    let rows = statement.query_map([], |row| Ok((plain(&row.get::<_, String>(0)?), row.get(1)?)))?;
    rows.collect()
}

fn counts(database: &Connection) -> rusqlite::Result<BTreeMap<i64, Count>> {
    let query = "SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages GROUP BY topic_id";
    let mut statement = database.prepare(query)?;
    let rows = statement.query_map([], |row| {
        let messages: i64 = row.get(1)?;
        Ok((row.get(0)?, Count::of(messages.unsigned_abs(), row.get(2)?, row.get(3)?)))
    })?;
    rows.collect()
}

type Listed = (i64, String, String, String);

fn listed(database: &Connection) -> rusqlite::Result<Vec<Listed>> {
    let mut statement = database.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)))?;
    rows.collect()
}

fn damaged(name: &str, place: &str, error: &rusqlite::Error) -> Error {
    Error::new(ErrorKind::Format, name, format!("the SQLite file is damaged or truncated: {error}"))
        .at(place)
        .hint("copy the file again; `sqlite3 FILE .recover` saves what can be read of it")
}

impl Container for Db3 {
    fn listing(&self) -> &Listing {
        &self.listing
    }

    fn open(self: Box<Self>, topic: usize, stamp: Stamp) -> Result<Box<dyn Source>> {
        let Topic { name, type_name, .. } = &self.listing.topics[topic];
        let message = self.channels[topic].message.as_ref().map_err(|why| {
            Error::new(ErrorKind::Format, &self.listing.about.source, format!("{type_name}: {why}"))
                .at(format!("topic {name}"))
                .hint("convert the bag to MCAP where its types are known: `ros2 bag convert`")
        })?;
        let (message, name, ids) = (message.clone(), name.clone(), self.channels[topic].ids.clone());
        Ok(Box::new(OneTopic::new(*self, ids, message, stamp, name)))
    }
}

impl MessageFile for Db3 {
    type Id = i64;
    const MEND: &'static str = "copy the file again";

    fn walk(&self, own: &[i64], topic: &str, meet: MeetMessage<'_>) -> Result<Option<String>> {
        let list: Vec<String> = own.iter().map(ToString::to_string).collect();
        let query =
            format!("SELECT id, timestamp, data FROM messages WHERE topic_id IN ({}) ORDER BY id", list.join(", "));
        let sql = |read: u64, e: &rusqlite::Error| {
            damaged(&self.listing.about.source, &format!("table messages, after {read} messages of {topic}"), e)
        };
        let mut statement = self.database.prepare(&query).map_err(|e| sql(0, &e))?;
        let mut cursor = statement.query([]).map_err(|e| sql(0, &e))?;
        let mut read = 0;
        while let Some(row) = cursor.next().map_err(|e| sql(read, &e))? {
            let id: i64 = row.get(0).map_err(|e| sql(read, &e))?;
            let receipt_ns: i64 = row.get(1).map_err(|e| sql(read, &e))?;
            let data = row.get_ref(2).map_err(|e| sql(read, &e))?;
            let data = data.as_blob().map_err(|e| sql(read, &e.into()))?;
            meet(data, receipt_ns, Place::Id(id))?;
            read += 1;
        }
        Ok(None)
    }
}
