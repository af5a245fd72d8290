"""Meshes that the program's own shapes do not come in: an organ stretched, one of twice and half the triangles, and two
bodies of formulas. Vertices in mm, triangles from 0."""

import os

import numpy as np

import decimation
import meshes


def liver_stretched(project):
    """Longer, flatter across and thicker: by 1.3, 0.8 and 1.1."""
    points, triangles = meshes.read_obj(os.path.join(project, "assets/liver/liver.obj"))
    return points * LIVER_STRETCH, triangles


LIVER_STRETCH = np.array((1.3, 0.8, 1.1))


def gallbladder_decimated(project, triangles):
    """From the drawn shape of 20 000 triangles: none of the vertices is one of the physics mesh."""
    return decimation.decimate(*meshes.read_obj(os.path.join(project, "assets/gallbladder/gallbladder_fine.obj")), triangles)


def sphere(passes):
    """An icosahedron, every triangle in four `passes` times, on the unit sphere."""
    g = (1 + 5**0.5) / 2
    points = np.array([(s, t * g, 0) for s in (-1, 1) for t in (-1, 1)] + [(0, s, t * g) for s in (-1, 1) for t in (-1, 1)]
                      + [(t * g, 0, s) for s in (-1, 1) for t in (-1, 1)], float)
    triangles = []
    for i in range(12):
        for j in range(i):
            for k in range(j):
                if all(abs(np.linalg.norm(points[a] - points[b]) - 2) < 1e-6 for a, b in ((i, j), (j, k), (k, i))):
                    outward = np.linalg.det(points[[i, j, k]]) > 0
                    triangles.append((i, j, k) if outward else (i, k, j))
    triangles = np.array(triangles)
    for _ in range(passes):
        points /= np.linalg.norm(points, axis=1)[:, None]
        points, triangles, _ = meshes.split(points, triangles, 2)
    return points / np.linalg.norm(points, axis=1)[:, None], triangles


def kidney():
    """A bean, 115 mm from pole to pole along y and bent about the hilum on its side of +x, where the renal sinus makes a
    dent; flatter from front to back, the upper pole the thicker."""
    unit, triangles = sphere(3)
    y = 57 * unit[:, 1]
    taper = 1 + 0.12 * unit[:, 1]
    x, z = 29 * taper * unit[:, 0], 21 * taper * unit[:, 2]
    dent = 12 * np.exp(-((y / 17) ** 2) - (z / 13) ** 2) * np.clip(unit[:, 0], 0, 1)
    points = np.column_stack([x - dent + 0.006 * y**2, y, z])
    return points, triangles


def cube():
    """30 mm wide, 10 by 10 squares a side, their diagonals turning from each to the next."""
    count, width = 10, 30
    index, points, triangles = {}, [], []

    def vertex(axis, level, i, j):
        at = [0, 0, 0]
        at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3] = level, i, j
        if tuple(at) not in index:
            index[tuple(at)] = len(points)
            points.append([x * width / count for x in at])
        return index[tuple(at)]

    for axis in range(3):
        for level in (0, count):
            for i in range(count):
                for j in range(count):
                    ring = [vertex(axis, level, i + a, j + b) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                    if level == 0:
                        ring.reverse()
                    if (i + j) % 2:
                        ring = ring[1:] + ring[:1]
                    triangles += [ring[:3], [ring[0], ring[2], ring[3]]]
    return np.array(points), np.array(triangles)


def write_missing(project):
    """A minute for the gallbladder's two."""
    makers = {
        "liver_stretched": lambda: liver_stretched(project),
        "gallbladder_halved": lambda: gallbladder_decimated(project, 232),
        "gallbladder_doubled": lambda: gallbladder_decimated(project, 932),
        "kidney": kidney,
        "cube": cube,
    }
    for name, make in makers.items():
        path = os.path.join(project, "tests/accuracy", name + ".obj")
        if not os.path.exists(path):
            meshes.write_obj(path, name, *make())
