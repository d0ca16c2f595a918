//! Effects that are known to be at work in a drive: fitted together with their intervals, what they gain where they are known
//! beside what an answer gains, and which of them a drive cannot tell apart.

use crate::bench::worlds::Mix;
use crate::bench::{OfOracle, Order, make, oracle};
use crate::config::Kind;
use crate::effects::Library;
use crate::effects::drive::registry;
use crate::gap::drive::model_selection::{Judged, judge};
use crate::gap::drive::options::Options;
use crate::gap::drive::record::Record;
use crate::gap::known_gain;
use crate::gap::rest::explain::Explanations;
use crate::gap::selection::sets::Main;
use crate::ingest::read_log;
use assert_cmd::Command;
use std::path::Path;

const ROBOT: &str = include_str!("../../../../tests/common/robot.toml");

/// Exit code, standard output, standard error.
fn gyroid(dir: &Path, line: &str) -> (i32, String, String) {
    let output = Command::cargo_bin("gyroid").unwrap().current_dir(dir).args(line.split(' ')).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

fn drive(dir: &Path, effects: &str, seed: u64) {
    std::fs::write(dir.join("sim.toml"), ROBOT).unwrap();
    std::fs::write(dir.join("real.toml"), format!("{ROBOT}{effects}")).unwrap();
    let line = format!("simulate real.toml --course random --duration 80 --seed {seed} -o fit.parquet");
    let (code, _, error) = gyroid(dir, &line);
    assert_eq!(code, 0, "{error}");
}

const THREE: &str = "[[effect]]\nid = \"vehicle.payload\"\nmass_relative = 0.08\ninertia_relative = 0.1\n\
    [[effect]]\nid = \"gyro.scale_factor\"\nrelative = 0.004\n[[effect]]\nid = \"wheel.radius_mismatch\"\nright_over_left_minus_one = 0.003\n";

#[test]
fn effects_that_are_known_are_fitted_together_with_intervals() {
    let dir = tempfile::tempdir().unwrap();
    drive(dir.path(), THREE, 5);
    let line = "gap explain sim.toml --fit fit.parquet --json e.json \
                --effect gyro.scale_factor vehicle.payload wheel.radius_mismatch";
    let (code, text, error) = gyroid(dir.path(), line);
    assert_eq!(code, 0, "{error}");
    assert!(text.contains("fitted together") && text.contains("payload (vehicle.payload), gains"), "{text}");
    let found: Explanations = serde_json::from_slice(&std::fs::read(dir.path().join("e.json")).unwrap()).unwrap();
    let ids: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(ids, ["gyro.scale_factor", "vehicle.payload", "wheel.radius_mismatch"], "in the order asked for");
    for (i, name, truth) in [
        (0, "relative", 0.004),
        (1, "mass_relative", 0.08),
        (1, "inertia_relative", 0.1),
        (2, "right_over_left_minus_one", 0.003),
    ] {
        let e = &found.effects[i].parameters[name];
        // four standard deviations: one such test in four thousand fails by chance
        assert!((e.estimate - truth).abs() < 4.0 * e.std, "{}: {e:?} for {truth}", ids[i]);
        assert!(e.std < 0.2 * truth, "{}: {e:?}", ids[i]);
        assert!(e.ci95[0] < e.estimate && e.estimate < e.ci95[1]);
    }
    assert!(found.effects.iter().all(|e| e.gain_nats > 20.0), "{text}");
    // one that is not there gains nothing, and its interval says so
    let (code, _, error) = gyroid(
        dir.path(),
        "gap explain sim.toml --fit fit.parquet --json f.json --effect gyro.scale_factor vehicle.payload \
         wheel.radius_mismatch vehicle.track_width",
    );
    assert_eq!(code, 0, "{error}");
    let found: Explanations = serde_json::from_slice(&std::fs::read(dir.path().join("f.json")).unwrap()).unwrap();
    let none = &found.effects[3];
    assert!(none.gain_nats < 8.0, "{none:?}");
    assert!(none.parameters.values().all(|e| e.estimate.abs() < 4.0 * e.std), "{none:?}");
}

#[test]
fn what_cannot_be_fitted_is_refused_with_its_mend() {
    let dir = tempfile::tempdir().unwrap();
    drive(dir.path(), "", 6);
    for (ids, found, hint) in
        [("gyro.tone", "gyro.tone", "wheel.slip"), ("wheel.slip wheel.slip", "twice", "name some of")]
    {
        let (code, _, error) = gyroid(dir.path(), &format!("gap explain sim.toml --fit fit.parquet --effect {ids}"));
        assert!(code == 2 && error.contains(found) && error.contains(hint), "{code} {error}");
    }
    let wheels = "t_s,wheel_left_rad_s,wheel_right_rad_s\n";
    let rows: String = (0..600).map(|k| format!("{},1,1\n", f64::from(k) * 0.01)).collect();
    std::fs::write(dir.path().join("wheels.csv"), format!("{wheels}{rows}")).unwrap();
    let (code, _, error) = gyroid(dir.path(), "gap explain sim.toml --fit wheels.csv --effect vehicle.payload");
    assert!(code == 1 && error.contains("wheels.csv") && error.contains("torques"), "{code} {error}");
}

/// What is said of a drive with `effects`, without the channels that `cut` takes away.
fn judged(effects: &str, seed: u64, cut: impl Fn(&mut Record)) -> Judged {
    let dir = tempfile::tempdir().unwrap();
    drive(dir.path(), effects, seed);
    let config = crate::config::Config::read(dir.path().join("sim.toml")).unwrap();
    let mut record = Record::new(&config, &read_log(dir.path().join("fit.parquet")).unwrap(), 0.0).unwrap();
    cut(&mut record);
    judge(&record, registry(), &Options::default())
}

#[test]
#[ignore = "battery: drives of the generator"]
fn battery_what_physics_confounds_is_one_class_until_a_channel_separates_it() {
    let track = "[[effect]]\nid = \"vehicle.track_width\"\nrelative = 0.01\n";
    // without pose and torques all that is known is the ratio of two yaw rates
    let blind = judged(track, 7, |r| {
        r.pose = None;
        r.torques_n_m = None;
    });
    let mains = blind.findings.mains();
    for id in ["vehicle.track_width", "wheel.radius_scale", "gyro.scale_factor"] {
        let p = mains.iter().find(|m| m.0 == Main::Effect(id.into())).unwrap().1;
        // plausible sizes differ by no more than the widths of their priors
        assert!((0.1..0.6).contains(&p), "about a third each: {mains:?}");
        let part = blind.findings.best_with(id, true).unwrap().part(id).unwrap();
        let truth = if id == "vehicle.track_width" { 0.01 } else { 1.0 / 1.01 - 1.0 };
        let (value, std) = (part.parameters["relative"], part.std["relative"]);
        assert!((value - truth).abs() < 4.0 * std && std < 5e-4, "{id}: {value} ± {std} for {truth}");
    }
    // the pose knows the yaw rate itself
    let seen = judged(track, 7, |_| {});
    assert_eq!(seen.findings.top(), Main::Effect("vehicle.track_width".into()));
    assert!(seen.findings.mains()[0].1 > 0.8 && seen.alike.is_empty(), "{:?}", seen.alike);
}

#[test]
fn answers_are_held_against_an_oracle_that_is_told_the_effects() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("bench");
    let mix = Mix { cases: 4, none: 0.25, pairs: 0.0, unlisted: 0.25, messy: 0.0, habits: 0.0 };
    let made = make(&folder, &Order { kind: Kind::Driving, mix, seed: Some(3) }, |_, _| {}).unwrap();
    let library = Library::new();
    let mut answers = std::collections::BTreeMap::new();
    let mut told = Vec::new();
    for (name, label) in &made.labels {
        let ids: Vec<&str> = label.effects.keys().map(String::as_str).collect();
        let log = |which: &str| read_log(folder.join(name).join(format!("{which}.parquet"))).unwrap();
        let config = crate::config::Config::read(folder.join(name).join("sim.toml")).unwrap();
        let mut after = 0.0;
        if label.effects.keys().any(|id| !id.starts_with("x.")) {
            // who gains half of what is to be gained
            let gain = known_gain(&config, &log("fit"), &log("hold"), &library, &ids).unwrap();
            after = 0.5 * gain;
            told.push((name.clone(), gain));
        }
        let gap = serde_json::json!([{"metric": "log_score", "before": 1.0, "after": 1.0 + after, "floor": 2.0}]);
        answers.insert(name.clone(), serde_json::json!({"verdict": "none", "gap": gap}));
    }
    let gains = oracle(&folder, &made.labels, &answers, 0, |_, _| {}).unwrap();
    assert_eq!(
        gains.keys().collect::<Vec<_>>(),
        told.iter().map(|t| &t.0).collect::<Vec<_>>(),
        "effects of the list alone"
    );
    for (name, gain) in told.iter().filter(|t| t.1 > 0.0) {
        let found = gains[name].unwrap();
        assert!((found.oracle - gain).abs() < 1e-12 && (found.answer / found.oracle - 0.5).abs() < 1e-9, "{found:?}");
    }
    let of = OfOracle::of(&gains).unwrap();
    assert!((of.share.median - 0.5).abs() < 1e-9 && (of.total - 0.5).abs() < 1e-9, "{of:?}");
}
