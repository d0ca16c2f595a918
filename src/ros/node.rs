//! The node: its topics, and the loop that takes up samples and gives them on.

use super::keeper::{Correctors, Keeper, Reports};
use super::messages::{Imu, TwistWithCovarianceStamped};
use super::options::{self, Options, Signals, boot_id};
use super::recorder::{Recorder, Tape};
use super::report::{self, Counts, Report};
use super::services::Services;
use super::wheels::{WheelJoints, WheelOdometry};
use super::wires::{Wires, publish, reliable_qos};
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::live::{Corrected, Corrector, Saved, Settings, Start};
use ros2_client::Subscription;
use rustdds::mio1::{Events, Interest, Poll, Token};
use serde::de::DeserializeOwned;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Most messages that are taken up before the other topics have their turn.
const TURN: usize = 4096;

/// Shortest time between two messages on `~/bias`, s.
const BIAS_EVERY_S: f64 = 0.1;

/// Runs the node until a signal, or the time that was asked for, ends it. `say` is told what happens.
///
/// # Errors
/// Those of the configuration and of the state file; [`ErrorKind::Usage`] for names that are none in ROS 2; [`ErrorKind::Io`]
/// where the network refuses.
pub fn run(options: &Options, signals: &Signals, say: &mut (dyn FnMut(&str) + Send)) -> Result<()> {
    let gyros = options.gyros.iter().map(|gyro| Gyro::new(options, gyro)).collect::<Result<Vec<_>>>()?;
    let configs = gyros.iter().map(|gyro| gyro.config.clone()).collect();
    let mut wires = Wires::new(options)?;
    let services = Services::new(options, &mut wires.node)?;
    let diagnostics =
        publish(options, &mut wires.node, "/diagnostics", ["diagnostic_msgs", "DiagnosticArray"], &reliable_qos(10))?;
    say(&format!(
        "{} corrects {} about {} and publishes {}",
        wires.node.fully_qualified_name(),
        options.absolute(&options.topics.imu),
        options.axes().join(", "),
        options.absolute(&options.topics.out)
    ));
    let recording = options.record.as_deref().map(|path| Recorder::new(path, options)).transpose()?;
    let (recorder, tape) = recording.unzip();
    std::thread::scope(|scope| {
        let recorded = recorder.map(|recorder| scope.spawn(move || recorder.run()));
        let (keeper, reports, correctors) = Keeper::new((options, configs), signals, diagnostics, say);
        let kept = scope.spawn(move || keeper.run(&services));
        let mut live = Loop::new(options, gyros, (reports, correctors, tape));
        let ran = live.run(&mut wires, signals);
        // the keeper ends when nobody reports any more
        drop(live);
        signals.stop.store(true, Ordering::Relaxed);
        let kept = joined(kept.join());
        let recorded = recorded.map_or(Ok(()), |thread| joined(thread.join()));
        ran.and(kept).and(recorded)
    })
}

/// Outcome of a thread.
fn joined(ended: std::thread::Result<Result<()>>) -> Result<()> {
    ended.unwrap_or_else(|_| {
        Err(Error::new(ErrorKind::Numeric, "a thread", "ended before its time").hint("report it as a fault of gyroid"))
    })
}

/// A gyro, and its corrector from the first message on.
struct Gyro {
    /// Element of a vector.
    axis: usize,
    config: Config,
    saved: Option<Saved>,
    now: Option<report::Gyro>,
}

impl Gyro {
    fn new(options: &Options, gyro: &options::Gyro) -> Result<Self> {
        let saved = options.state_file(gyro.axis).as_deref().map(Saved::read).transpose()?.flatten();
        Ok(Self { axis: gyro.axis as usize, config: Config::read(&gyro.config)?, saved, now: None })
    }

    /// Corrects the message's rate about this axis; `None` before there is a corrector.
    fn correct(&mut self, message: &mut Imu, now_s: f64) -> Option<Corrected> {
        let (gyro, axis) = (self.now.as_mut()?, self.axis);
        let got = gyro.corrector.sample(message.header.stamp.ns(), now_s, message.angular_velocity[axis]);
        gyro.last = Some(got);
        message.angular_velocity[axis] = got.rate_rad_s;
        let covariance = &mut message.angular_velocity_covariance;
        (0..3).filter(|other| *other != axis).for_each(|other| {
            covariance[3 * axis + other] = 0.0;
            covariance[3 * other + axis] = 0.0;
        });
        covariance[4 * axis] = got.rate_variance_rad2_s2;
        Some(got)
    }

