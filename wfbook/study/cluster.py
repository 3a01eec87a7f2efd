"""Cases through Dask: on this machine's cores or, by the same code, on the workers of any scheduler."""

import contextlib
import logging
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from wfbook.study.case import Case, execute, versions

if TYPE_CHECKING:
    from distributed import Client

PATIENCE_S = 20.0
"""How long a scheduler may take to answer and to have a worker."""

_AHEAD = 3
"""Cases that are given out for each worker's thread, finished or not."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_HERE = "127.0.0.1"
# Without pages to serve, what Dask's HTTP servers answer is "not found".
_NO_PAGES = {f"distributed.{part}.http.routes": [] for part in ("scheduler", "worker", "nanny")}
# An interrupt from the keyboard goes to all processes, but it is for this program to end its workers.
_IGNORE_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


class ClusterError(RuntimeError):
    """The cluster can't run the study."""


@contextlib.contextmanager
def local(workers: int) -> Iterator["Client"]:
    """Start workers on this machine, each a process with one thread, and one for BLAS.

    Everything listens at 127.0.0.1 only, and there is no dashboard.
    """
    import dask
    from distributed import Client, LocalCluster

    with dask.config.set(_NO_PAGES):
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            host=_HERE,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": f"{_HERE}:0"},
            silence_logs=logging.CRITICAL,
            env=dict.fromkeys(_THREADS, "1"),
            preload=[_IGNORE_INTERRUPTS],
        )
        with cluster, Client(cluster) as client:
            yield client


@contextlib.contextmanager
def remote(address: str) -> Iterator["Client"]:
    """Use the workers of a scheduler, which stay when the study ends.

    Raises:
        ClusterError: there is none, or it has no workers.
    """
    from distributed import Client

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(f"--scheduler {address!r}: {' '.join(str(error).split())}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE_S)
        except TimeoutError:
            raise ClusterError(f"--scheduler {address!r} has no workers") from None
        yield client


def results(
    client: "Client", cases: dict[str, Case], plans: dict[str, bytes]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Run cases and yield their rows in the order in which they finish.

    Only a few cases a worker are given out at a time, each with its plan: what a scheduler holds stays small
    whatever the study, and workers may come and go. A case whose worker dies is given to another, and if
    that happens again and again, it is a row with an error.

    Args:
        client: of the cluster.
        cases: by key, in the order in which they are to be run.
        plans: content of the plan files by digest.

    Yields:
        A key and the row of :func:`wfbook.study.case.execute`.

    Raises:
        ClusterError: the scheduler was lost, or a worker can't run wfbook, or another version of it.
    """
    from distributed import as_completed

    coming = iter(cases)
    asked: dict[Any, str] = {}
    finished = as_completed(loop=client.loop, raise_errors=False)

    def give_out() -> None:
        room = _AHEAD * max(1, sum(client.nthreads().values())) - len(asked)
        for _, key in zip(range(room), coming, strict=False):
            case = cases[key]
            future = client.submit(execute, case, plans[case.plan], key=f"case-{key}", pure=False)
            asked[future] = key
            finished.add(future)

    give_out()
    while asked:
        future = next(finished)
        key = asked.pop(future)
        row = _row(future, cases[key])
        future.release()
        give_out()
        yield key, row


def _row(future: Any, case: Case) -> dict[str, Any]:
    """Return what a case gave; a row with an error if it kills its workers."""
    from distributed import KilledWorker

    if future.status == "finished":
        row = future.result()
        theirs, ours = row["versions"], versions()
        for name in ours:
            if theirs.get(name) != ours[name]:
                raise ClusterError(
                    f"worker {row['worker']} has {name} {theirs.get(name)}, this program {ours[name]}"
                )
        return row
    if future.status != "error":
        raise ClusterError("the scheduler was lost")
    error = future.exception()
    if isinstance(error, KilledWorker):
        return case.row() | {"error": "KilledWorker: every worker that ran it died", "traceback": str(error)}
    raise ClusterError(f"a worker can't run cases: {type(error).__name__}: {' '.join(str(error).split())}")
