//! `gyroid gap diagnose` on recordings as users have them: what is refused is refused by name, what is used is used with a
//! word about it.

use crate::place::Place;
use gyroid::gap::Answer;
use gyroid::gap::answer::Verdict;
use gyroid::math::random::Stream;

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 60.0\nangle_random_walk_rad_sqrt_s = 1e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";
const ROWS: usize = 2000;

/// What the nominal simulator would have recorded: time and rate of each row.
fn rows(rows: usize, step_s: f64, seed: u64) -> Vec<(f64, f64)> {
    let mut draw = Stream::new(seed, 0);
    let std = 1e-4 / step_s.sqrt();
    let t = |i: usize| step_s * i as f64;
    (0..rows).map(|i| (t(i), -2e-3 - 1e-3 * (-t(i) / 60.0).exp_m1() + std * draw.normal())).collect()
}

fn csv(rows: &[(f64, f64)]) -> String {
    let line = |(t, w): &(f64, f64)| format!("{t:.4},{w:.9e}\n");
    format!("t_s,gyro_z_rad_s\n{}", rows.iter().map(line).collect::<String>())
}

/// With a nominal simulator, and a recording of it.
fn new() -> Place {
    Place::with(&[("sim.toml", REST), ("fit.csv", &csv(&rows(ROWS, 0.2, 1)))])
}

#[track_caller]
fn diagnosed(place: &Place, line: &str) -> Answer {
    serde_json::from_str(&place.ok(&format!("gap diagnose {line} --json -"))).unwrap()
}

#[track_caller]
fn noted(place: &Place, line: &str, parts: &[&str]) -> Answer {
    let answer = diagnosed(place, line);
    for part in parts {
        assert!(answer.notes.iter().any(|n| n.contains(part)), "{line}: no {part:?} in {:#?}", answer.notes);
    }
    answer
}

#[track_caller]
fn refused(place: &Place, line: &str, parts: &[&str]) {
    place.refused(&format!("gap diagnose {line}"), 1, parts);
}

#[test]
fn without_covariates_the_answer_says_what_it_cannot_tell() {
    let place = new();
    let answer = noted(&place, "sim.toml --fit fit.csv", &["No temperature", "No supply", "No recording was held out"]);
    assert_eq!(answer.verdict, Verdict::None);
    assert!(answer.effects.iter().all(|e| !e.id.contains("temperature") && !e.id.contains("supply")));
}

#[test]
fn a_covariate_that_is_constant_or_empty_is_as_good_as_none() {
    let place = new();
    let with = |value: &str| {
        let line = |(t, w): &(f64, f64)| format!("{t:.4},{w:.9e},{value}\n");
        format!("t_s,gyro_z_rad_s,temperature_c\n{}", rows(ROWS, 0.2, 1).iter().map(line).collect::<String>())
    };
    for value in ["25.0", ""] {
        place.write("flat.csv", &with(value));
        let answer = diagnosed(&place, "sim.toml --fit flat.csv");
        assert_eq!(answer.verdict, Verdict::None);
        assert!(answer.effects.iter().all(|e| e.id != "gyro.temperature_sensitivity" && e.id != "gyro.noise_growth"));
    }
}

#[test]
fn a_hold_log_of_another_unit_is_said_to_be_one() {
    let place = new();
    let noisy: Vec<(f64, f64)> = rows(ROWS, 0.2, 2).into_iter().map(|(t, w)| (t, 2.0 * w)).collect();
    place.write("noisy.csv", &csv(&noisy));
    let answer = noted(&place, "sim.toml --fit fit.csv --hold noisy.csv", &["same unit: its noise is"]);
    let told =
        answer.notes.iter().find_map(|n| n.split("its noise is ").nth(1)?.split(' ').next()?.parse::<f64>().ok());
    // the standard deviation of the ratio of two logs of this length is 3 %
    assert!((told.unwrap() / 2.0 - 1.0).abs() < 0.1, "{told:?}");
    // another bias: 20 standard deviations of the stated repeatability
    let shifted: Vec<(f64, f64)> = rows(ROWS, 0.2, 2).into_iter().map(|(t, w)| (t, w + 4e-3)).collect();
    place.write("shifted.csv", &csv(&shifted));
    noted(
        &place,
        "sim.toml --fit fit.csv --hold shifted.csv",
        &["does not seem to be of the same unit: its turn-on bias"],
    );
    // one of the same unit is not said to be another's
    place.write("hold.csv", &csv(&rows(ROWS, 0.2, 3)));
    let answer = diagnosed(&place, "sim.toml --fit fit.csv --hold hold.csv");
    assert!(answer.notes.iter().all(|n| !n.contains("same unit")), "{:?}", answer.notes);
}

