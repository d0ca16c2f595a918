//! The figures of a study, each under the name of its file.

use super::{MAIN, StudyReport};
use crate::error::Result;
use crate::report::plot::drive::Dimension;
use crate::report::plot::study::{
    AutocorrelationFigure, Line, NeesFigure, RmsFigure, RunFigure, SlipFigure, SlipRow, SweepFigure, SweepLine,
    SweepRow, TimeRow,
};
use crate::report::plot::{Page, Panel, Picture};
use crate::study::{Belief, Estimator, RunCount, Study};
use crate::units::duration_text;

/// x, y and heading: name on an axis, and dimension.
const AXES: [(&str, Dimension); 3] =
    [("x", Dimension::Length), ("y", Dimension::Length), ("heading", Dimension::Angle)];

/// Estimators that show the benefit of the gyro's error model.
const WITH_AND_WITHOUT: [Estimator; 6] = [
    Estimator::Slip,
    Estimator::Rolling,
    Estimator::SlipWithoutErrorModel,
    Estimator::GyroReckoning,
    Estimator::GyroReckoningZeroed,
    Estimator::GyroReckoningModelled,
];

/// Estimators whose NEES is drawn: those with the gyro's error model.
const CONSISTENT: [Estimator; 3] = [Estimator::Slip, Estimator::Rolling, Estimator::SlipUnscented];

