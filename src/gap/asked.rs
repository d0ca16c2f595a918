//! Effects that are asked for by id

use crate::config::Kind;
use crate::error::{Error, ErrorKind, Result, one_of};

/// Refuses `ids` unless each is one of those `known` for recordings of this `kind`, and stands once; `input`: where they were
/// given.
///
/// # Errors
/// [`ErrorKind::Usage`] for an id that is unknown or stands twice, and for none.
pub(crate) fn check(input: &str, ids: &[&str], known: &[&str], kind: Kind) -> Result<()> {
    let refused = |found: String| {
        Error::new(ErrorKind::Usage, input, found).hint(format!("name some of {}, each once", known.join(", ")))
    };
    if ids.is_empty() {
        return Err(refused("no effect is named".into()));
    }
    for (i, id) in ids.iter().enumerate() {
        if !known.contains(id) {
            let of = if kind == Kind::Driving { "of drives" } else { "at rest" };
            return Err(refused(format!("no effect {of} is called {id:?}")).hint(one_of(id, known)));
        }
        if ids[..i].contains(id) {
            return Err(refused(format!("{id} is named twice")));
        }
    }
    Ok(())
}
