//! Plain lines of numbers, as nearly all text logs have, on all cores: while the lines of one block are read as numbers, the next
//! block is fetched, and the one before it is handed over. From the first quotation mark on, and for a last line without an end,
//! it is the turn of the `csv` crate.

use super::text_column::Filling;
use crate::ingest::formats::source::Column;
use memchr::{memchr, memchr_iter, memchr2, memrchr};
use rayon::prelude::*;
use std::io::{self, Cursor, Read};
use std::sync::mpsc::{SyncSender, sync_channel};

/// Bytes of a block.
const BLOCK: usize = 4 << 20;
/// Bytes of a part of it that one core reads.
const PART: usize = 256 << 10;

/// Rows so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress {
    /// Rows of data.
    pub rows: usize,
    /// Lines, also those that are blank or comments.
    pub lines: u64,
    /// Whether each line up to the last row was a row.
    pub unbroken: bool,
}

/// Reason that the reading ended.
pub(crate) enum Stop<E> {
    Io(io::Error),
    /// A row of so many fields, in the line that is counted from 1.
    Ragged(usize, u64),
    /// An error of the caller that takes the rows.
    Taken(E),
}

/// The part of a file that is yet to be read.
type Rest<'a> = Box<dyn Read + Send + 'a>;

/// Why no more can be read.
enum Halt {
    Io(io::Error),
    Ragged(usize, u64),
}

/// Reads `stream` into `columns` as long as it is plain. After each block `full` is called with the cells, of which it
/// takes some or all, and with the number of all rows so far. Returns the unread rest.
pub(crate) fn read<'a, R: Read + Send + 'a, E>(
    stream: R,
    delimiter: u8,
    width: usize,
    columns: &mut [Filling],
    progress: &mut Progress,
    mut full: impl FnMut(&mut [Column], usize) -> Result<(), E>,
) -> Result<Rest<'a>, Stop<E>> {
    let shape = Shape { delimiter, width };
    let mut cells = vec![Column::default(); columns.len()];
    let (rest, taken) = std::thread::scope(|scope| {
        // one block waits at most
        let (send, receive) = sync_channel(1);
        let reading = scope.spawn(|| blocks(stream, shape, columns, progress, send));
        let (mut rows, mut room) = (0, 0);
        let taken = receive.into_iter().try_for_each(|parts: Vec<Cells>| {
            for part in parts {
                rows += part.rows;
                for (cells, column) in cells.iter_mut().zip(part.columns) {
                    cells.origin = column.origin;
                    if cells.values.is_empty() {
                        cells.values.reserve(room);
                    }
                    cells.values.extend_from_slice(&column.values);
                }
            }
            room = cells.first().map_or(room, |cells| room.max(cells.values.len()));
            full(&mut cells, rows)
        });
        (reading.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), taken)
    });
    taken.map_err(Stop::Taken)?;
    columns.iter_mut().zip(cells).for_each(|(column, cells)| column.put_back(cells.values));
    rest.map_err(|halt| match halt {
        Halt::Io(e) => Stop::Io(e),
        Halt::Ragged(fields, line) => Stop::Ragged(fields, line),
    })
}

