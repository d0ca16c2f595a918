//! `gyroid gap diagnose`, as a user runs it.

use crate::place::Place;
use gyroid::config::Config;
use gyroid::gap::Answer;
use gyroid::gap::answer::Verdict;
use gyroid::gap::predictive::{Curve, Over, Shown};
use gyroid::gap::trace::{Decision, TraceStage};

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 120.0\nangle_random_walk_rad_sqrt_s = 1e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";
/// A tone of 0.31 Hz with the amplitude of the white noise: n a²/4σ² is over a thousand nats.
const TONE: &str = "[[effect]]\nid = \"gyro.tone\"\nfrequency_hz = 0.31\namplitude_rad_s = 2.2e-4\n";
const LASTING: &str = "--duration 900";

/// With a nominal simulator, and recordings of one with `effects`.
fn new(effects: &str) -> Place {
    let place = Place::with(&[("sim.toml", REST), ("real.toml", &format!("{REST}{effects}"))]);
    for (name, seed) in [("fit", 11), ("hold", 12)] {
        place.ok(&format!("simulate real.toml {LASTING} --seed {seed} -o {name}.csv"));
    }
    place
}

fn answer(place: &Place, name: &str) -> (Answer, Vec<Curve>) {
    let value: serde_json::Value = serde_json::from_str(&place.read(name)).unwrap();
    let curves = serde_json::from_value(value["curves"].clone()).unwrap();
    (serde_json::from_value(value).unwrap(), curves)
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
fn a_tone_is_found_drawn_written_and_can_be_simulated() {
    let place = new(TONE);
    let line = "gap diagnose sim.toml --fit fit.csv --hold hold.csv --json a.json --write-sim augmented.toml \
                --plot a.png --plot a.svg --why why.md";
    let text = place.ok(line);
    in_order(&text, &["IDENTIFIED: tone", "1. Where", "2. Which", "0.31", "3. How far", "log score", "4. What to do"]);
    let (answer, curves) = answer(&place, "a.json");
    assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Identified, Some("gyro.tone")));
    assert!(text.contains(&format!("probability {:.2}", answer.main_probability)));
    let spectrum = curves.iter().find(|c| c.over == Over::Frequency && c.shown == Shown::Power).unwrap();
    let [low, high] = spectrum.most_in.unwrap();
    assert!(low < 0.31 && 0.31 < high, "{low} {high}");
    assert!(spectrum.excess_after < 0.1 * spectrum.excess_before);
    let augmented = Config::parse(&place.read("augmented.toml"), "augmented.toml").unwrap();
    let effect = &augmented.effects[0];
    assert_eq!((augmented.effects.len(), effect.id.as_str()), (1, "gyro.tone"));
    // Cramér-Rao: √24 σ / (2π a step n^1.5), five of them
    assert!((effect.parameters["frequency_hz"] - 0.31).abs() < 5.0 * 1.3e-5, "{effect:?}");
    // the trail leads from the data to the same verdict, in the file for people and in the answer
    let why = place.read("why.md");
    let stages = [
        "# Why: IDENTIFIED: tone",
        "Screening",
        "samples",
        "Sets",
        "Additions",
        "Leaving one out",
        "Probabilities",
        "Hold-out",
    ];
    in_order(&why, &stages);
    let taken = |stage| {
        answer.trace.iter().any(|s| s.stage == stage && s.decision == Decision::Taken && s.subject == "gyro.tone")
    };
    let of_effects = [TraceStage::LeaveOneOut, TraceStage::Probabilities, TraceStage::HoldOut];
    assert!(of_effects.into_iter().all(taken), "{:?}", answer.trace);
    assert_eq!(why.matches("\n| taken | gyro.tone |").count(), of_effects.len() + usize::from(taken(TraceStage::Sets)));
    // nothing more is worth its price beside the best set
    let added = answer.trace.iter().filter(|s| s.stage == TraceStage::Additions);
    assert!(added.clone().count() > 5 && added.into_iter().all(|s| s.nats.unwrap() <= 0.0), "{:?}", answer.trace);
    place.ok("simulate augmented.toml --inputs hold.csv --seed 1 -o predicted.csv");
    assert!(place.read("a.svg").contains("tone"));
    assert!(std::fs::read(place.path("a.png")).unwrap().starts_with(b"\x89PNG"));

    // without the effect in the library the recording has a gap that no effect explains
    let json = place.ok("gap diagnose sim.toml --fit fit.csv --without gyro.tone --json -");
    let answer: Answer = serde_json::from_str(&json).unwrap();
    assert_eq!(answer.verdict, Verdict::Unknown);
    assert!(answer.effects.iter().all(|e| e.id != "gyro.tone"));
    // and the trail says that it was left out
    assert!(answer.trace.iter().any(|s| s.subject == "gyro.tone" && s.reason.contains("left out of the library")));
}

