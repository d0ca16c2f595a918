//! Columns of Parquet whose pages hold plain floats and no gaps, as recorders write them: put straight into their places, on
//! all cores. Whatever looks otherwise, or damaged, is left to the decoder that knows it all.

use crate::files::parquet::{Contents, read_at};
use crate::unwind;
use polars_parquet::parquet::encoding::Encoding;
use polars_parquet::parquet::encoding::hybrid_rle::{HybridRleChunk, HybridRleDecoder};
use polars_parquet::parquet::metadata::{ColumnChunkMetadata, RowGroupMetadata};
use polars_parquet::parquet::page::{DataPage, split_buffer};
use polars_parquet::parquet::read::{BasicDecompressor, PageReader};
use polars_parquet::parquet::schema::types::PhysicalType;
use rayon::prelude::*;
use std::fs::File;
use std::io::Cursor;

/// All cells of a column.
pub(crate) struct Floats {
    pub values: Vec<f64>,
    /// The largest of them by its size, of those that are finite; of single precision only.
    pub largest: f64,
}

/// Bytes of a page's levels, where no cell is missing.
const MOST_LEVEL_BYTES: usize = 4096;

/// The columns of these names, all rows of them; none if they are not plain, or damaged.
pub(crate) fn read(file: &File, contents: &Contents, names: &[&str]) -> Option<Vec<Floats>> {
    let metadata = &contents.metadata;
    let rows = metadata.num_rows;
    let bytes = file.metadata().ok()?.len();
    let groups = &metadata.row_groups;
    if names.is_empty() || groups.iter().try_fold(0_usize, |sum, g| sum.checked_add(g.num_rows()))? != rows {
        return None;
    }
    // a count that a damaged file states may be beyond all memory
    Vec::<f64>::new().try_reserve_exact(rows.checked_mul(names.len())?).ok()?;
    let mut columns: Vec<Vec<f64>> = names.iter().map(|_| vec![0.0; rows]).collect();
    let mut tasks = Vec::with_capacity(groups.len() * names.len());
    let mut left: Vec<&mut [f64]> = columns.iter_mut().map(Vec::as_mut_slice).collect();
    for group in groups {
        for (column, (name, left)) in names.iter().zip(&mut left).enumerate() {
            let (places, rest) = std::mem::take(left).split_at_mut(group.num_rows());
            *left = rest;
            // numbers of a damaged footer may make it panic
            let chunk = unwind::caught(|| Chunk::of(group, name, places.len(), bytes))??;
            tasks.push((column, chunk, places));
        }
    }
    let largest = |buffer: &mut Vec<u8>, (column, chunk, places): (usize, Chunk<'_>, &mut [f64])| {
        Some((column, unwind::caught(|| chunk.read(file, contents, places, buffer))??))
    };
    let largest: Option<Vec<(usize, f64)>> =
        tasks.into_par_iter().with_max_len(1).map_init(Vec::new, largest).collect();
    let mut floats: Vec<Floats> = columns.into_iter().map(|values| Floats { values, largest: 0.0 }).collect();
    for (column, largest) in largest? {
        floats[column].largest = floats[column].largest.max(largest);
    }
    Some(floats)
}

/// Floats of a column in one row group.
struct Chunk<'a> {
    about: &'a ColumnChunkMetadata,
    single: bool,
}

impl<'a> Chunk<'a> {
    fn of(group: &'a RowGroupMetadata, name: &str, rows: usize, file_bytes: u64) -> Option<Self> {
        let mut leaves = group.columns_under_root_iter(name)?;
        let (about, None) = (leaves.next()?, leaves.next()) else { return None };
        let single = match about.physical_type() {
            PhysicalType::Float => true,
            PhysicalType::Double => false,
            _ => return None,
        };
        let descriptor = &about.descriptor().descriptor;
        let flat = descriptor.max_rep_level == 0 && descriptor.max_def_level <= 1;
        let whole = usize::try_from(about.num_values()) == Ok(rows) && about.byte_range().end <= file_bytes;
        (flat && whole && about.dictionary_page_offset().is_none()).then_some(Self { about, single })
    }

    /// Puts its values into `places`; returns the largest by its size. `buffer` comes and goes.
    fn read(&self, file: &File, contents: &Contents, places: &mut [f64], buffer: &mut Vec<u8>) -> Option<f64> {
        let range = self.about.byte_range();
        let mut bytes = vec![0; usize::try_from(range.end - range.start).ok()?];
        read_at(file, &mut bytes, range.start).ok()?;
        contents.check(self.about, &bytes, &(0..places.len())).ok()?;
        let most = bytes.len();
        let reader = PageReader::new(Cursor::new(bytes.into()), self.about, Vec::new(), most);
        let mut pages = BasicDecompressor::new(reader, std::mem::take(buffer));
        let (mut rest, mut largest) = (places, 0_f64);
        while let Some(page) = pages.next() {
            let page = page.ok()?;
            let count = page.num_values();
            let width = if self.single { 4 } else { 8 };
            if count > rest.len() || page.page().uncompressed_size() > width * count + MOST_LEVEL_BYTES {
                return None;
            }
            let page = page.decompress(&mut pages).ok()?;
            let (places, later) = rest.split_at_mut(count);
            largest = largest.max(self.decode(&page, places)?);
            rest = later;
            pages.reuse_page_buffer(page);
        }
        *buffer = pages.into_inner();
        rest.is_empty().then_some(largest)
    }

