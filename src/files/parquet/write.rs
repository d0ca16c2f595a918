//! Data frames as Parquet with checksums. The writer of polars writes none: it encodes the pages here, and their headers, the
//! row groups and the footer are put together as it does, with a checksum each.

use super::checks::{MAGIC, before_footer, crc32};
use crate::files::mark;
use crate::progress;
use polars::prelude::{ArrowSchema, CompatLevel, DataFrame, PolarsError, PolarsResult, SchemaExt};
use polars_parquet::parquet::compression::compress;
use polars_parquet::parquet::metadata::ColumnDescriptor;
use polars_parquet::read::DataPageHeader;
use polars_parquet::write::{
    CompressionOptions, DynIter, FileWriter, Page, StatisticsOptions, Version, WriteOptions, array_to_columns,
    get_dtype_encoding, schema_to_metadata_key, to_parquet_schema,
};
use polars_parquet_format::thrift::protocol::TCompactOutputProtocol;
use polars_parquet_format::{
    ColumnChunk, ColumnMetaData, DictionaryPageHeader, Encoding, PageHeader, PageType, RowGroup, Statistics,
};
use rayon::prelude::*;
use std::io::Write;

/// Rows of a row group that is written.
const GROUP_ROWS: usize = 1 << 18;

/// Writes `frame` with gyroid's mark: row groups compressed with zstd, columns on all cores.
pub(crate) fn write(frame: &mut DataFrame, out: impl Write) -> PolarsResult<()> {
    write_as(frame, out, GROUP_ROWS, CompressionOptions::Zstd(None))
}

pub(crate) fn write_as(
    frame: &mut DataFrame,
    mut out: impl Write,
    group_rows: usize,
    compression: CompressionOptions,
) -> PolarsResult<()> {
    let frame = polars::frame::chunk_df_for_writing(frame, group_rows)?;
    let fields = frame.schema().iter_fields();
    let schema: ArrowSchema =
        fields.map(|f| (f.name().clone(), f.dtype().to_arrow_field(f.name().clone(), CompatLevel::newest()))).collect();
    let types = to_parquet_schema(&schema)?;
    let encodings: Vec<_> = schema.iter_values().map(|field| get_dtype_encoding(&field.dtype)).collect();
    let options = WriteOptions {
        statistics: StatisticsOptions::default(),
        compression,
        version: Version::V1,
        // one page a column and row group: its statistics are theirs
        data_page_size: Some(usize::MAX),
    };
    // schema and keys as polars writes them
    let keys = vec![schema_to_metadata_key(&schema), mark::parquet()];
    let mut empty = FileWriter::try_new(std::io::sink(), schema, options)?;
    empty.end(Some(keys))?;
    let (_, mut metadata) = empty.into_inner_and_metadata();
    out.write_all(&MAGIC)?;
    let mut at = MAGIC.len() as i64;
    for group in frame.iter_chunks(CompatLevel::newest(), false).filter(|group| !group.is_empty()) {
        progress::tell(metadata.num_rows as usize, frame.height());
        let chunks: PolarsResult<Vec<Vec<Chunk>>> = group
            .columns()
            .par_iter()
            .zip(types.fields())
            .zip(&encodings)
            .map(|((array, of), encoding)| {
                let leaves = array_to_columns(array, of.clone(), options, encoding)?;
                leaves.into_iter().map(|pages| Chunk::of(pages, compression)).collect()
            })
            .collect();
        let start = at;
        let mut columns = Vec::with_capacity(types.columns().len());
        for (chunk, of) in chunks?.into_iter().flatten().zip(types.columns()) {
            out.write_all(&chunk.bytes)?;
            let length = chunk.bytes.len() as i64;
            columns.push(chunk.column(of, at, compression));
            at += length;
        }
        let unpacked = columns.iter().filter_map(|c| Some(c.meta_data.as_ref()?.total_uncompressed_size)).sum();
        metadata.num_rows += group.len() as i64;
        metadata.row_groups.push(RowGroup {
            columns,
            total_byte_size: unpacked,
            num_rows: group.len() as i64,
            sorting_columns: None,
            file_offset: Some(start),
            total_compressed_size: Some(at - start),
            ordinal: i16::try_from(metadata.row_groups.len()).ok(),
        });
    }
    let mut footer = Vec::new();
    metadata.write_to_out_protocol(&mut TCompactOutputProtocol::new(&mut footer)).map_err(failed)?;
    out.write_all(&before_footer(&footer))?;
    out.write_all(&footer)?;
    out.write_all(&u32::try_from(footer.len()).map_err(failed)?.to_le_bytes())?;
    out.write_all(&MAGIC)?;
    Ok(out.flush()?)
}

