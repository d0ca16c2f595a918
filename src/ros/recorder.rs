//! The third thread, where a recording was asked for: what arrived and what was published, to MCAP.

use super::mcap::{Channel, Writer};
use super::messages::{Imu, JointState, Temperature, TwistWithCovarianceStamped};
use super::options::{BIAS, Options};
use crate::error::{Error, ErrorKind, Result};
use rustdds::CDRSerializerAdapter;
use rustdds::no_key::SerializerAdapter;
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Messages that may wait for the disk: two seconds at 1 kHz.
const WAITING: usize = 4096;
/// Joint states are larger and fewer.
const JOINTS_WAITING: usize = 256;

/// How often the file is handed to the system: a sudden end loses so much.
const FLUSH: Duration = Duration::from_secs(1);

const HEADER: &str = "================================================================================\n\
    MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\n\
    MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const VECTOR: &str = "================================================================================\n\
    MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const IMU: &str = "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
    geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
    geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n\
    ================================================================================\n\
    MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
const JOINT_STATE: &str =
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n";
const TEMPERATURE: &str = "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n";
const TWIST: &str = "std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist\n\
    ================================================================================\n\
    MSG: geometry_msgs/TwistWithCovariance\ngeometry_msgs/Twist twist\nfloat64[36] covariance\n\
    ================================================================================\n\
    MSG: geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n";

/// A message with the time of its receipt, ns since the epoch; its kind is its channel's place.
#[derive(Clone, Copy)]
enum Record {
    Raw(Imu),
    Corrected(Imu),
    Bias(TwistWithCovarianceStamped),
    Temperature(Temperature),
}

/// The loop's end: gives messages on, and counts those that the disk is too slow for.
pub(super) struct Tape {
    records: SyncSender<(u64, Record)>,
    joints: SyncSender<(u64, JointState)>,
    pub lost: u64,
}

impl Tape {
    pub(super) fn raw(&mut self, message: Imu) {
        self.put(Record::Raw(message));
    }

    pub(super) fn corrected(&mut self, message: Imu) {
        self.put(Record::Corrected(message));
    }

    pub(super) fn bias(&mut self, message: TwistWithCovarianceStamped) {
        self.put(Record::Bias(message));
    }

    pub(super) fn temperature(&mut self, message: Temperature) {
        self.put(Record::Temperature(message));
    }

    pub(super) fn joints(&mut self, message: JointState) {
        self.lost += u64::from(self.joints.try_send((now_ns(), message)).is_err());
    }

    fn put(&mut self, record: Record) {
        self.lost += u64::from(self.records.try_send((now_ns(), record)).is_err());
    }
}

fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// Writes the file.
pub(super) struct Recorder<'a> {
    path: &'a Path,
    writer: Writer<BufWriter<File>>,
    records: Receiver<(u64, Record)>,
    joints: Receiver<(u64, JointState)>,
}

impl<'a> Recorder<'a> {
    /// Begins `path`, which must not be there yet; and the loop's end.
    ///
    /// # Errors
    /// [`ErrorKind::Exists`] where there is such a file, [`ErrorKind::Io`] where none can be made.
    pub(super) fn new(path: &'a Path, options: &Options) -> Result<(Self, Tape)> {
        let file = File::options().write(true).create_new(true).open(path).map_err(|e| match e.kind() {
            io::ErrorKind::AlreadyExists => Error::new(ErrorKind::Exists, path.display(), "is there already")
                .at("--record")
                .hint("name another file: a recording replaces none"),
            _ => Error::io(path, &e),
        })?;
        let topics = &options.topics;
        let imu = [IMU, VECTOR, HEADER].concat();
        let [joint_state, temperature] = [JOINT_STATE, TEMPERATURE].map(|own| [own, HEADER].concat());
        let twist = [TWIST, VECTOR, HEADER].concat();
        let names = [
            topics.imu.as_str(),
            &topics.out,
            BIAS,
            topics.temperature.as_deref().unwrap_or("temperature"),
            topics.joints.as_deref().unwrap_or("joint_states"),
        ];
        let names = names.map(|topic| options.absolute(topic));
        let kinds = [
            ("sensor_msgs/msg/Imu", &imu),
            ("sensor_msgs/msg/Imu", &imu),
            ("geometry_msgs/msg/TwistWithCovarianceStamped", &twist),
            ("sensor_msgs/msg/Temperature", &temperature),
            ("sensor_msgs/msg/JointState", &joint_state),
        ];
        let channels: Vec<Channel<'_>> =
            names.iter().zip(kinds).map(|(topic, (kind, definition))| Channel { topic, kind, definition }).collect();
        let writer = Writer::new(BufWriter::new(file), &channels).map_err(|e| Error::io(path, &e))?;
        let (record, records) = sync_channel(WAITING);
        let (joint, joints) = sync_channel(JOINTS_WAITING);
        Ok((Self { path, writer, records, joints }, Tape { records: record, joints: joint, lost: 0 }))
    }

    /// Until nobody gives messages any more.
    pub(super) fn run(mut self) -> Result<()> {
        let path = self.path;
        self.write().and_then(|()| self.writer.finish()).map_err(|e| Error::io(path, &e))
    }

    fn write(&mut self) -> io::Result<()> {
        let mut flushed = std::time::Instant::now();
        loop {
            let next = self.records.recv_timeout(FLUSH);
            while let Ok((ns, message)) = self.joints.try_recv() {
                self.put(4, ns, &message)?;
            }
            match next {
                Ok((ns, Record::Raw(message))) => self.put(0, ns, &message)?,
                Ok((ns, Record::Corrected(message))) => self.put(1, ns, &message)?,
                Ok((ns, Record::Bias(message))) => self.put(2, ns, &message)?,
                Ok((ns, Record::Temperature(message))) => self.put(3, ns, &message)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            if flushed.elapsed() >= FLUSH {
                flushed = std::time::Instant::now();
                self.writer.flush()?;
            }
        }
    }

    fn put<M: Serialize>(&mut self, place: u16, ns: u64, message: &M) -> io::Result<()> {
        let cdr = <CDRSerializerAdapter<M> as SerializerAdapter<M>>::to_bytes(message)
            .map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e.to_string()))?;
        self.writer.message(place, ns, &cdr)
    }
}
