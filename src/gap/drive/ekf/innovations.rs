//! ν_k = z_k - h(ξ_k), S_k = H P H' + R;  ln p = -½ Σ (ν²/S + ln 2πS);  ∂ν/∂β = -(H D + ∂h/∂β),
//! D⁺ = D + K ∂ν/∂β,  D⁻ = F D⁺ + ∂f/∂β
//!
//! One pass of the extended Kalman filter over a drive, with the derivatives of every innovation by every coefficient β
//! of what may be missing. State ξ: x, y, θ, v, ω. Where torques were not logged, v and ω diffuse as fast as this robot
//! accelerates. The whitened derivatives are summed up in one Gram matrix, which is all that the comparison of effects
//! needs. Several drives have a pass each, whose sums are added.

use super::filter_pass::{FilterPass, RowLinearization, ScalarUpdate};
use super::sensitivity::Tangents;
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::{Channel, Noise};
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::basis::{Column, Scales, Scoped};
use crate::math::registers::free_upper_halves;
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// One innovation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Innovation<'a> {
    /// Row of the log.
    pub row: usize,
    /// Channel.
    pub channel: Channel,
    /// ν/√S
    pub white: f64,
    /// √S
    pub std: f64,
    /// Whitened derivatives by the coefficients: ν/√S = Σ_j slopes_j β_j + white noise.
    pub slopes: &'a [f64],
}

/// Sums of a pass: [A b; b' yy] of the whitened innovations, and ln p at β.
#[derive(Debug, Clone)]
pub(crate) struct Summed {
    /// Gram matrix of the slopes, the innovations in the last row and column.
    pub gram: Mat<f64>,
    /// Σ ln(2πS), over innovations.
    pub ln_volume: f64,
}

impl Summed {
    /// ln p of the drive at β.
    #[must_use]
    pub(crate) fn ln_likelihood(&self) -> f64 {
        let last = self.gram.ncols() - 1;
        -0.5 * (self.ln_volume + self.gram[(last, last)])
    }
}

/// Rows that are added to the Gram matrix at once.
const BLOCK: usize = 192;

/// Runs the filter over `record`; every column is one coefficient for all its drives.
pub(crate) fn run(
    record: &Record,
    models: &Models,
    noise: &Noise,
    columns: &[Column],
    each: impl FnMut(&Innovation) + Send,
) -> Summed {
    let everywhere: Vec<Scoped> = columns.iter().map(|c| Scoped::from(*c)).collect();
    run_scoped(record, models, noise, &everywhere, each)
}

/// Runs the filter over `record`, anew in each drive; slopes are zero in drives where a column does nothing.
pub(crate) fn run_scoped(
    record: &Record,
    models: &Models,
    noise: &Noise,
    columns: &[Scoped],
    mut each: impl FnMut(&Innovation) + Send,
) -> Summed {
    let p = columns.len();
    // one scale for all drives: a free form is the same function in each
    let scales = Scales::of(record, &noise.process.agility);
    let mut summed = Summed { gram: Mat::zeros(p + 1, p + 1), ln_volume: 0.0 };
    let mut slopes = vec![0.0; p];
    for (drive, rows) in record.drives().enumerate() {
        let mut places: Vec<usize> = (0..p).filter(|c| columns[*c].acts_in(drive)).collect();
        let own: Vec<Column> = places.iter().map(|c| columns[*c].column).collect();
        if own.len() == p && record.starts.len() == 1 {
            return one(record, rows, &scales, models, noise, &own, each);
        }
        slopes.fill(0.0);
        let part = one(record, rows, &scales, models, noise, &own, |i| {
            places.iter().zip(i.slopes).for_each(|(place, slope)| slopes[*place] = *slope);
            each(&Innovation { slopes: &slopes, ..*i });
        });
        // the innovations stand last
        places.push(p);
        for (j, to) in places.iter().enumerate() {
            for (i, from) in places.iter().enumerate() {
                summed.gram[(*from, *to)] += part.gram[(i, j)];
            }
        }
        summed.ln_volume += part.ln_volume;
    }
    summed
}

/// Runs the filter over the rows of one drive.
fn one(
    record: &Record,
    rows: Range<usize>,
    scales: &Scales,
    models: &Models,
    noise: &Noise,
    columns: &[Column],
    each: impl FnMut(&Innovation) + Send,
) -> Summed {
    let models = models.carrying(record.load_kg(rows.start));
    let mut along = FilterPass::new(record, rows, scales, models, noise, columns);
    let mut sum = Sum::new(columns.len(), each);
    if columns.is_empty() {
        let mut row = RowLinearization::default();
        while along.row(&mut row) {
            sum.add(std::slice::from_ref(&row), &[]);
        }
    } else {
        let parts = parts(columns, rayon::current_num_threads());
        let forced = record.torques_n_m.is_some();
        let part = |places: &Vec<usize>| Tangents::new(places.iter().map(|c| columns[*c]).collect(), models, forced);
        let tangents: Vec<Tangents> = parts.iter().map(part).collect();
        // the pool is entered once, rather than at every stretch
        rayon::scope(|_| in_stretches(&mut along, tangents, &parts, &mut sum));
    }
    sum.whole(along.ln_volume)
}

