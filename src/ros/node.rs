//! The node: its topics, and the loop that takes up samples and gives them on.

use super::keeper::Keeper;
use super::messages::{Imu, JointState, Temperature, TwistWithCovarianceStamped};
use super::options::{BIAS, Options, Signals, boot_id};
use super::recorder::{Recorder, Tape};
use super::report::{Counts, Report};
use super::wheels::WheelJoints;
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::live::{Corrected, Corrector, Saved, Settings, Start};
use ros2_client::qos::{History, WhenFull};
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, QosProfile, Subscription,
};
use rustdds::mio1::{Events, Interest, Poll, Token};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Display;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Samples that may wait: half a second at 1 kHz.
const DEPTH: usize = 512;

/// Most messages that are taken up before the other topics have their turn.
const TURN: usize = 4096;

/// Shortest time between two messages on `~/bias`, s.
const BIAS_EVERY_S: f64 = 0.1;

/// An error of the network, in our words.
fn network(what: impl Display) -> impl FnOnce(&dyn Display) -> Error {
    move |e| {
        Error::new(ErrorKind::Io, "DDS", format!("{what}: {e}"))
            .hint("check the network interfaces, the domain and that the topic's name is one of ROS 2")
    }
}

fn sensor_qos() -> QosProfile {
    QosProfile::subscription_default().reliability_best_effort().history(History::KeepLast { depth: DEPTH })
}

/// The node's publishers and subscriptions.
struct Wires {
    node: Node,
    imu: Subscription<Imu>,
    joints: Option<Subscription<JointState>>,
    temperature: Option<Subscription<Temperature>>,
    out: Publisher<Imu>,
    bias: Publisher<TwistWithCovarianceStamped>,
}

impl Wires {
    fn new(options: &Options) -> Result<Self> {
        let context = Context::with_options(ContextOptions::new().domain_id(options.domain))
            .map_err(|e| network("no participant")(&e))?;
        let name = NodeName::new(&options.namespace, &options.name).map_err(|e| {
            Error::new(ErrorKind::Usage, "--name", e).hint("letters, digits and _; the namespace begins with /")
        })?;
        let settings = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let mut node = context.new_node(name, settings).map_err(|e| network("no node")(&format!("{e:?}")))?;
        let imu = subscribe(options, &mut node, &options.topics.imu, "Imu")?;
        let joints = options.topics.joints.as_ref();
        let joints = joints.map(|topic| subscribe(options, &mut node, topic, "JointState")).transpose()?;
        let temperature = options.topics.temperature.as_ref();
        let temperature = temperature.map(|topic| subscribe(options, &mut node, topic, "Temperature")).transpose()?;
        let out = publish(options, &mut node, &options.topics.out, ["sensor_msgs", "Imu"], &sensor_qos())?;
        let kind = ["geometry_msgs", "TwistWithCovarianceStamped"];
        let bias = publish(options, &mut node, BIAS, kind, &sensor_qos())?;
        Ok(Self { node, imu, joints, temperature, out, bias })
    }
}

fn topic(options: &Options, node: &Node, topic: &str, kind: [&str; 2], qos: &QosProfile) -> Result<rustdds::Topic> {
    // ros2-client joins the root namespace to a relative name by two slashes
    let full = options.absolute(topic);
    let name = Name::parse(&full).map_err(|e| {
        Error::new(ErrorKind::Usage, topic, format!("is no name of a topic: {e}"))
            .hint("letters, digits, _ and /, as in imu/data_raw")
    })?;
    node.create_topic(&name, MessageTypeName::new(kind[0], kind[1]), qos).map_err(|e| network(full)(&e))
}

fn subscribe<M: 'static>(options: &Options, node: &mut Node, name: &str, kind: &str) -> Result<Subscription<M>> {
    let topic = topic(options, node, name, ["sensor_msgs", kind], &sensor_qos())?;
    node.create_subscription(&topic, Some(sensor_qos())).map_err(|e| network(name)(&e))
}

fn publish<M: Serialize>(
    options: &Options,
    node: &mut Node,
    name: &str,
    kind: [&str; 2],
    qos: &QosProfile,
) -> Result<Publisher<M>> {
    let topic = topic(options, node, name, kind, qos)?;
    node.create_publisher(&topic, Some(qos.clone())).map_err(|e| network(name)(&e))
}

