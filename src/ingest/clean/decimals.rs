//! Whether a column is written with the same decimals from its first row to its last.
//!
//! Of numbers with noise the last decimal is any digit: eight different ones all end in zero once in 10⁸. Blocks of rows therefore
//! show the decimals with which they were printed, and a column whose blocks change once was printed in two ways: its steps, and
//! what they hide, are not those of one sensor.

/// Rows of a block.
const ROWS: usize = 64;
/// Blocks that are looked at.
const BLOCKS: usize = 64;
/// Blocks of fewer different values rest, and show nothing ...
const DIFFERENT: usize = 8;
/// ... but for those that go to and fro between as many as this ...
const FEW: usize = 3;
/// ... in so many of their rows: noise of a few steps of the last decimal.
const CHANGES: usize = ROWS / 4;
/// Decimals that are looked for; a number with all digits of a double has more.
const MOST: i32 = 12;

/// Decimals of one part of a column and of what follows, and the first row of what follows, counted from 0, to a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Change {
    pub before: i32,
    pub after: i32,
    pub row: usize,
}

impl Change {
    /// Sentence about the change in the column `name`.
    pub(crate) fn text(self, name: &str) -> String {
        format!(
            "{name:?} is written with {} decimals up to about row {} and with {} after it: two recorders, or two settings of one; \
             cut the log there",
            self.before, self.row, self.after
        )
    }
}

/// The one change of decimals in a column of numbers as they are in the file.
pub(crate) fn change(values: &[f64]) -> Option<Change> {
    let step = (values.len() / BLOCKS).max(ROWS);
    let starts = (0..values.len()).step_by(step).filter(|at| at + ROWS <= values.len());
    let shown: Vec<(usize, [i32; 2])> = starts.filter_map(|at| Some((at, printed(&values[at..at + ROWS])?))).collect();
    let first = shown.first()?.1;
    let at = shown.iter().position(|s| s.1[0] != first[0])?;
    let (one, other) = shown.split_at(at);
    let after = other[0].1;
    // a fixed number of leading digits has more decimals where numbers are small
    let alike =
        |part: &[(usize, [i32; 2])], digits: [i32; 2]| part.len() > 1 && part.iter().all(|s| s.1[0] == digits[0]);
    let told =
        alike(one, first) && alike(other, after) && (first[1] - after[1]).signum() == (first[0] - after[0]).signum();
    told.then_some(Change { before: first[0], after: after[0], row: other[0].0 })
}

/// Most decimals and most leading digits in a block; none where it rests.
fn printed(block: &[f64]) -> Option<[i32; 2]> {
    let mut there: Vec<f64> = block.iter().copied().filter(|v| v.is_finite()).collect();
    let changes = there.windows(2).filter(|w| w[0] != w[1]).count();
    there.sort_by(f64::total_cmp);
    there.dedup();
    if there.len() < if changes < CHANGES { DIFFERENT } else { FEW } {
        return None;
    }
    let digits = there.iter().map(|v| {
        let decimals = decimals(*v);
        [decimals, decimals + v.abs().log10().floor() as i32 + 1]
    });
    digits.reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])
}

/// The fewest decimals with which a number is written.
fn decimals(v: f64) -> i32 {
    let whole = |d: &i32| {
        let scaled = v.abs() * 10f64.powi(*d);
        (scaled - scaled.round()).abs() <= (4.0 * f64::EPSILON * scaled).max(1e-9)
    };
    (0..MOST).find(whole).unwrap_or(MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise about `mean`, as `print` writes it.
    fn column(rows: usize, mean: f64, print: impl Fn(usize, f64) -> String) -> Vec<f64> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..rows).map(|k| print(k, mean + next()).parse().unwrap()).collect()
    }

    #[test]
    fn a_change_of_decimals_is_found_and_one_kind_of_print_is_none() {
        let two = column(10_000, 0.0, |k, v| if k < 5000 { format!("{v:.6}") } else { format!("{v:.3}") });
        let found = change(&two).unwrap();
        assert!((found.before, found.after) == (6, 3) && found.row.abs_diff(5000) < 200, "{found:?}");
        assert!(found.text("gz").contains("up to about row 5"));
        // so few that a block has a dozen different numbers
        let coarse = column(10_000, 0.0, |k, v| format!("{:.*}", if k < 5000 { 6 } else { 2 }, 0.12 * v));
        assert_eq!(change(&coarse).map(|found| (found.before, found.after)), Some((6, 2)));
        // at rest, where three different ones are left
        let rest = column(10_000, 6.0, |k, v| format!("{:.*}e-3", if k < 5000 { 3 } else { 0 }, v + 0.3));
        assert_eq!(change(&rest).map(|found| (found.before, found.after)), None);
        let rest = column(10_000, 6.0, |k, v| format!("{:.*}e-3", if k < 5000 { 3 } else { 0 }, 6.0 + 2.2 * (v - 6.0)));
        assert_eq!(change(&rest).map(|found| (found.before, found.after)), Some((6, 3)));
        assert_eq!(change(&column(10_000, 0.0, |_, v| format!("{v:.6}"))), None);
        assert_eq!(change(&column(10_000, 0.0, |_, v| format!("{v}"))), None);
        // leading digits: a jump from 0.0x to 10 takes decimals, not digits
        let leading = |k: usize, v: f64| {
            let v = if k < 5000 { 0.05 * v } else { 10.0 + v };
            format!("{v:.5e}")
        };
        assert_eq!(change(&column(10_000, 0.0, leading)), None);
        // a robot that stands
        assert_eq!(change(&column(10_000, 0.0, |k, v| if k < 5000 { format!("{v:.4}") } else { "0".into() })), None);
        assert_eq!(change(&[1.0, 2.0]), None);
    }
}
