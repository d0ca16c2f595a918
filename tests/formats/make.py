#!/usr/bin/env python3
"""Writes the files of this folder: one log at rest in every format, each by the format's own library.

    pip install rosbags mcap mcap-ros2-support pyulog pymavlink scipy h5py numpy
    python tests/formats/make.py

Where a library cannot write its format, the bytes are put together here after the published specification, and read
back by that library. The same seed gives the same numbers; archives and databases also hold the time of writing.
"""

import io
import shutil
import sqlite3
import struct
import tempfile
from pathlib import Path

import h5py
import numpy as np
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as Ros2Writer
from pymavlink import DFReader
from pyulog import ULog
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import Writer as Bag2Writer, StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.io import savemat

HERE = Path(__file__).parent
SAMPLES = 400
STEP_NS = 500_000_000
EPOCH_NS = 1_700_000_000_000_000_000
BOOT_US = 12_000_000
# a recorder stores a message this long after the sensor was read
DELAY_NS = 3_000_000

rng = np.random.default_rng(20261122)
t_s = np.arange(SAMPLES) * STEP_NS * 1e-9
warm_up = 1 - np.exp(-t_s / 30)
drift = np.array([1e-3, -1.5e-3, 2e-3]) * warm_up[:, None] + np.array([2e-3, -3e-3, -5e-3])
gyro = drift + 2e-4 * rng.standard_normal((SAMPLES, 3))
accel = np.array([0.0, 0.0, 9.81]) + 0.01 * rng.standard_normal((SAMPLES, 3))
temperature_c = 25 + 10 * warm_up
stamp_ns = EPOCH_NS + STEP_NS * np.arange(SAMPLES)
boot_us = BOOT_US + STEP_NS // 1000 * np.arange(SAMPLES)


def euroc():
    lines = ["#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
             "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"]
    for stamp, w, a in zip(stamp_ns, gyro, accel):
        lines.append(",".join([str(stamp), *map(repr, w.tolist()), *map(repr, a.tolist())]))
    (HERE / "euroc.csv").write_text("\n".join(lines) + "\n")


