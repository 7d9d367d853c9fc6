"""Tests of runs on an existing Dask cluster.

Scheduler and workers are separate processes. The results are bitwise identical to local
runs, and error messages name faults of the cluster.
"""

import contextlib
import functools
import ipaddress
import json
import os
import re
import runpy
import signal
import socket
import subprocess
import sys
from pathlib import Path

import dask
import psutil
import pytest
import yaml
from faulty_study import faulty_study
from study_runs import (
    FAULTY_STUDY_FILE,
    HANG_TIMEOUT,
    QUIET_CLUSTER_OPTIONS,
    SMALL_STUDY,
    have_same_numbers,
    run,
    start_command,
    wait_for_command,
    wait_for_journal_cells,
    wait_until,
)

import rsfstudy
from rsfstudy.errors import RunError
from rsfstudy.execution import dask_clusters, provenance

CLUSTERS = Path(__file__).parent.parent / "studies" / "clusters"
#: Kubernetes objects of the page, by kind and name.
PARTS = {
    (part["kind"], part["metadata"]["name"]): part
    for part in yaml.safe_load_all((CLUSTERS / "kubernetes.yaml").read_text())
}


def container(name):
    """Return the labels of a deployment, and its container."""
    template = PARTS["Deployment", name]["spec"]["template"]
    return template["metadata"]["labels"], template["spec"]["containers"][0]


class Cluster:
    """Scheduler and workers in separate processes.

    The processes use the commands of the Kubernetes file, and each worker runs in a
    separate empty directory. If a test kills a process, the process is started again for
    the next test.
    """

    def __init__(self, place, stack):
        self.place, self.gate, self.stack = place, place / "gate", stack
        self.scheduler, self.workers, self.started = None, [], 0
        self.gate.mkdir()

    def repaired(self):
        """Restore two workers and an empty gate."""
        for mark in self.gate.iterdir():
            mark.unlink()
        if self.scheduler is None or self.scheduler.poll() is not None:
            for worker in self.workers:
                self._end(worker)
            self._start_scheduler()
        self.workers = [worker for worker in self.workers if worker.poll() is None]
        while len(self.workers) < 2:
            self._start_worker()
        return self

    def _start_scheduler(self):
        file = self.place / "scheduler.json"
        file.unlink(missing_ok=True)
        words = [word.replace("8786", "0") for word in container("rsfstudy-scheduler")[1]["args"]]
        words += ["--host", "127.0.0.1", "--scheduler-file", str(file)]
        self.scheduler = self._start(*words, cwd=self.place)
        wait_until(lambda: file.exists() and file.stat().st_size > 0, self.scheduler)
        self.address = json.loads(file.read_text())["address"]

    def _start_worker(self):
        place = self.place / f"worker{self.started}"
        place.mkdir()
        self.started += 1
        there, words = "tcp://rsfstudy-scheduler:8786", container("rsfstudy-workers")[1]["args"]
        words = [word.replace(there, self.address) for word in words]
        self.workers.append(self._start(*words, "--no-nanny", cwd=place))

    def _start(self, *words, cwd):
        process = subprocess.Popen(
            [sys.executable, "-m", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            cwd=cwd,
            env={**os.environ, "FAULT_GATE": str(self.gate)},
        )
        self.stack.callback(self._end, process)
        return process

    @staticmethod
    def _end(process):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(HANG_TIMEOUT)


@pytest.fixture(scope="module")
def started(tmp_path_factory):
    with contextlib.ExitStack() as stack:
        yield Cluster(tmp_path_factory.mktemp("cluster"), stack)


@pytest.fixture
def separate(started):
    return started.repaired()


def test_the_same_bits_as_in_this_process(separate, tmp_path):
    """The results are bitwise identical, and the workers write no files."""
    with dask_clusters.connect_to_cluster(separate.address, timeout=HANG_TIMEOUT) as client:
        client.wait_for_workers(2)
        have_same_numbers(run(SMALL_STUDY, client=client, output=tmp_path / "results"), run())
    assert sorted(os.listdir(tmp_path / "results")) == ["small.cells.sqlite", "small.nc"]
    for place in separate.place.glob("worker*"):
        assert not list(place.rglob("*.nc"))
        assert not list(place.rglob("*.sqlite"))


@pytest.fixture
def held(separate, tmp_path):
    """Start a run on two workers whose remaining cells wait at a gate.

    The fixture yields the process, the output directory and the gate.
    """
    output = tmp_path / "results"
    words = ("run", FAULTY_STUDY_FILE, "--scheduler", separate.address, "--output", output)
    process = start_command(*words, FAULT_CELLS="30")
    wait_for_journal_cells(output / "faulty.cells.sqlite", process)
    # Both workers have cells now.
    wait_until(lambda: len(list(separate.gate.iterdir())) == 2, process)
    yield process, output, separate.gate / "open"
    process.kill()
    process.communicate()


def test_a_worker_lost_in_mid_run(separate, held):
    """A worker that is killed during a run does not cause failed cells."""
    process, output, gate = held
    separate.workers[0].kill()
    gate.touch()
    code, out, said = wait_for_command(process)
    assert code == 0, out + said
    have_same_numbers(rsfstudy.open("faulty", output), run(faulty_study(cells=30)))


def test_a_scheduler_lost_in_mid_run(separate, held):
    """The run keeps the finished cells, and resumes without the cluster."""
    process, output, _gate = held
    separate.scheduler.kill()
    code, _out, said = wait_for_command(process)
    assert code == 1
    assert "the connection to the Dask scheduler is lost" in said
    assert "distributed." not in said  # Dask does not print the error again.
    assert "of 30 cells are finished and stored" in said
    assert (output / "faulty.partial.nc").exists()
    resumed = run(faulty_study(cells=30), output=output)
    have_same_numbers(resumed, run(faulty_study(cells=30)))


def test_a_worker_of_another_version_is_refused(cluster, monkeypatch):
    other = {**provenance.collect_code_fingerprint(), "scipy": "0.1"}
    monkeypatch.setattr(provenance, "collect_code_fingerprint", lambda *_used: other)
    with pytest.raises(RunError, match=r"a worker has scipy .*, but this run has 0\.1"):
        run(client=cluster)


def test_nothing_listens_beyond_this_machine(cluster):
    """Scheduler, nannies and workers listen on the loopback interface only."""
    processes = {os.getpid(), *cluster.run(os.getpid).values()}
    assert len(processes) == 3
    for process in processes:
        sockets = psutil.Process(process).net_connections("inet")
        listening = [found.laddr for found in sockets if found.status == psutil.CONN_LISTEN]
        assert listening
        assert [a for a in listening if not ipaddress.ip_address(a.ip).is_loopback] == []


def test_a_scheduler_by_tls():
    """The client uses the certificates of the Dask configuration."""
    from distributed import LocalCluster, Security

    security = Security.temporary()
    pem = security.get_tls_config_for_role("client")
    names = {f"distributed.comm.tls.{name}": pem[key] for name, key in (
        ("ca-file", "ca_file"), ("client.cert", "cert"), ("client.key", "key"))}  # fmt: skip
    with LocalCluster(
        1, processes=False, protocol="tls", security=security, **QUIET_CLUSTER_OPTIONS
    ) as encrypted:
        connected = functools.partial(
            dask_clusters.connect_to_cluster, encrypted.scheduler_address, timeout=HANG_TIMEOUT
        )
        with dask.config.set(names), connected() as client:
            have_same_numbers(run(client=client), run())
        with pytest.raises(RunError, match=r"ssl_context.*certificates for tls://"), connected():
            pass


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:1", "nonsense", "tcp://", "http://127.0.0.1:1", "tcp://[", "", " "]
)
def test_a_scheduler_that_does_not_answer_is_named(address):
    with (
        pytest.raises(RunError, match=re.escape(f"no Dask scheduler responds at {address!r}")),
        dask_clusters.connect_to_cluster(address, timeout=0.3),
    ):
        pass


