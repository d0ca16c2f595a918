//! Draws one of each figure from simulated data, and some of unusual data, into a directory:
//! `cargo run --example figures -- target/figures`.

use gyroid::bias::WarmUp;
use gyroid::files::OutputFile;
use gyroid::math::random::Stream;
use gyroid::report::plot::drive::{Dimension, ErrorFigure, ErrorRow, ErrorSeries, Track, TrackFigure};
use gyroid::report::plot::fit::{CurvePoint, FitFigure, WhitenessLevel};
use gyroid::report::plot::{Axis, Chart, HeatMap, Page, Picture, palette};
use gyroid::signal::TimeAxis;
use gyroid::units::RateUnit;
use gyroid::{ErrorKind, Result, validate};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<()> {
    let directory = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "target/figures".into()));
    std::fs::create_dir_all(&directory).map_err(|e| gyroid::Error::io(&directory, &e))?;
    let model = |c1, c2, t| WarmUp { c1_rad_s: c1, c2_rad_s: c2, time_constant_s: t };
    let warm = model(2e-3, -4e-3, 612.0);
    let slow = model(2e-3, 1e-3, 20_000.0);

    Demo::new("fit_1hz", warm, 5600, 1.0).save(&directory)?;
    Demo { unit: Some(RateUnit::DegPerH), ..Demo::new("fit_100hz", warm, 1_000_000, 100.0) }
        .noise(3e-3)
        .walk(2e-6)
        .save(&directory)?;
    Demo { ci: [4000.0, f64::INFINITY], ..Demo::new("fit_unbounded", slow, 5600, 1.0) }.save(&directory)?;
    Demo::new("fit_constant", model(0.0, 0.0125, 100.0), 1000, 10.0).noise(0.0).save(&directory)?;
    Demo::new("fit_zero", model(0.0, 0.0, 100.0), 1000, 10.0).noise(0.0).save(&directory)?;
    Demo::new("fit_tiny", model(1e-13, 0.1, 100.0), 1000, 10.0).noise(1e-14).save(&directory)?;
    Demo::new("fit_huge", model(3e22, -1e22, 1e6), 2000, 1e-3).noise(2e21).save(&directory)?;
    Demo::new("fit_negative", model(-5.0, -100.0, 40.0), 300, 2.0).noise(0.5).save(&directory)?;
    Demo::new("fit_3_points", warm, 3, 0.01).save(&directory)?;
    Demo { gaps: true, ..Demo::new("fit_gaps", warm, 20_000, 10.0) }.save(&directory)?;
    save(&directory, "track", &track()?)?;
    save(&directory, "errors", &errors()?)?;
    save(&directory, "others", &others()?)
}

fn save(directory: &Path, name: &str, picture: &Picture) -> Result<()> {
    for ending in ["svg", "png"] {
        let begin = Instant::now();
        let path = directory.join(format!("{name}.{ending}"));
        picture.write(OutputFile::claim(&path)?)?;
        let size = std::fs::metadata(&path).map_err(|e| gyroid::Error::io(&path, &e))?.len();
        println!("{:>5} kB  {:>5} ms  {}", size / 1000, begin.elapsed().as_millis(), path.display());
    }
    Ok(())
}

/// A simulated log with its true model in the place of a fitted one.
struct Demo {
    name: &'static str,
    model: WarmUp,
    samples: usize,
    rate_hz: f64,
    noise_rad_s: f64,
    walk_rad_s: f64,
    ci: [f64; 2],
    unit: Option<RateUnit>,
    gaps: bool,
}

impl Demo {
    fn new(name: &'static str, model: WarmUp, samples: usize, rate_hz: f64) -> Self {
        let t = model.time_constant_s;
        let ci = [0.88 * t, 1.15 * t];
        Self { name, model, samples, rate_hz, noise_rad_s: 4e-4, walk_rad_s: 0.0, ci, unit: None, gaps: false }
    }

    fn noise(self, noise_rad_s: f64) -> Self {
        Self { noise_rad_s, ..self }
    }

