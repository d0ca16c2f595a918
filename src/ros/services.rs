//! The services of the parameters, which `ros2 param` calls, and `/parameter_events`.

use super::options::Options;
use super::parameters;
use super::wires::{network, publish, reliable_qos};
use crate::error::Result;
use ros2_client::parameters::raw::{Parameter, ParameterEvent, SetParametersResult};
use ros2_client::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest, GetParameterTypesResponse,
    GetParametersRequest, GetParametersResponse, ListParametersRequest, ListParametersResponse,
    SetParametersAtomicallyResponse, SetParametersRequest, SetParametersResponse,
};
use ros2_client::{Message, Name, Node, Publisher, Server, ServiceMapping, ServiceTypeName, builtin_interfaces};

/// Most requests of one service that are answered in a turn.
const TURN: usize = 64;

/// Names ROS 2's way of putting requests on the wire.
const RMW: &str = "RMW_IMPLEMENTATION";

/// The servers.
pub(super) struct Services {
    node: String,
    get: Server<GetParametersRequest, GetParametersResponse>,
    types: Server<GetParameterTypesRequest, GetParameterTypesResponse>,
    list: Server<ListParametersRequest, ListParametersResponse>,
    set: Server<SetParametersRequest, SetParametersResponse>,
    set_atomically: Server<SetParametersRequest, SetParametersAtomicallyResponse>,
    describe: Server<DescribeParametersRequest, DescribeParametersResponse>,
    events: Publisher<ParameterEvent>,
}

/// How requests are put on the wire by the ROS 2 that the environment names: Cyclone's own way, or that of all others.
fn mapping() -> ServiceMapping {
    match std::env::var(RMW) {
        Ok(name) if name.contains("cyclonedds") => ServiceMapping::Cyclone,
        _ => ServiceMapping::Enhanced,
    }
}

/// Who keeps the parameters.
pub(super) trait Keeps {
    /// Options with the parameters as they are now.
    fn options(&self) -> &Options;

    /// Sets all of `wanted` or none.
    ///
    /// # Errors
    /// Why not, in words for who asked.
    fn set(&mut self, wanted: &[Parameter]) -> std::result::Result<(), String>;
}

impl Services {
    /// Offers the services as the node's own.
    ///
    /// # Errors
    /// [`ErrorKind::Io`](crate::ErrorKind::Io) where the network refuses.
    pub(super) fn new(options: &Options, node: &mut Node) -> Result<Self> {
        let kind = ["rcl_interfaces", "ParameterEvent"];
        Ok(Self {
            node: options.absolute("~/").trim_end_matches('/').to_string(),
            get: server(options, node, "get_parameters", "GetParameters")?,
            types: server(options, node, "get_parameter_types", "GetParameterTypes")?,
            list: server(options, node, "list_parameters", "ListParameters")?,
            set: server(options, node, "set_parameters", "SetParameters")?,
            set_atomically: server(options, node, "set_parameters_atomically", "SetParametersAtomically")?,
            describe: server(options, node, "describe_parameters", "DescribeParameters")?,
            events: publish(options, node, "/parameter_events", kind, &reliable_qos(1000))?,
        })
    }

    /// Answers what was asked since the last turn.
    pub(super) fn answer(&self, keeper: &mut impl Keeps) {
        answer(&self.list, |r| ListParametersResponse { result: parameters::list(keeper.options(), &r.prefixes) });
        answer(&self.get, |r| GetParametersResponse { values: parameters::get(keeper.options(), &r.names) });
        answer(&self.types, |r| {
            let values = parameters::get(keeper.options(), &r.names);
            GetParameterTypesResponse { values: values.iter().map(|v| v.ptype).collect() }
        });
        answer(&self.describe, |r| DescribeParametersResponse {
            values: parameters::describe(keeper.options(), &r.names),
        });
        answer(&self.set, |r| SetParametersResponse {
            results: r.parameter.iter().map(|one| self.set(keeper, std::slice::from_ref(one))).collect(),
        });
        answer(&self.set_atomically, |r| SetParametersAtomicallyResponse { result: self.set(keeper, &r.parameter) });
    }

    /// Sets all of `wanted` or none, and tells who listens.
    fn set(&self, keeper: &mut impl Keeps, wanted: &[Parameter]) -> SetParametersResult {
        let result = keeper.set(wanted);
        if result.is_ok() {
            let event = ParameterEvent {
                stamp: builtin_interfaces::Time::now(),
                node: self.node.clone(),
                new_parameters: Vec::new(),
                changed_parameters: wanted.to_vec(),
                deleted_parameters: Vec::new(),
            };
            // who does not listen misses it
            let _ = self.events.publish(event);
        }
        result.into()
    }
}

fn server<Q: Message + Clone + 'static, A: Message + 'static>(
    options: &Options,
    node: &mut Node,
    service: &str,
    kind: &str,
) -> Result<Server<Q, A>> {
    let full = options.absolute(&format!("~/{service}"));
    let name = Name::parse(&full).map_err(|e| network(&full)(&e))?;
    let kind = ServiceTypeName::new("rcl_interfaces", kind);
    node.create_server(mapping(), &name, &kind, reliable_qos(10), reliable_qos(10)).map_err(|e| network(&full)(&e))
}

/// Takes up requests and sends back what `give` makes of each. What is no request is left out: its sender waits in vain.
fn answer<Q: Message + 'static, A: Message + 'static>(server: &Server<Q, A>, mut give: impl FnMut(Q) -> A) {
    for _ in 0..TURN {
        match server.receive_request() {
            Ok(Some((id, request))) => {
                let _ = server.send_response(id, give(request));
            }
            Ok(None) => return,
            Err(_) => {}
        }
    }
}
