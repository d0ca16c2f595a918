use super::words::name_and_unit;
use super::*;
use crate::bias::WarmUp;
use crate::effects::by_id;
use crate::effects::{Parameters, registry};
use crate::gap::Trace;
use crate::gap::answer::Metric;
use crate::gap::answer::{
    Against, Alike, Correction, EquationAnswer, FreeFormAnswer, Place, Regressor, Remainder, TimeOffset,
};
use crate::gap::rest::predictive::curves;
use crate::gap::rest::state_space::{Coefficient, StateSpaceModel};
use crate::model::Scene;
use crate::signal::{TimeAxis, names};

fn effect(id: &str, probability: f64, parameter: (&str, f64, f64), closed: Option<f64>) -> EffectAnswer {
    EffectAnswer {
        parameters: Parameters::from([(parameter.0.to_string(), parameter.1)]),
        std: Parameters::from([(parameter.0.to_string(), parameter.2)]),
        gap_closed: closed,
        gap_closed_ci95: closed.map(|c| [c - 0.03, (c + 0.02).min(1.0)]),
        ..EffectAnswer::new(id, probability)
    }
}

fn identified() -> Answer {
    let metric = |name: &str, before, after, floor| Metric { metric: name.into(), before, after, floor };
    Answer {
        verdict: Verdict::Identified,
        main: Some("gyro.temperature_sensitivity".into()),
        main_probability: 0.93,
        none_probability: 0.0,
        unknown_probability: 0.04,
        effects: vec![
            effect("gyro.temperature_sensitivity", 0.95, ("coefficient_rad_s_per_c", 3.127e-5, 1.4e-6), Some(0.96)),
            effect("gyro.rate_ramp", 0.03, ("ramp_rad_s2", 2e-7, 1e-7), Some(0.41)),
        ],
        together: vec!["gyro.temperature_sensitivity".into()],
        remainder: None,
        time_offsets: Vec::new(),
        nearest: None,
        cannot_tell_apart: vec![vec!["gyro.temperature_sensitivity".into(), "gyro.rate_ramp".into()]],
        alike: vec![Alike {
            ids: vec!["gyro.temperature_sensitivity".into(), "gyro.rate_ramp".into()],
            overlap: 0.87,
            separate_by: "a recording in which the temperature falls again".into(),
        }],
        place: Some(Place {
            channel: "gyro".into(),
            equation: "gyro bias: a term that follows the temperature".into(),
            time_s: None,
            frequency_hz: None,
            condition: Some("temperature_c".into()),
            description: None,
        }),
        free_forms: Vec::new(),
        equations: Vec::new(),
        gap: vec![
            metric("log_score", 4.31, 5.872, 5.874),
            metric("heading_drift_rms_rad_10s", 2e-3, 1.9e-3, 1.9e-3),
            metric("heading_drift_rms_rad_600s", 0.21, 0.0123, 0.0119),
            metric("allan_deviation_ln_rms", 0.4, 0.08, 0.07),
        ],
        navigation: None,
        notes: vec!["the configuration states no repeatability".into()],
        trace: Vec::new(),
    }
}

fn unknown() -> Answer {
    Answer {
        verdict: Verdict::Unknown,
        main: None,
        main_probability: 0.1,
        unknown_probability: 0.88,
        together: Vec::new(),
        cannot_tell_apart: Vec::new(),
        alike: Vec::new(),
        place: Some(Place {
            channel: "gyro".into(),
            equation: "gyro bias".into(),
            time_s: Some([210.0, 260.0]),
            description: Some("bursts of noise that come every 50 s".into()),
            ..Place::default()
        }),
        free_forms: vec![FreeFormAnswer {
            id: "time".into(),
            probability: 0.8,
            share_nats: 30.0,
            description: "a bump at 230 s".into(),
        }],
        ..identified()
    }
}

fn none() -> Answer {
    Answer { verdict: Verdict::None, none_probability: 0.91, place: None, gap: Vec::new(), ..unknown() }
}

/// Curves of a recording whose bias follows the temperature, or of one that lacks nothing.
fn seen(coefficient_rad_s_per_c: f64) -> Vec<Curve> {
    let (rows, step_s) = (6000, 0.1);
    let temperature: Vec<f64> = (0..rows).map(|i| 25.0 + 6.0 * (i as f64 * step_s / 60.0).sin()).collect();
    let scene = Scene {
        time: TimeAxis::Uniform { start_s: 0.0, step_s, len: rows },
        step_s,
        temperature_c: Some(temperature.clone()),
        power_on_temperature_c: None,
        supply_v: None,
        warm_up: WarmUp { c1_rad_s: 2e-3, c2_rad_s: -4e-3, time_constant_s: 200.0 },
        white_std_rad_s: 5e-4,
        turn_on_bias_std_rad_s: 2e-4,
        warm_up_relative_std: 0.03,
    };
    let nominal = StateSpaceModel::nominal(&scene);
    let mut after = nominal.clone();
    let column = temperature.iter().map(|t| t - 25.0).collect();
    after.coefficients.push(Coefficient { column, mean: coefficient_rad_s_per_c, std: 0.0 });
    let recorded = after.simulate(11, 0).unwrap();
    curves(&scene, &recorded, &nominal, &after, 1).unwrap()
}

