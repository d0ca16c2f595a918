//! Work on many cases, on threads of its own: a case uses rayon's pool itself, and a worker of that pool which waits for it
//! would take up the next case inside the first, deeper and deeper.

use crate::error::Result;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// `work` on every one of `items`, so many at a time (0: one a core); the results in the order of the items. After the first
/// failure no further item is begun. `progress` is called with (done, all).
///
/// # Errors
/// The failure of the first item, in their order, of those that failed.
pub(super) fn each<T: Sync, R: Send>(
    items: &[T],
    at_a_time: usize,
    progress: impl Fn(usize, usize) + Sync,
    work: impl Fn(usize, &T) -> Result<R> + Sync,
) -> Result<Vec<R>> {
    let next = AtomicUsize::new(0);
    let done: Mutex<BTreeMap<usize, Result<R>>> = Mutex::new(BTreeMap::new());
    let failed = AtomicUsize::new(0);
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..if at_a_time == 0 { cores() } else { at_a_time } {
            scope.spawn(|| {
                while failed.load(Ordering::Relaxed) == 0 {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(index) else { return };
                    let result = work(index, item);
                    failed.fetch_add(usize::from(result.is_err()), Ordering::Relaxed);
                    let mut done = done.lock().unwrap_or_else(|e| e.into_inner());
                    done.insert(index, result);
                    progress(done.len(), items.len());
                }
            });
        }
    });
    done.into_inner().unwrap_or_else(|e| e.into_inner()).into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, ErrorKind};
    use rayon::prelude::*;

    #[test]
    fn results_come_in_order_and_the_first_failure_is_told() {
        let items: Vec<u64> = (0..50).collect();
        let (most, quiet) = (AtomicUsize::new(0), |_, _| ());
        let count = |done, all| assert!(most.fetch_max(done, Ordering::Relaxed) < done && done <= all && all == 50);
        let doubled = each(&items, 3, count, |i, x| Ok(i as u64 + x)).unwrap();
        assert_eq!((doubled, most.into_inner()), ((0..50).map(|x| 2 * x).collect(), 50));
        let bad = |i: usize, x: &u64| if i >= 7 { Err(Error::new(ErrorKind::Numeric, "case", x)) } else { Ok(*x) };
        assert!(each(&items, 1, quiet, bad).unwrap_err().to_string().contains('7'));
        assert!(each(&[0u64; 0], 2, quiet, |_, x| Ok(*x)).unwrap().is_empty());
    }

    #[test]
    fn items_that_wait_for_the_pool_do_not_pile_up() {
        // with a worker of the pool itself, every wait would begin another item on the same stack
        thread_local!(static DEEP: std::cell::Cell<usize> = const { std::cell::Cell::new(0) });
        let deepest = each(
            &[(); 40],
            4,
            |_, _| (),
            |_, ()| {
                let deep = DEEP.with(|d| {
                    d.set(d.get() + 1);
                    d.get()
                });
                let sum: u64 = (0..200_000u64).into_par_iter().map(|x| x ^ (x >> 3)).sum();
                std::hint::black_box(sum);
                DEEP.with(|d| d.set(d.get() - 1));
                Ok(deep)
            },
        );
        assert!(deepest.unwrap().into_iter().all(|d| d == 1));
    }
}
