//! Effects whose law is not the textbook's, and what only resembles an effect: drives of the generator that shares no code
//! with the library.

use crate::bench::worlds::label::Strength;
use crate::bench::worlds::{Spec, make};
use crate::config::Kind;
use crate::effects::drive::registry;
use crate::gap::drive::model_selection::judge;
use crate::gap::drive::options::Options;
use crate::gap::drive::record::Record;
use crate::gap::selection::sets::Main;

/// What is said of a strong `id`, drive by drive.
fn said(id: &'static str, drives: std::ops::Range<usize>) -> Vec<Main> {
    let one = |index: usize| {
        let spec = Spec { effects: vec![(id, Strength::Strong)], messy: false };
        let case = make(Kind::Driving, 90_210, index, &spec).unwrap();
        let record = Record::new(&case.config, &case.fit, 0.0).unwrap();
        let found = judge(&record, registry(), &Options::default()).findings.mains().swap_remove(0);
        println!("{id} {index} {:?}: {found:?}", case.label.without);
        found.0
    };
    drives.map(one).collect()
}

const LAWS: [&str; 4] =
    ["wheel.lateral_skid", "wheel.rolling_resistance", "gyro.vibration_rectification", "gyro.bias_step"];
const VARYING: [&str; 3] = ["x.load_falls_off", "x.battery_sag", "x.tyre_heating"];
const CONSTANTS: [&str; 3] = ["vehicle.payload", "motor.torque_gain", "wheel.radius_scale"];

/// Right main cause of a drive with `id`.
fn wanted(id: &str) -> Main {
    if id.starts_with("x.") { Main::Unknown } else { Main::Effect(id.into()) }
}

/// How many of three drives of each say what is wanted.
fn right(ids: &[&'static str]) -> usize {
    ids.iter().map(|id| said(id, 0..3).iter().filter(|main| **main == wanted(id)).count()).sum()
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_laws_that_bend_lag_and_settle_are_recognised() {
    for id in LAWS {
        assert_eq!(said(id, 0..1), [wanted(id)]);
    }
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_constant_that_varies_is_no_effect_of_the_library() {
    // the third drive of each has all channels
    for id in VARYING {
        assert_eq!(said(id, 2..3), [wanted(id)]);
    }
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_constant_that_is_one_stays_an_effect() {
    for id in CONSTANTS {
        assert_eq!(said(id, 0..1), [wanted(id)]);
    }
}

#[test]
#[ignore = "battery: thirty drives"]
fn battery_of_laws() {
    let found = right(&LAWS);
    assert!(found >= 11, "{found} of 12");
    let found = right(&VARYING);
    assert!(found >= 7, "{found} of 9");
    let found = right(&CONSTANTS);
    assert!(found >= 8, "{found} of 9");
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_where_none_explains_most_the_nearest_effect_is_told() {
    // with a pose: without one, wheels and gyro that both read too large are what a heavier robot is
    let spec = Spec { effects: vec![("x.load_falls_off", Strength::Strong)], messy: false };
    let case = make(Kind::Driving, 90_210, 4, &spec).unwrap();
    assert!(case.fit.get("x_m").is_some());
    let record = Record::new(&case.config, &case.fit, 0.0).unwrap();
    let (closest, share) = judge(&record, registry(), &Options::default()).closest.unwrap();
    // a load that falls off is a force's or a motor's affair, and nothing of it is told by the gyro
    let channel = crate::effects::drive::by_id(&closest.part.id).unwrap().about().channel;
    assert_eq!(channel, "torque", "{}", closest.part.id);
    assert!(closest.gain > 0.0 && (0.0..1.0).contains(&share), "{share}");
    let scale = Spec { effects: vec![("gyro.scale_factor", Strength::Strong)], messy: false };
    let case = make(Kind::Driving, 90_210, 1, &scale).unwrap();
    let record = Record::new(&case.config, &case.fit, 0.0).unwrap();
    assert!(judge(&record, registry(), &Options::default()).closest.is_none());
}