/// Sends the cells of block after block, as far as they are plain.
fn blocks<'a, R: Read + Send + 'a>(
    mut stream: R,
    shape: Shape,
    columns: &mut [Filling],
    progress: &mut Progress,
    send: SyncSender<Vec<Cells>>,
) -> Result<Rest<'a>, Halt> {
    let mut block = Block::after(&[], Vec::new(), &mut stream).map_err(Halt::Io)?;
    // two buffers take turns
    let mut spare = Vec::new();
    loop {
        // what follows the last whole line belongs to the next block
        let (lines, rest) = block.filled().split_at(block.whole);
        let buffer = std::mem::take(&mut spare);
        let fetch = || if block.last { Ok(Block::end(rest)) } else { Block::after(rest, buffer, &mut stream) };
        let (parts, next) = rayon::join(|| shape.parts(lines, columns), fetch);
        let Some(parts) = parts else {
            let next = next.map_err(Halt::Io)?;
            block.text.truncate(block.whole);
            return Ok(Box::new(Cursor::new(block.text).chain(next.into_rest()).chain(stream)));
        };
        let mut read = Vec::with_capacity(parts.len());
        for part in parts {
            progress.unbroken &= part.unbroken && (part.rows == 0 || progress.lines == progress.rows as u64);
            if let Some((fields, line)) = part.ragged {
                return Err(Halt::Ragged(fields, progress.lines + line));
            }
            let cells = columns.iter_mut().zip(part.columns).map(|(column, later)| column.append(later, progress.rows));
            read.push(Cells { columns: cells.collect(), rows: part.rows });
            progress.rows += part.rows;
            progress.lines += part.lines;
        }
        let unwanted = send.send(read).is_err();
        spare = std::mem::replace(&mut block, next.map_err(Halt::Io)?).text;
        if block.whole == 0 || unwanted {
            return Ok(Box::new(block.into_rest().chain(stream)));
        }
    }
}

/// Cells of some rows.
struct Cells {
    columns: Vec<Column>,
    rows: usize,
}

/// Bytes of the file of which the first `whole` are whole lines.
struct Block {
    /// A buffer; the bytes behind the first `length` are old.
    text: Vec<u8>,
    length: usize,
    whole: usize,
    /// Whether nothing comes after it.
    last: bool,
}

impl Block {
    /// The next block: `rest` and what follows it, up to a line's end at least. It is put into `text`.
    fn after(rest: &[u8], mut text: Vec<u8>, stream: &mut impl Read) -> io::Result<Self> {
        let mut length = rest.len();
        if text.is_empty() {
            // pages that no byte comes to are never touched
            text = vec![0; length + BLOCK];
        }
        text.resize(text.len().max(length), 0);
        text[..length].copy_from_slice(rest);
        loop {
            let from = length;
            // zeroed once: the buffer comes back
            text.resize(text.len().max(from + BLOCK), 0);
            let read = fill(&mut text[from..from + BLOCK], stream)?;
            length += read;
            let end = memrchr(b'\n', &text[from..length]);
            let last = read < BLOCK;
            if end.is_some() || last {
                return Ok(Self { text, length, whole: end.map_or(0, |end| from + end + 1), last });
            }
        }
    }

    /// The bytes of a file after its last complete line.
    fn end(rest: &[u8]) -> Self {
        Self { text: rest.to_vec(), length: rest.len(), whole: 0, last: true }
    }

    fn filled(&self) -> &[u8] {
        &self.text[..self.length]
    }

    /// Its bytes, to be read by others.
    fn into_rest(mut self) -> Cursor<Vec<u8>> {
        self.text.truncate(self.length);
        Cursor::new(self.text)
    }
}

