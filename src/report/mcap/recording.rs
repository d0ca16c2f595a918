//! The file: topics, and messages as they come.

use super::message::Message;
use super::messages::Stamp;
use crate::error::{Error, Result};
use crate::files::{OutputFile, mark};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::marker::PhantomData;

/// A topic with the type of its messages.
pub(crate) struct Topic<M> {
    id: u16,
    messages: PhantomData<M>,
}

/// Messages of several topics, written to `W` as they come.
pub(crate) struct Stream<W: Write> {
    writer: Writer<NoSeek<W>>,
    /// Messages of each channel so far.
    counts: BTreeMap<u16, u32>,
    bytes: Vec<u8>,
}

impl<W: Write> Stream<W> {
    fn new(to: W, options: WriteOptions) -> io::Result<Self> {
        let options = options.profile("ros2").disable_seeking(true);
        let writer = options.create(NoSeek::new(to)).map_err(refused)?;
        Ok(Self { writer, counts: BTreeMap::new(), bytes: Vec::new() })
    }

    /// Without chunks: what was written before a sudden end can be read.
    #[cfg(feature = "ros2")]
    pub(crate) fn without_index(to: W) -> io::Result<Self> {
        Self::new(to, WriteOptions::new().library(concat!("gyroid ", env!("CARGO_PKG_VERSION"))).use_chunks(false))
    }

    /// Adds a topic of messages `M`.
    pub(crate) fn topic<M: Message>(&mut self, name: &str) -> io::Result<Topic<M>> {
        let [encoding, schema] = M::ENCODINGS;
        let schema = self.writer.add_schema(&M::kind(), schema, &M::schema()).map_err(refused)?;
        let id = self.writer.add_channel(schema, name, encoding, &BTreeMap::new()).map_err(refused)?;
        Ok(Topic { id, messages: PhantomData })
    }

    /// Adds a message at a time in ns.
    pub(crate) fn put<M: Message>(&mut self, topic: &Topic<M>, time_ns: u64, message: &M) -> io::Result<()> {
        self.bytes.clear();
        message.encode(&mut self.bytes)?;
        let count = self.counts.entry(topic.id).or_default();
        let header = MessageHeader { channel_id: topic.id, sequence: *count, log_time: time_ns, publish_time: time_ns };
        *count = count.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &self.bytes).map_err(refused)
    }

    /// Hands what was written to the system.
    #[cfg(feature = "ros2")]
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(refused)
    }

    /// Ends the recording.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.writer.finish().map_err(refused)?;
        Ok(self.writer.into_inner().into_inner())
    }
}

fn refused(error: McapError) -> io::Error {
    match error {
        McapError::Io(e) => e,
        other => io::Error::other(other),
    }
}

/// A file as a stream wants it.
struct Sink(OutputFile);

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.file().flush()
    }
}

/// A file of a command's results.
pub(crate) struct Recording {
    stream: Stream<Sink>,
    target: String,
    /// Added to each time, s.
    shift_s: f64,
}

impl Recording {
    /// Begins `file` with a log whose first time is `first_s`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Io`] if the disk refuses.
    pub(crate) fn new(file: OutputFile, first_s: f64) -> Result<Self> {
        let target = file.target().display().to_string();
        let stream =
            Stream::new(Sink(file), WriteOptions::new().library(mark::text()).compression(Some(Compression::Lz4)))
                .map_err(|e| Error::io(&target, &e))?;
        Ok(Self { stream, target, shift_s: (-first_s).max(0.0) })
    }

    /// Adds a topic of messages `M`.
    ///
    /// # Errors
    /// As [`Recording::new`].
    pub(crate) fn topic<M: Message>(&mut self, name: &str) -> Result<Topic<M>> {
        self.stream.topic(name).map_err(|e| Error::io(&self.target, &e))
    }

    /// A time of the log, s, as in a message's header.
    pub(crate) fn stamp(&self, time_s: f64) -> Stamp {
        let time_s = (time_s + self.shift_s).max(0.0);
        let whole_s = time_s.floor();
        // a stamp's seconds end in 2038; the digits after a whole second may round to the next
        let nanosec = ((time_s - whole_s) * 1e9).round().min(999_999_999.0);
        Stamp { sec: whole_s.min(f64::from(i32::MAX)) as i32, nanosec: nanosec as u32 }
    }

    /// Adds a message at a time of the log, s.
    ///
    /// # Errors
    /// As [`Recording::new`].
    pub(crate) fn put<M: Message>(&mut self, topic: &Topic<M>, time_s: f64, message: &M) -> Result<()> {
        let time_ns = self.stamp(time_s).ns().unsigned_abs();
        self.stream.put(topic, time_ns, message).map_err(|e| Error::io(&self.target, &e))
    }

    /// Ends the file and puts it in its place.
    ///
    /// # Errors
    /// As [`Recording::new`].
    pub(crate) fn finish(self) -> Result<()> {
        let sink = self.stream.finish().map_err(|e| Error::io(&self.target, &e))?;
        sink.0.commit()
    }
}
