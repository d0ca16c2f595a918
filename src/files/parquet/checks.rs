//! Checksums in Parquet files: CRC-32 of each page in its header, as the format has it, and of the footer before it, which the
//! format leaves open and gyroid writes.

use flate2::Crc;
use polars_parquet::parquet::metadata::ColumnChunkMetadata;
use polars_parquet::parquet::page::ParquetPageHeader;
use polars_parquet_format::thrift::protocol::TCompactInputProtocol;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;

/// First and last bytes of a Parquet file.
pub(super) const MAGIC: [u8; 4] = *b"PAR1";
/// Stands before the checksum of the footer, which stands before the footer. Other readers pass over it.
const FOOTER_TAG: [u8; 16] = *b"CRC-32 of footer";
/// Bytes behind the footer: its length and the magic.
const END_BYTES: u64 = 8;
/// Bytes of a page's header; what the format puts there is shorter by far.
const MOST_HEADER_BYTES: usize = 1 << 20;

/// CRC-32 as gzip has it.
pub(super) fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// Tag and checksum that stand before `footer`: 16 bytes and its CRC-32, little-endian.
pub(super) fn before_footer(footer: &[u8]) -> [u8; 20] {
    let mut out = [0; 20];
    out[..16].copy_from_slice(&FOOTER_TAG);
    out[16..].copy_from_slice(&crc32(footer).to_le_bytes());
    out
}

/// The checksum of a footer. Where there is one, each page has one too.
pub(super) struct Footer {
    /// Whether it fits.
    pub fits: bool,
    /// Where it stands in the file, at the end of the last page.
    pub at: u64,
}

/// The checksum of the footer; none where the file has none.
pub(super) fn footer(file: &mut (impl Read + Seek)) -> io::Result<Option<Footer>> {
    let end = file.seek(SeekFrom::End(0))?;
    let mut last = [0; END_BYTES as usize];
    if end < END_BYTES {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(end - END_BYTES))?;
    file.read_exact(&mut last)?;
    let [a, b, c, d, ..] = last;
    let length = u64::from(u32::from_le_bytes([a, b, c, d]));
    let Some(at) = (end - END_BYTES).checked_sub(length + 20) else { return Ok(None) };
    file.seek(SeekFrom::Start(at))?;
    let mut tagged = [0; 20];
    file.read_exact(&mut tagged)?;
    if tagged[..16] != FOOTER_TAG {
        return Ok(None);
    }
    let mut footer = vec![0; length as usize];
    file.read_exact(&mut footer)?;
    Ok(Some(Footer { fits: tagged == before_footer(&footer), at }))
}

/// Checks the pages with any of `rows` in `bytes`, those of the column's `chunk`: their checksums, and that they hold no more
/// than the footer says, for the decoder asks for as much memory as a page claims. Pages without a checksum pass, unless `all`
/// must have one.
///
/// # Errors
/// The page that is damaged.
pub(super) fn pages(chunk: &ColumnChunkMetadata, bytes: &[u8], rows: &Range<usize>, all: bool) -> Result<(), String> {
    let (from, values) = (chunk.byte_range().start, usize::try_from(chunk.num_values()).unwrap_or(0));
    let (mut rest, mut row) = (bytes, 0);
    while !rest.is_empty() && row < rows.end {
        let page = format!("the page at byte {}", from + (bytes.len() - rest.len()) as u64);
        // what cannot be read here is told by the decoder
        let mut protocol = TCompactInputProtocol::new(&mut rest, MOST_HEADER_BYTES);
        let Ok(header) = ParquetPageHeader::read_from_in_protocol(&mut protocol) else { return Ok(()) };
        let length = usize::try_from(header.compressed_page_size).ok();
        let Some((packed, next)) = length.and_then(|n| rest.split_at_checked(n)) else { return Ok(()) };
        let data = header.data_page_header.as_ref().map(|h| h.num_values);
        let data = data.or(header.data_page_header_v2.as_ref().map(|h| h.num_values));
        let dictionary = header.dictionary_page_header.as_ref().map(|h| h.num_values);
        let unpacked = i64::from(header.uncompressed_page_size);
        // a dictionary may have words that no row has, but none without a byte
        let words = dictionary.is_none_or(|n| (0..=unpacked).contains(&i64::from(n)));
        let data_fit = data.is_none_or(|n| usize::try_from(n).is_ok_and(|n| n <= values));
        if !words || !data_fit || !(0..=chunk.uncompressed_size()).contains(&unpacked) {
            return Err(format!("{page} claims more than its column holds"));
        }
        let last = row + data.map_or(0, |n| n as usize);
        if last > values || (next.is_empty() && last != values) {
            return Err(format!("{page} ends with value {last} of {values}"));
        }
        // a dictionary has no rows, and belongs to all of them
        if data.is_none() || last > rows.start {
            match header.crc {
                Some(crc) if crc as u32 != crc32(packed) => {
                    return Err(format!("{page} does not fit its checksum: its bytes were changed"));
                }
                None if all => return Err(format!("{page} has lost its checksum")),
                _ => {}
            }
        }
        (rest, row) = (next, last);
    }
    Ok(())
}
