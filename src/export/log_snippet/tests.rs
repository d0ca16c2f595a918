use super::*;
use crate::effects::drive::{ids, registry};
use crate::effects::{Library, Parameters};
use crate::files::mark;
use crate::ingest::{DriveQuery, LogWriter, read_drive};
use crate::math::random::Stream;
use crate::signal::Log;
use crate::simulate::{Course, Options, drive_with, replay_with};
use std::path::Path;
use std::process::Command;

/// Quiet sensors, so that what an effect does is seen by itself.
const QUIET: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 181.0\nangle_random_walk_rad_sqrt_s = 1e-9\n\
    [vehicle]\nmass_kg = 17.1\nyaw_inertia_kg_m2 = 0.61\nhalf_track_m = 0.24\nwheel_radius_m = 0.066\n\
    wheel_inertia_kg_m2 = 0.0011\nviscous_friction_n_m_s = 0.0005\ntorque_noise_n_m_sqrt_s = 0.0002\n\
    [encoder]\nspeed_noise_std_rad_s = 1e-7\n[pose]\nrate_hz = 100.0\nposition_std_m = 1e-8\nheading_std_rad = 1e-8\n";

fn found(id: &str, parameters: &Parameters) -> EffectAnswer {
    let std = parameters.iter().map(|(name, value)| (name.clone(), 0.01 * value.abs())).collect();
    EffectAnswer { parameters: parameters.clone(), std, ..EffectAnswer::new(id, 0.99) }
}

fn usual(id: &str) -> EffectAnswer {
    found(id, &by_id(id).unwrap().tried().parameters())
}

fn snippet(effects: &[&EffectAnswer]) -> Snippet {
    log_snippet(effects, &[], &Config::parse(QUIET, "robot.toml").unwrap())
}

fn python(arguments: &[&str]) -> bool {
    Command::new("python3").args(arguments).output().is_ok_and(|ended| ended.status.success())
}

/// The log that the Python, run as a program, makes of one.
fn made(snippet: &Snippet, log: &Log, options: &[&str]) -> Log {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    LogWriter::claim(at("given.csv")).unwrap().write(log).unwrap();
    std::fs::write(at("log.py"), &snippet.text).unwrap();
    let words = ["log.py", "given.csv", "made.csv"];
    let ended = Command::new("python3").current_dir(folder.path()).args(words).args(options).output().unwrap();
    assert!(ended.status.success(), "{}\n{}", String::from_utf8_lossy(&ended.stderr), snippet.text);
    let read: &[&Path] = &[&at("made.csv")];
    read_drive(read, &DriveQuery::default()).unwrap().log
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    let squares: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).filter(|x| x.is_finite()).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn effects_stand_in_the_order_of_a_sensor_each_with_its_interval() {
    let late = found(ids::gyro_delay(), &[("delay_s".to_string(), 0.03)].into());
    let gain = found(ids::scale_factor(), &[("relative".to_string(), 0.02)].into());
    let loud = found(ids::gyro_noise(), &[("noise_over_nominal".to_string(), 2.0)].into());
    let made = log_snippet(
        &[&loud, &gain, &late],
        &[("a \"name\"\\".to_string(), "it changes how the robot moves".to_string())],
        &Config::parse(QUIET, "robot.toml").unwrap(),
    );
    let at = |part: &str| made.text.find(part).unwrap_or_else(|| panic!("{part} is not in\n{}", made.text));
    assert!(at("delay_s = 0.03  # 95 %: 2.941e-2 to 3.059e-2") < at("relative = 0.02  # 95 %: 1.961e-2 to 2.039e-2"));
    assert!(at("value * (1 + relative)") < at("noise_over_nominal = 2.0"));
    assert!(at("a 'name'/: it changes how the robot moves") < at("import numpy"));
    assert!(!made.commands && !made.text.contains("as_real_inputs") && !made.text.contains("def bursts"));
}

#[test]
fn gyroid_knows_its_snippet_until_somebody_changes_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot_log.py");
    let text = snippet(&[&usual(ids::gyro_delay())]).text;
    std::fs::write(&path, &text).unwrap();
    assert!(mark::is_own(&path));
    std::fs::write(&path, text.replace("0.03", "0.04")).unwrap();
    assert!(!mark::is_own(&path));
}

#[test]
fn an_effect_of_the_motion_and_less_noise_are_refused_with_the_reason() {
    assert!(on_log(&usual(ids::slip())).unwrap_err().contains("how the robot moves"));
    let quiet = found(ids::wheel_noise(), &[("noise_over_nominal".to_string(), 0.5)].into());
    assert!(on_log(&quiet).unwrap_err().contains("cannot be taken out"));
    assert!(on_log(&found("wheel.unheard_of", &Parameters::new())).is_err());
}

