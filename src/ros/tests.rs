use super::messages::{Header, Imu, JointState, Odometry, Stamp, TwistWithCovarianceStamped};
use super::options::{Axis, Gyro, Options, Topics};
use super::parameters;
use super::wheels::{WheelJoints, WheelOdometry};
use crate::ingest::{GyroQuery, read_gyro};
use crate::report::mcap::Stream;
use crate::report::mcap::fixed::Text;
use ros2_client::parameters::raw::Parameter;
use ros2_client::parameters::{Parameter as Plain, ParameterValue};
use rustdds::no_key::{DefaultDecoder, SerializerAdapter};
use rustdds::{CDRDeserializerAdapter, CDRSerializerAdapter, RepresentationIdentifier};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// As Cyclone DDS 11.0.1 writes them, without the four bytes before them.
const IMU: &str = "0c0000002200000009000000696d755f6c696e6b0000000000000000000000000000000000000000000000000000000000000000000000\
    00000000000000f0bf00000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000\
    000000000000000000000000000000000000000000000000f03f0000000000000040000000000000084000000000000000000000000000\
    00000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000\
    00000000000000000000104000000000000014400000000000001840000000000000000000000000000000000000000000000000000000\
    000000000000000000000000000000000000000000000000000000000000000000000000000000000000001c40";
const JOINTS: &str = "0100000002000000010000000000000002000000050000006c6566740000000002000000720000000200000000000000000000000000e03f\
    000000000000f0bf02000000000000000000000000000000000000000000004000000000";

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|k| u8::from_str_radix(&hex[2 * k..2 * k + 2], 16).unwrap()).collect()
}

fn decode<M: DeserializeOwned + 'static>(cdr: &[u8]) -> Option<M> {
    use rustdds::no_key::{Decode, DeserializerAdapter};
    let decoder = <CDRDeserializerAdapter<M> as DefaultDecoder<M>>::DECODER;
    let decoded = decoder.decode_bytes(cdr, RepresentationIdentifier::CDR_LE).ok()?;
    Some(<CDRDeserializerAdapter<M> as DeserializerAdapter<M>>::transform_decoded(decoded))
}

fn encode<M: Serialize>(message: &M) -> Vec<u8> {
    <CDRSerializerAdapter<M> as SerializerAdapter<M>>::to_bytes(message).unwrap().to_vec()
}

fn imu(t_s: f64, rate_rad_s: f64) -> Imu {
    let stamp = Stamp { sec: t_s as i32, nanosec: (t_s.fract() * 1e9).round() as u32 };
    let header = Header { stamp, frame_id: Text::new("imu_link").unwrap() };
    Imu { header, angular_velocity: [0.0, 0.0, rate_rad_s], ..Imu::default() }
}