def test_a_port_that_listens_and_says_nothing():
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with (
            pytest.raises(RunError, match="no Dask scheduler responds"),
            dask_clusters.connect_to_cluster(address, timeout=0.3),
        ):
            pass


# ---- the files of the page ----------------------------------------------------------------------


def test_the_slurm_job_is_what_it_says(tmp_path, monkeypatch):
    from dask_jobqueue import SLURMCluster

    monkeypatch.setenv("HOME", str(tmp_path))  # The certificates are written to the home directory.
    job = runpy.run_path(str(CLUSTERS / "slurm.py"))["JOB_OPTIONS"]
    with SLURMCluster(**job, scheduler_options={"dashboard_address": "127.0.0.1:0"}) as cluster:
        script = cluster.job_script()
        assert cluster.scheduler_address.startswith("tls://")
    assert "#SBATCH --cpus-per-task=16" in script
    assert re.search("--nthreads 1 .*--nworkers 16 ", script)
    assert re.search("tls://.*--tls-ca-file ~/.dask-jobqueue", script)


#: Source of a script that replaces SLURM jobs by local processes.
LOCAL_JOBS = """
import functools, runpy, sys
from dask_jobqueue.local import LocalCluster

def cluster(walltime, queue, **words):
    started = LocalCluster(**words)
    assert started.scheduler_address.startswith("tls://")
    return started

command = runpy.run_path(sys.argv[1])["command"]
names = command.callback.__globals__
names["main"] = functools.partial(
    names["main"], cluster=cluster, jobs=1, cores=1, processes=1, memory="2GB",
    python=sys.executable, death_timeout=1200, shared_temp_directory=".",
    scheduler_options={"dashboard_address": "127.0.0.1:0"},
)
command(sys.argv[2:])
"""


def test_the_slurm_script_runs_a_study(tmp_path):
    script = [sys.executable, "-c", LOCAL_JOBS, str(CLUSTERS / "slurm.py")]
    given = ["--set", "law=slip", "--rtol", "1e-5", "--engine", "compiled", "--output", "there"]
    words = [*script, "rigid_response", *given]
    ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "reproduced" in ran.stdout
    results = rsfstudy.open(tmp_path / "there" / "rigid_response.nc")
    assert results["law"].values.tolist() == ["slip"]
    accuracy = results.rsf.study.accuracy
    assert (accuracy.rtol, accuracy.engine) == (1e-5, "compiled")


def test_the_kubernetes_file_joins_its_parts():
    """The parts of the Kubernetes file refer to each other.

    The cluster of these tests is started with the same commands.
    """
    service = PARTS["Service", "rsfstudy-scheduler"]["spec"]
    labels, scheduler = container("rsfstudy-scheduler")
    workers, worker = container("rsfstudy-workers")
    port = service["ports"][0]
    assert service["selector"] == labels
    assert {"containerPort": port["targetPort"]} in scheduler["ports"]
    assert f"tcp://rsfstudy-scheduler:{port['port']}" in worker["args"]
    policy = PARTS["NetworkPolicy", "rsfstudy"]["spec"]
    (allowed,) = policy["podSelector"]["matchExpressions"]
    assert allowed["values"] == [labels["app"], workers["app"]]
    assert policy["ingress"] == [{"from": [{"podSelector": policy["podSelector"]}]}]
