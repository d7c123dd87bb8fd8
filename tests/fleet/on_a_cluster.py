"""Prints the rows that a cluster of two worker processes gives, one of which dies on the way; or what is said of no cluster."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[2])]


def main(folder: str, address: str = "") -> None:
    from distributed import LocalCluster

    from gateway.fleet.engines import EngineError, cluster
    from gateway.fleet.tasks import Task, find_tasks
    from tests.fleet.workers import die_at_some

    if address:
        try:
            list(cluster(address)(die_at_some, [Task("x", "", "", "")]))
        except EngineError as error:
            print(error)
        return
    tasks = find_tasks([f"{folder}/cell=*/date=*/*.csv"])
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as two:
        found = dict(cluster(two.scheduler_address)(die_at_some, tasks))
    print([found[task] for task in tasks])


if __name__ == "__main__":
    main(*sys.argv[1:])