fn failed(why: impl std::fmt::Display) -> PolarsError {
    PolarsError::ComputeError(why.to_string().into())
}

/// A column of a row group as it lies in the file.
#[derive(Default)]
struct Chunk {
    bytes: Vec<u8>,
    /// Length with pages unpacked, bytes.
    unpacked: usize,
    values: i64,
    /// Where the data begin; behind the dictionary, where there is one.
    data: Option<usize>,
    encodings: Vec<Encoding>,
    /// Of the only page with data.
    statistics: Option<Statistics>,
}

impl Chunk {
    fn of(pages: DynIter<'static, PolarsResult<Page>>, compression: CompressionOptions) -> PolarsResult<Self> {
        let mut chunk = Self::default();
        for page in pages {
            match page? {
                Page::Dict(page) => {
                    let about = DictionaryPageHeader {
                        num_values: i32::try_from(page.num_values).map_err(failed)?,
                        encoding: Encoding::PLAIN,
                        is_sorted: None,
                    };
                    chunk.encodings.push(about.encoding);
                    let header = |header| PageHeader {
                        type_: PageType::DICTIONARY_PAGE,
                        dictionary_page_header: Some(about),
                        ..header
                    };
                    chunk.push(&page.buffer, compression, header)?;
                }
                Page::Data(page) => {
                    // asked for as version 1
                    let DataPageHeader::V1(mut about) = page.header().clone() else { return Err(failed("a page")) };
                    let statistics = about.statistics.take();
                    chunk.statistics = if chunk.data.is_none() { statistics } else { None };
                    chunk.data.get_or_insert(chunk.bytes.len());
                    chunk.values += i64::from(about.num_values);
                    chunk.encodings.extend([about.encoding, Encoding::RLE]);
                    let header = |header| PageHeader { data_page_header: Some(about), ..header };
                    chunk.push(page.buffer(), compression, header)?;
                }
            }
        }
        chunk.encodings.sort_unstable();
        chunk.encodings.dedup();
        Ok(chunk)
    }

    fn push(
        &mut self,
        page: &[u8],
        compression: CompressionOptions,
        header: impl FnOnce(PageHeader) -> PageHeader,
    ) -> PolarsResult<()> {
        let mut packed = Vec::new();
        let packed = match compression {
            CompressionOptions::Uncompressed => page,
            _ => {
                compress(compression, page, &mut packed)?;
                &packed
            }
        };
        let header = header(PageHeader {
            type_: PageType::DATA_PAGE,
            uncompressed_page_size: i32::try_from(page.len()).map_err(failed)?,
            compressed_page_size: i32::try_from(packed.len()).map_err(failed)?,
            crc: Some(crc32(packed) as i32),
            data_page_header: None,
            index_page_header: None,
            dictionary_page_header: None,
            data_page_header_v2: None,
        });
        let before = self.bytes.len();
        header.write_to_out_protocol(&mut TCompactOutputProtocol::new(&mut self.bytes)).map_err(failed)?;
        self.unpacked += self.bytes.len() - before + page.len();
        self.bytes.extend_from_slice(packed);
        Ok(())
    }

    /// The entry in the footer of a chunk that begins at byte `at`.
    fn column(self, of: &ColumnDescriptor, at: i64, compression: CompressionOptions) -> ColumnChunk {
        let data = self.data.unwrap_or(0) as i64;
        let about = ColumnMetaData {
            type_: <(polars_parquet_format::Type, Option<i32>)>::from(of.descriptor.primitive_type.physical_type).0,
            encodings: self.encodings,
            path_in_schema: of.path_in_schema.iter().map(ToString::to_string).collect(),
            codec: compression.into(),
            num_values: self.values,
            total_uncompressed_size: self.unpacked as i64,
            total_compressed_size: self.bytes.len() as i64,
            key_value_metadata: None,
            data_page_offset: at + data,
            index_page_offset: None,
            dictionary_page_offset: (data > 0).then_some(at),
            statistics: self.statistics,
            encoding_stats: None,
            bloom_filter_offset: None,
            bloom_filter_length: None,
            size_statistics: None,
        };
        ColumnChunk {
            file_path: None,
            file_offset: 0,
            meta_data: Some(about),
            offset_index_offset: None,
            offset_index_length: None,
            column_index_offset: None,
            column_index_length: None,
            crypto_metadata: None,
            encrypted_column_metadata: None,
        }
    }
}