#[test]
fn a_log_shorter_than_a_time_constant_is_judged_and_says_so() {
    let place = new();
    place.write("slow.toml", &REST.replace("60.0", "900.0"));
    noted(&place, "slow.toml --fit fit.csv", &["lasts 400 s, less than one time constant (900 s)"]);
}

#[test]
fn gaps_in_time_are_filled_up_to_a_fifth() {
    let place = new();
    let all = rows(ROWS, 0.2, 1);
    let some: Vec<(f64, f64)> = all.iter().copied().enumerate().filter(|(i, _)| i % 500 > 40).map(|x| x.1).collect();
    place.write("gaps.csv", &csv(&some));
    let answer = noted(&place, "sim.toml --fit gaps.csv", &["rows are missing"]);
    assert_eq!(answer.verdict, Verdict::None, "{:?}", answer.effects);
    // a tenth of the hold log too
    noted(&place, "sim.toml --fit fit.csv --hold gaps.csv", &["Of the recording held out: 123 of 1959 rows"]);
    let few: Vec<(f64, f64)> = all.iter().copied().enumerate().filter(|(i, _)| i % 500 > 200).map(|x| x.1).collect();
    place.write("holes.csv", &csv(&few));
    refused(&place, "sim.toml --fit holes.csv", &["holes.csv", "rows are missing", "hint:", "a fifth"]);
}

#[test]
fn another_sample_rate_in_hold_is_scaled_and_said() {
    let place = new();
    place.write("fast.csv", &csv(&rows(2 * ROWS, 0.1, 4)));
    let answer =
        noted(&place, "sim.toml --fit fit.csv --hold fast.csv", &["differ in their sample time: 0.2 s and 0.1 s"]);
    assert!(answer.notes.iter().all(|n| !n.contains("same unit")), "{:?}", answer.notes);
    let score = &answer.gap[0];
    // a row of white noise: 1/2 nat and its normalisation
    assert!((score.before - score.floor).abs() < 0.1, "{score:?}");
}

#[test]
fn missing_values_are_filled_and_said() {
    let place = new();
    let line = |(i, (t, w)): (usize, &(f64, f64))| {
        if i % 50 == 7 { format!("{t:.4},NaN\n") } else { format!("{t:.4},{w:.9e}\n") }
    };
    let text: String = rows(ROWS, 0.2, 1).iter().enumerate().map(line).collect();
    place.write("nan.csv", &format!("t_s,gyro_z_rad_s\n{text}"));
    let answer = noted(&place, "sim.toml --fit nan.csv", &["40 of 2000 rows are missing"]);
    assert_eq!(answer.verdict, Verdict::None, "{:?}", answer.effects);
    // filled rows do not hide a lattice
    let line = |(i, (t, w)): (usize, &(f64, f64))| {
        if i % 50 == 7 { format!("{t:.4},\n") } else { format!("{t:.4},{:.9e}\n", 4e-4 * (w / 4e-4).round()) }
    };
    let text: String = rows(ROWS, 0.2, 1).iter().enumerate().map(line).collect();
    place.write("lattice.csv", &format!("t_s,gyro_z_rad_s\n{text}"));
    assert_eq!(diagnosed(&place, "sim.toml --fit lattice.csv").main.as_deref(), Some("gyro.quantization"));
    let none: String = rows(ROWS, 0.2, 1).iter().map(|(t, _)| format!("{t:.4},NaN\n")).collect();
    place.write("none.csv", &format!("t_s,gyro_z_rad_s\n{none}"));
    refused(&place, "sim.toml --fit none.csv", &["none.csv", "hint:"]);
}

#[test]
fn degrees_per_second_are_read_as_such() {
    let place = new();
    let line = |(t, w): &(f64, f64)| format!("{t:.4},{:.9e}\n", w.to_degrees());
    let text: String = rows(ROWS, 0.2, 1).iter().map(line).collect();
    place.write("named.csv", &format!("t_s,gyro_z_deg_s\n{text}"));
    assert_eq!(diagnosed(&place, "sim.toml --fit named.csv").verdict, Verdict::None);
    place.write("bare.csv", &format!("t_s,gz\n{text}"));
    assert_eq!(diagnosed(&place, "sim.toml --fit bare.csv --unit deg/s").verdict, Verdict::None);
    // taken for rad/s the readings are 57 times too large: nothing is silently right
    let wrong = diagnosed(&place, "sim.toml --fit bare.csv --unit rad/s");
    assert_ne!(wrong.verdict, Verdict::None);
    assert!(wrong.notes.iter().any(|n| n.contains("degrees")), "{:?}", wrong.notes);
}

