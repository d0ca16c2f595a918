//! How many cases a battery takes. Batteries are ignored; `cargo test battery -- --ignored` runs them all.

/// All of them, or as many as `GYROID_CASES` says: the bounds follow from the number.
pub(crate) fn cases(all: u64) -> u64 {
    match std::env::var("GYROID_CASES") {
        Ok(most) => all.min(most.parse().expect("GYROID_CASES is a number of cases")).max(1),
        Err(_) => all,
    }
}