    /// Axis, bias, rad/s, and its variance, (rad/s)².
    fn bias(&self) -> Option<(usize, f64, f64)> {
        let got = self.now.as_ref()?.last?;
        Some((self.axis, got.bias_rad_s, got.bias_std_rad_s * got.bias_std_rad_s))
    }
}

/// The loop's state.
struct Loop<'a> {
    options: &'a Options,
    settings: Settings,
    gyros: Vec<Gyro>,
    boot_id: String,
    begun: Instant,
    wheels: WheelJoints,
    odometry: WheelOdometry,
    counts: Counts,
    reports: Reports,
    correctors: Correctors,
    tape: Option<Tape>,
    reported_s: f64,
    bias_s: f64,
}

impl<'a> Loop<'a> {
    fn new(
        options: &'a Options,
        gyros: Vec<Gyro>,
        (reports, correctors, tape): (Reports, Correctors, Option<Tape>),
    ) -> Self {
        Self {
            options,
            settings: options.settings(),
            gyros,
            boot_id: if options.power_cut { String::new() } else { boot_id() },
            begun: Instant::now(),
            wheels: WheelJoints::new(&options.wheels),
            odometry: WheelOdometry::default(),
            counts: Counts::default(),
            reports,
            correctors,
            tape,
            reported_s: 0.0,
            bias_s: f64::NEG_INFINITY,
        }
    }

    fn now_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    fn run(&mut self, wires: &mut Wires, signals: &Signals) -> Result<()> {
        let failed = |e: std::io::Error| Error::new(ErrorKind::Io, "DDS", e).hint("start it again");
        let mut poll = Poll::new().map_err(failed)?;
        let register = |poll: &mut Poll, source: &mut dyn rustdds::mio1::event::Source, token: usize| {
            poll.registry().register(source, Token(token), Interest::READABLE).map_err(failed)
        };
        register(&mut poll, &mut wires.imu, 0)?;
        if let Some(joints) = &mut wires.joints {
            register(&mut poll, joints, 1)?;
        }
        if let Some(temperature) = &mut wires.temperature {
            register(&mut poll, temperature, 2)?;
        }
        if let Some(odometry) = &mut wires.odometry {
            register(&mut poll, odometry, 3)?;
        }
        let mut events = Events::with_capacity(8);
        while !signals.stop.load(Ordering::Relaxed) {
            match poll.poll(&mut events, Some(Duration::from_millis(100))) {
                Err(e) if e.kind() != std::io::ErrorKind::Interrupted => return Err(failed(e)),
                _ => {}
            }
            // notifications are edges: whatever woke it, every topic is looked at
            while self.turn(wires)? {}
            self.report();
            if self.options.duration.is_some_and(|d| self.begun.elapsed() >= d) {
                break;
            }
        }
        Ok(())
    }

    /// Takes up what has arrived; whether more may be there.
    fn turn(&mut self, wires: &Wires) -> Result<bool> {
        if let Some(joints) = &wires.joints {
            drain(joints, &mut self.counts.malformed, |message| {
                heed(&mut self.gyros, self.wheels.stand(&message), self.begun);
                if let Some(tape) = &mut self.tape {
                    tape.joints(message);
                }
                Ok(())
            })?;
        }
        if let Some(odometry) = &wires.odometry {
            drain(odometry, &mut self.counts.malformed, |message| {
                heed(&mut self.gyros, self.odometry.stand(&message), self.begun);
                if let Some(tape) = &mut self.tape {
                    tape.odometry(message);
                }
                Ok(())
            })?;
        }
        if let Some(temperature) = &wires.temperature {
            drain(temperature, &mut self.counts.malformed, |message| {
                let now_s = self.begun.elapsed().as_secs_f64();
                for gyro in self.gyros.iter_mut().filter_map(|gyro| gyro.now.as_mut()) {
                    gyro.corrector.temperature(message.temperature, now_s);
                }
                if let Some(tape) = &mut self.tape {
                    tape.temperature(message);
                }
                Ok(())
            })?;
        }
        let mut malformed = 0;
        let taken = drain(&wires.imu, &mut malformed, |message| self.imu(message, wires))?;
        self.counts.malformed += malformed;
        Ok(taken == TURN)
    }