#[test]
fn a_clock_that_runs_backwards_is_refused_with_its_row() {
    let place = new();
    let mut all = rows(ROWS, 0.2, 1);
    all.swap(700, 710);
    place.write("back.csv", &csv(&all));
    refused(&place, "sim.toml --fit back.csv", &["back.csv", "row", "hint:", "--sort-time"]);
    diagnosed(&place, "sim.toml --fit back.csv --sort-time");
}

#[test]
fn an_empty_hold_log_is_refused_before_the_work() {
    let place = new();
    place.write("empty.csv", "t_s,gyro_z_rad_s\n");
    refused(&place, "sim.toml --fit fit.csv --hold empty.csv", &["empty.csv", "hint:"]);
    place.write("nothing.csv", "");
    refused(&place, "sim.toml --fit fit.csv --hold nothing.csv", &["nothing.csv"]);
    place.write("few.csv", &csv(&rows(100, 0.2, 2)));
    refused(&place, "sim.toml --fit fit.csv --hold few.csv", &["few.csv", "100 rows", "hint:"]);
    place.write("cold.csv", "t_s,temperature_c\n0,20\n0.2,20\n0.4,20\n");
    refused(&place, "sim.toml --fit fit.csv --hold cold.csv", &["cold.csv", "hint:"]);
}

#[test]
fn a_configuration_that_lacks_something_is_refused_by_the_key() {
    let place = new();
    for key in ["c1_rad_s", "c2_rad_s", "time_constant_s", "angle_random_walk_rad_sqrt_s"] {
        let without: String = REST.lines().filter(|l| !l.starts_with(key)).map(|l| format!("{l}\n")).collect();
        place.write("less.toml", &without);
        refused(&place, "less.toml --fit fit.csv", &["less.toml", key]);
    }
    place.write("drive.toml", &REST.replace("stationary", "driving"));
    refused(&place, "drive.toml --fit fit.csv", &["drive.toml"]);
    place.write("bare.toml", "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n");
    refused(&place, "bare.toml --fit fit.csv", &["bare.toml", "gyro"]);
    let loose: String = REST.lines().filter(|l| !l.contains("_std")).map(|l| format!("{l}\n")).collect();
    place.write("loose.toml", &loose);
    noted(&place, "loose.toml --fit fit.csv", &["turn_on_bias_std_rad_s", "warm_up_relative_std"]);
}

#[test]
fn explain_fits_what_it_is_asked_and_refuses_the_rest() {
    let place = new();
    let tone = |(t, w): (f64, f64)| (t, w + 2e-4 * (std::f64::consts::TAU * 0.31 * t).cos());
    place.write("tone.csv", &csv(&rows(ROWS, 0.2, 5).into_iter().map(tone).collect::<Vec<_>>()));
    let output = place.run("gap explain sim.toml --fit tone.csv --effect gyro.tone gyro.outliers --json -");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let effect = &json["effects"][0];
    assert_eq!(effect["id"], "gyro.tone");
    for (name, truth) in [("frequency_hz", 0.31), ("amplitude_rad_s", 2e-4)] {
        let ends: [f64; 2] = serde_json::from_value(effect["parameters"][name]["ci95"].clone()).unwrap();
        // Cramér-Rao: √24 σ / (2π a step n^1.5), σ √(2/n)
        let std =
            if name == "frequency_hz" { 4.9 * 2.2e-4 / (std::f64::consts::TAU * 2e-4 * 0.2 * 8.9e4) } else { 7e-6 };
        assert!(ends[0] < truth + 2.0 * std && ends[1] > truth - 2.0 * std, "{name}: {ends:?}");
        assert!(ends[1] - ends[0] < 5.0 * std, "{name}: {ends:?}, {std}");
    }
    let text =
        String::from_utf8(place.run("gap explain sim.toml --fit tone.csv --effect gyro.quantization").stdout).unwrap();
    assert!(text.contains("gyro.quantization: the recording has no trace of it"), "{text}");
    for (line, code, part) in [
        ("--effect gyro.tune", 2, "gyro.tone"),
        ("--effect gyro.tone gyro.tone", 2, "twice"),
        ("--effect gyro.supply_sensitivity", 1, "supply_v"),
        ("--effect wheel.slip", 2, "wheel.slip"),
    ] {
        let output = place.run(&format!("gap explain sim.toml --fit tone.csv {line}"));
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(code) && text.contains(part), "{line}: {text}");
    }
}
