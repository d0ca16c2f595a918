//! Notes of the answer of a drive.

use crate::effects::Parameters;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::holdout::DriveFar;
use crate::gap::drive::preprocess::acceleration_model::LOUDER;
use crate::gap::drive::record::{Belief, Record};
use crate::gap::holdout::Closed;

/// Note on the noise of wheels and gyro, where it is not as stated.
pub(super) fn loud_note(stated: &Belief, found: &Noise) -> Option<String> {
    let [wheel, _, gyro, ..] = found.reading.map(f64::sqrt);
    let over = [("the wheels", wheel / stated.wheel_std_rad_s), ("the gyro", gyro / stated.gyro_std_rad_s)];
    let told: Vec<String> = over
        .iter()
        .filter(|(_, over)| over.ln().abs() > LOUDER)
        .map(|(name, over)| format!("{name} {over:.2} times"))
        .collect();
    (!told.is_empty()).then(|| {
        format!(
            "Without torques the noise of wheels and gyro is estimated with how the robot moves, what shakes them and their timing \
             included: {} what the simulator states. The gap is measured with that, before and after.",
            told.join(", ")
        )
    })
}

/// Note on the drives that were fitted together; none for one drive.
pub(super) fn together_note(record: &Record) -> Option<String> {
    let sources = &record.sources;
    (sources.len() > 1).then(|| {
        format!(
            "{} drives are fitted together: {}. Effects and their parameters are the same in all of them, what is drawn anew in \
             each run is each drive's own.",
            sources.len(),
            sources.join("; ")
        )
    })
}

/// Note on the share closed in each of several hold-out drives.
pub(super) fn each_note(far: &DriveFar, together: &[(String, Parameters)]) -> Option<String> {
    let share = |(source, closed): &(String, Closed)| Some(format!("{source} {:.0} %", 100.0 * closed.estimate?));
    let shares = far.each.iter().map(share).collect::<Option<Vec<_>>>()?;
    let what = match (together, &far.nearest) {
        ([], None) => return None,
        ([], Some((id, _))) => format!("{id} closes alone"),
        _ => "what was found closes".into(),
    };
    (!shares.is_empty()).then(|| format!("Of the gap in log score {what}, drive by drive: {}.", shares.join("; ")))
}
