#!/usr/bin/env python3
"""Rollouts from Python beside the same from C++ by the planner's own propagator: rollouts.py PROGRAM [SCENE].

PROGRAM is build/bench/rollouts_bench; PYTHONPATH=build/python. Both start 256 pushes from states along a planned path, where bodies touch.
"""
import subprocess
import sys
import tempfile
import time

import numpy as np

import limber

program, scene = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "barriers1"
count, rounds = 256, 5
folder = tempfile.TemporaryDirectory()
world = limber.World(limber.Scene(scene, preset="fast"), folder.name)
frames = world.plan(seed=1).states
i = np.arange(count)
states = limber.States(*(numbers[i % len(frames.steps)] for numbers in frames))
pushes = limber.pushes(count, force_n=np.stack([7 * i % 61 - 30, 13 * i % 61 - 30, 0 * i], axis=1), steps=20 + 7 * i % 80)
steps = int(pushes["steps"].sum())
print(f"{scene}: {world.nodes} nodes, {count} rollouts, {steps} steps")
for threads in (1, 2):
    python = []
    for _ in range(rounds):
        began = time.perf_counter()
        ends = world.rollout(states, pushes, threads=threads)
        python.append(time.perf_counter() - began)
    told = subprocess.run([program, scene, folder.name, str(threads)], check=True, capture_output=True, text=True).stdout.split()
    same = abs(float(told[1]) - float(world.robot_centers(ends).sum())) < 1e-6
    python_s, cpp_s = np.median(python), float(told[0])
    print(f"{threads} threads: C++ {steps / cpp_s:.0f} steps/s, Python {steps / python_s:.0f} ({cpp_s / python_s:.2f} ×), "
          f"{'the same ends' if same else 'OTHER ENDS'}")
