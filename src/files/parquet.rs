//! Parquet: data frames out, columns in. Bytes are mapped into memory while they are read.

use super::mark;
use crate::progress;
use polars::prelude::{
    ArrowField, ArrowSchema, CompatLevel, DataFrame, IntoColumn, PolarsError, PolarsResult, SchemaExt, Series,
};
use polars_arrow::array::Array;
use polars_buffer::Buffer;
use polars_parquet::parquet::error::ParquetError;
use polars_parquet::read::{
    BasicDecompressor, FileMetadata, Filter, PageReader, column_iter_to_arrays, infer_schema, read_metadata,
};
use polars_parquet::write::{
    CompressionOptions, Compressor, DynIter, DynStreamingIterator, FileWriter, StatisticsOptions, Version,
    WriteOptions, array_to_columns, get_dtype_encoding, schema_to_metadata_key, to_parquet_schema,
};
use polars_utils::mmap::MMapSemaphore;
use rayon::prelude::*;
use std::fs::File;
use std::io::{Cursor, Write};
use std::ops::Range;

/// Rows of a row group that is written.
const GROUP_ROWS: usize = 1 << 18;

/// Metadata and schema of a Parquet file. A damaged file may make any method panic.
pub(crate) struct Contents {
    pub metadata: FileMetadata,
    pub schema: ArrowSchema,
}

impl Contents {
    pub(crate) fn of(file: &File) -> PolarsResult<Self> {
        let metadata = read_metadata(&mut &*file)?;
        let schema = infer_schema(&metadata)?;
        Ok(Self { metadata, schema })
    }

    /// The field of a column.
    pub(crate) fn field(&self, column: usize) -> PolarsResult<&ArrowField> {
        self.schema.get_at_index(column).map(|(_, field)| field).ok_or_else(|| lacking("a column"))
    }

    /// `rows` of `column`, one array or more for each row group; decoded on all cores.
    pub(crate) fn arrays(
        &self,
        file: &Mapped,
        column: usize,
        rows: &Range<usize>,
    ) -> PolarsResult<Vec<Box<dyn Array>>> {
        let field = self.field(column)?;
        let mut from = 0;
        let mut parts = Vec::new();
        for group in &self.metadata.row_groups {
            let to = from + group.num_rows();
            let part = rows.start.max(from)..rows.end.min(to);
            if !part.is_empty() {
                parts.push((group, part.start - from..part.end - from));
            }
            from = to;
        }
        let decode = |(group, part): (&polars_parquet::read::RowGroupMetadata, Range<usize>)| {
            let chunks = group.columns_under_root_iter(&field.name).ok_or_else(|| lacking(&field.name))?;
            let (pages, types) = chunks
                .map(|chunk| {
                    let bytes = chunk.byte_range();
                    let bytes = file.0.clone().sliced(bytes.start as usize..bytes.end as usize);
                    let pages = PageReader::new(Cursor::new(bytes), chunk, Vec::new(), usize::MAX);
                    (BasicDecompressor::new(pages, Vec::new()), &chunk.descriptor().descriptor.primitive_type)
                })
                .unzip();
            let part = Filter::new_ranged(part.start, part.end);
            Ok(column_iter_to_arrays(pages, types, field.clone(), Some(part))?.0)
        };
        let arrays: PolarsResult<Vec<_>> = parts.into_par_iter().map(decode).collect();
        Ok(arrays?.into_iter().flatten().collect())
    }

    /// All columns, all rows.
    pub(crate) fn frame(&self, file: &Mapped) -> PolarsResult<DataFrame> {
        let rows = 0..self.metadata.num_rows;
        if rows.is_empty() {
            // no row group holds cells that a column could be made of
            return Ok(DataFrame::empty());
        }
        let column = |i: usize| {
            let series = Series::try_from((self.field(i)?, self.arrays(file, i, &rows)?))?;
            Ok(series.into_column())
        };
        let columns: PolarsResult<Vec<_>> = (0..self.schema.len()).map(column).collect();
        DataFrame::new(rows.end, columns?)
    }
}

/// The bytes of a file; what was read of them is given back with it.
pub(crate) struct Mapped(Buffer<u8>);

impl Mapped {
    pub(crate) fn of(file: &File) -> PolarsResult<Self> {
        Ok(Self(Buffer::from_owner(MMapSemaphore::new_from_file(file)?)))
    }
}

fn lacking(what: &str) -> PolarsError {
    PolarsError::ColumnNotFound(format!("a row group lacks {what}").into())
}

/// Writes `frame` with gyroid's mark: row groups compressed with zstd, columns on all cores.
pub(crate) fn write(frame: &mut DataFrame, out: impl Write) -> PolarsResult<()> {
    write_as(frame, out, GROUP_ROWS, CompressionOptions::Zstd(None))
}

pub(crate) fn write_as(
    frame: &mut DataFrame,
    out: impl Write,
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
        data_page_size: None,
    };
    let mut metadata = vec![schema_to_metadata_key(&schema)];
    let mut writer = FileWriter::try_new(out, schema, options)?;
    let mut written = 0;
    for group in frame.iter_chunks(CompatLevel::newest(), false).filter(|group| !group.is_empty()) {
        progress::tell(written, frame.height());
        let columns: PolarsResult<Vec<_>> = group
            .columns()
            .par_iter()
            .zip(types.fields())
            .zip(&encodings)
            .map(|((array, of), encoding)| array_to_columns(array, of.clone(), options, encoding))
            .collect();
        let compressed = columns?.into_iter().flatten().map(|pages| {
            let pages = pages.map(|page| page.map_err(|e| ParquetError::FeatureNotSupported(e.to_string())));
            let pages = Compressor::new_from_vec(pages, compression, Vec::new());
            Ok(DynStreamingIterator::new(polars_parquet::write::FallibleStreamingIterator::map_err(
                pages,
                PolarsError::from,
            )))
        });
        writer.write(group.len() as u64, DynIter::new(compressed))?;
        written += group.len();
    }
    metadata.push(mark::parquet());
    writer.end(Some(metadata))?;
    Ok(())
}
