//! `gyroid navigate`: the bundled filter over a recorded drive.

mod results;

use super::drive_args::DriveArgs;
use super::drive_plot::{self, Estimated};
use super::html::{self, HtmlArgs};
use super::mcap::McapArgs;
use super::outcome::Outcome;
use super::output::{Common, Output};
use super::places;
use super::restart::PowerArgs;
use clap::Args;
use gyroid::config::Config;
use gyroid::files::{OutputFile, Plan};
use gyroid::ingest::LogWriter;
use gyroid::navigate::{
    Alignment, Consistency, ReferenceErrors, Run, Settings, Standstill, Summary, WheelModel, WheelSlip,
};
use gyroid::report::html::{DrivePage, drive_page};
use gyroid::report::mcap::{DriveRecording, Shown};
use gyroid::signal::Log;
use gyroid::units::{RAD_S_PER_DEG_S, duration_text};
use gyroid::{Error, ErrorKind, Result};
use results::{Asked, Results, ZEROED, has_gyro};
use std::fmt::Write;
use std::path::PathBuf;

/// Run the navigation filter over a drive, beside a gyro zeroed at the start, the filter without error model, and encoders alone
///
/// The filter takes what the drive has: gyro, wheel speeds or the speed and yaw rate of an odometry, or a speed alone. Effects
/// that the configuration holds as tables [[effect]] (gyroid gap diagnose writes them) are in its model; the filter without
/// them runs beside it. The pose that is written and drawn is smoothed: each row's is given the whole drive.
///
/// Exit code 3: a sensor's readings lie further from what the filter expects of them, or nearer, than its model allows (mean NIS
/// outside its 99.9 % bounds); --save-config is then withheld unless --accept says so.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    gyroid navigate gyroid.toml drive.parquet -o pose.parquet --plot drive.png\n  \
    gyroid navigate gyroid.toml drive.parquet --json -\n  \
    gyroid navigate husky.toml imu.csv wheels.csv gps.csv --map gyro_z_rad_s=gy_rad_s\n  \
    gyroid navigate gyroid.toml drive.parquet --save-config gyroid.toml\n  \
    gyroid navigate gyroid.toml next.parquet --off-time 300"
)]
pub(crate) struct NavigateArgs {
    /// Configuration (schema 1) with [gyro], [vehicle] and [encoder]; [gyro] may be missing where the drive has no gyro
    config: PathBuf,
    /// Recorded drive: one file, or several on one clock
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    columns: DriveArgs,
    /// Write the pose to this log (.csv or .parquet), in the filter's own frame
    #[arg(short, long, value_name = "LOG")]
    out: Option<PathBuf>,
    /// Draw paths and errors here (.png or .svg; without an ending both)
    #[arg(long, value_name = "FILE")]
    plot: Vec<PathBuf>,
    #[command(flatten)]
    page: HtmlArgs,
    #[command(flatten)]
    recording: McapArgs,
    /// Write and draw each pose given the readings up to it, as the robot knew it on its way: it jumps as the filter learns
    #[arg(long)]
    filtered: bool,
    /// Write the pose of the filter that takes the gyro for free of error
    #[arg(long)]
    no_error_model: bool,
    /// Use the log's reference pose as a measurement (else it is only compared with)
    #[arg(long)]
    use_pose: bool,
    /// Start at the reference's first pose instead of x = y = heading = 0
    #[arg(long)]
    start_at_reference: bool,
    /// Lay the first part of each track on the reference (share of the way; 0: not at all) before they are compared
    /// [default: 0.2 where the reference has no heading, else 0]
    #[arg(long, value_name = "SHARE", num_args = 0..=1, require_equals = true, default_missing_value = "0.2")]
    align: Option<f64>,
    /// How the wheels move: with slip, without, or with where the configuration has [traction] and the drive torques
    #[arg(long, value_enum, default_value_t = WheelsName::Auto)]
    wheels: WheelsName,
    #[command(flatten)]
    power: PowerArgs,
    /// Write the configuration with [gyro.last_run], how warm the drive left the gyro, for a restart with --off-time
    #[arg(long, value_name = "FILE")]
    save_config: Option<PathBuf>,
    /// Write it also by a filter that is not fit for use
    #[arg(long, requires = "save_config")]
    accept: bool,
    /// Take wheels that read zero within their noise for standing still too; only where something holds the robot
    #[arg(long)]
    zero_updates: bool,
    /// Never take the robot for standing still, not even where both wheels read zero
    #[arg(long, conflicts_with = "zero_updates")]
    no_zero_updates: bool,
    /// Leave out readings beyond this quantile of chi-squared (such as 0.9999) [default: use all]
    #[arg(long, value_name = "P")]
    gate: Option<f64>,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum WheelsName {
    Auto,
    Rolling,
    Slip,
}

impl NavigateArgs {
    fn asked(&self) -> Asked {
        Asked { settings: self.settings(), filtered: self.filtered, no_error_model: self.no_error_model }
    }