/// One thread runs ahead with the filter, others follow with a part of the columns each, and one sums what they have
/// written. The sums do not depend on the division of work.
fn in_stretches(
    along: &mut FilterPass,
    mut tangents: Vec<Tangents>,
    parts: &[Vec<usize>],
    sum: &mut Sum<impl FnMut(&Innovation) + Send>,
) {
    let stretch = Stretch::default;
    let (mut ahead, mut followed, mut done) = (stretch(), stretch(), stretch());
    let slopes = || vec![Vec::new(); parts.len()];
    let (mut written, mut read): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (slopes(), slopes());
    loop {
        let follow = || {
            let each = tangents.par_iter_mut().zip(&mut written);
            each.for_each(|(tangents, slopes)| {
                slopes.clear();
                followed.rows().iter().for_each(|row| tangents.follow(row, slopes));
            });
        };
        let add = || sum.add(done.rows(), &parts.iter().map(Vec::as_slice).zip(&read).collect::<Vec<_>>());
        rayon::join(|| ahead.fill(along), || rayon::join(follow, add));
        std::mem::swap(&mut done, &mut followed);
        std::mem::swap(&mut followed, &mut ahead);
        std::mem::swap(&mut read, &mut written);
        if done.rows().is_empty() && followed.rows().is_empty() {
            return;
        }
    }
}

/// Rows that are handed from thread to thread at once.
#[derive(Default)]
struct Stretch {
    rows: Vec<RowLinearization>,
    used: usize,
}

impl Stretch {
    /// Enough that handing over costs little, and few enough to stay in a cache.
    const ROWS: usize = 64;

    fn fill(&mut self, along: &mut FilterPass) {
        self.rows.resize_with(Self::ROWS, RowLinearization::default);
        self.used = 0;
        while self.used < Self::ROWS && along.row(&mut self.rows[self.used]) {
            self.used += 1;
        }
    }

    fn rows(&self) -> &[RowLinearization] {
        &self.rows[..self.used]
    }
}

/// Distributes the columns over at most `most` parts of similar work. Columns of one change stay together: they share
/// its shape.
fn parts(columns: &[Column], most: usize) -> Vec<Vec<usize>> {
    // a coordinate needs a model evaluation of its own
    let cost = |c: &Column| if matches!(c, Column::Coordinate(..) | Column::Usual(_)) { 10 } else { 1 };
    let mut units: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (c, column) in columns.iter().enumerate() {
        let unit = match *column {
            Column::Coordinate(i, _) | Column::Varying(i, ..) | Column::Usual(i) => (i, 0),
            _ => (usize::MAX, c),
        };
        units.entry(unit).or_default().push(c);
    }
    let mut parts = vec![(0, Vec::new()); most.clamp(1, units.len().max(1))];
    for unit in units.into_values() {
        if let Some((work, part)) = parts.iter_mut().min_by_key(|p| p.0) {
            *work += unit.iter().map(|c| cost(&columns[*c])).sum::<usize>();
            part.extend(unit);
        }
    }
    parts.into_iter().map(|(_, part)| part).collect()
}

/// Whitened innovations with their slopes, summed up block by block.
struct Sum<E> {
    gram: Mat<f64>,
    block: Vec<f64>,
    filled: usize,
    each: E,
}

impl<E: FnMut(&Innovation)> Sum<E> {
    fn new(columns: usize, each: E) -> Self {
        let width = columns + 1;
        Self { gram: Mat::zeros(width, width), block: vec![0.0; BLOCK * width], filled: 0, each }
    }

    /// Adds the readings of `rows`. `parts`: for each part of the columns their indices, and the slopes by them,
    /// reading by reading.
    fn add(&mut self, rows: &[RowLinearization], parts: &[(&[usize], &Vec<f64>)]) {
        let width = self.gram.ncols();
        let taken = rows.iter().flat_map(|row| row.taken.iter().map(|taken| (row.row, taken)));
        for (n, (row, taken)) in taken.enumerate() {
            let out = &mut self.block[self.filled * width..(self.filled + 1) * width];
            for (places, slopes) in parts {
                let own = &slopes[n * places.len()..(n + 1) * places.len()];
                places.iter().zip(own).for_each(|(place, slope)| out[*place] = *slope);
            }
            out[width - 1] = taken.white;
            let ScalarUpdate { channel, white, std, .. } = *taken;
            (self.each)(&Innovation { row, channel, white, std, slopes: &out[..width - 1] });
            self.filled += 1;
            if self.filled == BLOCK {
                self.empty();
            }
        }
    }

    /// G += B'B over the rows of the block.
    fn empty(&mut self) {
        let (rows, width) = (self.filled, self.gram.ncols());
        if rows > 0 {
            let b = MatRef::from_row_major_slice(&self.block[..rows * width], rows, width);
            // one triangle is enough until the end
            let (whole, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
            matmul(self.gram.as_mut(), lower, Accum::Add, b.transpose(), whole, b, whole, 1.0, Par::Seq);
            free_upper_halves();
        }
        self.filled = 0;
    }

    fn whole(mut self, ln_volume: f64) -> Summed {
        self.empty();
        let mut gram = self.gram;
        for j in 0..gram.ncols() {
            for i in 0..j {
                gram[(i, j)] = gram[(j, i)];
            }
        }
        Summed { gram, ln_volume }
    }
}
