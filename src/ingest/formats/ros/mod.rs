//! Messages of ROS 1 and 2 as the rows of a table, whatever file holds them.

pub(crate) mod decode;
pub(crate) mod definition;
pub(crate) mod topic;
mod unsaid;

use super::fill::{Fill, Number, Ratio};
use super::head::Head;
use super::px4;
use super::scalar::Scalar;
use super::source::{ColumnFacts, Take};
use super::topics::Stamp;
use crate::error::Result;
use crate::ingest::columns::names::{Role, TimeKind};
use decode::{Cursor, Encoding, Short};
use definition::{Field, Generation, Primitive, plain};

/// Name of the column with the time of receipt.
const RECEIPT: &str = "receipt_time";

/// CDR may be padded to a multiple of four.
const PADDING: usize = 3;

/// One of the layouts that messages of a type may have.
#[derive(Debug, Clone)]
struct Version {
    fields: Vec<Field>,
    /// The message's column of each of its numbers; beyond the last one where the type has it no more.
    columns: Vec<usize>,
}

/// A message type that can be read.
#[derive(Debug, Clone)]
pub(crate) struct Message {
    /// Definition in the file, or the newest of those that are assumed.
    version: Version,
    /// Older definitions that are assumed.
    older: Vec<Version>,
    encoding: Encoding,
    /// Columns: the time of receipt, and the message's numbers.
    heads: Vec<Head>,
    ratios: Vec<Ratio>,
    /// Column of the stamp that counts, and its unit, ns.
    stamp: Option<(usize, i64)>,
    /// Whether the definition was not in the file: then the length has to agree.
    assumed: bool,
}

impl Message {
    /// Reads the definition; the error says why messages of this type cannot be read.
    pub(crate) fn new(type_name: &str, text: Option<&str>, encoding: Encoding) -> std::result::Result<Self, String> {
        let generation = if encoding == Encoding::Packed { Generation::One } else { Generation::Two };
        let name = plain(type_name);
        let known = if text.is_none() { unsaid::versions(&name) } else { Vec::new() };
        let (newest, before) = (known.first().copied().or(text), known.get(1..).unwrap_or_default());
        let fields = definition::parse(type_name, newest, generation)?;
        let mut heads: Vec<Head> = decode::leaves(&fields).into_iter().map(head).collect();
        let column = |name: &str| heads.iter().position(|h| h.name == name).unwrap_or(heads.len()) + 1;
        let older = before.iter().map(|text| {
            let fields = definition::parse(type_name, Some(text), generation)?;
            let columns = decode::leaves(&fields).iter().map(|(name, _)| column(name)).collect();
            Ok(Version { fields, columns })
        });
        let older = older.collect::<std::result::Result<Vec<_>, String>>()?;
        let version = Version { columns: (1..=heads.len()).collect(), fields };
        let (package, bare) = name.rsplit_once('/').unwrap_or(("", &name));
        let mut ratios = Vec::new();
        let stamped = |h: &Head| matches!(h.named().role, Role::Time(TimeKind::Sensor));
        if package == "px4_msgs" {
            ratios = px4::dress(&px4::topic_of(bare), &mut heads, false);
        } else {
            let own = heads.iter().position(|h| h.name == "header.stamp").or_else(|| heads.iter().position(stamped));
            for (i, head) in heads.iter_mut().enumerate() {
                // REP 103: what has no other unit is in SI
                let by_name = head.named();
                match by_name.role {
                    Role::Gyro(_) if by_name.unit.is_none() && head.unit.is_none() => head.unit = Some("rad/s".into()),
                    // times beside the stamp are something else's
                    Role::Time(_) | Role::TimePart { .. } if Some(i) != own => head.role = Some(Role::Other),
                    _ => {}
                }
            }
        }
        let stamp = heads.iter().position(stamped).map(|i| (i + 1, if package == "px4_msgs" { 1000 } else { 1 }));
        for ratio in &mut ratios {
            (ratio.column, ratio.by) = (ratio.column + 1, ratio.by + 1);
        }
        heads.insert(0, Head::number(RECEIPT, "time").with_unit("ns").with_role(Role::Time(TimeKind::Host)));
        Ok(Self { version, older, encoding, heads, ratios, stamp, assumed: text.is_none() })
    }

