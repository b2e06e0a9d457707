#!/usr/bin/env python3
"""run_many against a real slurmctld and slurmd of this machine, with a configuration of their own in a temporary folder. Needs
slurm-wlm, munge, root (for slurmd), and the built tools render_drive, convert and run_sequence."""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TOOLS = ROOT / ".catkin_ws/devel/lib/stereo_descriptor_vo"
RUN_MANY = TOOLS / "run_many"
PATIENCE = 60  # s

CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmctldPort={port}
SlurmdPort={port_of_node}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
MpiDefault=none
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def wait_until(condition, patience=PATIENCE):
    end = time.time() + patience
    while not condition():
        if time.time() > end:
            return False
        time.sleep(0.2)
    return True


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Cluster:
    """munged, slurmctld and slurmd in a folder."""

    def __init__(self, folder):
        self.folder, self.processes = folder, []

    def run(self):
        folder = self.folder
        for name in ("state", "spool"):
            (folder / name).mkdir()
        key = folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        (folder / "slurm.conf").write_text(CONFIGURATION.format(folder=folder, host=socket.gethostname().split(".")[0], cpus=os.cpu_count(),
                                                                port=free_port(), port_of_node=free_port()))
        (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        os.environ["SLURM_CONF"] = str(folder / "slurm.conf")
        self.start("munged", "--foreground", "--force", f"--socket={folder}/munge.socket", f"--key-file={key}",
                   f"--pid-file={folder}/munge.pid", f"--log-file={folder}/munge.log", f"--seed-file={folder}/munge.seed")
        assert wait_until(lambda: (folder / "munge.socket").exists(), 20)
        self.start("slurmctld", "-D", "-i")
        self.start("slurmd", "-D")
        if not wait_until(lambda: "idle" in self.say("sinfo", "--noheader", "--format=%T"), 60):
            raise AssertionError("no node: " + self.say("sinfo") + (folder / "slurmd.log").read_text()[-2000:])

    def start(self, *command):
        with open(self.folder / (command[0] + ".out"), "w") as log:
            self.processes.append(subprocess.Popen(command, stdout=log, stderr=log))

    @staticmethod
    def say(*command):
        return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True).stdout

    def stop(self):
        for process in reversed(self.processes):
            process.terminate()
            process.wait()


class RunMany(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="sdvo_run_many_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.cluster = Cluster(cls.folder)
        cls.addClassCleanup(cls.cluster.stop)
        cls.cluster.run()
        quiet = dict(check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        drive = cls.folder / "drive"
        subprocess.run([TOOLS / "render_drive", "--trajectory", "figure_eight", "--frames", "60", "--output", drive], **quiet)
        cls.bags = cls.folder / "bags"
        cls.bags.mkdir()
        for name, frames in (("killed", 60), ("short", 5)):
            subprocess.run([TOOLS / "convert", drive, "--frames", str(frames), "--output", cls.bags / (name + ".bag")], **quiet)
        (cls.folder / "vo.yaml").write_text("visual_odometry: {map: {keyframes: 7}}\n")  # found from where the command is given
        (cls.bags / "damaged.bag").write_bytes((cls.bags / "short.bag").read_bytes()[:5000])

    def start(self, results, *options):
        return subprocess.Popen([RUN_MANY, self.bags, "--output", self.folder / results, *options, "--", "--config", "vo.yaml"], cwd=self.folder,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def kill_run_of(self, bag):
        def is_killed():
            for process in pathlib.Path("/proc").glob("[0-9]*"):
                try:
                    line = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
                except OSError:
                    continue
                if line[0].endswith("run_sequence") and str(bag) in line:
                    os.kill(int(process.name), signal.SIGKILL)
                    return True
            return False
        self.assertTrue(wait_until(is_killed), f"no run of {bag}")

    def test_what_fails_or_is_killed_runs_again(self):
        poses = []
        for results, *options in (("local", "--jobs", "2"), ("cluster", "--slurm", "--sbatch=--mem=0")):
            run = self.start(results, *options)
            self.kill_run_of(self.bags / "killed.bag")
            said = run.communicate()[0]
            self.assertEqual(run.returncode, 1, said)
            self.assertRegex(said, r"^damaged,{10}.+\nkilled,{10}.+\n1 of 3 recordings are finished\n$")
            short = self.folder / results / "short/short.txt"
            written = short.stat().st_mtime_ns
            run = self.start(results, *options)
            self.assertRegex(run.communicate()[0], r"^damaged,{10}.+\n2 of 3 recordings are finished\n$")
            self.assertEqual(short.stat().st_mtime_ns, written)
            self.assertRegex((self.folder / results / "report.csv").read_text(), r"\nkilled,60,.*,\nshort,5,.*,\n$")
            poses.append((self.folder / results / "killed/killed.txt").read_text())
        self.assertEqual(*poses)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
