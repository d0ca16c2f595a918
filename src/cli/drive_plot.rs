//! The picture of a drive: paths beside the reference, and errors against time.

use gyroid::Result;
use gyroid::config::Config;
use gyroid::files::OutputFile;
use gyroid::navigate::{Comparison, Reckoning, Settings, Track, compare, names as estimates};
use gyroid::report::plot::drive as figure;
use gyroid::report::plot::drive::{Dimension, DriveFigure, ErrorFigure, ErrorRow, ErrorSeries, TrackFigure};
use gyroid::report::plot::{Format, Picture};
use gyroid::signal::{Log, names};
use std::path::{Path, PathBuf};

/// A track with its name, and where it comes from a filter the standard deviation of its heading.
pub(crate) struct Estimated {
    name: &'static str,
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    heading_rad: Vec<f64>,
    heading_std_rad: Option<Vec<f64>>,
}

impl Estimated {
    pub(super) fn of_pose(name: &'static str, pose: &Log) -> Self {
        let column = |name: &str| pose.get(name).map(<[f64]>::to_vec);
        let all = |name: &str| column(name).unwrap_or_default();
        Self {
            name,
            x_m: all(names::X),
            y_m: all(names::Y),
            heading_rad: all(names::HEADING),
            heading_std_rad: column(estimates::HEADING_STD),
        }
    }

    pub(super) fn of_reckoning(name: &'static str, reckoning: &Reckoning) -> Self {
        let motion = || reckoning.motion.iter();
        Self {
            name,
            x_m: motion().map(|m| m.x_m).collect(),
            y_m: motion().map(|m| m.y_m).collect(),
            heading_rad: motion().map(|m| m.heading_rad).collect(),
            heading_std_rad: None,
        }
    }

    fn track(&self) -> Track<'_> {
        Track { x_m: &self.x_m, y_m: &self.y_m, heading_rad: &self.heading_rad }
    }
}

/// The pictures: a name without an ending stands for both kinds.
pub(crate) fn files(paths: &[PathBuf]) -> Vec<PathBuf> {
    let both = |path: &Path| match path.extension() {
        None => ["png", "svg"].map(|ending| path.with_extension(ending)).to_vec(),
        Some(_) => vec![path.to_path_buf()],
    };
    paths.iter().flat_map(|path| both(path)).collect()
}

/// Claims the pictures.
pub(crate) fn claim(paths: &[PathBuf]) -> Result<Vec<OutputFile>> {
    files(paths).iter().map(|path| Format::of(path).and_then(|_| OutputFile::claim(path))).collect()
}

/// Draws the tracks beside the reference of `log`, in its frame, and their errors.
pub(crate) fn draw(config: &Config, log: &Log, settings: &Settings, estimated: &[Estimated]) -> Result<Picture> {
    let compared = estimated
        .iter()
        .map(|e| Ok(compare(config, log, settings, &e.track())?.map(|c| (e, c))))
        .collect::<Result<Vec<Option<_>>>>()?;
    let compared: Vec<(&Estimated, Comparison)> = compared.into_iter().flatten().collect();
    let files: Vec<_> = log.source.split(" + ").map(|f| f.rsplit(['/', '\\']).next().unwrap_or(f)).collect();
    let title = format!("{}: paths", files.join(" + "));
    let Some((_, first)) = compared.first() else {
        let tracks: Vec<_> =
            estimated.iter().map(|e| figure::Track { name: e.name, x_m: &e.x_m, y_m: &e.y_m }).collect();
        let subtitle = "No reference: each path in its own frame";
        let tracks = TrackFigure { title: &title, subtitle, reference: None, tracks: &tracks };
        return DriveFigure { tracks, errors: None }.draw();
    };
    let tracks: Vec<_> =
        compared.iter().map(|(e, c)| figure::Track { name: e.name, x_m: &c.x_m, y_m: &c.y_m }).collect();
    let reference = figure::Track { name: "reference", x_m: &first.reference_x_m, y_m: &first.reference_y_m };
    // laid on a reference, the heading is as uncertain as the laying on, which the filter does not know
    let std = |e: &Estimated, c: &Comparison| {
        let std = e.heading_std_rad.as_ref().filter(|_| c.alignment.is_none())?;
        Some(c.rows.iter().map(|row| std[*row]).collect::<Vec<f64>>())
    };
    let bands: Vec<Option<Vec<f64>>> =
        compared.iter().enumerate().map(|(i, (e, c))| if i == 0 { std(e, c) } else { None }).collect();
    let positions: Vec<_> =
        compared.iter().map(|(e, c)| ErrorSeries { name: e.name, error: &c.position_error_m, std: None }).collect();
    let headings: Vec<_> = compared
        .iter()
        .zip(&bands)
        .filter_map(|((e, c), std)| {
            Some(ErrorSeries { name: e.name, error: c.heading_error_rad.as_ref()?, std: std.as_deref() })
        })
        .collect();
    let mut rows = vec![ErrorRow { label: "Distance", dimension: Dimension::Length, series: &positions }];
    if !headings.is_empty() {
        rows.push(ErrorRow { label: "Heading error", dimension: Dimension::Angle, series: &headings });
    }
    let subtitle = match &first.alignment {
        None => "Beside the reference, and the errors against time".to_string(),
        Some(a) => format!(
            "Each path laid on the reference over the first {:.0} % of the way ({:.0} m), and the errors against time",
            100.0 * a.path_share,
            a.path_m
        ),
    };
    let tracks = TrackFigure { title: &title, subtitle: &subtitle, reference: Some(reference), tracks: &tracks };
    let errors = ErrorFigure { title: "", subtitle: "", time_s: &first.time_s, rows: &rows };
    DriveFigure { tracks, errors: Some(errors) }.draw()
}
