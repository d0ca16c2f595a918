//! Decoders that others wrote and that give up on damaged content by a panic.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}
static HOOK: Once = Once::new();

/// Runs `work` on this thread; none if it panics. Nothing is printed then: the program's panic hook is not called for this
/// thread as long as `work` runs, and is for all others. Work that is spread over threads is caught on each of them.
pub(crate) fn caught<T>(work: impl FnOnce() -> T) -> Option<T> {
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !QUIET.try_with(Cell::get).unwrap_or(false) {
                before(panic);
            }
        }));
    });
    let outer = QUIET.replace(true);
    // whatever the work left half done is dropped by its caller, who learns nothing but that it failed
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    QUIET.set(outer);
    done.ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_none_and_quiet_ends_with_the_work() {
        assert_eq!(caught(|| 3), Some(3));
        assert_eq!(caught(|| if QUIET.get() { panic!("never shown") } else { 3 }), None);
        assert_eq!(caught(|| (caught(|| panic!("nor this")), QUIET.get())), Some((None::<()>, true)));
        assert!(!QUIET.get());
    }
}
