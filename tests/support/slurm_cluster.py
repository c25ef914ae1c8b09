"""A Slurm cluster of virtual nodes on this machine, in a folder of its own, with its own key and ports."""

import getpass
import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

from tests.support.waiting import wait_for

PROGRAMS = ("munged", "slurmctld", "slurmd", "srun", "sbatch", "scontrol", "squeue", "scancel", "sinfo")
# Debian puts daemons where a user's PATH may not look.
PATH = os.pathsep.join((os.environ.get("PATH", ""), "/usr/sbin", "/sbin"))

CONFIG = """
ClusterName=perpetua
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmctldPort={controller_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerParameters=bf_interval=2,sched_interval=2,batch_sched_delay=0
KillWait=10
SlurmdTimeout=30
ReturnToService=0
MaxArraySize=101
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
JobCompType=jobcomp/none
"""
NODE = "NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 RealMemory=8000 State=UNKNOWN\n"


@dataclass(frozen=True)
class SlurmCluster:
    """A running cluster. ``environment`` makes Slurm's commands talk to it."""

    folder: Path
    environment: dict[str, str]
    nodes: dict[str, subprocess.Popen[bytes]]

    def run(self, *command: str) -> str:
        """What one of Slurm's commands says."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False, timeout=60)
        assert done.returncode == 0, (command, done.stdout, done.stderr)
        return done.stdout

    def tasks(self) -> dict[str, tuple[str, str]]:
        """State and node of every task that is queued or runs, by its name."""
        lines = self.run("squeue", "--noheader", "--array", "--format=%i|%T|%N").splitlines()
        return {name: (state, node) for name, state, node in (line.split("|") for line in lines)}

    def running(self, job: str) -> dict[str, str]:
        """The node of each running task of an array."""
        tasks = self.tasks().items()
        return {name: node for name, (state, node) in tasks if name.startswith(f"{job}_") and state == "RUNNING"}

    def describe(self, lines: int = 60) -> str:
        """What is queued and why, how the nodes are, and the ends of the daemons' logs: for who reads a failure."""
        looks = (
            ("squeue", "--array", "--format=%i %T %r %N"),
            ("sinfo", "--Node", "--format=%N %T %E"),
            ("scontrol", "show", "job"),
        )
        said = [self.run(*look) for look in looks]
        for log in sorted(self.folder.glob("slurm*.log")):
            said.append("\n".join([log.name, *log.read_text(errors="replace").splitlines()[-lines:]]))
        return "\n\n".join(said)

    def power_off(self, node: str) -> None:
        """Ends the node's daemon and all that runs on it without a word, as a power failure does."""
        self.nodes[node].kill()
        self.nodes[node].wait()
        for process in psutil.process_iter():
            with suppress(psutil.Error):
                environment = process.environ()
                if environment.get("SLURMD_NODENAME") == node and environment.get("SLURM_CONF") == self._config:
                    for dying in (*process.parents(), process):
                        if dying.name() == "slurmstepd" or dying == process:
                            dying.kill()
        self.run("scontrol", "update", f"NodeName={node}", "State=DOWN", "Reason=no power")

    def power_on(self, node: str) -> None:
        """Starts the node's daemon, and gives the node back to the cluster once it answers."""
        self.start_node(node)
        wait_for(lambda: "*" not in self.run("sinfo", "--noheader", f"--nodes={node}", "--format=%T"), node, 120, 0.25)
        self.run("scontrol", "update", f"NodeName={node}", "State=RESUME")

    def start_node(self, node: str) -> None:
        """Starts a node's daemon."""
        self.nodes[node] = _start(self.folder, self.environment, "slurmd", "-D", "-N", node)

    @property
    def _config(self) -> str:
        return self.environment["SLURM_CONF"]

    def start_requeued(self) -> None:
        """Slurm lets a requeued task wait for two minutes; a test has no use for that."""
        for name, (state, _) in self.tasks().items():
            if state == "PENDING":
                subprocess.run(
                    ["scontrol", "update", f"JobId={name}", "StartTime=now"],
                    env=self.environment, capture_output=True, check=False, timeout=60,
                )  # fmt: skip


def missing_programs() -> list[str]:
    """What is not installed of what a cluster needs."""
    return [program for program in PROGRAMS if shutil.which(program, path=PATH) is None]


@contextmanager
def slurm_cluster(folder: Path, nodes: tuple[str, ...]) -> Iterator[SlurmCluster]:
    """Starts a cluster, and ends every process of it."""
    environment = {**os.environ, "PATH": PATH, "SLURM_CONF": str(folder / "slurm.conf")}
    _write_config(folder, nodes)
    cluster = SlurmCluster(folder, environment, {})
    daemons: list[subprocess.Popen[bytes]] = []
    try:
        daemons.append(_start(folder, environment, "munged", "--foreground", "--force", *_munge_options(folder)))
        wait_for(lambda: (folder / "munge.socket").exists(), "munged", 30)
        daemons.append(_start(folder, environment, "slurmctld", "-D"))
        for node in nodes:
            cluster.start_node(node)
        wait_for(lambda: _idle_nodes(cluster) == len(nodes), "all nodes to be idle", 120, 0.25)
        yield cluster
    finally:
        # Nodes first, while the controller can still tell them what they run.
        subprocess.run(["scancel", "--me"], env=environment, capture_output=True, check=False, timeout=60)
        daemons += cluster.nodes.values()
        for daemon in reversed(daemons):
            daemon.send_signal(signal.SIGTERM)
        for daemon in reversed(daemons):
            _end(daemon)


def _write_config(folder: Path, nodes: tuple[str, ...]) -> None:
    host, user = socket.gethostname(), getpass.getuser()
    ports = _free_ports(len(nodes) + 1)
    text = CONFIG.format(host=host, user=user, folder=folder, controller_port=ports[0])
    for name, port in zip(nodes, ports[1:], strict=True):
        text += NODE.format(name=name, host=host, port=port)
        (folder / f"spool-{name}").mkdir()
    text += f"PartitionName=main Nodes={','.join(nodes)} Default=YES MaxTime=INFINITE State=UP\n"
    (folder / "slurm.conf").write_text(text)
    (folder / "state").mkdir()
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)


def _munge_options(folder: Path) -> list[str]:
    files = {"key-file": "munge.key", "socket": "munge.socket", "pid-file": "munged.pid", "log-file": "munged.log"}
    return [f"--{name}={folder / file}" for name, file in {**files, "seed-file": "munged.seed"}.items()]


def _free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


def _start(folder: Path, environment: dict[str, str], *command: str) -> subprocess.Popen[bytes]:
    with (folder / "daemons.out").open("ab") as log:
        return subprocess.Popen(command, env=environment, stdout=log, stderr=log, stdin=subprocess.DEVNULL)


def _end(daemon: subprocess.Popen[bytes]) -> None:
    try:
        daemon.wait(timeout=20)
    except subprocess.TimeoutExpired:
        daemon.kill()
        daemon.wait()


def _idle_nodes(cluster: SlurmCluster) -> int:
    done = subprocess.run(
        ["sinfo", "--noheader", "--Node", "--format=%T"],
        env=cluster.environment, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    return done.stdout.split().count("idle")