    /// The columns; by the time of receipt, a stamp in the message is no time.
    pub(crate) fn heads(&self, stamp: Stamp) -> Vec<Head> {
        let mut heads = self.heads.clone();
        if stamp == Stamp::Receipt {
            for head in heads.iter_mut().skip(1).filter(|h| matches!(h.named().role, Role::Time(_))) {
                head.role = Some(Role::Other);
            }
        }
        heads
    }

    /// The newest version that is as long as `message`; if none is, the oldest, whose parser reports the fault.
    fn version_of(&self, message: &[u8]) -> &Version {
        let fits = |v: &&Version| {
            let Ok(mut cursor) = Cursor::new(message, self.encoding) else { return false };
            cursor.walk(&v.fields, &mut |_| ()).is_ok() && cursor.left() <= PADDING
        };
        // of a type that the file defines there is nothing to choose
        let older = &self.older;
        if older.is_empty() || fits(&&self.version) {
            return &self.version;
        }
        older.iter().find(fits).unwrap_or(older.last().unwrap_or(&self.version))
    }

    /// Whether the message has a time of its own.
    pub(crate) fn has_stamp(&self) -> bool {
        self.stamp.is_some()
    }

    /// Reads a message, with the time of receipt.
    fn numbers(
        &self,
        message: &[u8],
        receipt_ns: i64,
        put: &mut dyn FnMut(usize, Number),
    ) -> std::result::Result<(), String> {
        let mut cursor = Cursor::new(message, self.encoding)?;
        put(0, Number::Whole(receipt_ns));
        let version = self.version_of(message);
        let mut columns = version.columns.iter();
        let walked = cursor.walk(&version.fields, &mut |number| {
            if let Some(column) = columns.next() {
                put(*column, number);
            }
        });
        let left = cursor.left();
        match walked {
            Err(Short) => Err(format!("{} bytes are fewer than its type has", message.len())),
            Ok(()) if self.assumed && left > PADDING => {
                Err(format!("{left} bytes are left over: it is of another version"))
            }
            Ok(()) => Ok(()),
        }
    }
}

fn head((name, primitive): (String, Primitive)) -> Head {
    let type_name = match primitive {
        Primitive::Bool => "bool",
        Primitive::Scalar(Scalar::I8) => "int8",
        Primitive::Scalar(Scalar::U8) => "uint8",
        Primitive::Scalar(Scalar::I16) => "int16",
        Primitive::Scalar(Scalar::U16) => "uint16",
        Primitive::Scalar(Scalar::I32) => "int32",
        Primitive::Scalar(Scalar::U32) => "uint32",
        Primitive::Scalar(Scalar::I64) => "int64",
        Primitive::Scalar(Scalar::U64) => "uint64",
        Primitive::Scalar(Scalar::F32) => "float32",
        Primitive::Scalar(Scalar::F64) => "float64",
        Primitive::Time => "time",
        Primitive::Duration => "duration",
    };
    let head = Head::number(name, type_name);
    if matches!(primitive, Primitive::Time | Primitive::Duration) { head.with_unit("ns") } else { head }
}

/// A table of messages in the making.
struct Rows<'a> {
    message: &'a Message,
    fill: Fill,
    stamp: Stamp,
    /// The first message waits for the second: one stamp may be zero, two are not set.
    held: Option<(Vec<u8>, i64)>,
    unset: bool,
    rows: u64,
    notes: Vec<String>,
}

/// Why a message did not become a row.
enum RowError {
    /// The message is damaged.
    Message(String),
    /// Whoever takes the rows does not want them.
    Taken(crate::Error),
}

impl<'a> Rows<'a> {
    pub(crate) fn new(message: &'a Message, wanted: &[bool], stamp: Stamp) -> Self {
        let fill = Fill::new(wanted).with_ratios(&message.ratios);
        Self { message, fill, stamp, held: None, unset: false, rows: 0, notes: Vec::new() }
    }

    /// Messages so far.
    pub(crate) fn count(&self) -> u64 {
        self.rows
    }

    /// Adds a message.
    pub(crate) fn add(&mut self, bytes: &[u8], receipt_ns: i64, take: Take<'_>) -> std::result::Result<(), RowError> {
        self.rows += 1;
        if self.rows == 1 && self.stamp == Stamp::Header && self.message.has_stamp() {
            // a damaged first message is told with its own number
            self.stamp_of(bytes)?;
            self.held = Some((bytes.to_vec(), receipt_ns));
            return Ok(());
        }
        if let Some((first, first_ns)) = self.held.take() {
            if self.stamp_of(&first)? == 0 && self.stamp_of(bytes)? == 0 {
                self.unset = true;
                self.notes.push("the stamps in the messages are zero: their times of receipt are used".to_string());
            }
            self.row(&first, first_ns, take)?;
        }
        self.row(bytes, receipt_ns, take)
    }

