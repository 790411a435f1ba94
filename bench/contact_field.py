#!/usr/bin/env python3
"""How exact the distances are that contact reads near a surface: contact_field.py BODY_FOLDER…

Of a prepared body (limber prepare), 1,500 places up to some 2 mm off its samples. Once by the field's value φ, as
contact takes it, and once by φ/|∇φ|, the slope no less than ½: error against the nearest triangle. PYTHONPATH=build/python.
"""
import json
import sys

import numpy as np

import limber


def distance_to_triangles(places, a, b, c):
    def to_segments(p, start, way):
        t = np.clip(((p - start) * way).sum(1) / np.maximum((way * way).sum(1), 1e-30), 0, 1)
        return ((start + t[:, None] * way - p) ** 2).sum(1)

    middle = (a + b + c) / 3
    reach = np.sqrt(np.max([((corner - middle) ** 2).sum(1) for corner in (a, b, c)], 0))
    found = []
    for p in places:
        to_middle = np.sqrt(((middle - p) ** 2).sum(1))
        near = to_middle - reach <= to_middle.min()
        x, u, v = a[near], (b - a)[near], (c - a)[near]
        normal, way = np.cross(u, v), p - x
        area2 = np.maximum((normal * normal).sum(1), 1e-30)
        s, t = (np.cross(way, v) * normal).sum(1) / area2, (np.cross(u, way) * normal).sum(1) / area2
        edges = np.minimum(np.minimum(to_segments(p, x, u), to_segments(p, x, v)), to_segments(p, x + u, v - u))
        above = (s >= 0) & (t >= 0) & (s + t <= 1)
        found.append(np.sqrt(np.where(above, (way * normal).sum(1) ** 2 / area2, edges).min()))
    return np.array(found)


for folder in sys.argv[1:]:
    rng = np.random.default_rng(1)
    contact = np.load(folder + "/contact.npz")
    meta = json.loads(contact["meta.json"])
    field = contact["field"].transpose(2, 1, 0) * meta["unit_m"]
    body = limber.load_body(folder)
    samples = contact["sample_positions_m"]
    places = samples[rng.choice(len(samples), 1500)] + rng.normal(size=(1500, 3)) * 0.5e-3
    cells = (places - meta["lower_m"]) / meta["cell_m"]
    low = np.clip(np.floor(cells).astype(int), 0, np.array(field.shape) - 2)
    part = cells - low
    value, slope = np.zeros(len(places)), np.zeros((len(places), 3))
    for corner in np.ndindex(2, 2, 2):
        at = field[tuple((low + corner).T)]
        weight = np.where(corner, part, 1 - part)
        value += at * weight.prod(1)
        for k in range(3):
            slope[:, k] += at * (2 * corner[k] - 1) * np.delete(weight, k, 1).prod(1) / meta["cell_m"]
    steep = np.linalg.norm(slope, axis=1)
    faces = np.asarray(body.vertices)[np.asarray(body.faces)]
    truth = distance_to_triangles(places, faces[:, 0], faces[:, 1], faces[:, 2])
    print(f"{folder}: cells of {1e3 * meta['cell_m']:.2f} mm, slope {np.quantile(steep, 0.05):.2f} in the twentieth least")
    for name, distance in (("value", np.abs(value)), ("value/slope", np.abs(value) / np.maximum(steep, 0.5))):
        error = 1e3 * np.abs(distance - truth)
        print(f"  {name:12} error {error.mean():.3f} mm in the mean, 99 % within {np.quantile(error, 0.99):.2f}")