    fn decode(&self, page: &DataPage, places: &mut [f64]) -> Option<f64> {
        let optional = self.about.descriptor().descriptor.max_def_level > 0;
        if page.encoding() != Encoding::Plain || page.definition_level_encoding() != Encoding::Rle {
            return None;
        }
        let parts = split_buffer(page).ok()?;
        if optional && !all_there(parts.def, places.len()) {
            return None;
        }
        if !self.single {
            let (values, []) = parts.values.as_chunks() else { return None };
            if values.len() != places.len() {
                return None;
            }
            places.iter_mut().zip(values).for_each(|(place, bytes)| *place = f64::from_le_bytes(*bytes));
            return Some(0.0);
        }
        let (values, []) = parts.values.as_chunks() else { return None };
        if values.len() != places.len() {
            return None;
        }
        let mut largest = 0;
        for (place, bytes) in places.iter_mut().zip(values) {
            let value = f32::from_le_bytes(*bytes);
            *place = f64::from(value);
            // sizes are in the order of their bits
            let size = value.to_bits() & !SIGN;
            largest = largest.max(if size < INFINITY { size } else { 0 });
        }
        Some(f64::from(f32::from_bits(largest)))
    }
}

const SIGN: u32 = 1 << 31;
const INFINITY: u32 = f32::INFINITY.to_bits();

/// Whether the definition levels of `count` cells say that none is missing.
fn all_there(levels: &[u8], count: usize) -> bool {
    let mut runs = HybridRleDecoder::new(levels, 1, count).into_chunk_iter();
    let there = runs.try_fold(0, |sum, run| match run {
        Ok(HybridRleChunk::Rle(1, length)) => Some(sum + length),
        _ => None,
    });
    there == Some(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::parquet::write_as;
    use polars::prelude::{Column, DataFrame, IntoColumn, NamedFrom, Series};
    use polars_parquet::write::CompressionOptions;

    fn written(columns: Vec<Column>, compression: CompressionOptions, rows_of_group: usize) -> File {
        let mut file = tempfile::tempfile().unwrap();
        let mut frame = DataFrame::new(columns[0].len(), columns).unwrap();
        write_as(&mut frame, &mut file, rows_of_group, compression).unwrap();
        file
    }

    fn read_back(file: &File, names: &[&str]) -> Option<Vec<Floats>> {
        read(file, &Contents::of(file).unwrap(), names)
    }

    #[test]
    fn plain_floats_come_back_bit_by_bit() {
        let rows = 1_507;
        let double: Vec<f64> = (0..rows).map(|i| f64::from(i) * 0.01 - 3.0).collect();
        let mut single: Vec<f32> = (0..rows).map(|i| (f64::from(i) * 0.37).sin() as f32).collect();
        single[7] = f32::NAN;
        single[8] = f32::NEG_INFINITY;
        single[9] = -2.5;
        single[10] = -0.0;
        for compression in [
            CompressionOptions::Uncompressed,
            CompressionOptions::Snappy,
            CompressionOptions::Zstd(None),
            CompressionOptions::Lz4Raw,
        ] {
            for rows_of_group in [1, 1000, 20_000] {
                let columns = vec![
                    Series::new("t_s".into(), &double).into_column(),
                    Series::new("n".into(), &(0..rows).collect::<Vec<i32>>()).into_column(),
                    Series::new("gz".into(), &single).into_column(),
                ];
                let file = written(columns, compression, rows_of_group);
                let [gz, t] = &read_back(&file, &["gz", "t_s"]).unwrap()[..] else { panic!("two columns") };
                assert!(t.values.iter().zip(&double).all(|(a, b)| a.to_bits() == b.to_bits()));
                assert!(gz.values.iter().zip(&single).all(|(a, b)| a.to_bits() == f64::from(*b).to_bits()));
                assert_eq!((t.values.len(), gz.values.len(), gz.largest), (double.len(), single.len(), 2.5));
                // whole numbers are not floats
                assert!(read_back(&file, &["t_s", "n"]).is_none() && read_back(&file, &["no such"]).is_none());
            }
        }
    }

    #[test]
    fn gaps_are_left_to_others() {
        let some: Vec<Option<f64>> = (0..1000).map(|i| (i != 500).then_some(f64::from(i))).collect();
        let file = written(vec![Series::new("a".into(), some).into_column()], CompressionOptions::Zstd(None), 300);
        assert!(read_back(&file, &["a"]).is_none());
    }
}