    fn walk(self, walk_rad_s: f64) -> Self {
        Self { walk_rad_s, ..self }
    }

    fn save(&self, directory: &Path) -> Result<()> {
        let mut stream = Stream::new(1, 0);
        let mut walk = 0.0;
        let time = TimeAxis::Uniform { start_s: 0.0, step_s: 1.0 / self.rate_hz, len: self.samples };
        let residual: Vec<f64> = (0..self.samples)
            .map(|i| {
                walk += self.walk_rad_s * stream.normal();
                let value = walk + self.noise_rad_s * stream.normal();
                if self.gaps && (i / 1500) % 4 == 2 { f64::NAN } else { value }
            })
            .collect();
        let rate: Vec<f64> = (0..self.samples).map(|i| self.model.error_rad_s(time.at(i)) + residual[i]).collect();
        let end = time.at(self.samples - 1);
        let curve: Vec<CurvePoint> = (0..=300)
            .map(|i| {
                let t_s = end * f64::from(i) / 300.0;
                let fit = self.model.error_rad_s(t_s);
                let half = 0.05 * self.model.c1_rad_s.abs() * (1.0 + (4.0 * t_s / end - 2.0).powi(2));
                CurvePoint { t_s, fit_rad_s: fit, low_rad_s: fit - half, high_rad_s: fit + half }
            })
            .collect();
        let options = validate::Options { draws: 99, ..validate::Options::default() };
        let validation = validate::whiteness(&time, &residual, &[], &options);
        let levels: Vec<WhitenessLevel> = validation.levels.iter().map(WhitenessLevel::from).collect();
        let white = if validation.white { "white" } else { "not white" };
        let verdict = format!("Simulated. The residuals are {white} (p = {:.2}).", validation.joint_p_value);
        let begin = Instant::now();
        let picture = FitFigure {
            title: &format!("{}.csv, axis z", self.name),
            verdict: &verdict,
            time: &time,
            rate_rad_s: &rate,
            residual_rad_s: &residual,
            curve: &curve,
            time_constant_s: self.model.time_constant_s,
            time_constant_ci95_s: self.ci,
            levels: &levels,
            unit: self.unit,
        }
        .draw()?;
        println!("{:>16} {:>5} ms  {} samples", "", begin.elapsed().as_millis(), self.samples);
        save(directory, self.name, &picture)
    }
}

fn track() -> Result<Picture> {
    let t: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 0.01).collect();
    let path = |drift: f64| -> (Vec<f64>, Vec<f64>) {
        let (mut x, mut y) = (0.0, 0.0);
        t.iter()
            .map(|t| {
                let heading = 1.2 * (t / 17.0).sin() + t / 60.0 + drift * t;
                x += 0.005 * heading.cos();
                y += 0.005 * heading.sin();
                (x, y)
            })
            .unzip()
    };
    let (truth, filter, reckoned) = (path(0.0), path(2e-4), path(2.5e-3));
    let track = |name, p| {
        let (x, y): &(Vec<f64>, Vec<f64>) = p;
        Track { name, x_m: x, y_m: y }
    };
    TrackFigure {
        title: "drive.csv: path",
        subtitle: "End of the path: filter 0.4 m from the reference, dead reckoning 4.9 m",
        reference: Some(track("reference", &truth)),
        tracks: &[track("filter", &filter), track("dead reckoning", &reckoned)],
    }
    .draw()
}

