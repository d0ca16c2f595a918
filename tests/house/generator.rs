//! The generator of cases models every effect of the library on its own, or says why it has none of it.

use gyroid::bench::worlds;
use gyroid::effects::{drive, registry};

/// Every id of `library` is in `made`, or in `left_out` with its reason; neither holds others.
fn covers(library: &[&str], made: &[&str], left_out: &[(&str, &str)]) {
    for id in library {
        let reason = left_out.iter().find(|(out, _)| out == id).map(|(_, reason)| reason.len());
        match reason {
            None => assert!(made.contains(id), "{id} has no generator in src/bench/worlds, nor a reason"),
            Some(length) => assert!(length > 20 && !made.contains(id), "{id} is left out without a reason, or made"),
        }
    }
    for id in made.iter().chain(left_out.iter().map(|(id, _)| id)) {
        assert!(library.contains(id), "{id} is a listed effect of the generator, and the library has none of that id");
    }
}

#[test]
fn every_effect_has_a_generator_or_a_reason_to_have_none() {
    let at_rest: Vec<&str> = registry().iter().map(|e| e.about().id).collect();
    covers(&at_rest, &worlds::LISTED, worlds::LEFT_OUT);
    let of_drives: Vec<&str> = drive::registry().iter().map(|e| e.about().id).collect();
    covers(&of_drives, &worlds::drive::LISTED, worlds::drive::LEFT_OUT);
}