    fn stamp_of(&self, bytes: &[u8]) -> std::result::Result<i64, RowError> {
        let mut stamp = 0;
        let column = self.message.stamp.map(|s| s.0);
        self.message
            .numbers(bytes, 0, &mut |at, number| {
                if let (Number::Whole(x), true) = (number, Some(at) == column) {
                    stamp = x;
                }
            })
            .map_err(RowError::Message)?;
        Ok(stamp)
    }

    fn row(&mut self, bytes: &[u8], receipt_ns: i64, take: Take<'_>) -> std::result::Result<(), RowError> {
        let fill = &mut self.fill;
        self.message.numbers(bytes, receipt_ns, &mut |at, number| fill.put(at, number)).map_err(RowError::Message)?;
        if let (true, Some((column, unit_ns))) = (self.unset, self.message.stamp) {
            fill.put(column, Number::Whole(receipt_ns / unit_ns));
        }
        fill.end_row(take).map_err(RowError::Taken)
    }

    /// Hands over the last rows; with the notes.
    pub(crate) fn finish(mut self, take: Take<'_>) -> Result<(Vec<ColumnFacts>, Vec<String>)> {
        if let Some((first, first_ns)) = self.held.take()
            && let Err(RowError::Taken(e)) = self.row(&first, first_ns, take)
        {
            return Err(e);
        }
        Ok((self.fill.finish(take)?, self.notes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ingest::columns::names::Axis;
    use crate::ingest::formats::topics::has_gyro;

    fn imu(stamp_ns: i64, z: f64) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend(0u32.to_le_bytes());
        out.extend(((stamp_ns / 1_000_000_000) as u32).to_le_bytes());
        out.extend(((stamp_ns % 1_000_000_000) as u32).to_le_bytes());
        out.extend(1u32.to_le_bytes());
        out.push(b'i');
        for value in [[0.0; 13].as_slice(), &[0.1, 0.2, z], &[0.0; 21]].concat() {
            out.extend(f64::to_le_bytes(value));
        }
        out
    }

    fn table(message: &Message, stamp: Stamp, stamps_ns: &[i64]) -> (Vec<f64>, Vec<f64>, Vec<String>) {
        let heads = message.heads(stamp);
        let at = |name: &str| heads.iter().position(|h| h.name == name).unwrap();
        let (time, z) = (at("header.stamp"), at("angular_velocity.z"));
        let mut rows = Rows::new(message, &vec![true; heads.len()], stamp);
        let (mut times, mut rates) = (Vec::new(), Vec::new());
        let mut take = |b: crate::ingest::formats::source::Batch| {
            times.extend(b.columns[time].values.iter().map(|v| v + b.columns[time].origin as f64));
            rates.extend(b.columns[z].values.clone());
            Ok(())
        };
        for (i, stamp_ns) in stamps_ns.iter().enumerate() {
            assert!(rows.add(&imu(*stamp_ns, i as f64), 1000 + i as i64, &mut take).is_ok());
        }
        let (_, notes) = rows.finish(&mut take).unwrap();
        (times, rates, notes)
    }

    #[test]
    fn messages_of_px4_are_known_without_definitions_in_every_version() {
        let rates = [0.25f32, -0.5, 0.125];
        let head = |sampled: bool| {
            let mut out = vec![0, 1, 0, 0];
            (0..if sampled { 2 } else { 1 }).for_each(|_| out.extend(7_000_000u64.to_le_bytes()));
            out
        };
        let floats = |out: &mut Vec<u8>, values: [f32; 3]| values.iter().for_each(|v| out.extend(v.to_le_bytes()));
        let mut gyro = head(true);
        gyro.extend(9u32.to_le_bytes());
        floats(&mut gyro, rates);
        gyro.extend(31.5f32.to_le_bytes());
        gyro.extend([0; 8]);
        let combined = |flags: usize| {
            let mut out = head(false);
            floats(&mut out, rates);
            out.extend(5000u32.to_le_bytes());
            out.extend(0i32.to_le_bytes());
            floats(&mut out, [0.0, 0.0, -9.81]);
            out.extend(5000u32.to_le_bytes());
            out.extend(vec![0; flags]);
            out
        };
        let imu = |wide: bool, flags: usize| {
            let mut out = head(true);
            out.extend([1, 0, 0, 0, 2, 0, 0, 0]);
            floats(&mut out, rates.map(|v| v * 0.004));
            floats(&mut out, [0.0, 0.0, -9.81 * 0.004]);
            for _ in 0..2 {
                if wide { out.extend(4000u32.to_le_bytes()) } else { out.extend(4000u16.to_le_bytes()) }
            }
            out.extend(vec![0; flags]);
            out
        };
        let cases = [
            ("px4_msgs/msg/SensorGyro", vec![gyro]),
            ("px4_msgs/msg/SensorCombined", vec![combined(4), combined(1)]),
            ("px4_msgs/msg/VehicleImu", vec![imu(true, 4), imu(false, 4), imu(false, 2)]),
        ];
        for (type_name, messages) in cases {
            let message = Message::new(type_name, None, Encoding::Cdr).unwrap();
            let heads = message.heads(Stamp::Header);
            let z = heads.iter().position(|h| h.named().role == Role::Gyro(Some(Axis::Z))).unwrap();
            for bytes in messages {
                let mut rows = Rows::new(&message, &vec![true; heads.len()], Stamp::Header);
                let mut found = Vec::new();
                let mut take = |b: crate::ingest::formats::source::Batch| {
                    found.extend(b.columns[z].values.clone());
                    Ok(())
                };
                (0..2).for_each(|_| assert!(rows.add(&bytes, 0, &mut take).is_ok(), "{type_name} {}", bytes.len()));
                rows.finish(&mut take).unwrap();
                assert!(found.iter().all(|v| (v / 0.125 - 1.0).abs() < 1e-6), "{type_name} {}: {found:?}", bytes.len());
                // a length that no version has
                let mut rows = Rows::new(&message, &vec![true; heads.len()], Stamp::Header);
                for wrong in [bytes[..bytes.len() - 20].to_vec(), [&bytes[..], &[0; 12]].concat()] {
                    assert!(rows.add(&wrong, 0, &mut |_| Ok(())).is_err(), "{type_name} {}", wrong.len());
                }
            }
        }
    }

    #[test]
    fn an_imu_is_a_gyro_in_rad_per_s() {
        let message = Message::new("sensor_msgs/Imu", None, Encoding::Packed).unwrap();
        let heads = message.heads(Stamp::Header);
        assert!(has_gyro(&heads) && message.has_stamp());
        let z = heads.iter().find(|h| h.name == "angular_velocity.z").unwrap();
        assert_eq!((z.named().role, z.unit.as_deref()), (Role::Gyro(Some(Axis::Z)), Some("rad/s")));
        let receipt = message.heads(Stamp::Receipt);
        assert!(receipt.iter().all(|h| h.named().role != Role::Time(TimeKind::Sensor)));
        let odometry = Message::new("p/T", Some("Header header\nfloat64 yaw_setpoint"), Encoding::Packed).unwrap();
        assert!(!has_gyro(&odometry.heads(Stamp::Header)));
    }

    #[test]
    fn stamps_that_are_not_set_are_replaced_and_it_is_told() {
        let message = Message::new("sensor_msgs/Imu", None, Encoding::Packed).unwrap();
        let (times, rates, notes) = table(&message, Stamp::Header, &[0, 0, 0]);
        assert_eq!((times, rates), (vec![1000.0, 1001.0, 1002.0], vec![0.0, 1.0, 2.0]));
        assert!(notes[0].contains("zero"));
        // a simulation that begins at zero
        let (times, _, notes) = table(&message, Stamp::Header, &[0, 10, 20]);
        assert_eq!((times, notes.len()), (vec![0.0, 10.0, 20.0], 0));
        let (times, rates, _) = table(&message, Stamp::Header, &[7]);
        assert_eq!((times, rates), (vec![7.0], vec![0.0]));
    }

    #[test]
    fn messages_of_another_version_are_refused() {
        let message = Message::new("sensor_msgs/Imu", None, Encoding::Packed).unwrap();
        let mut rows = Rows::new(&message, &[true; 20], Stamp::Header);
        let mut long = imu(1, 1.0);
        long.extend([0; 8]);
        let Err(RowError::Message(why)) = rows.add(&long, 0, &mut |_| Ok(())) else { panic!("accepted") };
        assert!(why.contains("another version"), "{why}");
    }
}