fn page(answer: &Answer, curves: &[Curve]) -> String {
    GapReport { recording: "fit.parquet", held_out: Some("hold.parquet"), answer, curves, traces: &[] }.text()
}

#[track_caller]
fn in_order(text: &str, parts: &[&str]) {
    let mut from = 0;
    for part in parts {
        match text[from..].find(part) {
            Some(at) => from += at + part.len(),
            None => panic!("{part:?} is missing, or too early, in\n{text}"),
        }
    }
}

#[test]
fn the_three_questions_are_answered_in_their_order() {
    let curves = seen(3e-5);
    let text = page(&identified(), &curves);
    in_order(
        &text,
        &[
            "IDENTIFIED: temperature sensitivity (gyro.temperature_sensitivity), probability 0.93",
            "96 % (95 %: 93 % to 98 %)",
            "1. Where",
            "a term that follows the temperature",
            "it follows temperature\n",
            "deviation over temperature",
            "°C",
            "2. Which",
            "probability 0.93",
            "coefficient",
            "3.13e-5 ± 1.4e-6 rad/s/°C",
            "otherwise:",
            "0.03 rate ramp",
            "0.04 something that is not in the library",
            "cannot tell apart: temperature sensitivity, rate ramp",
            "overlap 0.87; what would separate them: a recording in which the temperature falls again",
            "3. How far",
            "log score, nats",
            "4.3100",
            "5.8720",
            "5.8740",
            "heading drift in 10 min, rms, deg",
            "12.03",
            "0.7047",
            "4. What to do",
            by_id("gyro.temperature_sensitivity").unwrap().about().remedy,
            "0.705° rms in 10 min at rest, where it is 12.0° without",
            "note: the configuration states no repeatability",
        ],
    );
}

#[test]
fn unknown_and_none_say_what_can_be_said() {
    let curves = seen(3e-5);
    in_order(
        &page(&unknown(), &curves),
        &[
            "UNKNOWN",
            "probability 0.88",
            "1. Where",
            "time 210.0 to 260.0 s",
            "2. Which",
            "0.80 time: a bump at 230 s",
            "0.95 temperature sensitivity",
            "3. How far",
            "4. What to do",
            "Look for a cause of this: bursts of noise that come every 50 s.",
        ],
    );
    let nothing = seen(0.0);
    let text = page(&none(), &nothing);
    in_order(&text, &["NO GAP", "0.91", "No curve leaves", "None", "Not measured.", "Nothing: the simulator"]);
    let alone = GapReport { recording: "a", held_out: None, answer: &none(), curves: &[], traces: &[] }.text();
    in_order(&alone, &["Not compared", "(--hold)"]);
}

#[test]
fn every_parameter_of_the_library_has_its_unit() {
    for p in registry().iter().flat_map(|e| e.about().parameters) {
        let (name, unit) = name_and_unit(p.name);
        assert!(!name.is_empty(), "{}", p.name);
        let pure =
            ["order", "sections", "zero", "share", "ratio", "over_nominal"].iter().any(|end| p.name.ends_with(end));
        assert_eq!(unit.is_empty(), pure, "{}: {name}, {unit:?}", p.name);
    }
    assert_eq!(name_and_unit("rate_random_walk_rad_s_sqrt_s"), ("rate random walk".into(), "rad/s/√s"));
    assert_eq!(name_and_unit("coefficient_rad_s_per_m2_s2"), ("coefficient".into(), "rad/s per m²/s²"));
    // a key whose unit is not known would be printed as words: "coefficient rad s per m2 s2"
    let units = ["rad", "s", "s2", "s3", "m", "m2", "hz", "per", "c", "v"];
    for p in crate::effects::drive::registry().iter().flat_map(|e| e.about().parameters) {
        let (name, _) = name_and_unit(p.name);
        assert!(name.split(' ').all(|word| !units.contains(&word)), "{}: {name}", p.name);
    }
}

#[test]
fn the_figure_holds_the_numbers_of_the_answer() {
    let curves = seen(3e-5);
    let draw = |answer: &Answer, curves: &[Curve]| {
        GapReport { recording: "fit.parquet", held_out: None, answer, curves, traces: &[] }
            .picture()
            .unwrap()
            .svg()
            .unwrap()
    };
    let svg = draw(&identified(), &curves);
    for part in
        ["Deviation over temperature", "temperature sensitivity", "0.95", "12 °", "0.705 °", "Allan deviation (rad/s)"]
    {
        assert!(svg.contains(part), "{part} is missing");
    }
    assert!(svg.contains("with effects, 95 %") && !draw(&none(), &curves).contains("with effects, 95 %"));
    assert!(draw(&none(), &[]).contains("not compared with simulated recordings"));
}

