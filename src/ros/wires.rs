//! The node's place in the network: its topics and how they are sent.

use super::messages::{Imu, JointState, Odometry, Temperature, TwistWithCovarianceStamped};
use super::options::{BIAS, Options};
use crate::error::{Error, ErrorKind, Result};
use ros2_client::qos::{History, WhenFull};
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, QosProfile, Subscription,
};
use serde::Serialize;
use std::fmt::Display;

/// Samples that may wait: half a second at 1 kHz.
const DEPTH: usize = 512;

/// An error of the network, in our words.
pub(super) fn network(what: impl Display) -> impl FnOnce(&dyn Display) -> Error {
    move |e| {
        Error::new(ErrorKind::Io, "DDS", format!("{what}: {e}"))
            .hint("check the network interfaces, the domain and that the topic's name is one of ROS 2")
    }
}

/// Reliable delivery of the last `depth` messages.
pub(super) fn reliable_qos(depth: usize) -> QosProfile {
    QosProfile::publisher_default().reliability_reliable(WhenFull::DEFAULT).history(History::KeepLast { depth })
}

fn sensor_qos() -> QosProfile {
    QosProfile::subscription_default().reliability_best_effort().history(History::KeepLast { depth: DEPTH })
}

/// The node's publishers and subscriptions.
pub(super) struct Wires {
    pub node: Node,
    pub imu: Subscription<Imu>,
    pub joints: Option<Subscription<JointState>>,
    pub odometry: Option<Subscription<Odometry>>,
    pub temperature: Option<Subscription<Temperature>>,
    pub out: Publisher<Imu>,
    pub bias: Publisher<TwistWithCovarianceStamped>,
}

impl Wires {
    /// Joins the domain, and subscribes and announces the topics of `options`.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for names that are none in ROS 2, [`ErrorKind::Io`] where the network refuses.
    pub(super) fn new(options: &Options) -> Result<Self> {
        let context = Context::with_options(ContextOptions::new().domain_id(options.domain))
            .map_err(|e| network("no participant")(&e))?;
        let name = NodeName::new(&options.namespace, &options.name).map_err(|e| {
            Error::new(ErrorKind::Usage, "--name", e).hint("letters, digits and _; the namespace begins with /")
        })?;
        let settings = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let mut node = context.new_node(name, settings).map_err(|e| network("no node")(&format!("{e:?}")))?;
        let topics = &options.topics;
        let imu = subscribe(options, &mut node, &topics.imu, ["sensor_msgs", "Imu"])?;
        let joints = optional(options, &mut node, topics.joints.as_ref(), ["sensor_msgs", "JointState"])?;
        let odometry = optional(options, &mut node, topics.odometry.as_ref(), ["nav_msgs", "Odometry"])?;
        let temperature = optional(options, &mut node, topics.temperature.as_ref(), ["sensor_msgs", "Temperature"])?;
        let out = publish(options, &mut node, &options.topics.out, ["sensor_msgs", "Imu"], &sensor_qos())?;
        let kind = ["geometry_msgs", "TwistWithCovarianceStamped"];
        let bias = publish(options, &mut node, BIAS, kind, &sensor_qos())?;
        Ok(Self { node, imu, joints, odometry, temperature, out, bias })
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

fn subscribe<M: 'static>(options: &Options, node: &mut Node, name: &str, kind: [&str; 2]) -> Result<Subscription<M>> {
    let topic = topic(options, node, name, kind, &sensor_qos())?;
    node.create_subscription(&topic, Some(sensor_qos())).map_err(|e| network(name)(&e))
}

fn optional<M: 'static>(
    options: &Options,
    node: &mut Node,
    name: Option<&String>,
    kind: [&str; 2],
) -> Result<Option<Subscription<M>>> {
    name.map(|name| subscribe(options, node, name, kind)).transpose()
}

/// A publisher of a topic of the node.
///
/// # Errors
/// As those of [`Wires::new`].
pub(super) fn publish<M: Serialize>(
    options: &Options,
    node: &mut Node,
    name: &str,
    kind: [&str; 2],
    qos: &QosProfile,
) -> Result<Publisher<M>> {
    let topic = topic(options, node, name, kind, qos)?;
    node.create_publisher(&topic, Some(qos.clone())).map_err(|e| network(name)(&e))
}