    fn imu(&mut self, mut message: Imu, wires: &Wires) -> Result<()> {
        let now_s = self.now_s();
        if self.gyros.iter().any(|gyro| gyro.now.is_none()) {
            self.begin(message.header.stamp.ns(), now_s)?;
        }
        while let Ok((k, renewed)) = self.correctors.try_recv() {
            let before = self.gyros[k].now.take();
            let corrector = renewed.in_place_of(before.as_ref().map(|b| &b.corrector));
            self.gyros[k].now = Some(report::Gyro { corrector, last: before.and_then(|b| b.last) });
        }
        if let Some(tape) = &mut self.tape {
            tape.raw(message);
        }
        let covariance = &mut message.angular_velocity_covariance;
        // REP 145: -1 in the first element says that the quantity itself is missing, and zeros that its covariance is not known
        if covariance[0] < 0.0 {
            *covariance = [0.0; 9];
        }
        if message.orientation == [0.0; 4] {
            message.orientation_covariance[0] = -1.0;
        }
        self.counts.samples += 1;
        for (k, gyro) in self.gyros.iter_mut().enumerate() {
            if let Some(got) = gyro.correct(&mut message, now_s) {
                self.counts.add(&got, k == 0);
            }
        }
        if wires.out.publish(message).is_err() {
            self.counts.unsent += 1;
        }
        if let Some(tape) = &mut self.tape {
            tape.corrected(message);
            self.counts.unrecorded = tape.lost;
        }
        if now_s - self.bias_s >= BIAS_EVERY_S {
            self.bias_s = now_s;
            let known = self.gyros.iter().filter_map(Gyro::bias);
            let bias = TwistWithCovarianceStamped::of_gyro(message.header, known);
            if let Some(tape) = &mut self.tape {
                tape.bias(bias);
            }
            if wires.bias.publish(bias).is_err() {
                self.counts.unsent += 1;
            }
        }
        Ok(())
    }

    fn begin(&mut self, stamp_ns: i64, arrival_s: f64) -> Result<()> {
        let mut notes: Vec<String> = Vec::new();
        for gyro in &mut self.gyros {
            let start = Start {
                stamp_ns,
                arrival_s,
                since_power_on_s: self.options.since_power_on_s,
                saved: gyro.saved.as_ref(),
                boot_id: &self.boot_id,
            };
            let (corrector, said) = Corrector::new(&gyro.config, self.settings, &start)?;
            gyro.now = Some(report::Gyro { corrector, last: None });
            // the axes share their clock, and so most of what is to be said
            notes.extend(said.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
        }
        let _ = self.reports.send(Report { notes, ..self.snapshot() });
        Ok(())
    }

    fn snapshot(&self) -> Report {
        Report {
            gyros: std::array::from_fn(|k| self.gyros.get(k).and_then(|gyro| gyro.now.clone())),
            counts: self.counts,
            now_s: self.now_s(),
            notes: Vec::new(),
        }
    }

    /// Once a second, and where the keeper is busy not at all.
    fn report(&mut self) {
        let now_s = self.now_s();
        if now_s - self.reported_s >= 1.0 {
            self.reported_s = now_s;
            let _ = self.reports.try_send(self.snapshot());
        }
    }
}

impl Drop for Loop<'_> {
    /// The last report has the state that a restart begins with.
    fn drop(&mut self) {
        let _ = self.reports.send(self.snapshot());
    }
}

/// Tells the correctors whether the wheels stand, where a message says so.
fn heed(gyros: &mut [Gyro], still: Option<bool>, begun: Instant) {
    let Some(still) = still else { return };
    for gyro in gyros.iter_mut().filter_map(|gyro| gyro.now.as_mut()) {
        gyro.corrector.wheels(still, begun.elapsed().as_secs_f64());
    }
}

/// Takes up to a turn of messages and gives each to `take`; how many there were.
fn drain<M: DeserializeOwned + 'static>(
    subscription: &Subscription<M>,
    malformed: &mut u64,
    mut take: impl FnMut(M) -> Result<()>,
) -> Result<usize> {
    for taken in 0..TURN {
        match subscription.take() {
            Ok(Some((message, _))) => take(message)?,
            Ok(None) => return Ok(taken),
            Err(_) => *malformed += 1,
        }
    }
    Ok(TURN)
}
