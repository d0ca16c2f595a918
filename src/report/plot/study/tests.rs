use super::super::tests::{check_texts, check_xml};
use super::*;
use crate::math::random::Stream;

const ROWS: usize = 6001;

fn times() -> Vec<f64> {
    (0..ROWS).map(|i| 0.01 * i as f64).collect()
}

/// A series that begins at zero and ends near `end`.
fn growing(end: f64, seed: u64) -> Vec<f64> {
    let mut draw = Stream::new(seed, 0);
    times().iter().map(|t| end * (t / 60.0).sqrt() * (1.0 + 0.02 * draw.normal())).collect()
}

/// Every figure of a study, with ordinary numbers.
fn all() -> Vec<(&'static str, Result<Picture>)> {
    let time_s = times();
    let names = ["slip", "rolling", "dead reckoning"];
    let rms: Vec<Vec<f64>> = [0.05, 0.3, 2.0].iter().map(|e| growing(*e, 1)).collect();
    let lines: Vec<Line> = names.iter().zip(&rms).map(|(name, values)| Line { name, values }).collect();
    let rows = ["RMS error of x", "RMS error of heading"].iter().zip([Dimension::Length, Dimension::Angle]);
    let rows: Vec<TimeRow> = rows.map(|(label, dimension)| TimeRow { label, dimension, filters: &lines }).collect();
    let (title, subtitle) = ("Title", "100 runs of 60 s, seed 1");

    let mut draw = Stream::new(2, 0);
    let correlation: Vec<f64> = (0..=40).map(|k| if k == 0 { 1.0 } else { 0.03 * draw.normal() }).collect();
    let strips =
        [Line { name: "samples", values: &correlation }, Line { name: "means over 10 s", values: &correlation[..20] }];
    let truth: Vec<f64> = time_s.iter().map(|t| (0.1 * t).sin()).collect();
    let estimates: Vec<Vec<f64>> = rms.iter().map(|e| e.iter().zip(&truth).map(|(e, t)| e + t).collect()).collect();
    let estimates: Vec<Line> = names.iter().zip(&estimates).map(|(name, values)| Line { name, values }).collect();
    let nees: Vec<Vec<f64>> = [3.0, 200.0]
        .iter()
        .map(|level| {
            time_s.iter().map(|t| if *t == 0.0 { f64::NAN } else { level * (1.0 + 0.1 * draw.normal()) }).collect()
        })
        .collect();
    let nees: Vec<Line> = names.iter().zip(&nees).map(|(name, values)| Line { name, values }).collect();

    let points = |settings: &[f64], level: f64| -> Vec<[f64; 4]> {
        settings.iter().map(|s| [*s, level / s, 0.8 * level / s, 1.3 * level / s]).collect()
    };
    let grounds =
        [(0.05, "ice"), (0.19, "snow"), (0.38, "wet cobblestone"), (0.8, "wet asphalt"), (1.17, "dry asphalt")];
    let friction = [0.05, 0.19, 0.38, 0.8, 1.17];
    let against: Vec<Vec<[f64; 4]>> = [0.05, 0.3, 2.0].iter().map(|l| points(&friction, *l)).collect();
    let against: Vec<SweepLine> = names.iter().zip(&against).map(|(name, points)| SweepLine { name, points }).collect();
    let sweep: Vec<SweepRow> = ["RMS error of x", "RMS error of heading"]
        .iter()
        .zip([Dimension::Length, Dimension::Angle])
        .map(|(label, dimension)| SweepRow { label, dimension: Some(dimension), filters: &against })
        .collect();
    let slip: Vec<f64> = time_s.iter().map(|t| 0.05 * (0.7 * t).sin().powi(9)).collect();
    let noisy: Vec<f64> = slip.iter().map(|s| s + 0.004 * draw.normal()).collect();
    let std = vec![0.004; ROWS];
    let wheels = ["left", "right"].map(|wheel| SlipRow { wheel, truth: &slip, estimate: &noisy, std: &std });
    vec![
        ("autocorrelation", AutocorrelationFigure { title, subtitle, strips: &strips, bounds: &[0.06, 0.12] }.draw()),
        ("rms", RmsFigure { title, subtitle, time_s: &time_s, rows: &rows }.draw()),
        ("rms_one", RmsFigure { title, subtitle, time_s: &time_s, rows: &rows[..1] }.draw()),
        (
            "run",
            RunFigure {
                title,
                subtitle,
                label: "x",
                dimension: Dimension::Length,
                time_s: &time_s,
                truth: &truth,
                filters: &estimates,
            }
            .draw(),
        ),
        (
            "nees",
            NeesFigure { title, subtitle, time_s: &time_s, expected: 3.0, bounds95: [2.54, 3.5], filters: &nees }
                .draw(),
        ),
        (
            "friction",
            SweepFigure {
                title,
                subtitle,
                setting: "Greatest friction coefficient",
                named: &grounds,
                reference: Some(1.0),
                band: false,
                rows: &sweep,
            }
            .draw(),
        ),
        (
            "convergence",
            SweepFigure {
                title,
                subtitle,
                setting: "Runs",
                named: &[],
                reference: None,
                band: true,
                rows: &sweep[..1],
            }
            .draw(),
        ),
        ("slip", SlipFigure { title, subtitle, time_s: &time_s, wheels: &wheels }.draw()),
    ]
}