#[test]
fn a_simulator_that_lacks_nothing_is_left_as_it_is() {
    let place = new("");
    let text = place.ok("gap diagnose sim.toml --fit fit.csv --json a.json --write-sim augmented.toml");
    in_order(&text, &["NO GAP", "1. Where", "2. Which", "None", "3. How far", "4. What to do", "othing"]);
    let (answer, curves) = answer(&place, "a.json");
    assert_eq!((answer.verdict, answer.main), (Verdict::None, None));
    assert!(answer.place.is_none() && answer.together.is_empty() && !curves.is_empty());
    let augmented = Config::parse(&place.read("augmented.toml"), "augmented.toml").unwrap();
    assert_eq!(augmented, Config::parse(REST, "sim.toml").unwrap());
    assert_eq!(place.ok("gap diagnose sim.toml --fit fit.csv --quiet"), "");
    // what the reader guessed and found stands here too: a unit of time, a gyro that froze in the last fifth
    let rows = place.read("fit.csv").replacen("t_s", "time", 1);
    let lines: Vec<&str> = rows.lines().collect();
    let frozen = lines.iter().enumerate().map(|(k, line)| {
        let (time, _) = line.split_once(',').unwrap();
        if 5 * k < 4 * lines.len() {
            format!("{line}\n")
        } else {
            format!("{time},{}\n", &lines[1].split_once(',').unwrap().1)
        }
    });
    place.write("frozen.csv", &frozen.collect::<String>());
    let text = place.ok("gap diagnose sim.toml --fit frozen.csv");
    in_order(
        &text,
        &["note: time unit of \"time\" guessed: s", "stuck at a value", "froze from 7", "cut the log there"],
    );
    assert!(!text.contains("the log moves"), "{text}");
}

#[test]
fn what_cannot_be_diagnosed_is_refused_by_name() {
    let place = new("");
    let robot = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/data/robot.toml")).unwrap();
    let tables = &robot[robot.find("[vehicle]").unwrap()..];
    place.write("drive.toml", &format!("{}{tables}", REST.replace("stationary", "driving")));
    place.refused(
        "gap diagnose drive.toml --fit fit.csv",
        1,
        &["fit.csv", "no wheels", "drive.toml", "hint:", "--map"],
    );
    // a car: one speed, and one yaw rate that is read as the gyro; with positions, so that there is something to test
    let rows =
        (0..600).map(|k| 0.1 * f64::from(k)).map(|t| format!("{t:.1},5.0,{:.4},{:.3},0.0\n", 0.1 * t.sin(), 5.0 * t));
    place.write("car.csv", &format!("t_s,odo_v_m_s,yaw_rate_rad_s,x_m,y_m\n{}", rows.collect::<String>()));
    let hint = "--map odo_yaw_rate_rad_s=yaw_rate_rad_s";
    place.refused("gap diagnose drive.toml --fit car.csv", 1, &["one speed for the whole robot", hint]);
    place.write("slips.toml", &format!("{REST}[[effect]]\nid = \"wheel.slip\"\ncompliance = 0.1\n"));
    place.refused("gap diagnose slips.toml --fit fit.csv", 1, &["wheel.slip", "[[effect]]", "hint:"]);
    place.refused("gap diagnose no.toml --fit fit.csv", 1, &["no.toml", "hint:"]);
    place.refused("gap diagnose sim.toml --fit no.csv", 1, &["no.csv", "hint:"]);
    place.refused("gap diagnose sim.toml --fit fit.csv --hold no.csv", 1, &["no.csv"]);
    place.refused("gap diagnose sim.toml --fit fit.csv --column wz", 1, &["fit.csv", "wz", "hint:"]);
    place.write("short.csv", "t_s,gyro_z_rad_s\n0,1e-3\n0.2,1e-3\n0.4,1.1e-3\n");
    place.refused("gap diagnose sim.toml --fit short.csv", 1, &["short.csv", "3 rows"]);
    place.refused("gap diagnose sim.toml --fit fit.csv --without gyro.tune", 2, &["gyro.tune", "gyro.tone"]);
    place.refused("gap diagnose sim.toml --fit fit.csv --plot a.gif", 2, &["a.gif", ".png"]);
    place.refused("gap diagnose sim.toml --fit no.csv --write-sim no/where.toml", 1, &["no directory"]);
    place.refused("gap diagnose sim.toml --fit no.csv --json a.json --write-sim a.toml --plot a.png", 1, &["no.csv"]);
    assert!(!place.has("a.json") && !place.has("a.toml") && !place.has("a.png"));
    place.refused("gap diagnose sim.toml", 2, &["--fit"]);
}