impl StudyReport {
    /// Names of the figures that [`Self::figures`] draws, in its order: known before a run is made, so that files can
    /// be claimed. Those of the sweeps are there where the study has `sweeps`.
    #[must_use]
    pub(crate) fn figure_names(sweeps: bool) -> Vec<&'static str> {
        let all = [
            "figure_2_autocorrelation",
            "figure_3_rms_x",
            "figure_4_rms_y_heading",
            "figure_5_x",
            "figure_6_y",
            "figure_7_heading",
            "nees",
            "error_model",
            "slip",
            "convergence",
        ];
        let swept = if sweeps { &["friction", "sensitivity"][..] } else { &[] };
        all.iter().chain(swept).copied().collect()
    }

    /// Draws the paper's figures and those that it leaves out.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if an error of a filter is not finite; it names the figure's series.
    pub(crate) fn figures(&self) -> Result<Vec<(&'static str, Picture)>> {
        let mut pictures = vec![
            self.autocorrelation()?,
            self.rms("Figure 3: RMS error of x", &[0], &MAIN)?,
            self.rms("Figure 4: RMS error of y and heading", &[1, 2], &MAIN)?,
            self.run("Figure 5: x in one run", 0)?,
            self.run("Figure 6: y in one run", 1)?,
            self.run("Figure 7: heading in one run", 2)?,
            self.nees()?,
            self.rms("RMS error of heading, with and without the gyro's error model", &[2], &WITH_AND_WITHOUT)?,
            self.slip()?,
            self.convergence_figure()?,
        ];
        let sweeps = !self.grounds.is_empty() || !self.beliefs.is_empty();
        if sweeps {
            pictures.push(self.friction_figure()?);
            pictures.push(self.sensitivity_figure()?);
        }
        Ok(Self::figure_names(sweeps).into_iter().zip(pictures).collect())
    }

    fn autocorrelation(&self) -> Result<Picture> {
        let levels = &self.identification.validation.levels;
        let title = "Figure 2: autocorrelation of the residuals of the identified error model";
        let subtitle = format!("{}: {}", self.identification.log.name, self.identification.verdict_line());
        // the samples, and of the averaging times that leave lags enough to be worth a picture the middle and the last
        let last = levels.iter().rposition(|l| l.whiteness.autocorrelation.len() > 10).unwrap_or(0);
        let mut shown: Vec<usize> = vec![0, last / 2, last];
        shown.dedup();
        let there: Vec<_> = shown.into_iter().filter_map(|i| levels.get(i)).collect();
        let names: Vec<String> = there
            .iter()
            .enumerate()
            .map(|(i, l)| match i {
                0 => format!("samples, n = {}", l.whiteness.samples),
                _ => format!("means over {}, n = {}", duration_text(l.averaging_time_s), l.whiteness.samples),
            })
            .collect();
        let lines: Vec<Line> =
            there.iter().zip(&names).map(|(l, name)| Line { name, values: &l.whiteness.autocorrelation }).collect();
        let bounds: Vec<f64> = there.iter().map(|l| l.whiteness.autocorrelation_bound).collect();
        if lines.is_empty() {
            return notice(title, "The residuals of this log are too few, or do not vary.");
        }
        AutocorrelationFigure { title, subtitle: &subtitle, strips: &lines, bounds: &bounds }.draw()
    }

    fn rms(&self, title: &str, quantities: &[usize], estimators: &[Estimator]) -> Result<Picture> {
        let lines: Vec<Vec<Line>> = quantities
            .iter()
            .map(|i| {
                let there = estimators.iter().filter_map(|e| self.study.of(*e));
                there.map(|e| Line { name: e.estimator.words(), values: &e.rms_over_time[*i] }).collect()
            })
            .collect();
        if lines.iter().any(Vec::is_empty) {
            return notice(title, "None of these estimators ran.");
        }
        let labels: Vec<String> = quantities.iter().map(|i| format!("RMS error of {}", AXES[*i].0)).collect();
        let rows: Vec<TimeRow> = quantities
            .iter()
            .zip(&labels)
            .zip(&lines)
            .map(|((i, label), filters)| TimeRow { label, dimension: AXES[*i].1, filters })
            .collect();
        RmsFigure { title, subtitle: &self.heading(), time_s: &self.study.times_s, rows: &rows }.draw()
    }

    fn run(&self, title: &str, quantity: usize) -> Result<Picture> {
        let Some(example) = &self.study.example else { return notice(title, "The study kept no run.") };
        let column = |poses: &[[f64; 3]]| poses.iter().map(|p| p[quantity]).collect::<Vec<f64>>();
        let shown = example.estimates.iter().filter(|(e, _)| MAIN.contains(e));
        let estimates: Vec<(&str, Vec<f64>)> = shown.map(|(e, poses)| (e.words(), column(poses))).collect();
        let lines: Vec<Line> = estimates.iter().map(|(name, values)| Line { name, values }).collect();
        let (label, dimension) = AXES[quantity];
        let subtitle = format!("the first of {}", self.heading());
        RunFigure {
            title,
            subtitle: &subtitle,
            label,
            dimension,
            time_s: &example.times_s,
            truth: &column(&example.truth),
            filters: &lines,
        }
        .draw()
    }

    fn nees(&self) -> Result<Picture> {
        let title = "NEES of (x, y, heading): squared errors over what the filter believes them to be";
        let there: Vec<_> = CONSISTENT.iter().filter_map(|e| Some((e, self.study.of(*e)?.nees.as_ref()?))).collect();
        let Some((_, first)) = there.first() else { return notice(title, "No estimator has a covariance.") };
        let lines: Vec<Line> = there.iter().map(|(e, n)| Line { name: e.words(), values: &n.over_time }).collect();
        NeesFigure {
            title,
            subtitle: &self.heading(),
            time_s: &self.study.times_s,
            expected: 3.0,
            bounds95: first.bounds95,
            filters: &lines,
        }
        .draw()
    }

    fn slip(&self) -> Result<Picture> {
        let title = "Slip of the wheels in one run: true and estimated";
        let example = self.study.example.as_ref().filter(|e| !e.true_slips.is_empty() && !e.slips.is_empty());
        let Some(example) = example else { return notice(title, "The robot has no [traction], and so no slip.") };
        let part = |wheel: usize| -> [Vec<f64>; 3] {
            [
                example.true_slips.iter().map(|s| s[wheel]).collect(),
                example.slips.iter().map(|s| s[wheel][0]).collect(),
                example.slips.iter().map(|s| s[wheel][1]).collect(),
            ]
        };
        let [left, right] = [part(0), part(1)];
        let rows = [("left wheel", &left), ("right wheel", &right)].map(|(wheel, [truth, estimate, std])| SlipRow {
            wheel,
            truth,
            estimate,
            std,
        });
        let subtitle = format!("the first of {}", self.heading());
        SlipFigure { title, subtitle: &subtitle, time_s: &example.times_s, wheels: &rows }.draw()
    }

    fn convergence_figure(&self) -> Result<Picture> {
        let points = MAIN.map(|e| self.convergence(e));
        let title = "RMS error by the number of runs";
        if points.iter().all(Vec::is_empty) {
            return notice(title, "None of these estimators ran.");
        }
        let rows = |i: usize| -> Vec<Vec<[f64; 4]>> {
            let row = |p: &RunCount| {
                let [low, high] = p.rms_ci95[i];
                [p.runs as f64, p.rms[i], low, high]
            };
            points.iter().map(|points| points.iter().map(row).collect()).collect()
        };
        let subtitle = format!("{}; bands hold 95 %", self.heading());
        let figure = SweepFigure {
            title,
            subtitle: &subtitle,
            setting: "Runs",
            named: &[],
            reference: None,
            band: true,
            rows: &[],
        };
        sweep(figure, MAIN.map(Estimator::words), rows)
    }

    fn friction_figure(&self) -> Result<Picture> {
        let title = "RMS error by the ground, which the filter knows";
        if self.grounds.is_empty() {
            return notice(title, "No other grounds were studied.");
        }
        let names: Vec<(f64, String)> =
            self.grounds.iter().map(|g| (g.peak_friction, g.surface.name().replace('_', " "))).collect();
        let named: Vec<(f64, &str)> = names.iter().map(|(at, name)| (*at, name.as_str())).collect();
        let rows = |i: usize| -> Vec<Vec<[f64; 4]>> {
            let of =
                |e: &Estimator| self.grounds.iter().filter_map(|g| point(g.peak_friction, &g.study, *e, i)).collect();
            MAIN.iter().map(of).collect()
        };
        let setting = "Greatest friction coefficient";
        let figure = SweepFigure {
            title,
            subtitle: "bars hold 95 %",
            setting,
            named: &named,
            reference: None,
            band: false,
            rows: &[],
        };
        sweep(figure, MAIN.map(Estimator::words), rows)
    }

    fn sensitivity_figure(&self) -> Result<Picture> {
        let title = "What the slip model is worth to a filter that is wrong about traction";
        if self.beliefs.is_empty() {
            return notice(title, "No wrong parameters were studied.");
        }
        let points = |i: usize, factor: fn(&Belief) -> f64, other: fn(&Belief) -> f64| -> Vec<[f64; 4]> {
            let there = self.beliefs.iter().filter(|b| other(b) == 1.0);
            let mut points: Vec<[f64; 4]> = there
                .map(|b| {
                    let [low, high] = b.against_rolling.factor_ci95[i];
                    [factor(b), b.against_rolling.factor[i], low, high]
                })
                .collect();
            // the filter that is right stands in both sweeps
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points.dedup_by(|a, b| a[0] == b[0]);
            points
        };
        let lines: [[Vec<[f64; 4]>; 2]; 3] = std::array::from_fn(|i| {
            [
                points(i, |b| b.friction_factor, |b| b.stiffness_factor),
                points(i, |b| b.stiffness_factor, |b| b.friction_factor),
            ]
        });
        let names = ["friction wrong", "stiffness wrong"];
        let filters = lines.each_ref().map(|lines| {
            let both = names.iter().zip(lines);
            both.map(|(name, points)| SweepLine { name, points }).collect::<Vec<_>>()
        });
        let labels = AXES.map(|(name, _)| format!("Factor, {name}"));
        let rows: [SweepRow; 3] =
            std::array::from_fn(|i| SweepRow { label: &labels[i], dimension: None, filters: &filters[i] });
        let subtitle =
            format!("{}; factor: error without slip model over error with it; bars hold 95 %", self.heading());
        SweepFigure {
            title,
            subtitle: &subtitle,
            setting: "What the filter believes over what is",
            named: &[],
            reference: Some(1.0),
            band: false,
            rows: &rows,
        }
        .draw()
    }
}

