//! The generator of cases models every effect of the library on its own.

use super::worlds::{catalogue::LISTED, drive};
use crate::effects::{self, registry};
use std::collections::BTreeSet;

#[test]
fn every_effect_has_a_generator() {
    let set = |ids: &[&'static str]| ids.iter().copied().collect::<BTreeSet<_>>();
    assert_eq!(set(&LISTED), registry().iter().map(|e| e.about().id).collect());
    assert_eq!(set(&drive::catalogue::LISTED), effects::drive::registry().iter().map(|e| e.about().id).collect());
}
