"""Functions of (setting, seed) that workers in other processes can import."""

import os
import time
from pathlib import Path

import numpy as np

SETTINGS = [{"scale": 1, "way": "plain"}, {"scale": 10, "way": "plain"}, {"scale": 1, "way": "sum"}]
METRICS = ["x", "y"]


def steady(setting, seed):
    """Two numbers; `y` is missing for every third seed."""
    draws = np.random.default_rng(seed).normal(size=4) * setting["scale"]
    figures = {"x": float(draws.sum() if setting["way"] == "sum" else draws[0])}
    return figures | ({"y": float(draws[1])} if seed % 3 else {})


def unlucky(setting, seed):
    if seed == 13:
        raise ValueError("an unlucky,\nnumber")
    return steady(setting, seed)


def dies_once(setting, seed):
    marker = Path(setting["folder"]) / f"died-{seed}"
    if seed == 4 and not marker.exists():
        marker.touch()
        os._exit(9)
    return {"x": float(seed), "y": 0.0}


def dies(setting, seed):
    if seed == 4:
        os._exit(9)
    return {"x": float(seed), "y": 0.0}


def slow(setting, seed):
    """Leaves word of who does it, so that a test can kill that one."""
    word = Path(setting["folder"]) / f"{os.getpid()}.working"
    word.touch()
    time.sleep(0.15)
    return steady({"scale": 1, "way": "plain"}, seed)
