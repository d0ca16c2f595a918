//! Answers to fixed questions are what they were: every number of them to six digits.
//!
//! Other tests hold answers against truth, within what chance allows. These find a change that is smaller than that. What the numbers
//! were is in `tests/answers/*.json`; where a change is meant, `GYROID_WRITE_ANSWERS=1 cargo test --test answers` writes them anew, and the
//! difference belongs into the review.

mod kept;
#[path = "../common/place.rs"]
mod place;

use kept::{Kept, data};
use place::Place;

/// A gyro at rest, and terms of its noise that a log of half an hour shows.
const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.1\n\
    [gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\ntime_constant_s = 150.0\nangle_random_walk_rad_sqrt_s = 1e-4\n";

/// Logs of that gyro, by the effects that it has beside.
const LOGS: [(&str, &str); 6] = [
    ("plain", ""),
    ("walk", "[[effect]]\nid = \"gyro.rate_random_walk\"\nrate_random_walk_rad_s_sqrt_s = 3e-5\n"),
    ("coarse", "[[effect]]\nid = \"gyro.quantization\"\nlsb_rad_s = 1e-3\n"),
    ("shaken", "[[effect]]\nid = \"gyro.narrow_band_noise\"\ncenter_hz = 2.0\nbandwidth_hz = 0.2\nstd_rad_s = 2e-4\n"),
    ("flicker", "[[effect]]\nid = \"gyro.bias_instability\"\nbias_instability_rad_s = 4e-5\n"),
    ("outlying", "[[effect]]\nid = \"gyro.outliers\"\nprobability_per_sample = 0.02\n"),
];

fn rest() -> Place {
    let place = Place::with(&[]);
    for (seed, (name, effect)) in LOGS.into_iter().enumerate() {
        place.write("gyro.toml", &format!("{REST}{effect}"));
        place.ok(&format!("simulate gyro.toml --duration 1800 --seed {seed} -o {name}.csv"));
    }
    place.write("gyro.toml", REST);
    place
}

#[test]
fn of_fits() {
    let place = rest();
    let mut kept = Kept::of(&place, "fit");
    for (log, _) in LOGS {
        kept.same(log, &format!("fit {log}.csv --draws 99"));
    }
    for (name, line) in [
        ("huber", "fit outlying.csv --loss huber --draws 99"),
        ("weighted", "fit walk.csv --weighting walk --draws 99"),
        ("time constant fixed", "fit plain.csv --fix t=140 --draws 99"),
        ("amplitude fixed", "fit plain.csv --fix c1=2e-3 --draws 99"),
        ("read once", "fit walk.csv --memory 0 --draws 99"),
    ] {
        kept.same(name, line);
    }
    // so long that only means over several samples are held
    place.ok("simulate gyro.toml --duration 21000 --sample-time 0.01 --seed 7 -o long.parquet");
    kept.same("long, read once", "fit long.parquet --memory 0 --draws 99");
    let (warm, cold) = (data("power_on.csv"), data("cats_coldsoak_a.csv"));
    kept.same("recorded", &format!("fit {warm} --latitude 44.4 --draws 99"));
    for (log, model) in [("walk", "temperature"), ("plain", "temperature")] {
        // the log with a temperature that rises, and a bend
        let rows = std::fs::read_to_string(place.path(&format!("{log}.csv"))).unwrap();
        let warmed = |(i, row): (usize, &str)| match i {
            0 => format!("{row},temperature_c\n"),
            _ => format!("{row},{:.3}\n", 20.0 + 12.0 * (1.0 - (-(i as f64) / 6000.0).exp())),
        };
        place.write("warmed.csv", &rows.lines().enumerate().map(warmed).collect::<String>());
        for way in ["", " --memory 0"] {
            kept.same(
                &format!("{log}, against {model}{way}"),
                &format!("fit warmed.csv --against {model} --draws 99{way}"),
            );
        }
    }
    kept.same("against temperature", &format!("fit {cold} --axis x --against temperature --draws 99"));
    kept.same(
        "against temperature, read once",
        &format!("fit {cold} --axis x --against temperature --memory 0 --draws 99"),
    );
    kept.same("three axes", &format!("fit {cold} --axis all --draws 99"));
    kept.end();
}

#[test]
fn of_noise() {
    let place = rest();
    let mut kept = Kept::of(&place, "noise");
    for (log, _) in LOGS {
        kept.same(log, &format!("noise {log}.csv --draws 99"));
    }
    for (name, line) in [
        ("read once", "noise walk.csv --draws 99 --memory 0"),
        ("all terms", "noise flicker.csv --draws 99 --terms N,B,K --no-selection"),
        ("warm-up left in", "noise plain.csv --draws 99 --warm-up never"),
    ] {
        kept.same(name, line);
    }
    let cold = data("cats_coldsoak_a.csv");
    kept.same("recorded", &format!("noise {cold} --axis y --draws 99 --datasheet MPU-6050 --turn-on-std 1e-3"));
    kept.end();
}

#[test]
fn of_many_logs() {
    let place = rest();
    let mut kept = Kept::of(&place, "many");
    kept.same("fits", "fit . --accept --draws 99 --config fleet.toml");
    kept.text_file("configuration of the fits", "fleet.toml");
    kept.same("noise", "noise . --draws 99");
    kept.end();
}

#[test]
fn of_validations() {
    let place = rest();
    let mut kept = Kept::of(&place, "validate");
    for (log, _) in LOGS {
        kept.same(log, &format!("validate gyro.toml {log}.csv --draws 99"));
    }
    kept.same("read once", "validate gyro.toml walk.csv --memory 0 --draws 99");
    kept.end();
}

#[test]
fn of_the_filter() {
    let place = Place::with(&[]);
    let mut kept = Kept::of(&place, "navigate");
    let (robot, drive) = (data("truth.toml"), data("drive.parquet"));
    let [fit, _] = ["fit", "hold"].map(|name| data(&format!("drives/rover_{name}.parquet")));
    for (name, options) in [
        ("all estimators", ""),
        ("filtered, with a pose", "--filtered --use-pose --start-at-reference"),
        ("without the error model", "--no-error-model --no-zero-updates"),
        ("gated", "--gate 0.999 --align=0.3"),
    ] {
        kept.same(name, &format!("navigate {robot} {drive} {options}"));
    }
    kept.same("other radii", &format!("navigate {robot} {fit}"));
    // effects that the configuration holds are states of the filter, or change its model
    for (name, effect) in [
        ("a gyro's scale", "id = \"gyro.scale_factor\"\nrelative = 0.02\n"),
        ("compliant wheels", "id = \"wheel.slip\"\ncompliance = 0.1\n"),
        ("a load", "id = \"vehicle.payload\"\nmass_relative = 0.2\ninertia_relative = 0.1\n"),
        ("a walk", "id = \"gyro.rate_random_walk\"\nrate_random_walk_rad_s_sqrt_s = 1e-5\n"),
        ("a step", "id = \"gyro.bias_step\"\nstep_rad_s = 1e-3\n"),
        ("flicker", "id = \"gyro.bias_instability\"\nbias_instability_rad_s = 3e-5\n"),
        ("a late gyro", "id = \"sensor.gyro_delay\"\ndelay_s = 0.02\n"),
    ] {
        let changed = std::fs::read_to_string(&robot).unwrap() + "[[effect]]\n" + effect;
        place.write("changed.toml", &changed);
        place.ok("simulate changed.toml --course random --duration 20 --seed 4 -o changed.parquet --force");
        kept.same(name, "navigate changed.toml changed.parquet");
    }
    let slipping =
        std::fs::read_to_string(&robot).unwrap() + "[traction.law.burckhardt]\nc1 = 0.1946\nc2 = 94.129\nc3 = 0.0646\n";
    place.write("slipping.toml", &slipping);
    place.ok("simulate slipping.toml --course brisk --duration 30 --seed 3 -o slips.parquet");
    kept.same("with slip", "navigate slipping.toml slips.parquet");
    kept.same("with slip, with a pose", "navigate slipping.toml slips.parquet --use-pose --start-at-reference");
    kept.same("slip left out", "navigate slipping.toml slips.parquet --wheels rolling");
    kept.end();
}

#[test]
fn of_exports() {
    let place = rest();
    place.ok("fit walk.csv --accept --no-plot -o walk.toml");
    place.ok("noise walk.csv --draws 99 --write walk.toml --accept");
    let full = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/exports/full.toml");
    let mut kept = Kept::of(&place, "export");
    for to in kept::targets() {
        for (name, config) in [("fitted", "walk.toml"), ("full", full)] {
            kept.text(&format!("{to}, {name}"), &format!("export {config} --to {to}"));
        }
    }
    kept.end();
}

#[test]
fn of_effects() {
    let place = rest();
    place.write("sim.toml", &format!("{REST}turn_on_bias_std_rad_s = 1e-4\nwarm_up_relative_std = 0.05\n"));
    let mut kept = Kept::of(&place, "gap");
    for (log, effects) in [
        ("plain", "gyro.tone gyro.rate_ramp gyro.rate_random_walk"),
        ("shaken", "gyro.narrow_band_noise gyro.bias_instability"),
        ("coarse", "gyro.quantization gyro.noise_level"),
    ] {
        kept.same(log, &format!("gap explain sim.toml --fit {log}.csv --effect {effects}"));
    }
    for log in ["plain", "walk", "coarse", "shaken"] {
        kept.same(&format!("{log}, diagnosed"), &format!("gap diagnose sim.toml --fit {log}.csv --why why.md --force"));
        kept.text_file(&format!("{log}, why"), "why.md");
    }
    let [fit, hold] = ["fit", "hold"].map(|name| data(&format!("drives/rover_{name}.parquet")));
    let robot = data("truth.toml");
    kept.same("drive", &format!("gap explain {robot} --fit {fit} --effect wheel.radius_mismatch vehicle.payload"));
    kept.same("drive, diagnosed", &format!("gap diagnose {robot} --fit {fit} --hold {hold} --ranges ranges.json"));
    kept.file("drive, ranges", "ranges.json");
    kept.end();
}