#[test]
fn python_compiles_whatever_is_in_it() {
    if !python(&["-c", ""]) {
        return;
    }
    let all: Vec<EffectAnswer> = registry().iter().map(|e| usual(e.about().id)).filter(|e| on_log(e).is_ok()).collect();
    assert!(all.len() > 10);
    let whole = snippet(&all.iter().collect::<Vec<_>>());
    assert!(whole.commands);
    let check = "import sys; compile(sys.argv[1], 'log.py', 'exec')";
    for text in std::iter::once(whole.text).chain(all.iter().map(|e| snippet(&[e]).text)) {
        assert!(python(&["-W", "error", "-c", check, &text]), "{text}");
    }
}

#[test]
fn what_python_makes_of_a_log_is_what_the_simulator_makes_of_the_effect() {
    if !python(&["-c", "import numpy"]) {
        return;
    }
    let nominal = Config::parse(QUIET, "robot.toml").unwrap();
    let options = Options::from(3);
    let inputs = drive_with(&nominal, Course::Brisk, 40.0, &options, &Library::new()).unwrap().log;
    let replay = |config: &Config, inputs: &Log| replay_with(config, inputs, &options, &Library::new()).unwrap().log;
    let base = replay(&nominal, &inputs);
    let mut tried = 0;
    for effect in registry() {
        let effect = usual(effect.about().id);
        let Ok(work) = on_log(&effect) else { continue };
        if !work.repeats && work.stage != Stage::Recorder || effect.id == ids::missed_ticks() {
            continue;
        }
        let table = crate::config::EffectTable { id: effect.id.clone(), parameters: effect.parameters.clone() };
        let real = replay(&Config { effects: vec![table], ..nominal.clone() }, &inputs);
        let snippet = snippet(&[&effect]);
        let log = match snippet.commands {
            true => replay(&nominal, &made(&snippet, &inputs, &["--inputs"])),
            false => made(&snippet, &base, &[]),
        };
        let changed = if snippet.commands { &[names::GYRO_Z, names::X][..] } else { work.channels };
        for channel in changed {
            let [log, real, base] = [&log, &real, &base].map(|log| log.get(channel).unwrap());
            let (off, whole) = (rms(log, real), rms(real, base));
            // between the readings of a late sensor is a straight line; all else is the same law
            assert!(off < 0.02 * whole, "{} {channel}: {off} of {whole}", effect.id);
        }
        tried += 1;
    }
    assert!(tried >= 7, "{tried}");
}

#[test]
fn what_is_drawn_anew_has_the_sizes_that_were_found() {
    if !python(&["-c", "import numpy"]) {
        return;
    }
    let nominal = Config::parse(QUIET, "robot.toml").unwrap();
    let base = drive_with(&nominal, Course::Brisk, 200.0, &Options::from(5), &Library::new()).unwrap().log;
    let with = |effect: &EffectAnswer, channel: &str| {
        let log = made(&snippet(&[effect]), &base, &[]);
        let [made, given] = [&log, &base].map(|log| log.get(channel).unwrap().to_vec());
        made.into_iter().zip(given).collect::<Vec<_>>()
    };
    // 20 000 rows know a standard deviation to 0.5 %
    for (id, channel, std) in [
        (ids::gyro_noise(), names::GYRO_Z, 1e-9 / 0.1),
        (ids::wheel_noise(), names::WHEEL_RIGHT, 1e-7),
        (ids::pose_noise(), names::HEADING, 1e-8),
    ] {
        let more: Vec<f64> = with(&usual(id), channel).iter().map(|(made, given)| made - given).collect();
        let found = rms(&more, &vec![0.0; more.len()]);
        // twice the noise: what is added has √3 of it
        assert!((found / (3.0f64.sqrt() * std) - 1.0).abs() < 0.03, "{id}: {found}");
    }
    let step = with(&usual(ids::bias_step()), names::GYRO_Z);
    let after = step.iter().filter(|(made, given)| (made - given - 0.01).abs() < 1e-12).count();
    let before = step.iter().filter(|(made, given)| (made - given).abs() < 1e-12).count();
    assert!(after > 0 && before > 0 && after + before == step.len());
    let told = [("loss_fraction", 0.4), ("burst_s", 0.3), ("share_of_time", 0.2), ("right", 0.0)];
    let lost = found(ids::missed_ticks(), &told.map(|(name, value)| (name.to_string(), value)).into());
    let rows = with(&lost, names::WHEEL_LEFT);
    let low = |(made, given): &&(f64, f64)| (made - (1.0 - 0.4) * given).abs() < 1e-9 && given.abs() > 1e-3;
    let share = rows.iter().filter(low).count() as f64 / rows.len() as f64;
    // bursts of 0.3 s in a fifth of 200 s: 130 of them
    assert!((0.12..0.28).contains(&share), "{share}");
    assert!(with(&lost, names::WHEEL_RIGHT).iter().all(|(made, given)| (made - given).abs() < 1e-12));
    let mut stream = Stream::new(1, 1);
    let other =
        found(ids::missed_ticks(), &[("loss_fraction".into(), stream.uniform()), ("share_of_time".into(), 1.0)].into());
    assert!(on_log(&other).unwrap().repeats);
}
