//! An MCAP file as it grows: records without chunks or index, so that what was written before a sudden end can be read.
//!
//! Format: mcap.dev/spec. Little-endian; a record is its opcode, the length of its content and the content.

use std::io::{self, Write};

const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const DATA_END: u8 = 0x0F;

/// CDR, little-endian, without options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A channel's topic, type and definition in `ros2msg`.
pub(super) struct Channel<'a> {
    pub topic: &'a str,
    pub kind: &'a str,
    pub definition: &'a str,
}

/// Writes records to `W`.
pub(super) struct Writer<W> {
    to: W,
    /// Messages of each channel.
    sequence: Vec<u32>,
}

fn text(out: &mut Vec<u8>, text: &str) {
    let length = u32::try_from(text.len()).unwrap_or(u32::MAX);
    out.extend(length.to_le_bytes());
    out.extend(text.as_bytes());
}

impl<W: Write> Writer<W> {
    /// Begins a file with these channels, which are then known by their place in the list.
    pub(super) fn new(to: W, channels: &[Channel<'_>]) -> io::Result<Self> {
        let mut writer = Self { to, sequence: vec![0; channels.len()] };
        writer.to.write_all(MAGIC)?;
        let mut body = Vec::new();
        text(&mut body, "ros2");
        text(&mut body, concat!("gyroid ", env!("CARGO_PKG_VERSION")));
        writer.record(HEADER, &[&body])?;
        for (id, channel) in (1_u16..).zip(channels) {
            let mut schema = id.to_le_bytes().to_vec();
            [channel.kind, "ros2msg", channel.definition].iter().for_each(|part| text(&mut schema, part));
            writer.record(SCHEMA, &[&schema])?;
            let mut body = [id.to_le_bytes(), id.to_le_bytes()].concat();
            [channel.topic, "cdr"].iter().for_each(|part| text(&mut body, part));
            // no metadata
            body.extend(0_u32.to_le_bytes());
            writer.record(CHANNEL, &[&body])?;
        }
        Ok(writer)
    }

    /// Adds a message in plain CDR to the channel at `place`, received at `log_ns`, ns since the epoch.
    pub(super) fn message(&mut self, place: u16, log_ns: u64, cdr: &[u8]) -> io::Result<()> {
        let Some(sequence) = self.sequence.get_mut(usize::from(place)) else { return Ok(()) };
        *sequence = sequence.wrapping_add(1);
        let mut head = [0; 22];
        head[..2].copy_from_slice(&(place + 1).to_le_bytes());
        head[2..6].copy_from_slice(&sequence.to_le_bytes());
        head[6..14].copy_from_slice(&log_ns.to_le_bytes());
        head[14..].copy_from_slice(&log_ns.to_le_bytes());
        self.record(MESSAGE, &[&head, &ENCAPSULATION, cdr])
    }

    /// Hands what was written to the system.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }

    /// Ends the file.
    pub(super) fn finish(mut self) -> io::Result<()> {
        // no checksum of the data, no summary and none of that
        self.record(DATA_END, &[&[0; 4]])?;
        self.record(FOOTER, &[&[0; 20]])?;
        self.to.write_all(MAGIC)?;
        self.to.flush()
    }

    fn record(&mut self, opcode: u8, parts: &[&[u8]]) -> io::Result<()> {
        let length: usize = parts.iter().map(|part| part.len()).sum();
        self.to.write_all(&[opcode])?;
        self.to.write_all(&(length as u64).to_le_bytes())?;
        parts.iter().try_for_each(|part| self.to.write_all(part))
    }
}