/// Reads until `buffer` is full or the stream ends, in pieces that are hashed while they are in the processor's cache.
fn fill(buffer: &mut [u8], stream: &mut impl Read) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        let to = buffer.len().min(filled + PART);
        match stream.read(&mut buffer[filled..to]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

/// How rows look.
#[derive(Debug, Clone, Copy)]
struct Shape {
    delimiter: u8,
    /// Fields of a row.
    width: usize,
}

/// Some lines that were read.
struct Part {
    columns: Vec<Filling>,
    rows: usize,
    lines: u64,
    /// Whether each line up to its last row was a row.
    unbroken: bool,
    /// Fields of a row that has too few or too many, and its line; nothing after it was read.
    ragged: Option<(usize, u64)>,
}

impl Shape {
    /// Reads whole lines; none if they are not plain.
    fn parts(self, lines: &[u8], columns: &[Filling]) -> Option<Vec<Part>> {
        let parts: Option<Vec<Part>> = cut(lines).into_par_iter().map(|part| self.part(part, columns)).collect();
        let agree = |part: &Part| columns.iter().zip(&part.columns).all(|(before, later)| before.agrees(later));
        match parts? {
            parts if parts.iter().all(agree) => Some(parts),
            // the first value of a column says where it counts from: one after the other
            _ => self.part(lines, columns).map(|part| vec![part]),
        }
    }

    fn part(self, text: &[u8], columns: &[Filling]) -> Option<Part> {
        let returns = |at: usize| text.get(at + 1) == Some(&b'\n');
        if let Some(odd) = memchr2(b'"', b'\r', text) {
            let text = &text[odd..];
            if memchr(b'"', text).is_some() || !memchr_iter(b'\r', text).all(|at| returns(odd + at)) {
                return None;
            }
        }
        // by the length of the first line
        let line = memchr(b'\n', text).map_or(text.len(), |end| end + 1);
        let columns = columns.iter().map(|c| c.like(text.len() / line.max(1) + 16)).collect();
        let mut part = Part { columns, rows: 0, lines: 0, unbroken: true, ragged: None };
        let mut rest = text;
        while !rest.is_empty() && part.ragged.is_none() {
            part.lines += 1;
            rest = self.line(rest, &mut part);
        }
        Some(part)
    }

    /// Reads one line and returns what follows it.
    #[inline]
    fn line<'t>(self, text: &'t [u8], part: &mut Part) -> &'t [u8] {
        let after = |text: &'t [u8]| match text {
            [b'\n', rest @ ..] => rest,
            _ => memchr(b'\n', text).map_or(&text[text.len()..], |end| &text[end + 1..]),
        };
        match text[0] {
            b'\n' | b'\r' | b'#' => return after(text),
            first if first.is_ascii_whitespace() => {
                let line = &text[..memchr(b'\n', text).unwrap_or(text.len())];
                if memchr(self.delimiter, line).is_none() && line.trim_ascii().is_empty() {
                    part.unbroken = false;
                    return after(text);
                }
            }
            _ => {}
        }
        let mut rest = text;
        let mut wanted = part.columns.iter_mut().peekable();
        let mut fields = 0;
        loop {
            let column = wanted.next_if(|c| c.index == fields);
            fields += 1;
            let length = match column {
                None => self.field(rest),
                Some(column) => column.take_plain(rest, part.rows, self.delimiter).unwrap_or_else(|| {
                    let length = self.field(rest);
                    column.take(&rest[..length], part.rows);
                    length
                }),
            };
            match rest.get(length) {
                Some(&b) if b == self.delimiter => rest = &rest[length + 1..],
                _ => {
                    rest = after(&rest[length..]);
                    break;
                }
            }
            // a delimiter behind the last field
            if fields == self.width && matches!(rest.first(), None | Some(b'\n' | b'\r')) {
                rest = after(rest);
                break;
            }
        }
        if fields == self.width {
            part.unbroken &= part.lines == part.rows as u64 + 1;
            part.rows += 1;
        } else {
            part.ragged = Some((fields, part.lines));
        }
        rest
    }

    /// Length of the field that `text` begins with.
    fn field(self, text: &[u8]) -> usize {
        match memchr2(self.delimiter, b'\n', text) {
            Some(end) if end > 0 && text[end] == b'\n' && text[end - 1] == b'\r' => end - 1,
            Some(end) => end,
            None => text.len(),
        }
    }
}

/// Whole lines in parts for the cores.
fn cut(lines: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::with_capacity(lines.len() / PART + 1);
    let mut rest = lines;
    while !rest.is_empty() {
        let end = rest.get(PART..).and_then(|tail| memchr(b'\n', tail)).map_or(rest.len(), |end| PART + end + 1);
        let (part, tail) = rest.split_at(end);
        parts.push(part);
        rest = tail;
    }
    parts
}
