"""Pons at work, and a real node of ROS 2 beside it."""

import fcntl
import itertools
import os
import signal
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile

ROOT = Path(__file__).resolve().parents[3]
LONG_ENOUGH_S = 90  # beyond it nothing comes
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def take_domain() -> int:
    """ROS_DOMAIN_ID, or one that no other test on this computer has, as long as this process lives."""
    if "ROS_DOMAIN_ID" in os.environ:
        return int(os.environ["ROS_DOMAIN_ID"])
    for domain in itertools.cycle(range(20, 102)):
        lock = os.open(f"/tmp/pons_ros_domain_{domain}", os.O_CREAT | os.O_CLOEXEC | os.O_RDONLY, 0o666)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return domain
        except BlockingIOError:
            os.close(lock)
    raise AssertionError


FOLDER = tempfile.TemporaryDirectory()
DOMAIN = take_domain()
os.environ["ROS_DOMAIN_ID"] = str(DOMAIN)  # of whoever else is started
os.environ.setdefault("ROS_LOG_DIR", FOLDER.name)
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


def import_type(name: str):
    """'std_msgs/msg/String', as a class; also 'pons_msgs/action/ExecuteTask_FeedbackMessage'."""
    package, kind, name = name.split("/")
    if kind == "action" and name.endswith("_FeedbackMessage"):
        return getattr(import_module(f"{package}.action"), name.removesuffix("_FeedbackMessage")).Impl.FeedbackMessage
    return getattr(import_module(f"{package}.{kind}"), name)


class Run:
    """`pons run … --ros`, until it is ended, as a person would."""

    def __init__(self, pons: str, *words: str, worlds: Path = ROOT / "worlds"):
        self.folder = Path(tempfile.mkdtemp(dir=FOLDER.name))
        self.err = self.folder / "err"
        environment = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
        with self.err.open("wb") as stream:
            self.process = subprocess.Popen(
                [pons, "run", *words, "--realtime", "--quiet", "--ros", "--ros-domain", str(DOMAIN), "--socket",
                 self.folder / "s", "--journal", self.folder / "j.db"],
                stdout=subprocess.DEVNULL, stderr=stream, env=environment | {"PONS_WORLDS": str(worlds)})

    def said(self) -> str:
        return self.err.read_text()

    def end(self):
        """By Ctrl-C; nothing that came was unreadable, or of another definition than it has."""
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(LONG_ENOUGH_S)
        assert code == 130, f"pons has ended with {code}: {self.said()}"
        for complaint in ("cannot be read", "definition", "has the type", "serves it, too", "tells the time"):
            assert complaint not in self.said(), self.said()


class Peer:
    """A node of rclpy's."""

    def __init__(self, run: Run, name: str = "peer"):
        self.run = run
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.node = rclpy.create_node(name, context=self.context,
                                      parameter_overrides=[Parameter("use_sim_time", Parameter.Type.BOOL, True)])
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.clients = {}

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def until(self, what: str, condition):
        """Spins until the condition has a value that counts as true, and gives that."""
        end = time.monotonic() + LONG_ENOUGH_S
        while not (value := condition()):
            assert self.run.process.poll() is None, f"pons has ended: {self.run.said()}"
            assert time.monotonic() < end, f"it did not come: {what}\n{self.run.said()}"
            self.executor.spin_once(timeout_sec=0.05)
        return value

    def done(self, what: str, future):
        self.until(what, future.done)
        return future.result()

    def hear(self, type_name: str, topic: str, qos: QoSProfile | int = 100) -> list:
        """The messages that come, as they come."""
        messages: list = []
        self.node.create_subscription(import_type(type_name), topic, messages.append, qos)
        return messages

    def ask(self, type_name: str, service: str, **fields):
        kind = import_type(type_name)
        if service not in self.clients:
            self.clients[service] = self.node.create_client(kind, service)
        client = self.clients[service]
        self.until(f"{service} is served", client.service_is_ready)
        return self.done(f"an answer of {service}", client.call_async(kind.Request(**fields)))


def seconds(stamp) -> float:
    return stamp.sec + stamp.nanosec * 1e-9


def pons_program() -> str:
    if len(sys.argv) < 2:
        sys.exit(f"usage: {sys.argv[0]} PONS [TEST ...]     run by .venv-ros's interpreter")
    return str(Path(sys.argv[1]).resolve())
