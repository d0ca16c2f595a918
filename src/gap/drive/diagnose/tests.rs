use super::*;
use crate::effects::{self, drive::ids};
use crate::gap::Calibration;
use crate::gap::drive::options::Options as JudgeOptions;
use crate::gap::selection::sets::{Part, WeightedSet};

fn scale() -> &'static str {
    ids::radius_scale()
}

/// A robot of which each of two wheels reads 2 % less than the gyro and the torques say.
#[test]
fn what_makes_the_simulator_worse_is_not_offered() {
    use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
    let track = ids::track_width();
    let robot = belief().robot;
    let (v, rate) = (0.6, 0.4);
    let wheels = robot.wheels_rad_s(v, rate).map(|w| vec![0.98 * w; 400]);
    let record = recorded(belief(), 0.02, wheels, vec![rate; 400]);
    let process = Process { diffusion: [0.01; 2], ..Process::default() };
    let library = Library::new();
    let of_both = |radius: f64, width: f64| {
        let one = |id: &str, value| (id.to_owned(), Parameters::from([("relative".to_owned(), value)]));
        vec![one(track, width), one(scale(), radius)]
    };
    let (mut answer, _) = of(vec![part(scale(), true, 90.0, 0.02), part(track, true, 5.0, 0.0)]);
    let right = of_both(0.02, 0.0);
    let all = offered(&record, &library, right.clone(), process, &mut answer);
    assert_eq!((all, answer.notes.len()), (right, 0));
    // a track that belongs to a free form beside it
    let kept = offered(&record, &library, of_both(0.02, -0.3), process, &mut answer);
    assert_eq!(kept.iter().map(|k| k.0.as_str()).collect::<Vec<_>>(), [scale()]);
    assert!(answer.notes[0].contains(track) && !answer.notes[0].contains(scale()), "{}", answer.notes[0]);
    // nothing of it
    assert!(offered(&record, &library, of_both(-0.3, -0.3), process, &mut answer).is_empty());
}

/// A skid-steered robot whose body sways and shakes as no wheel turns: gyro at 100 Hz, wheels at 6.7 Hz, a clock each, no torques.
#[test]
fn a_track_is_named_though_the_gyro_shakes() {
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot, two_files};
    use crate::math::random::Stream;
    use crate::signal::names;
    let shaken = |seed: u64| {
        let mut log = recorded(150.0, seed, Some((ids::track_width(), "relative", 0.45)));
        let gyro = log.channels.iter_mut().find(|c| c.name == names::GYRO_Z).unwrap();
        let draw = &mut Stream::new(seed, 77);
        let mut sway = 0.0;
        for value in &mut gyro.values {
            // 0.02 rad/s that lasts 0.1 s, and white noise of thirty times what is stated
            sway = 0.9 * sway + 0.02 * (1.0 - 0.81_f64).sqrt() * draw.normal();
            *value += sway + 0.045 * draw.normal();
        }
        two_files(&log, 0.3 * seed as f64)
    };
    let (fit, hold) = (shaken(1), shaken(2));
    let drive = |log| Drive::new(log, 0.0);
    let found = diagnose(&robot(), &[drive(&fit)], &[drive(&hold)], &Library::new(), &Options::default(), &mut |_| {});
    let answer = found.unwrap().answer;
    assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Identified, Some(ids::track_width())), "{answer:?}");
    let track = answer.effects.iter().find(|e| e.id == ids::track_width()).unwrap();
    let (off, std) = (track.parameters["relative"] - 0.45, track.std["relative"]);
    assert!(off.abs() < 4.0 * std && std < 0.05, "{off} {std}");
    assert!(track.gap_closed.unwrap() > 0.5, "{:?}", track.gap_closed);
    let loud = answer.notes.iter().any(|n| n.contains("times what the simulator states"));
    assert!(loud, "{:?}", answer.notes);
}

#[test]
fn what_wanders_beside_something_else_is_told_and_not_named() {
    let walk = effects::ids::rate_random_walk();
    let (answer, _) = of(vec![part(scale(), true, 90.0, 0.02), part(walk, true, 20.0, 0.0)]);
    let (mut beside, mut alone) = (answer.clone(), answer);
    assert!(beside.together.iter().any(|id| id == walk), "{:?}", beside.together);
    assert!(told_as_wander(&mut beside).is_some_and(|note| note.contains("at rest")));
    assert_eq!(beside.together, [scale()]);
    assert!(beside.effects.iter().any(|e| e.id == walk), "it stays in the list");
    // where it matters most it is what there is
    alone.main = Some(walk.into());
    assert!(told_as_wander(&mut alone).is_none() && alone.together.iter().any(|id| id == walk));
}