#[test]
fn every_figure_is_drawn_with_its_words_in_their_places() {
    for (name, picture) in all() {
        let picture = picture.unwrap();
        check_texts(&picture).unwrap_or_else(|e| panic!("{name}: {e}"));
        let said = check_xml(&picture.svg().unwrap());
        assert!(said.contains("100 runs of 60 s, seed 1"), "{name}");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    let (title, subtitle, time_s) = ("", "", &[0.0, 1.0, 2.0]);
    let said = |picture: Result<Picture>| picture.unwrap_err().to_string();
    let short = [Line { name: "slip", values: &[1.0] }];
    let row = |filters| TimeRow { label: "RMS of x", dimension: Dimension::Length, filters };
    let rms = |rows: &[TimeRow]| said(RmsFigure { title, subtitle, time_s, rows }.draw());
    let rows = [row(&short)];
    assert!(rms(&rows).contains("RMS of x, slip: 1 values on 3 rows"));
    assert!(rms(&[]).contains("nothing to draw"));
    let infinite = [Line { name: "slip", values: &[0.0, f64::INFINITY, 0.0] }];
    let rows = [row(&infinite)];
    assert!(rms(&rows).contains("RMS of x, slip, row 1"));
    let nees =
        |bounds95, filters| said(NeesFigure { title, subtitle, time_s, expected: 3.0, bounds95, filters }.draw());
    assert!(nees([4.0, 5.0], &[]).contains("bounds"));
    assert!(nees([2.0, 5.0], &short).contains("slip"));
    let strips = [Line { name: "residuals", values: &[1.0] }];
    let correlation = |strips, bounds| said(AutocorrelationFigure { title, subtitle, strips, bounds }.draw());
    assert!(correlation(&strips, &[0.1]).contains("residuals: has no lag"));
    assert!(correlation(&strips, &[]).contains("bounds: 0 values on 1 rows"));
    let filters = [SweepLine { name: "slip", points: &[[0.0, 1.0, 1.0, 1.0]] }];
    let rows = [SweepRow { label: "RMS of x", dimension: None, filters: &filters }];
    let sweep = SweepFigure { title, subtitle, setting: "Runs", named: &[], reference: None, band: true, rows: &rows };
    assert!(said(sweep.draw()).contains("RMS of x, slip: settings must be positive"));
}

#[test]
fn errors_that_are_zero_or_missing_are_drawn() {
    let time_s = [0.0, 1.0, 2.0];
    for values in [[0.0, 1.0, 2.0], [0.0; 3], [f64::NAN, 0.0, 1e-9]] {
        let filters = [Line { name: "slip", values: &values }, Line { name: "rolling", values: &values }];
        let rows = [TimeRow { label: "RMS", dimension: Dimension::Angle, filters: &filters }];
        let picture = RmsFigure { title: "t", subtitle: "", time_s: &time_s, rows: &rows }.draw().unwrap();
        check_texts(&picture).unwrap();
    }
}
