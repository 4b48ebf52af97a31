"""What an IMU measured comes to the systems that need it, whatever it is read from."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SAMPLES

import dmp_slam as dmp
from dmp_slam._race import imu as imus
from dmp_slam._race.field import entries
from dmp_slam._race.scans import Scans, instant_ns

NS = 1_000_000_000
#: A driver that replays the truth and says what it got.
DRIVER = '''
import numpy as np
import dmp_slam as dmp

def run(scans, given):
    for scan in scans:
        print(len(scan.imu.stamps_ns), *scan.imu.imu_from_lidar[:3, 3])
        yield scan.stamp, np.eye(4) + np.array([[0, 0, 0, scan.stamp %% %d / 1e9]] + 3 * [4 * [0]])

def systems():
    return {"inertial": dmp.System(run, needs_imu=True), "other": dmp.System(run)}
'''


@pytest.fixture(scope="module")
def study() -> Any:
    spec = importlib.util.spec_from_file_location("study", SAMPLES.parent / "python/studies/race.py")
    module = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
    spec.loader.exec_module(module)  # type: ignore[union-attr]
    return module


@pytest.fixture(scope="module")
def measured(study, tmp_path_factory) -> Path:
    return study.imu(SAMPLES / "truth.tum", tmp_path_factory.mktemp("imu") / "imu.csv")


@pytest.fixture(scope="module")
def stamps(town, tmp_path_factory) -> list[int]:
    return Scans.of(town, tmp_path_factory.mktemp("log") / "scans", False, None, {}).stamps_ns()


def read(source: Any, stamps: Any, log: str = "", pose: Any = None) -> dmp.Imu:
    return imus.read(source, log, log, pose, stamps)


def test_a_file_of_euroc_is_read(measured, stamps):
    imu = read(measured, stamps)
    rows = [line.split(",") for line in measured.read_text().splitlines()[1:]]
    assert imu.stamps_ns.tolist() == [int(row[0]) for row in rows]
    assert np.hstack([imu.gyro_rad_s, imu.accel_m_s2]).tolist() == [[float(value) for value in row[1:]] for row in rows]
    assert np.array_equal(imu.imu_from_lidar, np.eye(4))


def test_a_topic_of_a_log_is_read(measured, stamps, town, tmp_path):
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    expected, store = read(measured, stamps), get_typestore(Stores.ROS2_HUMBLE)
    of, bag = store.types, tmp_path / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store)
        # Messages out of order, as some drivers write them.
        for number in np.argsort(expected.stamps_ns ^ 1 << 25):
            stamp_ns, vector = int(expected.stamps_ns[number]), of["geometry_msgs/msg/Vector3"]
            header = of["std_msgs/msg/Header"](of["builtin_interfaces/msg/Time"](*divmod(stamp_ns, NS)), "imu")
            none, turn = np.zeros(9), of["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
            gyro, accel = vector(*expected.gyro_rad_s[number]), vector(*expected.accel_m_s2[number])
            message = of["sensor_msgs/msg/Imu"](header, turn, none, gyro, none, accel, none)
            writer.write(topic, stamp_ns, store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
    for log in (bag, next(bag.glob("*.mcap"))):
        for column, same in zip(read("/imu/data", stamps, str(log)), expected):
            assert np.array_equal(column, same)
    for log, words in [(str(bag), "no IMU at /imu; it has /imu/data"), (str(town), "no IMU at /imu; it has none"), (str(SAMPLES), "has no topics")]:
        with pytest.raises(dmp.UsageError, match=re.escape(words)):
            read("/imu", stamps, log)


def test_what_is_no_imu_of_this_log_is_refused(measured, stamps, tmp_path):
    text = measured.read_text().splitlines()
    in_g = [",".join([*line.split(",")[:4], *(repr(float(value) / 9.8) for value in line.split(",")[4:])]) for line in text[1:]]
    for lines, words in [
        ([*text[:5], "1700000000000000000,0,0"], "line 6: 3 values, not stamp in ns"),
        ([*text[:5], "1.7e18,0,0,0,0,0,9.8"], "line 6: invalid literal"),
        ([*text[:5], "17,0,0,nan,0,0,9.8"], "measurement 0 is not finite"),
        (text[:1], "no measurement"),
        (text[1::50], "measurements are too few for "),
        (in_g, "the mean acceleration is 1.01, not about 9.8 m/s² with gravity"),
        (text[:20], "the scans are from 1700000000.000 to"),
    ]:
        file = tmp_path / "wrong.csv"
        file.write_text("\n".join(lines))
        with pytest.raises(dmp.InputError, match=re.escape(words)):
            read(file, stamps)
    for source, pose, words in [
        (tmp_path / "absent.csv", None, "absent.csv: "),
        (measured, "1,2,3", "imu_from_lidar is X,Y,Z,QX,QY,QZ,QW in metres, or 4 × 4"),
        (measured, 2 * np.eye(4), "its matrix is no rotation"),
        (None, "0,0,0,0,0,0,1", "imu_from_lidar is given, but no imu"),
    ]:
        with pytest.raises(dmp.UsageError, match=re.escape(words)):
            read(source, stamps, pose=pose)


def test_each_measurement_comes_once_and_reaches_the_end_of_its_scan(town, measured, tmp_path):
    scans = Scans.of(town, tmp_path / "scans", False, None, {})
    imu = read(measured, scans.stamps_ns(), pose="1,2,3,0,0,0.6,0.8")
    assert np.allclose(imu.imu_from_lidar @ [1, 0, 0, 1], [1.28, 2.96, 3, 1])
    scans.with_imu(imu)
    for part in (scans, scans.part(0.5, 0.8)):
        found = list(part.measured())
        together = np.concatenate([scan.imu.stamps_ns for scan in found])
        after = int(np.searchsorted(imu.stamps_ns, part.stamps_ns()[0] - NS))
        assert np.array_equal(together, imu.stamps_ns[after : after + len(together)])
        for scan in found[:-1]:
            ends = instant_ns(scan, "end")
            assert scan.imu.stamps_ns[-1] > ends and (len(scan.imu.stamps_ns) < 2 or scan.imu.stamps_ns[-2] <= ends)


def test_systems_that_need_an_imu_run_with_one(town, measured, tmp_path):
    driver = tmp_path / "mine.py"
    driver.write_text(DRIVER % NS)
    with pytest.raises(dmp.UsageError, match="inertial needs an IMU: give imu, a topic of the log or a .csv"):
        entries([str(driver)], {})
    race = dmp.race(town, [str(driver)], imu=measured, imu_from_lidar="1,2,3,0,0,0,1", score={"every": 4}, progress=False, out=tmp_path / "out")
    # The other gets none, and fails as it takes it.
    assert set(race.failed) == {"other"} and "NoneType" in race.failed["other"]
    assert (tmp_path / "out/inertial.log").read_text().splitlines()[1].split()[1:] == ["1.0", "2.0", "3.0"]
    assert race.data["asked"]["imu"] == str(measured) and race.data["asked"]["imu_from_lidar"][1][3] == 2


def test_datasets_bring_theirs(measured, stamps):
    expected = read(measured, stamps)

    class Measurement:
        def __init__(self, *of: Any) -> None:
            self.stamp, self.gyro, self.accel = self, *of[1:]
            self.to_nsec = lambda: of[0]

    class Dataset:
        def imu(self) -> Any:
            return (Measurement(*row) for row in zip(*expected[:3]))

        def imu_T_lidar(self) -> Any:
            return self

        def to_mat(self) -> Any:
            return np.diag([1.0, -1, -1, 1])

    imu = imus.read(None, Dataset(), "", None, stamps)
    assert np.array_equal(imu.gyro_rad_s, expected.gyro_rad_s)
    assert np.array_equal(imu.imu_from_lidar, np.diag([1.0, -1, -1, 1]))


@pytest.mark.parametrize("name", ["dlio", "lio-sam"])
def test_inertial_systems_of_evalio(study, tmp_path, name):
    pytest.importorskip("evalio")
    log, truth = tmp_path / "town.mcap", tmp_path / "truth.tum"
    dmp.simulate.town(log, truth=truth, scans=80, azimuth_steps=360, truth_rate=200)
    rows = [line.split(",") for line in study.imu(truth, tmp_path / "imu.csv").read_text().splitlines()[1:]]
    # An IMU that is turned by 120° about a diagonal of the sensor's axes.
    turned = tmp_path / "turned.csv"
    turned.write_text("\n".join(",".join([stamp, gy, gz, gx, ay, az, ax]) for stamp, gx, gy, gz, ax, ay, az in rows))
    race = dmp.race(log, [name], imu=turned, imu_from_lidar=[[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0]], progress=False)
    assert race.failed == {} and race.data["runs"][0]["parameters"]["gyro"] == 1e-3
    assert dmp.truth.ape(truth, race.trajectory(name), align=True)["stats"]["rmse"] < 0.2
