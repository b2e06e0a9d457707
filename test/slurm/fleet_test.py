#!/usr/bin/env python3
"""scripts/fleet against a real slurmctld and slurmd of this machine, with a configuration of their own in a temporary folder. Needs
slurm-wlm, munge, root (for slurmd), and the built tools render_drive, kitti_to_bag and run_bag."""
import csv
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
FLEET = ROOT / "scripts/fleet"
PATIENCE = 240  # s; a task that is queued again waits for two minutes

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


class Fleet(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="sdvo_fleet_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.cluster = Cluster(cls.folder)
        cls.addClassCleanup(cls.cluster.stop)
        cls.cluster.run()
        quiet = dict(check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        drive = cls.folder / "drive"
        subprocess.run([TOOLS / "render_drive", "--trajectory", "figure_eight", "--frames", "60", "--output", drive], **quiet)
        cls.bags, cls.results = cls.folder / "bags", cls.folder / "results"
        cls.bags.mkdir()
        for name, frames in (("short", 5), ("killed", 60), ("lost", 60)):
            subprocess.run([TOOLS / "kitti_to_bag", "--sequence", drive, "--frames", str(frames), "--output", cls.bags / (name + ".bag")],
                           **quiet)
        (cls.folder / "vo.yaml").write_text("visual_odometry: {motion: {seed: 5}}\n")  # found from where `submit` was called
        (cls.bags / "damaged.bag").write_bytes((cls.bags / "short.bag").read_bytes()[:5000])

    def fleet(self, *arguments, code=0):
        done = subprocess.run([FLEET, *map(str, arguments)], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
        print(f"$ fleet {arguments[0]}\n{done.stdout}", flush=True)
        self.assertEqual(done.returncode, code, done.stdout)
        return done.stdout

    def submit(self, code=0, seed=2):
        return self.fleet("submit", self.bags, "--output", self.results, "--at-most", "1", "--", "--config", "vo.yaml",
                          "--param", f"motion/seed={seed}", code=code)

    def process(self, *words):
        """The first process whose command line holds them, when there is one."""
        found = []

        def is_there():
            for process in pathlib.Path("/proc").glob("[0-9]*"):
                try:
                    line = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
                except OSError:
                    continue
                if all(any(word in part for part in line) for word in words):
                    found.append(int(process.name))
            return found
        self.assertTrue(wait_until(is_there), f"no process with {words}")
        return found[0]

    def is_quiet(self):
        return not self.cluster.say("squeue", "--noheader").strip()

    def test_killed_failed_and_finished_bags(self):
        self.assertIn("4 bags submitted, 0 are finished", self.submit())
        self.assertIn("0 bags submitted", self.submit())  # all of them wait
        self.assertIn("other arguments", self.submit(seed=3, code=1))
        # Tasks run in the order of names: damaged, killed, lost, short. A run that is killed is queued again.
        os.kill(self.process("run_bag", str(self.bags / "killed.bag")), signal.SIGKILL)
        self.assertTrue(wait_until(lambda: "queued again" in (self.results / "logs/0001_1.log").read_text()))
        # The whole task is killed, as on a node without memory.
        run = self.process("run_bag", str(self.bags / "lost.bag"))
        os.kill(self.process("fleet", "task", str(self.results)), signal.SIGKILL)
        os.kill(run, signal.SIGKILL)
        self.assertTrue(wait_until(lambda: (self.results / "short/short.row").exists()))
        out = self.fleet("status", self.results, code=1)
        self.assertRegex(out, "damaged: failed: .*")
        self.assertRegex(out, "lost: lost: ")
        self.assertNotRegex(out, "killed: (failed|lost)")  # it waits, runs, or has come back already
        self.assertTrue(wait_until(self.is_quiet))
        self.assertRegex(self.fleet("status", self.results, "--all", code=1), "killed: finished")

        # Again: only what is not finished runs.
        finished = {name: (self.results / name / (name + ".txt")).stat().st_mtime_ns for name in ("killed", "short")}
        self.assertIn("2 bags submitted, 2 are finished", self.submit())
        self.assertTrue(wait_until(self.is_quiet))
        self.assertRegex(self.fleet("status", self.results, code=1), r"damaged: failed: .*\n4 bags: 1 failed, 3 finished")
        for name, written in finished.items():
            self.assertEqual((self.results / name / (name + ".txt")).stat().st_mtime_ns, written)

        self.fleet("merge", self.results)
        with open(self.results / "table.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([(row["bag"], row["pairs"]) for row in rows],
                         [("damaged", ""), ("killed", "60"), ("lost", "60"), ("short", "5")])
        # The same run twice, once interrupted: the same trajectory.
        poses = [(self.results / name / (name + ".txt")).read_text() for name in ("killed", "lost")]
        self.assertEqual(*poses)
        report = (self.results / "report.md").read_text()
        print(report)
        self.assertIn("# 3 of 4 bags", report)
        self.assertIn("125 pairs, 0 without a pose", report)
        self.assertIn("- damaged: failed: ", report)


if __name__ == "__main__":
    sys.exit(unittest.main(verbosity=2))
