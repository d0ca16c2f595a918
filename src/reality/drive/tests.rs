//! Each effect of the generator does to a drive what it should.

use super::super::case::Case;
use super::super::label::Strength;
use super::super::plan::Spec;
use super::*;
use crate::error::ErrorKind;

/// All numbers of both logs; missing ones are equal to each other here.
fn bits(case: &Case) -> Vec<u64> {
    let logs = [&case.fit, &case.hold];
    logs.iter().flat_map(|log| &log.channels).flat_map(|c| &c.values).map(|v| v.to_bits()).collect()
}

#[test]
fn cases_repeat_and_differ_by_seed_and_index() {
    let effects = vec![("gyro.scale_factor", Strength::Medium), ("wheel.slip", Strength::Strong)];
    let spec = Spec { effects, messy: true };
    let one = make(1, 0, &spec).unwrap();
    let again = make(1, 0, &spec).unwrap();
    assert!(bits(&one) == bits(&again) && one.label == again.label && one.config == again.config);
    assert!(bits(&one) != bits(&make(1, 1, &spec).unwrap()));
    assert!(bits(&one) != bits(&make(2, 0, &spec).unwrap()));
    let nonsense = Spec { effects: vec![("gyro.nonsense", Strength::Weak)], messy: false };
    assert_eq!(make(1, 0, &nonsense).unwrap_err().kind, ErrorKind::Usage);
}
