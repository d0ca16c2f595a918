//! What the audit finds in a file, and what is done about it.

use super::*;
use gyroid::ingest::{Clock, Handling};
use gyroid::signal::TimeAxis;

const N: usize = 4000;

fn recording(time: impl Fn(usize) -> f64) -> GyroRecording {
    let files = Files::new();
    let rows: String = rates(N).iter().enumerate().map(|(i, x)| format!("{},{x}\n", time(i))).collect();
    read(&files.put("x.csv", format!("t_s,gz_rad_s\n{rows}"))).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_sound_log_has_no_findings() {
    let r = recording(|i| digits(37.2 + i as f64 * 0.01));
    let a = &r.audit;
    assert_eq!((a.rows, a.samples, a.gaps.count, a.duplicates.count, a.missing.count), (N, N, 0, 0, 0));
    assert_eq!((a.stuck.runs, a.saturation.samples, a.motion.intervals.len()), (0, 0, 0));
    assert!(a.sampling.uniform && (a.sampling.rate_hz - 100.0).abs() < 1e-6);
    assert_eq!(r.clock, Clock::PowerOn { first_s: 37.2, stated: false });
    assert!((r.log.time.at(0) - 37.2).abs() < 1e-9);
}

#[test]
fn rare_duplicates_are_left_out() {
    let r = recording(|i| digits(if i == 700 { 6.99 } else { i as f64 * 0.01 }));
    assert_eq!(r.audit.samples, N - 1);
    assert_eq!((r.audit.duplicates.count, r.audit.duplicates.first_row), (1, Some(701)));
    assert_eq!(r.audit.duplicates.handling, Handling::Dropped);
    assert_eq!(r.audit.gaps.count, 1);
}

#[test]
fn a_clock_coarser_than_the_sampling_keeps_its_samples() {
    // 4 kHz with stamps in whole milliseconds
    let r = recording(|i| digits((i as f64 / 4.0).floor() * 1e-3));
    assert_eq!((r.audit.samples, r.audit.duplicates.handling), (N, Handling::Spread));
    assert_eq!(r.audit.duplicates.count, N - N / 4);
    assert!((r.audit.sampling.rate_hz - 4000.0).abs() < 1.0, "{:?}", r.audit.sampling);
    for i in [0, 1, 1234, N - 1] {
        assert!((r.log.time.at(i) - i as f64 * 0.25e-3).abs() < 1e-6, "{i}: {}", r.log.time.at(i));
    }
}

#[test]
fn rows_that_were_written_twice_are_left_out() {
    let files = Files::new();
    let text = csv("gz_rad_s", 1.0, N);
    let twice: String =
        text.lines().enumerate().map(|(i, l)| if i == 0 { format!("{l}\n") } else { format!("{l}\n{l}\n") }).collect();
    let r = read(&files.put("x.csv", twice)).unwrap();
    assert_eq!((r.audit.rows, r.audit.samples), (2 * N, N));
    assert_eq!(r.audit.duplicates.handling, Handling::Dropped);
}

#[test]
fn times_rounded_to_few_digits_are_even() {
    // 300 Hz with stamps in whole milliseconds
    let r = recording(|i| (i as f64 / 300.0 * 1e3).round() / 1e3);
    assert!(matches!(r.log.time, TimeAxis::Uniform { .. }));
    let jittered = recording(|i| digits(i as f64 * 0.01 + if i % 7 == 0 { 0.002 } else { 0.0 }));
    assert!(matches!(jittered.log.time, TimeAxis::Explicit(_)));
    assert!(jittered.audit.sampling.step_std_s > 5e-4);
}

#[test]
fn motion_can_be_left_out() {
    let files = Files::new();
    let moving = |i: usize| (1500..1700).contains(&i);
    let rows: String = rates(N)
        .iter()
        .enumerate()
        .map(|(i, x)| format!("{},{}\n", digits(i as f64 * 0.01), if moving(i) { x + 0.1 } else { *x }))
        .collect();
    let r = read(&files.put("x.csv", format!("t_s,gz_rad_s\n{rows}"))).unwrap();
    assert_eq!(r.audit.motion.intervals.len(), 1, "{:?}", r.audit.motion);
    let moved = r.audit.motion.samples;
    let still = r.without_motion().unwrap();
    assert_eq!(still.log.len(), N - moved);
    assert!(gyro(&still).iter().all(|x| *x < 0.05));
    assert!(still.notes.iter().any(|n| n.contains("left out")), "{:?}", still.notes);
}

#[test]
fn the_hosts_clock_is_only_second_choice() {
    let files = Files::new();
    let rows: String = rates(N)
        .iter()
        .enumerate()
        .map(|(i, x)| format!("{},{},{x}\n", digits(5.0 + i as f64 * 0.011), digits(i as f64 * 0.01)))
        .collect();
    let r = read(&files.put("x.csv", format!("t_host_s,t_s,gz_rad_s\n{rows}"))).unwrap();
    assert!((r.audit.sampling.rate_hz - 100.0).abs() < 1e-6);
    let r = read(&files.put("x.csv", format!("t_host_s,seq,gz_rad_s\n{rows}"))).unwrap();
    assert!((r.audit.start_s - 5.0).abs() < 1e-9);
    assert!(r.notes.iter().any(|n| n.contains("time of a computer")), "{:?}", r.notes);
}