#[test]
fn messages_are_those_of_another_vendor() {
    let joints: JointState = decode(&bytes(JOINTS)).unwrap();
    assert_eq!(joints.header.stamp.ns(), 1_000_000_002);
    assert_eq!(joints.name.as_slice().iter().map(Text::as_str).collect::<Vec<_>>(), ["left", "r"]);
    assert_eq!((joints.position.as_slice(), joints.velocity.as_slice()), (&[0.5, -1.0][..], &[0.0, 2.0][..]));
    assert!(joints.effort.as_slice().is_empty());
    assert_eq!(encode(&joints), bytes(JOINTS));
    let twist = TwistWithCovarianceStamped {
        header: Header { frame_id: Text::new("a").unwrap(), ..Header::default() },
        linear: [0.0; 3],
        angular: [0.0; 3],
        covariance: ([0.0; 18], [1.0; 18]),
    };
    assert_eq!(encode(&twist).len(), 352);
    let found: Imu = decode(&bytes(IMU)).unwrap();
    assert_eq!((found.header.stamp.ns(), found.header.frame_id.as_str()), (12_000_000_034, "imu_link"));
    assert_eq!((found.angular_velocity, found.linear_acceleration), ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
    assert_eq!((found.orientation_covariance[0], found.linear_acceleration_covariance[8]), (-1.0, 7.0));
    assert_eq!(encode(&found), bytes(IMU));
    let message = imu(12.5, 0.25);
    let again: Imu = decode(&encode(&message)).unwrap();
    assert_eq!((again.header.stamp, again.angular_velocity), (message.header.stamp, message.angular_velocity));
    assert_eq!(again.header.frame_id.as_str(), "imu_link");
}

#[test]
fn what_is_cut_off_or_too_long_is_no_message() {
    let whole = encode(&imu(1.0, 0.1));
    assert!((0..whole.len()).all(|end| decode::<Imu>(&whole[..end]).is_none()));
    let mut long = whole.clone();
    // the length of frame_id
    long[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(decode::<Imu>(&long).is_none());
    let mut many = bytes(JOINTS);
    many[16..20].copy_from_slice(&65_u32.to_le_bytes());
    assert!(decode::<JointState>(&many).is_none());
}

#[test]
fn wheels_stand_by_their_positions_else_by_their_speeds() {
    let with = |position: &[f64], velocity: &[f64]| {
        let list = |values: &[f64]| {
            let mut cdr = (values.len() as u32).to_le_bytes().to_vec();
            cdr.extend(if values.is_empty() { vec![] } else { vec![0; 4] });
            values.iter().for_each(|v| cdr.extend(v.to_le_bytes()));
            decode(&cdr).unwrap()
        };
        let mut message: JointState = decode(&bytes(JOINTS)).unwrap();
        (message.position, message.velocity) = (list(position), list(velocity));
        message
    };
    let mut all = WheelJoints::new(&[]);
    assert_eq!(all.stand(&with(&[1.0, 2.0], &[0.1, 0.0])), None);
    assert_eq!(all.stand(&with(&[1.0, 2.0], &[0.1, 0.0])), Some(true));
    assert_eq!(all.stand(&with(&[1.0, 2.1], &[0.0, 0.0])), Some(false));
    assert_eq!(WheelJoints::new(&[]).stand(&with(&[], &[0.0, 0.0])), Some(true));
    assert_eq!(WheelJoints::new(&[]).stand(&with(&[], &[0.0, 0.2])), Some(false));
    assert_eq!(WheelJoints::new(&["left".into()]).stand(&with(&[], &[0.0, 0.2])), Some(true));
    assert_eq!(WheelJoints::new(&["wheel".into()]).stand(&with(&[], &[0.0, 0.2])), None);
}

#[test]
fn a_recording_is_a_log() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("live.mcap");
    let mut stream = Stream::without_index(std::fs::File::create(&path).unwrap()).unwrap();
    let topic = stream.topic("/imu/data_raw").unwrap();
    for k in 0..200 {
        let t = 100.0 + 0.005 * f64::from(k);
        stream.put(&topic, (t * 1e9) as u64, &imu(t, 0.001 * f64::from(k % 7))).unwrap();
    }
    stream.flush().unwrap();
    let rows = || read_gyro(&path, &GyroQuery::default()).unwrap().log.len();
    // as after a sudden end
    assert_eq!(rows(), 200);
    stream.finish().unwrap();
    assert_eq!(rows(), 200);
}

fn options(config: &Path) -> Options {
    Options {
        gyros: vec![Gyro { axis: Axis::Z, config: config.to_path_buf() }],
        topics: Topics {
            imu: "imu/data_raw".into(),
            joints: None,
            odometry: Some("/odom".into()),
            temperature: None,
            out: "imu/data".into(),
        },
        wheels: Vec::new(),
        name: "gyroid".into(),
        namespace: "/robot".into(),
        domain: 0,
        extrapolate: false,
        learn: true,
        since_power_on_s: 0.0,
        state: None,
        power_cut: false,
        record: None,
        duration: None,
    }
}

fn parameter(name: &str, value: ParameterValue) -> Parameter {
    Plain { name: name.into(), value }.into()
}

#[test]
fn parameters_change_all_or_none() {
    let options = options(Path::new("gyroid.toml"));
    let learn = || parameter("learn", ParameterValue::Boolean(false));
    let both = parameters::changed(&options, &[learn(), parameter("config", ParameterValue::String("b.toml".into()))]);
    let both = both.unwrap();
    assert!(!both.learn && both.gyros[0].config == Path::new("b.toml") && both.extrapolate == options.extrapolate);
    for (bad, why) in [
        (parameter("imu", ParameterValue::String("/x".into())), "start the node anew"),
        (parameter("extrapolate", ParameterValue::Integer(1)), "is a bool"),
        (parameter("config", ParameterValue::NotSet), "is a string"),
        (parameter("rate", ParameterValue::Integer(1)), "config, extrapolate, learn can be set"),
    ] {
        let refused = parameters::changed(&options, &[learn(), bad]).unwrap_err();
        assert!(refused.contains(why), "{refused}");
    }
    let names = parameters::list(&options, &[]).names;
    assert!(names.is_sorted() && parameters::list(&options, &["learn".into()]).names == ["learn"], "{names:?}");
    let found = parameters::get(&options, &["imu".into(), "odometry".into(), "joints".into(), "nothing".into()]);
    assert_eq!(
        found.iter().map(|v| v.string_value.as_str()).collect::<Vec<_>>(),
        ["/robot/imu/data_raw", "/odom", "", ""]
    );
    assert_eq!(found.iter().map(|v| v.ptype).collect::<Vec<_>>(), [4, 4, 4, 0]);
    let fixed = parameters::describe(&options, &names);
    assert_eq!(fixed.iter().filter(|d| !d.read_only).count(), 3);
}

#[test]
fn each_axis_has_its_configuration_and_its_state() {
    let mut options = options(Path::new("z.toml"));
    options.state = Some("/var/state.json".into());
    assert_eq!(options.state_file(Axis::Z), options.state);
    options.gyros.insert(0, Gyro { axis: Axis::X, config: "x.toml".into() });
    let states = [Axis::X, Axis::Z].map(|axis| options.state_file(axis).unwrap());
    assert_eq!(states, ["/var/state.x.json", "/var/state.z.json"].map(std::path::PathBuf::from));
    options.state = Some("state".into());
    assert_eq!(options.state_file(Axis::X).unwrap(), Path::new("state.x"));
    let names = parameters::list(&options, &[]).names;
    assert_eq!(names[..3], ["axis", "config_x", "config_z"]);
    let other = |name: &str| parameters::changed(&options, &[parameter(name, ParameterValue::String("b.toml".into()))]);
    let changed = other("config_z").unwrap();
    assert_eq!([0, 1].map(|k| changed.gyros[k].config.to_str().unwrap()), ["x.toml", "b.toml"]);
    assert!(other("config").unwrap_err().contains("there is no parameter config; config_x, config_z, extrapolate"));
}

#[test]
fn an_odometry_stands_where_neither_speed_nor_pose_changes() {
    let message = |x_m: f64, speed: f64| {
        let mut message = Odometry { linear: [speed, 0.0, 0.0], ..Odometry::default() };
        message.pose.position[0] = x_m;
        message
    };
    let mut odometry = WheelOdometry::default();
    let said = [(1.0, 0.0), (1.0, 0.0), (1.0, 0.1), (1.1, 0.0), (1.1, 0.0), (f64::NAN, 0.0)];
    let said = said.map(|(x_m, speed)| odometry.stand(&message(x_m, speed)));
    assert_eq!(said, [None, Some(true), Some(false), Some(false), Some(true), None]);
}
