"""How long a campaign of knits takes on a cluster, on paper: prices of the sample, placed on nodes one after the other.

    python benchmarks/makespan.py                # 200 knits, 1 to 1,000 nodes of one core

What takes seconds runs on the cores of the head node, as ``profiles/slurm`` has it; a simulation goes into the queue
when its geometry is there, and takes the first node that is free. Prices are those of a model setting in
``resources/trade.csv``, drawn again with replacement. Prints the table of docs/how-to/cluster.md.
"""

from __future__ import annotations

import argparse
import heapq
from collections.abc import Sequence

import numpy as np
import pandas as pd

from knitstudy.run.advice import SECONDS, TRADE_KEPT

LOCAL = 4.0  # Seconds of geometry and mesh, and again of contacts, with the start of their jobs
# Seconds until a job computes, which begins with two starts of Snakemake, and until Snakemake sees its end
START, SEEN = 8.0, 40.0
NODES = 1, 3, 10, 30, 100, 300, 1000
CORES = 2, 8, 32  # of the head node, `--local-cores`
SEED = 47


def makespan(seconds: Sequence[float], nodes: int, cores: int = 2) -> float:
    """Return when the last knit is done [s]: geometry and contacts on cores of the head node, simulation on a node.

    Examples
    --------
    >>> makespan([60.0], 1) == LOCAL + START + 60 + SEEN + LOCAL
    True
    """
    free = [0.0] * nodes
    head = [0.0] * cores
    ends = []
    for price in seconds:
        ready = heapq.heappop(head) + LOCAL
        heapq.heappush(head, ready)
        end = max(ready, heapq.heappop(free)) + START + price
        heapq.heappush(free, end)
        ends.append(end + SEEN)
    for end in sorted(ends):
        heapq.heappush(head, max(end, heapq.heappop(head)) + LOCAL)
    return max(head)


def main() -> None:
    """Print the makespan over nodes and cores of the head node, and how busy the nodes are with most of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--knits", type=int, default=200)
    parser.add_argument("--case", default="cut-knit-touching")
    parser.add_argument("--setting", default="yarns3", help="model setting of config/trade.yaml")
    asked = parser.parse_args()
    table = pd.read_csv(TRADE_KEPT)
    of = table[(table["case"] == asked.case) & (table["model setting"] == asked.setting)]
    prices = of.drop_duplicates("knit")[SECONDS].dropna().to_numpy()
    seconds = np.random.default_rng(SEED).choice(prices, asked.knits)
    print(
        f"{asked.knits} knits, {asked.setting}: {seconds.sum() / 3600:.2f} h, the longest {seconds.max():.0f} s"
    )
    print("| nodes | " + " | ".join(f"{cores} local cores" for cores in CORES) + " | nodes busy |")
    print("|---" * (2 + len(CORES)) + "|")
    for nodes in NODES:
        took = [makespan(seconds, nodes, cores) for cores in CORES]
        minutes = " | ".join(f"{each / 60:.1f} min" for each in took)
        print(f"| {nodes:,} | {minutes} | {seconds.sum() / (took[-1] * nodes):.0%} |")


if __name__ == "__main__":
    main()
