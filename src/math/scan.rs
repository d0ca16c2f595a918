//! Looks through long series on all cores, piece by piece.

use rayon::prelude::*;

/// Samples of a piece. Sums over pieces do not depend on how many cores there are.
pub(crate) const PIECE: usize = 1 << 16;

/// The first value, told with its place, that is `wanted`.
pub(crate) fn first_where(values: &[f64], wanted: impl Fn(usize, f64) -> bool + Sync) -> Option<usize> {
    first_piece(values.len(), |from, to| {
        let part = &values[from..to];
        // without a way out the compiler compares side by side
        let any = part.iter().enumerate().fold(false, |any, (i, v)| any | wanted(from + i, *v));
        any.then(|| part.iter().enumerate().position(|(i, v)| wanted(from + i, *v))).flatten().map(|i| from + i)
    })
}

/// The first value that is `wanted`, looked at together with the one before it.
pub(crate) fn first_after(values: &[f64], wanted: impl Fn(f64, f64) -> bool + Sync) -> Option<usize> {
    first_piece(values.len().saturating_sub(1), |from, to| {
        let (before, after) = (&values[from..to], &values[from + 1..=to]);
        let pairs = || before.iter().zip(after);
        let any = pairs().fold(false, |any, (a, b)| any | wanted(*a, *b));
        any.then(|| pairs().position(|(a, b)| wanted(*a, *b))).flatten().map(|i| from + i + 1)
    })
}

/// Whether a series holds values that are not finite, or negative zeros.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Odd {
    /// The first value that is not finite.
    pub first: Option<usize>,
    /// Whether all are finite and none is a negative zero: adding 0 and multiplying by 1 would change no bit.
    pub none: bool,
}

/// Looks for values that are not finite, and for negative zeros.
pub(crate) fn odd(values: &[f64]) -> Odd {
    let strange = first_where(values, |_, v| !v.is_finite() | (v.to_bits() == (-0.0_f64).to_bits()));
    Odd { first: strange.and_then(|_| first_where(values, |_, v| !v.is_finite())), none: strange.is_none() }
}

/// The first answer of `look`, asked piece by piece.
fn first_piece(len: usize, look: impl Fn(usize, usize) -> Option<usize> + Sync) -> Option<usize> {
    match len {
        0 => return None,
        1..=PIECE => return look(0, len),
        _ => {}
    }
    (0..len.div_ceil(PIECE)).into_par_iter().find_map_first(|k| look(k * PIECE, ((k + 1) * PIECE).min(len)))
}

/// Puts `new(value)` in the place of each value.
pub(crate) fn replace(values: &mut [f64], new: impl Fn(f64) -> f64 + Sync) {
    let each = |part: &mut [f64]| part.iter_mut().for_each(|v| *v = new(*v));
    if values.len() <= PIECE { each(values) } else { values.par_chunks_mut(PIECE).for_each(each) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_is_found_wherever_it_stands() {
        for n in [0, 1, 2, PIECE, PIECE + 1, 3 * PIECE + 7] {
            let x: Vec<f64> = (0..n).map(|i| i as f64).collect();
            assert_eq!(first_where(&x, |_, v| v.is_nan()), None);
            assert_eq!(first_after(&x, |a, b| b <= a), None);
            for at in [0, 1, PIECE - 1, PIECE, PIECE + 1, 3 * PIECE].into_iter().filter(|at| *at < n) {
                let mut odd = x.clone();
                odd[at] = -1.0;
                odd[n - 1] = -1.0;
                assert_eq!(first_where(&odd, |i, v| v != i as f64), Some(at), "{n}");
                let plain = odd.windows(2).position(|w| w[1] < w[0]).map(|k| k + 1);
                assert_eq!(first_after(&odd, |a, b| b < a), plain, "{n} {at}");
            }
        }
    }

    #[test]
    fn odd_values_are_told_apart() {
        let mut x = vec![1.0; PIECE + 5];
        assert_eq!(odd(&x), Odd { first: None, none: true });
        x[PIECE] = -0.0;
        assert_eq!(odd(&x), Odd { first: None, none: false });
        x[PIECE + 2] = f64::NAN;
        x[PIECE + 3] = f64::INFINITY;
        assert_eq!(odd(&x), Odd { first: Some(PIECE + 2), none: false });
    }

    #[test]
    fn every_value_is_replaced_once() {
        let mut x: Vec<f64> = (0..2 * PIECE + 3).map(|i| i as f64).collect();
        replace(&mut x, |v| 2.0 * v + 1.0);
        assert!(x.iter().enumerate().all(|(i, v)| *v == (2 * i + 1) as f64));
    }
}
