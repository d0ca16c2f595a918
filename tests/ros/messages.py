"""ROS 2 messages as Cyclone DDS has them on the wire, and the network in which the check runs."""

import os
from dataclasses import dataclass, field
from types import new_class

from cyclonedds.core import Policy, Qos
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl.types import array, float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.util import duration

DDS = """<CycloneDDS><Domain Id="any"><General><Interfaces>
<NetworkInterface name="lo" multicast="false"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
os.environ.setdefault("CYCLONEDDS_URI", DDS)

Array3, Array4, Array9, Array36 = (array[float64, n] for n in (3, 4, 9, 36))


@dataclass
@annotations.final
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
@annotations.final
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
@annotations.final
class Imu(IdlStruct, typename="sensor_msgs.msg.dds_.Imu_"):
    header: Header
    orientation: Array4
    orientation_covariance: Array9
    angular_velocity: Array3
    angular_velocity_covariance: Array9
    linear_acceleration: Array3
    linear_acceleration_covariance: Array9


@dataclass
@annotations.final
class JointState(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
@annotations.final
class TwistWithCovarianceStamped(IdlStruct, typename="geometry_msgs.msg.dds_.TwistWithCovarianceStamped_"):
    header: Header
    linear: Array3
    angular: Array3
    covariance: Array36


@dataclass
@annotations.final
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    key: str
    value: str


@dataclass
@annotations.final
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
@annotations.final
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
@annotations.final
class Odometry(IdlStruct, typename="nav_msgs.msg.dds_.Odometry_"):
    header: Header
    child_frame_id: str
    position: Array3
    orientation: Array4
    pose_covariance: Array36
    linear: Array3
    angular: Array3
    twist_covariance: Array36


@dataclass
@annotations.final
class ParameterValue(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = field(default_factory=list)
    bool_array_value: sequence[bool] = field(default_factory=list)
    integer_array_value: sequence[int64] = field(default_factory=list)
    double_array_value: sequence[float64] = field(default_factory=list)
    string_array_value: sequence[str] = field(default_factory=list)


@dataclass
@annotations.final
class Parameter(IdlStruct, typename="rcl_interfaces.msg.dds_.Parameter_"):
    name: str
    value: ParameterValue


@dataclass
@annotations.final
class ParameterEvent(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterEvent_"):
    stamp: Time
    node: str
    new_parameters: sequence[Parameter]
    changed_parameters: sequence[Parameter]
    deleted_parameters: sequence[Parameter]


@dataclass
@annotations.final
class SetParametersResult(IdlStruct, typename="rcl_interfaces.msg.dds_.SetParametersResult_"):
    successful: bool
    reason: str


@dataclass
@annotations.final
class ListParametersResult(IdlStruct, typename="rcl_interfaces.msg.dds_.ListParametersResult_"):
    names: sequence[str]
    prefixes: sequence[str]


@dataclass
@annotations.final
class ParameterDescriptor(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterDescriptor_"):
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[float64]
    integer_range: sequence[int64]


SERVICES = {
    "list_parameters": ("ListParameters", {"prefixes": sequence[str], "depth": uint64}, {"result": ListParametersResult}),
    "get_parameters": ("GetParameters", {"names": sequence[str]}, {"values": sequence[ParameterValue]}),
    "get_parameter_types": ("GetParameterTypes", {"names": sequence[str]}, {"types": sequence[uint8]}),
    "describe_parameters": ("DescribeParameters", {"names": sequence[str]}, {"descriptors": sequence[ParameterDescriptor]}),
    "set_parameters": ("SetParameters", {"parameters": sequence[Parameter]}, {"results": sequence[SetParametersResult]}),
    "set_parameters_atomically": (
        "SetParametersAtomically", {"parameters": sequence[Parameter]}, {"result": SetParametersResult}
    ),
}


def service(name, asked, answered, header):
    """Request and reply of a service; `header`: as rmw_cyclonedds has them, who asks and its number before the fields."""
    kinds = []
    for part, fields in [("Request", asked), ("Response", answered)]:
        words = {"typename": f"rcl_interfaces.srv.dds_.{name}_{part}_"}
        annotated = {"guid": uint64, "number": int64, **fields} if header else fields
        kind = new_class(name + part, (IdlStruct,), words, lambda body: body.update(__annotations__=annotated))
        kinds.append(annotations.final(dataclass(kind)))
    return kinds


# the same name on the wire, and nothing of an Imu in it
@dataclass
@annotations.final
class NoImu(IdlStruct, typename="sensor_msgs.msg.dds_.Imu_"):
    data: sequence[uint8]


def sensor_qos(depth=5000):
    """As sensor data is sent: BEST_EFFORT, in plain CDR."""
    return Qos(
        Policy.Reliability.BestEffort,
        Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )


def reliable_qos():
    """As /diagnostics are sent."""
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.Volatile,
        Policy.History.KeepLast(10),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )


def time_of(seconds):
    """A stamp, s since its clock's origin."""
    whole = int(seconds)
    return Time(sec=whole, nanosec=int((seconds - whole) * 1e9))


def imu(seconds, number, rate_rad_s):
    """A message that carries its number in the first acceleration and when it was sent, ns, in the second."""
    return Imu(
        header=Header(stamp=time_of(seconds), frame_id="imu_link"),
        orientation=[0.0] * 4,
        orientation_covariance=[-1.0] + [0.0] * 8,
        angular_velocity=[0.01, -0.02, rate_rad_s],
        angular_velocity_covariance=[0.0] * 9,
        linear_acceleration=[float(number), 0.0, 9.81],
        linear_acceleration_covariance=[0.0] * 9,
    )
