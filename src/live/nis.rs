//! NIS of the last blocks at rest: their mean, and whether it is too large for chi-squared.

use crate::math::distributions::chi_squared_interval;

/// Blocks that count.
const WINDOW: usize = 64;

/// Share of windows of a right filter that are called inconsistent.
const FALSE_ALARMS: f64 = 1e-3;

/// NIS of the last blocks that were learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NisSummary {
    /// Number of blocks, at most 64.
    pub blocks: usize,
    /// The last one's.
    pub last: f64,
    /// Their mean; 1 is expected.
    pub mean: f64,
    /// The mean exceeds the 0.999 quantile of chi-squared over its degrees of freedom.
    pub inconsistent: bool,
}

/// The last NIS values, in a ring.
#[derive(Debug, Clone, Copy)]
pub(super) struct NisWindow {
    ring: [f64; WINDOW],
    added: usize,
}

impl NisWindow {
    pub(super) const EMPTY: Self = Self { ring: [0.0; WINDOW], added: 0 };

    pub(super) fn add(&mut self, nis: f64) {
        self.ring[self.added % WINDOW] = nis;
        self.added += 1;
    }

    /// `None` before the first.
    pub(super) fn summary(&self) -> Option<NisSummary> {
        let blocks = self.added.min(WINDOW);
        let last = self.ring[self.added.checked_sub(1)? % WINDOW];
        let n = blocks as f64;
        let mean = self.ring[..blocks].iter().sum::<f64>() / n;
        let [_, most] = chi_squared_interval(n, 1.0 - 2.0 * FALSE_ALARMS);
        Some(NisSummary { blocks, last, mean, inconsistent: n * mean > most })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn too_large_is_said_once_in_a_thousand_and_the_window_forgets() {
        let mut draw = Stream::new(7, 0);
        assert!(NisWindow::EMPTY.summary().is_none());
        let (mut wrong, windows) = (0, 20_000);
        for _ in 0..windows {
            let mut window = NisWindow::EMPTY;
            (0..WINDOW).for_each(|_| window.add(draw.normal().powi(2)));
            wrong += u32::from(window.summary().unwrap().inconsistent);
        }
        // 20 are expected; five deviations of a count
        assert!(wrong < 43, "{wrong}");
        let mut window = NisWindow::EMPTY;
        (0..WINDOW).for_each(|_| window.add(9.0));
        assert!(window.summary().unwrap().inconsistent);
        (0..WINDOW).for_each(|_| window.add(1.0));
        let now = window.summary().unwrap();
        assert!(!now.inconsistent && now.mean == 1.0 && now.blocks == WINDOW && now.last == 1.0);
    }
}