/// A force that falls with speed, a wheel that needs a constant.
fn of_a_drive() -> Answer {
    let times_s: Vec<f64> = (0..40).map(f64::from).collect();
    let speed: Vec<f64> = times_s.iter().map(|t| 0.5 + 0.4 * (0.3 * t).sin()).collect();
    let force = Correction {
        diffusion: 0.0123,
        unit: "m/s²".into(),
        gain_nats: 41.0,
        p_value: 1e-19,
        about_mean: false,
        degrees_of_freedom: 17.0,
        values: speed.iter().map(|v| -0.06 * v).collect(),
        std: vec![0.004; times_s.len()],
        starts: Vec::new(),
        regressors: vec![Regressor { name: "speed".into(), share: 0.93 }],
        against: Some(Against { name: "speed".into(), unit: "m/s".into(), values: speed }),
        times_s: times_s.clone(),
    };
    let wheel = Correction {
        diffusion: 0.0,
        unit: "rad/s".into(),
        gain_nats: 0.0,
        p_value: 1.0,
        values: vec![0.002; times_s.len()],
        std: vec![0.001; times_s.len()],
        regressors: Vec::new(),
        against: None,
        // two drives
        starts: vec![0, 20],
        times_s: (0..40).map(|k| f64::from(k % 20)).collect(),
        ..force.clone()
    };
    let of = |equation: &str, correction| EquationAnswer {
        equation: equation.into(),
        channel: "torque".into(),
        gain_nats: 60.0,
        follows: "speed".into(),
        correction,
    };
    Answer {
        equations: vec![
            of("equations of motion: the force along the robot", Some(force)),
            of("wheel measurement: the left wheel", Some(wheel)),
            of("gyro measurement", None),
        ],
        ..identified()
    }
}

/// A path east, from which the simulator turns away, and with the effect does not.
fn driven() -> DriveTraces {
    let x: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
    let bent: Vec<f64> = x.iter().map(|x| 0.1 * x * x).collect();
    let straight = vec![0.0; x.len()];
    let of = |channel, recorded: &[f64], before: &[f64], after: &[f64]| Trace {
        channel,
        recorded: recorded.into(),
        before: before.into(),
        after: after.into(),
    };
    DriveTraces {
        source: "hold.parquet".into(),
        times_s: x.clone(),
        begins: vec![0, 25],
        by_torques: true,
        traces: vec![of(names::X, &x, &x, &x), of(names::Y, &straight, &bent, &straight)],
    }
}

#[test]
fn a_drive_is_drawn_with_its_path_and_errors_in_the_units_they_are_named_with() {
    let metric = |name: &str, before| Metric { metric: name.into(), before, after: 0.5 * before, floor: 0.4 * before };
    let gap = vec![
        metric("position_rms_m_1s", 0.001),
        metric("position_rms_m_20s", 0.25),
        metric("filter_heading_rms_rad_5s", 0.0244),
    ];
    let answer = Answer { gap, ..of_a_drive() };
    let traces = [driven()];
    let report = GapReport {
        recording: "fit.parquet",
        held_out: Some("hold.parquet"),
        answer: &answer,
        curves: &[],
        traces: &traces,
    };
    let svg = report.picture().unwrap().svg().unwrap();
    let words =
        ["Path", "simulated, before", "simulated, after", "position, 20 s", "0.25 m", "filter: heading, 5 s", "1.4 °"];
    words.iter().for_each(|w| assert!(svg.contains(w), "{w}"));
    // the shortest of several horizons stands in the text alone
    assert!(!svg.contains("position, 1 s"));
    let text = report.text();
    assert!(
        text.contains("position off after 1 s") && text.contains("filter: heading off after 5 s, rms, deg"),
        "{text}"
    );
}