/// Runs the node until a signal, or the time that was asked for, ends it. `say` is told what happens.
///
/// # Errors
/// Those of the configuration and of the state file; [`ErrorKind::Usage`] for names that are none in ROS 2; [`ErrorKind::Io`]
/// where the network refuses.
pub fn run(options: &Options, signals: &Signals, say: &mut (dyn FnMut(&str) + Send)) -> Result<()> {
    let config = Config::read(&options.config)?;
    let saved = options.state.as_deref().map(Saved::read).transpose()?.flatten();
    let mut wires = Wires::new(options)?;
    let reliable = QosProfile::publisher_default()
        .reliability_reliable(WhenFull::DEFAULT)
        .history(History::KeepLast { depth: 10 });
    let diagnostics =
        publish(options, &mut wires.node, "/diagnostics", ["diagnostic_msgs", "DiagnosticArray"], &reliable)?;
    say(&format!(
        "{} corrects {} about {:?} and publishes {}",
        wires.node.fully_qualified_name(),
        options.absolute(&options.topics.imu),
        options.axis,
        options.absolute(&options.topics.out)
    ));
    let recording = options.record.as_deref().map(|path| Recorder::new(path, options)).transpose()?;
    let (recorder, tape) = recording.unzip();
    std::thread::scope(|scope| {
        let recorded = recorder.map(|recorder| scope.spawn(move || recorder.run()));
        let (keeper, reports, correctors) = Keeper::new(options, signals, diagnostics, say);
        let kept = scope.spawn(move || keeper.run());
        let mut live = Loop::new(options, config, saved, (reports, correctors, tape));
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

type Reports = std::sync::mpsc::SyncSender<Report>;
type Correctors = std::sync::mpsc::Receiver<Box<Corrector>>;

/// The loop's state.
struct Loop<'a> {
    options: &'a Options,
    settings: Settings,
    config: Config,
    saved: Option<Saved>,
    boot_id: String,
    begun: Instant,
    corrector: Option<Corrector>,
    wheels: WheelJoints,
    counts: Counts,
    reports: Reports,
    correctors: Correctors,
    tape: Option<Tape>,
    last: Option<Corrected>,
    reported_s: f64,
    bias_s: f64,
}

impl<'a> Loop<'a> {
    fn new(
        options: &'a Options,
        config: Config,
        saved: Option<Saved>,
        (reports, correctors, tape): (Reports, Correctors, Option<Tape>),
    ) -> Self {
        Self {
            options,
            settings: options.settings(),
            config,
            saved,
            boot_id: if options.power_cut { String::new() } else { boot_id() },
            begun: Instant::now(),
            corrector: None,
            wheels: WheelJoints::new(&options.wheels),
            counts: Counts::default(),
            reports,
            correctors,
            tape,
            last: None,
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
                let now_s = self.begun.elapsed().as_secs_f64();
                if let (Some(still), Some(corrector)) = (self.wheels.stand(&message), &mut self.corrector) {
                    corrector.wheels(still, now_s);
                }
                if let Some(tape) = &mut self.tape {
                    tape.joints(message);
                }
                Ok(())
            })?;
        }
        if let Some(temperature) = &wires.temperature {
            drain(temperature, &mut self.counts.malformed, |message| {
                let now_s = self.begun.elapsed().as_secs_f64();
                if let Some(corrector) = &mut self.corrector {
                    corrector.temperature(message.temperature, now_s);
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
        let (now_s, stamp_ns) = (self.now_s(), message.header.stamp.ns());
        if self.corrector.is_none() {
            self.begin(stamp_ns, now_s)?;
        }
        if let Ok(renewed) = self.correctors.try_recv() {
            self.corrector = Some(renewed.in_place_of(self.corrector.as_ref()));
        }
        let Some(corrector) = &mut self.corrector else { return Ok(()) };
        let axis = self.options.axis as usize;
        if let Some(tape) = &mut self.tape {
            tape.raw(message);
        }
        let got = corrector.sample(stamp_ns, now_s, message.angular_velocity[axis]);
        message.angular_velocity[axis] = got.rate_rad_s;
        let covariance = &mut message.angular_velocity_covariance;
        // REP 145: -1 in the first element says that the quantity itself is missing, and zeros that its covariance is not known
        if covariance[0] < 0.0 {
            *covariance = [0.0; 9];
        }
        if message.orientation == [0.0; 4] {
            message.orientation_covariance[0] = -1.0;
        }
        (0..3).filter(|other| *other != axis).for_each(|other| {
            covariance[3 * axis + other] = 0.0;
            covariance[3 * other + axis] = 0.0;
        });
        covariance[4 * axis] = got.rate_variance_rad2_s2;
        self.counts.add(&got);
        self.last = Some(got);
        if wires.out.publish(message).is_err() {
            self.counts.unsent += 1;
        }
        if let Some(tape) = &mut self.tape {
            tape.corrected(message);
            self.counts.unrecorded = tape.lost;
        }
        if now_s - self.bias_s >= BIAS_EVERY_S {
            self.bias_s = now_s;
            let bias = bias_message(&message, axis, &got);
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
        let start = Start {
            stamp_ns,
            arrival_s,
            since_power_on_s: self.options.since_power_on_s,
            saved: self.saved.as_ref(),
            boot_id: &self.boot_id,
        };
        let (corrector, notes) = Corrector::new(&self.config, self.settings, &start)?;
        self.corrector = Some(corrector);
        let _ = self.reports.send(Report { notes, ..self.snapshot() });
        Ok(())
    }

    fn snapshot(&self) -> Report {
        Report {
            corrector: self.corrector.clone(),
            last: self.last,
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

fn bias_message(message: &Imu, axis: usize, got: &Corrected) -> TwistWithCovarianceStamped {
    TwistWithCovarianceStamped::of_gyro(message.header, axis, got.bias_rad_s, got.bias_std_rad_s * got.bias_std_rad_s)
}