/// A robot that creeps below the noise of its encoders is not at rest, and its gyro no other one.
#[test]
fn a_robot_that_creeps_has_no_other_bias() {
    use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
    use crate::math::random::Stream;
    let draw = &mut Stream::new(4, 4);
    let mut at_rest = |yaw_rate: f64, bias: f64| {
        let belief = belief();
        let turning = belief.robot.wheels_rad_s(0.0, yaw_rate);
        let mut noisy = |value: f64, std: f64| (0..2000).map(|_| value + std * draw.normal()).collect::<Vec<f64>>();
        let wheels = turning.map(|w| noisy(w, belief.wheel_std_rad_s));
        let gyro = noisy(yaw_rate + bias, belief.gyro_std_rad_s);
        recorded(belief, 0.01, wheels, gyro)
    };
    let [still, creeps, other] = [at_rest(0.0, 0.0), at_rest(0.004, 0.0), at_rest(0.0, 5e-3)];
    let said = |kept: &Record| {
        let mut notes = Vec::new();
        other_robot(&still, Some(kept), &mut notes);
        notes.len()
    };
    assert_eq!((said(&creeps), said(&other)), (0, 1));
}

fn part(id: &str, named: bool, share: f64, relative: f64) -> Part {
    let parameters = Parameters::from([("relative".into(), relative)]);
    Part { parameters, ..Part::new(id, named, share) }
}

fn of(parts: Vec<Part>) -> (Answer, Findings) {
    let prior = JudgeOptions::default().prior;
    let sets = vec![WeightedSet { parts, ln_weight: 0.0, probability: 0.0 }];
    let findings = Findings::new(sets, &prior, &Calibration::of_drives(&prior), Vec::new());
    (compose::answer(&findings, |_| None), findings)
}

fn relative(answer: &Answer, id: &str) -> f64 {
    answer.effects.iter().find(|e| e.id == id).unwrap().parameters["relative"]
}

#[test]
fn what_is_not_constant_is_not_simulated_with_a_constant() {
    let varying = format!("{VARYING}{}", scale());
    let parts = |share: f64| {
        vec![
            part(&varying, false, share, 0.0),
            part(scale(), true, 90.0, -0.17),
            part(ids::bias_step(), true, 20.0, 0.0),
        ]
    };
    let (mut answer, findings) = of(parts(500.0));
    assert_eq!((answer.verdict, answer.together.len()), (Verdict::Unknown, 2));
    drop_inconstant(&mut answer, &findings);
    assert_eq!(answer.together, [ids::bias_step()]);
    // alone it is another number
    let closest = BestSingleEffect { part: part(scale(), true, 30.0, -0.02), gain: 30.0 };
    let at = list_closest(&closest, &mut answer);
    assert_eq!((answer.effects[at].id.as_str(), relative(&answer, scale())), (scale(), -0.02));
    // what varies a little beside what explains most is a constant still
    let (mut answer, findings) = of(parts(10.0));
    assert_eq!(answer.main.as_deref(), Some(scale()));
    drop_inconstant(&mut answer, &findings);
    assert!(answer.together.iter().any(|id| id == scale()));
}

#[test]
fn what_comes_nearest_is_listed_once() {
    let (mut answer, _) = of(vec![part("free.along.time", false, 500.0, 0.0), part(scale(), true, 90.0, -0.01)]);
    // what was found keeps what it has beside the rest
    list_closest(&BestSingleEffect { part: part(scale(), true, 30.0, -0.02), gain: 30.0 }, &mut answer);
    assert_eq!((answer.effects.len(), relative(&answer, scale())), (1, -0.01));
    let track = ids::track_width();
    let at = list_closest(&BestSingleEffect { part: part(track, true, 30.0, 0.03), gain: 30.0 }, &mut answer);
    assert_eq!((at, answer.effects.len(), relative(&answer, track)), (1, 2, 0.03));
}