#[test]
fn corrections_are_told_in_a_line_each_and_drawn_in_two_rows() {
    let answer = of_a_drive();
    let report = GapReport { recording: "fit.parquet", held_out: None, answer: &answer, curves: &[], traces: &[] };
    let text = report.text();
    let lines = [
        "the force along the robot: 0.012 m/s²/√s (p < 0.001); 0.0350 m/s² rms, 93 % of it with speed",
        "the left wheel: none, a constant is enough, 2.00e-3 rad/s",
    ];
    assert!(lines.iter().all(|line| text.contains(line)), "{text}");
    let svg = report.picture().unwrap().svg().unwrap();
    let words = [
        "Force along the robot: what it lacks",
        "93 % of it goes with speed",
        "Speed (m/s)",
        "Correction (m/s²)",
        "Time, drive after drive (s)",
        "goes with no state and no input",
    ];
    words.iter().for_each(|w| assert!(svg.contains(w), "{w}"));
    // an answer of before there were corrections is still an answer
    let mut stored = serde_json::json!(answer);
    for equation in stored["equations"].as_array_mut().unwrap() {
        equation.as_object_mut().unwrap().remove("correction");
    }
    let read: Answer = serde_json::from_value(stored.clone()).unwrap();
    assert!(read.equations.iter().all(|e| e.correction.is_none()));
    assert_eq!(serde_json::json!(read), stored);
}

#[test]
fn what_is_left_over_and_what_is_idle_is_told_after_what_matters() {
    let place = Place { equation: "gyro bias".into(), description: Some("a bump at 230 s".into()), ..Place::default() };
    let lattice = effect("gyro.quantization", 1.0, ("lsb_rad_s", 1e-4, 0.0), Some(-0.001));
    let mut answer = Answer {
        remainder: Some(Remainder { share: 0.31, place: Some(place) }),
        time_offsets: vec![TimeOffset {
            channel: "wheels".into(),
            recording: "fit".into(),
            offset_s: 0.349,
            std_s: 0.016,
        }],
        ..identified()
    };
    answer.effects.push(EffectAnswer { idle: true, ..lattice });
    let report = GapReport { recording: "fit.parquet", held_out: None, answer: &answer, curves: &[], traces: &[] };
    let text = report.text();
    let lines = [
        "IDENTIFIED: temperature sensitivity",
        "idle: quantization (gyro.quantization), there, and closing nothing of the gap",
        "left over: 31 % of the gap: a bump at 230 s",
        "wheels, fit: stamped late by 0.349 ± 0.016 s",
        "This recording cannot tell apart",
    ];
    let at: Vec<usize> = lines.iter().map(|l| text.find(l).unwrap_or_else(|| panic!("{l}\n{text}"))).collect();
    assert!(at.is_sorted(), "{text}");
    // beside an unknown cause what has a name is told, and a share below zero is in no headline
    let mut answer = Answer {
        main: Some("gyro.temperature_sensitivity".into()),
        together: vec!["gyro.temperature_sensitivity".into()],
        remainder: Some(Remainder { share: 0.04, place: None }),
        ..unknown()
    };
    let line = |answer: &Answer| {
        GapReport { recording: "fit.parquet", held_out: None, answer, curves: &[], traces: &[] }.verdict_line()
    };
    let nearest = "nearest: temperature sensitivity (gyro.temperature_sensitivity)";
    let closes = format!("{nearest}; it closes 96 % (95 %: 93 % to 98 %) of the gap");
    assert!(line(&answer).ends_with(&closes), "{}", line(&answer));
    let without = Answer { remainder: None, ..answer.clone() };
    assert!(line(&without).ends_with(nearest), "{}", line(&without));
    answer.effects[0].gap_closed_ci95 = Some([-0.97, 1.89]);
    assert!(line(&answer).ends_with("closes 96 % of the gap, and its 95 % interval holds zero"), "{}", line(&answer));
    answer.effects[0].gap_closed = Some(-0.48);
    assert!(line(&answer).ends_with("(gyro.temperature_sensitivity)"), "{}", line(&answer));
    let report = GapReport { recording: "fit.parquet", held_out: None, answer: &answer, curves: &[], traces: &[] };
    assert!(report.text().contains("also temperature sensitivity"));
    // of two that hide each other the headline tells what both close
    answer.verdict = Verdict::Identified;
    answer.together.push("gyro.tone".into());
    answer.remainder = Some(Remainder { share: 0.02, place: None });
    assert!(line(&answer).contains("; with tone (gyro.tone) it closes 98 % of the gap"), "{}", line(&answer));
}

#[test]
fn no_gap_that_is_open_is_no_leave_to_use_the_simulator() {
    let unsure = Answer { none_probability: 0.56, ..none() };
    let text = page(&unsure, &[]);
    in_order(
        &text,
        &["NO GAP", "0.56", "Probably nothing; that something is lacking has probability 0.44.", "Record again"],
    );
    assert!(!text.contains("may be used as it is") && page(&none(), &[]).contains("may be used as it is"));
}

#[test]
fn words_of_torques_and_of_pairs_stand_where_they_are_true() {
    let mut answer = identified();
    assert!(!page(&answer, &seen(3e-5)).contains("without torques") && page(&answer, &[]).contains("without torques"));
    assert!(page(&answer, &[]).contains("cannot tell apart"));
    answer.alike[0].overlap = 0.004;
    assert!(!page(&answer, &[]).contains("cannot tell apart"));
}
