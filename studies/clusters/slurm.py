"""Run a named study on a SLURM cluster: ``python slurm.py rate_step_boundary``, and options as of
``rsfstudy run``: ``--set``, ``--rtol``, ``--engine``, ``--output``.

Run it on a login node, in the environment in which rsfstudy is installed (with dask-jobqueue); it
submits jobs, waits for the first, and ends them when the study is done.
"""

import shlex
import sys
from collections.abc import Mapping
from typing import Any

import click
import distributed
from dask_jobqueue.slurm import SLURMCluster

import rsfstudy
from rsfstudy.cli import assignments, options
from rsfstudy.study import catalogue

#: One job: 16 worker processes of one thread each, because a cell keeps its thread busy.
JOB_OPTIONS = {
    "cores": 16,
    "processes": 16,
    "memory": "32GB",
    "walltime": "02:00:00",
    "queue": "normal",  # your partition
    # "account": "...", "interface": "ib0", as your site asks for
    # encryption, with certificates for this cluster only: without it, everybody on the login node
    # could run code in your name
    "security": True,
    # a directory of yours that all nodes see; workers read the certificates from it
    "shared_temp_directory": "~",
}
JOBS = 4


def main(
    study: str,
    choices: Mapping[str, Any],
    cluster: type = SLURMCluster,
    jobs: int = JOBS,
    **job: object,
) -> None:
    """Start a cluster, run a study on it as `rsfstudy.run` does, and say what came out."""
    with cluster(**{**JOB_OPTIONS, **job}) as nodes, distributed.Client(nodes) as client:
        nodes.scale(jobs=jobs)
        client.wait_for_workers(1)
        dataset = rsfstudy.run(study, client=client, **choices)
    print(rsfstudy.check(dataset)[["id", "claim", "published", "ours", "verdict"]].to_string())


@click.command()
@click.argument("study")
@options.set_option
@options.rtol_option
@options.engine_option
@options.output_option
def command(study: str, settings: tuple[str, ...], **choices: Any) -> None:
    """Run a study on SLURM, by its NAME or file."""
    overrides = assignments.parse_overrides(catalogue.load_study(study), settings)
    main(study, {**choices, **overrides, "command": shlex.join(sys.argv)})


if __name__ == "__main__":
    command()
