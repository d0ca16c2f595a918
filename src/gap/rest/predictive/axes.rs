//! Bins of time, frequency, averaging time and amplitude.

/// Blocks of time.
const BLOCKS: usize = 48;
/// Width of a band of frequency, relative to its lower edge.
const BAND: f64 = 0.22;
/// Ordinates that a band needs for its largest to say anything.
const FEWEST_ORDINATES: usize = 8;

/// Rows of each block of time.
pub(super) fn blocks(rows: usize) -> Vec<[usize; 2]> {
    let blocks = BLOCKS.min(rows / 8).max(1);
    (0..blocks).map(|b| [b * rows / blocks, (b + 1) * rows / blocks]).collect()
}

/// Fourier frequencies j (from 1) of each band, `from..to`, of `ordinates`.
pub(super) fn bands(ordinates: usize) -> Vec<[usize; 2]> {
    let mut out = Vec::new();
    let mut from = 1;
    while from <= ordinates {
        let to = (from + ((BAND * from as f64) as usize).max(1)).min(ordinates + 1);
        out.push([from, to]);
        from = to;
    }
    out
}

/// Whether the largest ordinate of a band is worth a curve of its own.
pub(super) fn has_lines(band: &[usize; 2]) -> bool {
    band[1] - band[0] >= FEWEST_ORDINATES
}

/// Averaging times in rows: octaves that fit three times.
pub(super) fn octaves(rows: usize) -> Vec<usize> {
    (0..usize::BITS - 1).map(|k| 1_usize << k).take_while(|m| 3 * m <= rows).collect()
}

/// Edges of the amplitudes, in standard deviations: a quarter apart where a normal distribution is, then wider. The last
/// bin takes all that is larger.
pub(super) fn amplitudes() -> Vec<f64> {
    (0..16).map(|i| 0.25 * f64::from(i)).chain([4.0, 4.5, 5.0, 6.0, 8.0, 12.0, 20.0, 50.0]).collect()
}