/// Draws `figure` with rows for x, y and heading; `points` gives one line of a quantity for each of `words`.
fn sweep(figure: SweepFigure, words: [&str; 3], points: impl Fn(usize) -> Vec<Vec<[f64; 4]>>) -> Result<Picture> {
    let all: [Vec<Vec<[f64; 4]>>; 3] = std::array::from_fn(points);
    let lines: [Vec<SweepLine>; 3] =
        std::array::from_fn(|i| words.iter().zip(&all[i]).map(|(name, points)| SweepLine { name, points }).collect());
    let labels = AXES.map(|(name, _)| format!("RMS error of {name}"));
    let rows: [SweepRow; 3] = std::array::from_fn(|i| {
        let (_, dimension) = AXES[i];
        SweepRow { label: &labels[i], dimension: Some(dimension), filters: &lines[i] }
    });
    SweepFigure { rows: &rows, ..figure }.draw()
}

/// Setting, RMS and its interval.
fn point(setting: f64, study: &Study, estimator: Estimator, quantity: usize) -> Option<[f64; 4]> {
    let result = study.of(estimator)?;
    let [low, high] = result.rms_ci95[quantity];
    Some([setting, result.rms[quantity], low, high])
}

fn notice(title: &str, text: &str) -> Result<Picture> {
    let panel = Panel::Notice { title: String::new(), text: text.into() };
    Page::new(title).size(1200, 400).row([panel]).draw()
}
