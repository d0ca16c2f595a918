//! Drives prepared for the comparison: clocks set, effects selected that can be told, mounting of the reference
//! removed.

use super::Record;
use crate::config::Config;
use crate::effects::Library;
use crate::effects::drive::Driving;
use crate::error::Result;
use crate::gap::diagnosis::Drive;
use crate::gap::drive::model_selection::{judge, mounting};
use crate::gap::drive::options::Options;
use crate::gap::drive::preprocess::clocks;
use crate::gap::drive::preprocess::clocks::Clocks;
use crate::gap::drive::preprocess::reference_extrinsics::Mounting;
use crate::gap::selection::findings::Findings;

/// Drives with their clocks set, and the effects that are compared on them.
pub(crate) struct Ready {
    pub(crate) record: Record,
    pub(crate) kept: Option<Record>,
    /// Effects that are compared.
    pub(crate) effects: Vec<&'static dyn Driving>,
    /// Effects that are lags of streams whose clocks were set: not compared.
    pub(crate) lags: Vec<&'static dyn Driving>,
    /// Mounting of the reference, which was removed from the readings; none where it is stated.
    pub(crate) mounting: Option<Mounting>,
}

/// Prepares the drives to diagnose from and the hold-out drives, as corrected by `clocks`.
///
/// # Errors
/// Those of [`Record::of_drives`].
pub(crate) fn ready(
    config: &Config,
    clocks: &Clocks<'_>,
    [fit, hold]: [&[Drive<'_>]; 2],
    library: &Library,
    options: &Options,
) -> Result<Ready> {
    let wheels_were_set = clocks.wheels_were_set();
    let recorded = |drives: &[Drive<'_>]| Ok(Record { wheels_were_set, ..Record::of_drives(config, drives)? });
    let record = recorded(fit)?;
    let kept = (!hold.is_empty()).then(|| recorded(hold)).transpose()?;
    // between readings of the wheels nothing tells shaking of the gyro from turning
    let (record, kept) = if wheels_were_set && record.is_shaken() {
        (record.at_wheels(), kept.map(Record::at_wheels))
    } else {
        (record, kept)
    };
    let set = clocks.lags();
    let (lags, effects): (Vec<&'static dyn Driving>, Vec<_>) =
        library.driving().partition(|e| e.delays().is_some_and(|of| set.contains(&of)));
    let mounting = mounting(&record, &effects, options);
    // the same robot carries the same reference in the hold-out recording
    let taken_out = |r: Record| match &mounting {
        Some(mounting) => mounting.taken_out(&r),
        None => r,
    };
    let (record, kept) = (taken_out(record), kept.map(taken_out));
    Ok(Ready { record, kept, effects, lags, mounting })
}

/// Sets of effects with their probabilities for one drive, prepared as the diagnosis does; the gap is not measured.
///
/// # Errors
/// Those of [`Record::of_drives`].
pub(crate) fn compare(config: &Config, fit: &Drive<'_>, library: &Library, options: &Options) -> Result<Findings> {
    let fit = std::slice::from_ref(fit);
    let clocks = clocks::agree(config, fit, &[])?;
    let [fit, _] = &clocks.drives(fit, &[]);
    let Ready { record, effects, .. } = ready(config, &clocks, [fit, &[]], library, options)?;
    Ok(judge(&record, &effects, options).findings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{late, registry};
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot, two_files};
    use crate::model::drive::Instrument;

    /// A calibration compares the drives that the diagnosis does: an offset of a clock is no effect.
    #[test]
    fn clocks_are_set_before_drives_are_compared() {
        let log = two_files(&recorded(90.0, 4, None), 0.9);
        let fit = Drive::new(&log, 0.0);
        let found = compare(&robot(), &fit, &Library::new(), &Options::default()).unwrap();
        let late = [late(registry(), Instrument::Wheels).unwrap().id, "free.delay.wheels"];
        assert!(late.iter().all(|id| found.presence(id) == 0.0), "{:?}", found.mains());
    }
}