    fn settings(&self) -> Settings {
        Settings {
            use_pose: self.use_pose,
            start_at_reference: self.start_at_reference,
            align_share: self.align,
            gate_probability: self.gate,
            since_power_on_s: self.power.since_power_on_s(),
            off_time_s: self.power.off_time,
            wheels: match self.wheels {
                WheelsName::Auto => WheelModel::Auto,
                WheelsName::Rolling => WheelModel::Rolling,
                WheelsName::Slip => WheelModel::Slip,
            },
            standstill: (!self.no_zero_updates)
                .then_some(Standstill { within_noise: self.zero_updates, ..Standstill::default() }),
            innovations: self.recording.wanted(),
            ..Settings::default()
        }
    }
}

pub(crate) fn run(args: &NavigateArgs) -> Result<Outcome> {
    places::check("navigate", &args.config, "", &args.logs)?;
    let plan = Plan::new().reads([&args.config]).reads(&args.logs).writes("--out", &args.out);
    let plan = plan.updates("--save-config", &args.save_config).writes("--plot", drive_plot::files(&args.plot));
    let plan = args.recording.planned(args.page.planned(plan));
    let output = Output::open(&args.common, "navigate", plan)?;
    let out = args.out.as_ref().map(LogWriter::claim).transpose()?;
    let save = args.save_config.as_ref().map(OutputFile::claim).transpose()?;
    let plots: Vec<OutputFile> = drive_plot::claim(&args.plot)?;
    let page = args.page.claim()?;
    let mcap = args.recording.claim()?;
    let name = args.config.display().to_string();
    let named = |error: Error| if error.input == "configuration" { error.named(&name) } else { error };
    // without a gyro in the drive [gyro] may be missing
    let config = Config::read_base(&args.config)?;
    let working = output.working("reading the drive");
    let recording = args.columns.read(&args.logs, &config)?;
    let log = &recording.log;
    places::check_drive(log, &args.config)?;
    args.power.check(log)?;
    if save.is_some() && !has_gyro(log) {
        let found = format!("{} has no gyro that could be left warm", log.source);
        return Err(Error::new(ErrorKind::Usage, "--save-config", found).hint("leave out --save-config"));
    }
    let results = Results::of(args.asked(), &config, log, &working).map_err(named)?;
    drop(working);
    if let Some(out) = out {
        out.write(pose(results.written()))?;
    }
    let fit_for_use = results.written().summary.consistency.fit_for_use;
    if let Some(mut file) = save.filter(|_| fit_for_use || args.accept) {
        let after = config.clone().after_run(results.best().summary.warm_up_age_end_s).map_err(named)?;
        file.write_all(after.to_toml().map_err(named)?.as_bytes())?;
        file.commit()?;
    }
    if output.talks() {
        output.say(text(args, &config, &results, &recording.notes));
    }
    if !plots.is_empty() || page.is_some() {
        let mut estimated: Vec<Estimated> = match &results.with {
            Some(with) => vec![
                Estimated::of_pose("with error model", pose(with)),
                Estimated::of_pose("without error model", pose(&results.without)),
            ],
            None => vec![Estimated::of_pose("filter, no gyro", pose(&results.without))],
        };
        estimated.extend(results.nominal.as_ref().map(|run| Estimated::of_pose("without the effects", pose(run))));
        estimated.extend(results.zeroed.as_ref().map(|z| Estimated::of_pose(ZEROED, pose(&z.run))));
        let reckoned = results.reckoned().into_iter().filter(|(name, _)| !name.contains("zeroed"));
        estimated.extend(reckoned.map(|(name, r)| Estimated::of_reckoning(name, r)));
        let picture = drive_plot::draw(&config, log, &args.settings(), &estimated)?;
        let names: Vec<String> = plots.iter().map(|p| p.target().display().to_string()).collect();
        plots.into_iter().try_for_each(|file| picture.write(file))?;
        if !names.is_empty() {
            output.say(format!("drew {}", names.join(", ")));
        }
        if let Some(file) = page {
            let origin = html::origin([&args.config].into_iter().chain(&args.logs))?;
            let drive = DrivePage {
                logs: &args.logs.iter().map(|l| l.display().to_string()).collect::<Vec<_>>().join(" + "),
                rows: &results.rows(),
                judged: &results.written().summary,
                picture: &picture,
                text: &text(args, &config, &results, &recording.notes),
                notes: &recording.notes,
            };
            html::write(file, &drive_page(&drive, &origin)?, &output)?;
        }
    }
    if let Some(mcap) = mcap {
        let run = results.written();
        let drive = DriveRecording {
            config: &config,
            log,
            run,
            pose: pose(run),
            without: results.with.as_ref().map(|_| pose(&results.without)),
            text: &text(args, &config, &results, &recording.notes),
        };
        mcap.write(Shown::Navigation, |file| drive.write(file), &output)?;
    }
    output.finish(&results.json(&recording.notes))?;
    Ok(if fit_for_use || args.accept { Outcome::Done } else { Outcome::Unfit })
}

/// The pose that is shown of a run: smoothed where it was asked for.
fn pose(run: &Run) -> &Log {
    run.smoothed.as_ref().map_or(&run.pose, |s| &s.pose)
}

/// Report of the sensors whose mean NIS is out of bounds, with the remedy; empty where the filter is fit for use.
fn unfit(args: &NavigateArgs, consistency: &Consistency) -> String {
    let outside = consistency.sensors.iter().filter(|s| !s.fit_for_use).map(|s| {
        let [low, high] = s.nis_mean_bounds999;
        let (found, n) = (s.nis_mean, s.nis_effective_readings);
        format!(
            "{} has a mean NIS of {found:.3}, bounds {low:.3} to {high:.3} at {n:.0} independent readings",
            s.sensor
        )
    });
    let outside = outside.collect::<Vec<_>>().join("; ");
    if outside.is_empty() {
        return outside;
    }
    let logs: Vec<_> = args.logs.iter().map(|l| l.display().to_string()).collect();
    format!(
        "\nNOT FIT FOR USE: {outside}\n  the robot or its sensors are not as the configuration says, and the standard deviations are \
         not to be relied on;\n  gyroid gap diagnose {} --fit {}{} looks for the cause",
        args.config.display(),
        logs.join(" "),
        args.columns.maps()
    )
}

fn text(args: &NavigateArgs, config: &Config, results: &Results, reading: &[String]) -> String {
    let mut t = String::new();
    let best = &results.best().summary;
    let logs: Vec<_> = args.logs.iter().map(|l| l.display().to_string()).collect();
    let _ = writeln!(
        t,
        "{}: {} rows, {}, from {:.1} s after power-on; {}\n",
        logs.join(" + "),
        best.rows,
        duration_text(best.span_s),
        best.since_power_on_s,
        sensors(results, best),
    );
    let _ = writeln!(
        t,
        "{:<22}{:>13}{:>13}{:>13}{:>13}   NIS (95 % bounds), innovations",
        "", "heading rms", "at the end", "position rms", "at the end"
    );
    for (name, reference, summary) in results.rows() {
        let _ = writeln!(t, "{name:<22}{}   {}", errors(reference), summary.map_or(String::new(), nis));
    }
    let pose = &best.final_pose;
    let deg = RAD_S_PER_DEG_S;
    let _ = write!(
        t,
        "\nat the end, {}: x {:.3} ± {:.3} m, y {:.3} ± {:.3} m, heading {:.2} ± {:.2}°",
        results.rows().first().map_or("", |r| r.0),
        pose.x_m.estimate,
        pose.x_m.std,
        pose.y_m.estimate,
        pose.y_m.std,
        pose.heading_rad.estimate / deg,
        pose.heading_rad.std / deg,
    );
    if results.with.is_some() {
        let error = &pose.gyro_error_rad_s;
        let _ = write!(t, ", gyro error {:.5} ± {:.5} °/s", error.estimate / deg, error.std / deg);
    }
    if !config.effects.is_empty() {
        let ids: Vec<_> = config.effects.iter().map(|e| e.id.as_str()).collect();
        let _ = write!(t, "\nin the filter's model: {}", ids.join(", "));
    }
    if let Some([left, right]) = &best.slip {
        let _ = write!(t, "\nslip: {}", slips(left, right));
    }
    if let Some(still) = &best.standstill {
        let _ = write!(t, "\nstood still in {} rows", still.rows);
        if results.with.is_some() {
            let [before, after] = [still.gyro_error_std_before_rad_s, still.gyro_error_std_after_rad_s];
            let _ = write!(t, ": gyro error known to {:.5} °/s before, {:.5} °/s after", before / deg, after / deg);
        }
    }
    match &results.zeroed {
        Some(z) => {
            let _ = write!(
                t,
                "\n{ZEROED}: {:.5} °/s, the gyro's mean over {:.1} s at rest, held",
                z.zero_rad_s / deg,
                z.rest_s
            );
        }
        None if results.gyro.is_some() => {
            t.push_str("\nthe drive does not begin with a second at rest: no gyro is zeroed there")
        }
        None => {}
    }
    let judged = &results.written().summary.consistency;
    if let Some(path) = &args.save_config {
        let _ = match judged.fit_for_use || args.accept {
            true => write!(t, "\nwrote {}: warm-up age {:.0} s", path.display(), best.warm_up_age_end_s),
            false => write!(t, "\n{} not written; --accept writes it all the same", path.display()),
        };
    }
    match &best.reference {
        None => t.push_str("\nno reference pose in the log: errors are not known"),
        Some(reference) => t.extend(reference.alignment.iter().map(aligned)),
    }
    if !config.is_signed() {
        let _ = write!(t, "\nnote: {} is unsigned (written by hand, or with effects added)", args.config.display());
    }
    for note in reading.iter().chain(&best.notes) {
        let _ = write!(t, "\nnote: {note}");
    }
    t + &unfit(args, judged)
}

/// Sensors that the filters used, in words.
fn sensors(results: &Results, summary: &Summary) -> String {
    let encoders = if results.encoders.is_some() { "encoders" } else { "speed" };
    match (summary.torques_used, results.gyro.is_some()) {
        (true, true) => format!("torques, gyro and {encoders}"),
        (true, false) => format!("torques and {encoders}"),
        (false, true) => format!("gyro and {encoders} (no torques)"),
        (false, false) => format!("{encoders} alone"),
    }
}

fn slips(left: &WheelSlip, right: &WheelSlip) -> String {
    let wheel = |s: &WheelSlip| {
        let share = |x: f64| 100.0 * x;
        format!("{:.2} % rms, {:.1} % at most, known to {:.2} %", share(s.rms), share(s.largest), share(s.std_rms))
    };
    format!("left {}; right {}", wheel(left), wheel(right))
}

fn aligned(a: &Alignment) -> String {
    format!(
        "\neach track is laid on the reference over the first {:.0} % of the way ({:.1} m, up to {:.1} s); the first one is \
         turned by {:.1}° for it and keeps {:.2} m rms there",
        100.0 * a.path_share,
        a.path_m,
        a.until_s,
        a.rotation_rad / RAD_S_PER_DEG_S,
        a.rms_m
    )
}

fn errors(reference: Option<&ReferenceErrors>) -> String {
    let angle = |x: Option<f64>| match x {
        Some(rad) => format!("{:>11.2} °", rad.abs() / RAD_S_PER_DEG_S),
        None => format!("{:>13}", "-"),
    };
    let length = |x: Option<f64>| x.map_or(format!("{:>13}", "-"), |m| format!("{m:>11.3} m"));
    let of = |value: fn(&ReferenceErrors) -> Option<f64>| reference.and_then(value);
    [
        angle(of(|r| r.heading_rms_rad)),
        angle(of(|r| r.heading_end_rad)),
        length(of(|r| Some(r.position_rms_m))),
        length(of(|r| Some(r.position_end_m))),
    ]
    .concat()
}

fn nis(summary: &Summary) -> String {
    let c = &summary.consistency;
    let [low, high] = c.nis_mean_bounds95;
    let failed: Vec<_> = [(c.nis_holds, "NIS outside"), (c.unbiased, "biased"), (c.white, "not white")]
        .iter()
        .filter(|(holds, _)| !holds)
        .map(|(_, word)| *word)
        .collect();
    let verdict = if failed.is_empty() { "consistent".into() } else { failed.join(", ") };
    format!("{:.3} ({low:.3} .. {high:.3}) {verdict}", c.nis_mean)
}
