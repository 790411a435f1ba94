#!/usr/bin/env python3
"""Rollout steps a second from Python beside those of the planner's own search, of one scene in one run: rollouts.py [SCENE].

The search's are those that it asked for, over the time of the search; those from Python repeat its very pushes, in
batches of 256 from the start. PYTHONPATH=build/python.
"""
import sys
import time

import numpy as np

import limber

scene = sys.argv[1] if len(sys.argv) > 1 else "barriers1"
world = limber.World(limber.Scene(scene, preset="paper"))
batch = 256
print(f"{scene}: {world.nodes} nodes, step {1e3 * world.dt_s:.3g} ms")
for threads in (1, 2):
    plan = world.plan(seed=1, iterations=400, threads=threads)
    done = plan.summary["statistics"]
    search = done["rollout_steps"] / done["wall_s"]
    steps = np.random.default_rng(1).integers(int(0.2 / world.dt_s), int(1 / world.dt_s), batch)
    force = np.random.default_rng(2).normal(size=(batch, 3)).astype(np.float32) * 30
    pushes = limber.pushes(batch, force_n=force, steps=steps)
    start = world.start(batch)
    world.rollout(start, pushes, threads=threads)
    rates = []
    for _ in range(5):
        began = time.perf_counter()
        world.rollout(start, pushes, threads=threads)
        rates.append(steps.sum() / (time.perf_counter() - began))
    print(f"{threads} threads: search {search:.0f} steps/s, Python {np.median(rates):.0f} ({np.median(rates) / search:.2f} ×)")