fn errors() -> Result<Picture> {
    let mut stream = Stream::new(3, 0);
    let time_s: Vec<f64> = (0..60_000).map(|i| f64::from(i) * 0.01).collect();
    let std = |rate: f64| -> Vec<f64> { time_s.iter().map(|t| rate * (0.01 + t / 600.0).sqrt()).collect() };
    let mut error = |rate: f64| -> Vec<f64> {
        let mut e = 0.0;
        time_s
            .iter()
            .map(|_| {
                e += rate * stream.normal() / f64::from(60_000).sqrt();
                e
            })
            .collect()
    };
    let (heading, x, y) = (error(0.02), error(0.3), error(0.5));
    let rolling = error(1.2);
    let (heading_std, x_std, y_std) = (std(0.02), std(0.3), std(0.5));
    let slip = |error, std| ErrorSeries { name: "filter with slip", error, std: Some(std) };
    let row = |label, dimension, series| ErrorRow { label, dimension, series };
    ErrorFigure {
        title: "drive.csv: estimate less reference",
        subtitle: "Heading RMS 0.6°, position RMS 0.3 m",
        time_s: &time_s,
        rows: &[
            row("Heading error", Dimension::Angle, &[slip(&heading, &heading_std)]),
            row("x error", Dimension::Length, &[slip(&x, &x_std)]),
            row(
                "y error",
                Dimension::Length,
                &[slip(&y, &y_std), ErrorSeries { name: "filter without slip", error: &rolling, std: None }],
            ),
        ],
    }
    .draw()
}

fn others() -> Result<Picture> {
    let taus: Vec<f64> = (0..40).map(|i| 0.01 * 10f64.powf(f64::from(i) / 7.0)).collect();
    let deviation = |tau: f64| ((1.7e-4_f64).powi(2) / tau + 1e-10 + (2e-6_f64).powi(2) * tau / 3.0).sqrt();
    let spread = |tau: f64| 0.4 * (tau / 1e4).sqrt().min(1.0) * deviation(tau);
    let allan = Chart::new(Axis::log("Averaging time τ", "s"), Axis::log("Allan deviation", "rad/s"))
        .title("Allan deviation")
        .bars(
            "95 %",
            taus.iter().map(|t| [*t, deviation(*t) - spread(*t), deviation(*t) + spread(*t)]),
            palette::BLUE.stroke(1.5),
        )
        .dots("gyro z", taus.iter().map(|t| [*t, deviation(*t)]), palette::BLUE, 3.5)
        .line("N/√τ", taus.iter().map(|t| [*t, 1.7e-4 / t.sqrt()]), palette::VERMILION.stroke(1.5).dashed())
        .line("model", taus.iter().map(|t| [*t, deviation(*t)]), palette::GREEN.stroke(2.0));
    let confidence = [0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95];
    let reliability = Chart::new(
        Axis::linear("Stated probability", "").limits(0.0, 1.0),
        Axis::linear("Share that came true", "").limits(0.0, 1.0),
    )
    .title("Reliability")
    .equal_axes()
    .line("ideal", [[0.0, 0.0], [1.0, 1.0]], palette::GREY.stroke(1.5).dashed())
    .bars("95 %", confidence.map(|c| [c, c - 0.08, c + 0.06]), palette::BLUE.stroke(1.5))
    .line("", confidence.map(|c| [c, c - 0.02]), palette::BLUE.stroke(2.0))
    .dots("observed", confidence.map(|c| [c, c - 0.02]), palette::BLUE, 5.0);
    let names = ["none", "track width", "wheel radius", "gyro scale", "unknown"];
    let counts = (0..25).map(|i| if i % 6 == 0 { f64::from(40 - i) } else { f64::from(i % 4) }).collect();
    let confusion = HeatMap::new(names, names, counts)?.title("Confusion matrix").labels("Truth", "Answer").places(0);
    let signs: Vec<f64> = [1.0, -0.62, 0.97, -0.62, 1.0, -0.7, 0.97, -0.7, 1.0].into();
    let correlation = HeatMap::new(["C1", "C2", "T"], ["C1", "C2", "T"], signs)?.title("Correlation of the estimates");
    // what the figures refuse says which number is at fault
    let refused =
        Chart::new(Axis::linear("x", ""), Axis::log("y", "")).line("zero", [[0.0, 0.0]], palette::BLUE.stroke(1.0));
    if let Err(error) = Page::new("").row([refused.into()]).draw() {
        assert_eq!(error.kind, ErrorKind::Value);
        println!("refused, as it should be: {error}");
    }
    Page::new("Charts for other figures")
        .row([allan.into(), reliability.into()])
        .row([confusion.into(), correlation.into()])
        .draw()
}
