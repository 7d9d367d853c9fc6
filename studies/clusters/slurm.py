"""Script that runs a named study on a SLURM cluster.

Run ``python slurm.py rate_step_boundary`` on a login node, in an environment with rsfstudy and
dask-jobqueue. The options ``--set``, ``--rtol``, ``--engine`` and ``--output`` have the same
meaning as for ``rsfstudy run``. The script submits jobs, waits for the first job to start, and
cancels the jobs after the study has finished.
"""

import shlex
import sys
from collections.abc import Mapping
from typing import Any

import click
import distributed
from dask_jobqueue.slurm import SLURMCluster

import rsfstudy
from rsfstudy.cli import assignment_parsing, options
from rsfstudy.study import study_loader

#: Options of one job. Each of the 16 worker processes has one thread, because the computation of a
#: cell keeps one thread busy.
JOB_OPTIONS = {
    "cores": 16,
    "processes": 16,
    "memory": "32GB",
    "walltime": "02:00:00",
    "queue": "normal",  # name of your partition
    # Add "account": "..." or "interface": "ib0" if your site requires them.
    # Use encryption with temporary certificates. Without encryption, all users of the login node
    # could run code under your account.
    "security": True,
    # A directory of yours that is visible on all nodes. Workers read the certificates from this
    # directory.
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
    """Run a study on a cluster, and print the verdicts on its claims.

    Parameters
    ----------
    study : str
        Name of the study, or path of a study file.
    choices : mapping
        Keyword arguments of ``rsfstudy.run``.
    cluster : type, optional
        Class of the cluster.
    jobs : int, optional
        Number of jobs.
    **job : object
        Options that replace ``JOB_OPTIONS``.
    """
    with cluster(**{**JOB_OPTIONS, **job}) as nodes, distributed.Client(nodes) as client:
        nodes.scale(jobs=jobs)
        client.wait_for_workers(1)
        dataset = rsfstudy.run(study, client=client, **choices)
    print(rsfstudy.check(dataset)[["id", "claim", "published", "computed", "verdict"]].to_string())


@click.command()
@click.argument("study")
@options.set_axis_values_option
@options.rtol_option
@options.engine_option
@options.output_directory_option
def command(study: str, settings: tuple[str, ...], **choices: Any) -> None:
    """Run a named study or a study file (STUDY) on a SLURM cluster."""
    overrides = assignment_parsing.parse_overrides(study_loader.load_study(study), settings)
    main(study, {**choices, **overrides, "command": shlex.join(sys.argv)})


if __name__ == "__main__":
    command()