def imu_of(types, stamp, w, a, **header):
    v3, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    time = types["builtin_interfaces/msg/Time"](sec=int(stamp // 10**9), nanosec=int(stamp % 10**9))
    zeros = np.zeros(9)
    return types["sensor_msgs/msg/Imu"](
        header=types["std_msgs/msg/Header"](stamp=time, frame_id="imu_link", **header),
        orientation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0), orientation_covariance=zeros,
        angular_velocity=v3(*w.tolist()), angular_velocity_covariance=zeros,
        linear_acceleration=v3(*a.tolist()), linear_acceleration_covariance=zeros)


def temperature_of(types, stamp, value, **header):
    time = types["builtin_interfaces/msg/Time"](sec=int(stamp // 10**9), nanosec=int(stamp % 10**9))
    return types["sensor_msgs/msg/Temperature"](
        header=types["std_msgs/msg/Header"](stamp=time, frame_id="imu_link", **header),
        temperature=float(value), variance=0.0)


def bag1(name, compression, stamps=stamp_ns):
    store = get_typestore(Stores.ROS1_NOETIC)
    path = HERE / name
    path.unlink(missing_ok=True)
    writer = Bag1Writer(path)
    if compression:
        writer.set_compression(compression)
    writer.chunk_threshold = 32 * 1024
    with writer:
        imu = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store)
        heat = writer.add_connection("/imu/temperature", "sensor_msgs/msg/Temperature", typestore=store)
        for i, (stamp, w, a) in enumerate(zip(stamps, gyro, accel)):
            receipt = int(stamp_ns[i]) + DELAY_NS
            message = imu_of(store.types, stamp, w, a, seq=i)
            writer.write(imu, receipt, store.serialize_ros1(message, "sensor_msgs/msg/Imu"))
            if i % 10 == 0:
                message = temperature_of(store.types, stamp, temperature_c[i], seq=i)
                writer.write(heat, receipt, store.serialize_ros1(message, "sensor_msgs/msg/Temperature"))


IMU_DEFINITION = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance # Row major about x, y, z axes
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance # Row major about x, y, z axes
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance # Row major x, y z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
PX4_DEFINITION = """# Sensor readings in SI-unit form.
uint64 timestamp # time since system start (microseconds)
int32 RELATIVE_TIMESTAMP_INVALID = 2147483647
float32[3] gyro_rad # average angular rate measured in the FRD body frame XYZ-axis in rad/s
uint32 gyro_integral_dt
int32 accelerometer_timestamp_relative
float32[3] accelerometer_m_s2
uint32 accelerometer_integral_dt
uint8 accelerometer_clipping
uint8 gyro_clipping
uint8 accel_calibration_count
uint8 gyro_calibration_count
"""


def mcap(name, compression, px4=False):
    with open(HERE / name, "wb") as file:
        writer = Ros2Writer(file, chunk_size=16 * 1024, compression=compression)
        imu = writer.register_msgdef("sensor_msgs/msg/Imu", IMU_DEFINITION)
        combined = writer.register_msgdef("px4_msgs/msg/SensorCombined", PX4_DEFINITION)
        text = writer.register_msgdef("std_msgs/msg/String", "string data\n")
        for i in range(SAMPLES):
            vector = lambda v: dict(zip("xyz", v.tolist()))
            log = int(stamp_ns[i]) + DELAY_NS
            if px4:
                writer.write_message("/fmu/out/sensor_combined", combined, dict(
                    timestamp=int(boot_us[i]), gyro_rad=gyro[i].tolist(), gyro_integral_dt=2500,
                    accelerometer_timestamp_relative=0, accelerometer_m_s2=accel[i].tolist(),
                    accelerometer_integral_dt=2500, accelerometer_clipping=0, gyro_clipping=0,
                    accel_calibration_count=0, gyro_calibration_count=0), log_time=log, sequence=i)
            else:
                writer.write_message("/imu/data", imu, dict(
                    header=dict(stamp=dict(sec=int(stamp_ns[i] // 10**9), nanosec=int(stamp_ns[i] % 10**9)),
                                frame_id="imu_link"),
                    orientation=dict(x=0.0, y=0.0, z=0.0, w=1.0), orientation_covariance=[0.0] * 9,
                    angular_velocity=vector(gyro[i]), angular_velocity_covariance=[0.0] * 9,
                    linear_acceleration=vector(accel[i]), linear_acceleration_covariance=[0.0] * 9),
                    log_time=log, sequence=i)
            if i % 50 == 0:
                writer.write_message("/chatter", text, dict(data=f"hello {i}"), log_time=log, sequence=i)
        writer.finish()


def two_imus():
    """The second one lies on its back: half a turn about x."""
    turned = np.array([1.0, -1.0, -1.0])
    with open(HERE / "two_imus.mcap", "wb") as file:
        writer = Ros2Writer(file, chunk_size=16 * 1024, compression=CompressionType.ZSTD)
        imu = writer.register_msgdef("sensor_msgs/msg/Imu", IMU_DEFINITION)
        for i in range(SAMPLES):
            vector = lambda v: dict(zip("xyz", v.tolist()))
            for topic, signs in [("/front/imu", np.ones(3)), ("/rear/imu", turned)]:
                writer.write_message(topic, imu, dict(
                    header=dict(stamp=dict(sec=int(stamp_ns[i] // 10**9), nanosec=int(stamp_ns[i] % 10**9)),
                                frame_id=topic[1:-4] + "_imu_link"),
                    orientation=dict(x=0.0, y=0.0, z=0.0, w=1.0), orientation_covariance=[0.0] * 9,
                    angular_velocity=vector(signs * gyro[i]), angular_velocity_covariance=[0.0] * 9,
                    linear_acceleration=vector(signs * accel[i]), linear_acceleration_covariance=[0.0] * 9),
                    log_time=int(stamp_ns[i]) + DELAY_NS, sequence=i)
        writer.finish()


PX4_MESSAGES = {
    "px4_msgs/msg/SensorCombined": PX4_DEFINITION,
    "px4_msgs/msg/SensorGyro": """uint64 timestamp
uint64 timestamp_sample
uint32 device_id
float32 x
float32 y
float32 z
float32 temperature
uint32 error_count
uint8[3] clip_counter
uint8 samples
""",
    # of v1.13 to v1.15: later ones have periods of 32 bits
    "px4_msgs/msg/VehicleImu": """uint64 timestamp
uint64 timestamp_sample
uint32 accel_device_id
uint32 gyro_device_id
float32[3] delta_angle
float32[3] delta_velocity
uint16 delta_angle_dt
uint16 delta_velocity_dt
uint8 delta_angle_clipping
uint8 delta_velocity_clipping
uint8 accel_calibration_count
uint8 gyro_calibration_count
""",
}


def px4_db3():
    """As releases before Iron write it: without a table of definitions."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in PX4_MESSAGES.items():
        store.register(get_types_from_msg(text, name))
    combined, sensor, imu = (store.types[name] for name in PX4_MESSAGES)
    single = lambda v: np.asarray(v, dtype=np.float32)
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "bag"
        with Bag2Writer(bag, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
            topics = ["sensor_combined", "sensor_gyro", "vehicle_imu"]
            connections = [writer.add_connection(f"/fmu/out/{topic}", name, typestore=store)
                           for topic, name in zip(topics, PX4_MESSAGES)]
            for i in range(SAMPLES):
                time, w, a = int(boot_us[i]), gyro[i], accel[i]
                messages = [
                    combined(time, single(w), 2500, 0, single(a), 2500, 0, 0, 0, 0),
                    sensor(time + 200, time, 7, *map(float, single(w)), float(temperature_c[i]), 0,
                           np.zeros(3, dtype=np.uint8), 1),
                    imu(time + 200, time, 7, 7, single(w * 5000e-6), single(a * 5000e-6), 5000, 5000, 0, 0, 0, 0),
                ]
                for connection, name, message in zip(connections, PX4_MESSAGES, messages):
                    writer.write(connection, int(stamp_ns[i]) + DELAY_NS, store.serialize_cdr(message, name))
        shutil.copy(next(bag.glob("*.db3")), HERE / "px4.db3")
    with sqlite3.connect(HERE / "px4.db3") as database:
        database.execute("DROP TABLE IF EXISTS message_definitions")
    with sqlite3.connect(HERE / "px4.db3") as database:
        database.execute("VACUUM")


def db3():
    store = get_typestore(Stores.ROS2_HUMBLE)
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "bag"
        with Bag2Writer(bag, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
            imu = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store)
            heat = writer.add_connection("/imu/temperature", "sensor_msgs/msg/Temperature", typestore=store)
            for i, (stamp, w, a) in enumerate(zip(stamp_ns, gyro, accel)):
                receipt = int(stamp) + DELAY_NS
                message = imu_of(store.types, stamp, w, a)
                writer.write(imu, receipt, store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
                if i % 10 == 0:
                    message = temperature_of(store.types, stamp, temperature_c[i])
                    writer.write(heat, receipt, store.serialize_cdr(message, "sensor_msgs/msg/Temperature"))
        shutil.copy(next(bag.glob("*.db3")), HERE / "ros2.db3")
    # the pages that an index leaves free
    with sqlite3.connect(HERE / "ros2.db3") as database:
        database.execute("VACUUM")


def ulog():
    """After https://docs.px4.io/main/en/dev_log/ulog_file_format.html"""
    out = io.BytesIO()
    out.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", BOOT_US))

    def put(kind, body):
        out.write(struct.pack("<HB", len(body), ord(kind)) + body)

    def information(key, value):
        put("I", bytes([len(key)]) + key.encode() + value)

    put("B", bytes(40))
    information("char[3] sys_name", b"PX4")
    for text in [
        "sensor_gyro:uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
        "float temperature;uint32_t error_count;uint8_t[3] clip_counter;uint8_t samples;uint8_t[4] _padding0;",
        "sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;float[3] accelerometer_m_s2;"
        "uint32_t accelerometer_integral_dt;uint8_t gyro_clipping;uint8_t[7] _padding0;",
        "vehicle_imu:uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
        "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;",
        "sensors_status_imu:uint64_t timestamp;float[4] gyro_inconsistency_rad_s;",
    ]:
        put("F", text.encode())
    put("P", bytes([len("float IMU_GYRO_CUTOFF")]) + b"float IMU_GYRO_CUTOFF" + struct.pack("<f", 40.0))
    for number, (instance, name) in enumerate(
            [(0, "sensor_gyro"), (1, "sensor_gyro"), (0, "sensor_combined"), (0, "vehicle_imu"), (0, "sensors_status_imu")]):
        put("A", struct.pack("<BH", instance, number) + name.encode())
    sync = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])
    for i in range(SAMPLES):
        time, w = int(boot_us[i]), gyro[i]
        # published 200 us after the sample
        for number, sign in [(0, 1), (1, -1)]:
            put("D", struct.pack("<HQQI4fI3BB", number, time + 200, time, 7, *(sign * w), temperature_c[i], 0, 0, 0, 0, 1))
        put("D", struct.pack("<HQ3fI3fIB", 2, time, *w, 2500, *accel[i], 2500, 0))
        put("D", struct.pack("<HQQ3f3fII", 3, time + 200, time, *(w * 5000e-6), *(accel[i] * 5000e-6), 5000, 5000))
        if i % 100 == 0:
            put("D", struct.pack("<HQ4f", 4, time, 0, 0, 0, 0))
            put("S", sync)
        if i == 200:
            put("L", b"6" + struct.pack("<Q", time) + b"[commander] at rest")
    path = HERE / "px4.ulg"
    path.write_bytes(out.getvalue())
    read = ULog(str(path))
    assert not read.file_corruption
    names = sorted((d.name, d.multi_id) for d in read.data_list)
    assert names == [("sensor_combined", 0), ("sensor_gyro", 0), ("sensor_gyro", 1), ("sensors_status_imu", 0),
                     ("vehicle_imu", 0)], names
    back = read.get_dataset("sensor_gyro", 0).data
    assert np.array_equal(back["z"], gyro[:, 2].astype(np.float32))
    assert np.array_equal(back["timestamp_sample"], boot_us)


def dataflash():
    """After https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html and AP_Logger's LogStructure.h"""
    out = io.BytesIO()

    def describe(kind, length, name, letters, labels):
        out.write(b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, length, *(s.encode() for s in (name, letters, labels))))

    def put(kind, layout, *values):
        out.write(b"\xa3\x95" + bytes([kind]) + struct.pack("<" + layout, *values))

    describe(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    describe(129, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
    describe(130, 3 + 51, "IMU", "QBffffffIIfBBHH",
             "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")
    describe(131, 3 + 29, "GYR", "QBQfff", "TimeUS,I,SampleUS,GyrX,GyrY,GyrZ")
    describe(132, 3 + 8 + 64, "MSG", "QZ", "TimeUS,Message")
    describe(133, 3 + 8 + 2, "XKF1", "Qh", "TimeUS,GX")
    put(129, "QB16s16s", BOOT_US, 130, b"s#EEEooo--O--zz", b"F-000000-----00")
    put(132, "Q64s", BOOT_US, b"ArduRover V4.5.7")
    for i in range(SAMPLES):
        time, w = int(boot_us[i]), gyro[i]
        for instance, sign in [(0, 1), (1, -1)]:
            put(130, "QBffffffIIfBBHH", time, instance, *(sign * w), *accel[i], 0, 0, temperature_c[i], 1, 1, 400, 400)
        put(131, "QBQfff", time + 150, 0, time, *w)
        if i % 50 == 0:
            put(133, "Qh", time, -3)
    path = HERE / "ardupilot.bin"
    path.write_bytes(out.getvalue())
    log = DFReader.DFReader_binary(str(path))
    back = []
    while (message := log.recv_match(type=["IMU"])) is not None:
        if message.I == 0:
            back.append((message.TimeUS, message.GyrZ))
    assert [b[0] for b in back] == boot_us.tolist()
    assert np.array_equal(np.array([b[1] for b in back]), gyro[:, 2].astype(np.float32).astype(float))
    log.close()


def matlab():
    savemat(HERE / "v5.mat", {"t": t_s[:, None], "gyro": gyro, "fs": 2.0, "note": "at rest"}, do_compression=True)
    savemat(HERE / "v5_struct.mat", {
        "imu": {"t": t_s[:, None], "gyro": gyro.T, "temperature": temperature_c},
        "gps": {"t": t_s[::10], "lat": np.full(SAMPLES // 10, 44.4)},
        "scene": np.array(["a", "bc"], dtype=object)})
    # as MATLAB writes version 7.3: HDF5 after a header of 512 bytes, indices turned round
    path = HERE / "v73.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in [("t", t_s[None, :]), ("gyro", gyro.T), ("fs", np.array([[2.0]]))]:
            packed = {"compression": "gzip", "chunks": value.shape} if value.size > 1 else {}
            file.create_dataset(name, data=value, **packed).attrs["MATLAB_class"] = np.bytes_("double")
        note = file.create_dataset("note", data=np.array([[ord(c)] for c in "at rest"], dtype=np.uint16))
        note.attrs["MATLAB_class"] = np.bytes_("char")
    header = "MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Sun Nov 22 00:00:00 2026 HDF5 schema 1.00 ."
    with open(path, "r+b") as file:
        file.write(header.ljust(116).encode() + bytes(8) + b"\x00\x02IM")


def hdf5():
    with h5py.File(HERE / "log.h5", "w") as file:
        imu = file.create_group("imu")
        imu.create_dataset("timestamp_ns", data=stamp_ns)
        rates = imu.create_dataset("angular_velocity", data=gyro, chunks=(64, 3), compression="gzip", shuffle=True)
        rates.attrs["units"] = "rad/s"
        file.create_group("odometry").create_dataset("speed_m_s", data=np.zeros(50))


def numpy():
    np.savez_compressed(HERE / "log.npz", timestamp_ns=stamp_ns, gyro=gyro, fs=2.0)
    record = np.zeros(SAMPLES, dtype=[("time", "<M8[ns]"), ("gyro", "<f4", (3,)), ("temperature_c", ">f8")])
    record["time"], record["gyro"], record["temperature_c"] = stamp_ns.astype("M8[ns]"), gyro, temperature_c
    np.save(HERE / "record.npy", record)
    np.save(HERE / "matrix.npy", np.asfortranarray(np.column_stack([t_s, gyro])))


euroc()
bag1("ros1.bag", None)
bag1("ros1_lz4.bag", Bag1Writer.CompressionFormat.LZ4)
bag1("ros1_bz2.bag", Bag1Writer.CompressionFormat.BZ2)
bag1("ros1_unstamped.bag", Bag1Writer.CompressionFormat.BZ2, stamps=np.zeros(SAMPLES, dtype=int))
mcap("ros2.mcap", CompressionType.NONE)
mcap("ros2_lz4.mcap", CompressionType.LZ4)
mcap("ros2_zstd.mcap", CompressionType.ZSTD)
mcap("px4.mcap", CompressionType.ZSTD, px4=True)
two_imus()
db3()
px4_db3()
ulog()
dataflash()
matlab()
hdf5()
numpy()
