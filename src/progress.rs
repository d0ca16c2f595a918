//! How far the loops over the rows of a log have come, told to whoever listens on the thread that they run on.
//!
//! Loops that may take seconds tell; without a listener that costs a comparison a row.

use std::cell::RefCell;
use std::rc::Rc;

type Listener = Rc<dyn Fn(usize, usize)>;

thread_local! {
    static LISTENER: RefCell<Option<Listener>> = const { RefCell::new(None) };
}

/// Rows between two tellings: milliseconds of work.
const EVERY_ROWS: usize = 1 << 14;

/// Runs `work`; meanwhile `listener` is told the rows that are done, and of how many, by each loop on this thread.
pub(crate) fn listened<T>(listener: impl Fn(usize, usize) + 'static, work: impl FnOnce() -> T) -> T {
    let outer = LISTENER.replace(Some(Rc::new(listener)));
    let done = work();
    LISTENER.set(outer);
    done
}

/// Tells that `done` of `all` rows are done, now and then.
pub(crate) fn tell(done: usize, all: usize) {
    if done.is_multiple_of(EVERY_ROWS)
        && let Some(listener) = LISTENER.with_borrow(Clone::clone)
    {
        listener(done, all);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_is_heard_by_its_innermost_listener_alone() {
        let heard = Rc::new(RefCell::new(Vec::new()));
        let into = |mark: usize| {
            let heard = Rc::clone(&heard);
            move |done, all| heard.borrow_mut().push((mark, done, all))
        };
        let rows = 2 * EVERY_ROWS + 1;
        let work = || (0..rows).for_each(|k| tell(k, rows));
        listened(into(1), || listened(into(2), work));
        work();
        assert_eq!(heard.take(), [(2, 0, rows), (2, EVERY_ROWS, rows), (2, 2 * EVERY_ROWS, rows)]);
    }
}
