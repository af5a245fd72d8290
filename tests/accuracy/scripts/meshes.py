"""Meshes of the references: the project's closed triangle surfaces, filled with quadratic tetrahedra.

A body is the polyhedron of its physics mesh, flat triangles and all, so that a reference and the program speak of the
same shape. A grid splits every triangle into equal ones and refines the rim of
what is held before tetgen fills it; tetgen keeps the surface (-Y), so that
vertex v of the physics mesh is node v of every grid. Lengths in mm.
"""

import os
import subprocess
from collections import namedtuple

import numpy as np

from whole_files import publish

# Edges of a quadratic tetrahedron in the order of its mid-edge nodes 5 to 10 (CalculiX C3D10).
TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))


# How a surface is refined: every triangle into parts * parts, then `halvings` passes at the rims of
# what is held and what is loaded.
Grid = namedtuple("Grid", "parts halvings")


def rim_size(grid):
    """Edges at the rim over those of the physics mesh: two halvings of the longest edge halve a triangle's size."""
    return 2 ** (-grid.halvings / 2) / grid.parts


def read_obj(path):
    """Vertices (n x 3, mm) and triangles (m x 3, from 0) of an OBJ file in metres."""
    vertices, triangles = [], []
    with open(path) as file:
        for line in file:
            word = line.split()
            if word[:1] == ["v"]:
                vertices.append([1000 * float(x) for x in word[1:4]])
            elif word[:1] == ["f"]:
                triangles.append([int(x.split("/")[0]) - 1 for x in word[1:4]])
    return np.array(vertices), np.array(triangles)


def cylinder(length=100.0, radius=10.0, segments=18, stations=20):
    """A prism along +x that stands for a cylinder, root at x = 0: rings of vertices, caps with one inner ring and a
    centre. The rings are not turned against each other, so that the section is the same regular polygon everywhere."""
    angle = 2 * np.pi * np.arange(segments) / segments
    ring = np.column_stack([np.zeros(segments), radius * np.cos(angle), radius * np.sin(angle)])
    vertices = [ring + [length * k / stations, 0, 0] for k in range(stations + 1)]
    triangles = []
    node = lambda k, j: k * segments + j % segments
    for k in range(stations):
        for j in range(segments):
            a, b, c, d = node(k, j), node(k + 1, j), node(k + 1, j + 1), node(k, j + 1)
            # Diagonals alternate: no direction is preferred.
            triangles += [(a, c, b), (a, d, c)] if (j + k) % 2 else [(a, d, b), (b, d, c)]
    first = (stations + 1) * segments
    for end, x in ((0, 0.0), (stations, length)):
        inner = ring[::2] * 0.5 + [x, 0, 0]
        vertices += [inner, [[x, 0, 0]]]
        half, centre = segments // 2, first + segments // 2
        cap = []
        for i in range(half):
            p, q = first + i, first + (i + 1) % half
            cap += [(centre, p, q), (p, node(end, 2 * i), node(end, 2 * i + 1)), (p, node(end, 2 * i + 1), q),
                    (q, node(end, 2 * i + 1), node(end, 2 * i + 2))]
        triangles += [t[::-1] for t in cap] if end == 0 else cap
        first += half + 1
    return np.vstack(vertices), np.array(triangles)


def write_obj(path, name, vertices, triangles):
    rows = [f"# {name}: metres, {len(vertices)} vertices, {len(triangles)} triangles; made by tests/accuracy\n"]
    rows.append(f"o {name}\n")
    rows += ["v %.7f %.7f %.7f\n" % tuple(v / 1000 + 0.0) for v in vertices]
    rows += ["f %d %d %d\n" % tuple(t + 1) for t in triangles]
    publish(path, "".join(rows))


def volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def split(vertices, triangles, m):
    """Every triangle in m * m: vertices (old ones first), triangles, and of each triangle its parent."""
    points, lookup = list(vertices), {}

    def point(corners, weights):
        # A point is known by its corners with their weights, so that neighbours share it.
        key = tuple(sorted((int(c), w) for c, w in zip(corners, weights) if w))
        if len(key) == 1:
            return key[0][0]
        if key not in lookup:
            lookup[key] = len(points)
            points.append(sum(vertices[c] * (w / m) for c, w in key))
        return lookup[key]

    result, parent = [], []
    for number, corners in enumerate(triangles):
        grid = {(i, j): point(corners, (m - i - j, i, j)) for i in range(m + 1) for j in range(m + 1 - i)}
        for i in range(m):
            for j in range(m - i):
                result.append((grid[i, j], grid[i + 1, j], grid[i, j + 1]))
                if i + j < m - 1:
                    result.append((grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]))
        parent += [number] * (m * m)
    return np.array(points), np.array(result), np.array(parent)


def boundary(triangles):
    """Edges (pairs, lower number first) that belong to one of these triangles only."""
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    found, count = np.unique(edges, axis=0, return_counts=True)
    return [tuple(edge) for edge in found[count == 1].tolist()]


def grade(points, triangles, parent, rim, times):
    """Halves the triangles that touch an edge of the rim, `times` over: where a held surface ends, the stress is
    singular (displacements as the root of the distance), and equal elements would converge in the first order only.
    Longest edges are halved, and first those of neighbours that are longer (Rivara 1984), so that no node hangs and
    angles stay bounded."""
    points, triangles, parent, rim = list(points), triangles.tolist(), parent.tolist(), set(rim)
    edge = lambda a, b: (min(a, b), max(a, b))
    sides = {}
    for t, (a, b, c) in enumerate(triangles):
        for side in (edge(a, b), edge(b, c), edge(c, a)):
            sides.setdefault(side, []).append(t)

    def longest(t):
        a, b, c = triangles[t]
        # Ties go to the lower numbers, from both sides of the edge.
        return min((edge(a, b), edge(b, c), edge(c, a)), key=lambda e: (-round(length(e), 9), e))

    def length(e):
        return float(np.linalg.norm(points[e[0]] - points[e[1]]))

    def halve(side):
        middle = len(points)
        points.append(0.5 * (points[side[0]] + points[side[1]]))
        for t in sides.pop(side):
            corner = triangles[t]
            k = next(k for k in range(3) if corner[k] not in side)
            apex, p, q = corner[k], corner[(k + 1) % 3], corner[(k + 2) % 3]
            new = len(triangles)
            triangles[t] = [apex, p, middle]
            triangles.append([apex, middle, q])
            parent.append(parent[t])
            sides[edge(apex, q)].remove(t)
            sides[edge(apex, q)].append(new)
            sides.setdefault(edge(p, middle), []).append(t)
            sides.setdefault(edge(middle, q), []).append(new)
            sides[edge(apex, middle)] = [t, new]
        if side in rim:
            rim.remove(side)
            rim.update((edge(side[0], middle), edge(middle, side[1])))

    def bisect(t):
        while True:
            side = longest(t)
            other = next((n for n in sides[side] if n != t), t)
            if longest(other) == side:
                return halve(side)
            bisect(other)

    for _ in range(times):
        touched = {node for side in rim for node in side}
        for t, corner in [(t, corner) for t, corner in enumerate(triangles) if touched & set(corner)]:
            if triangles[t] is corner:  # else a neighbour has halved it already
                bisect(t)
    return np.array(points), np.array(triangles), np.array(parent)


def cut_off(vertices, triangles, held):
    """Without the material behind what is held: its triangles go, and a fan about the middle of their rim closes the body.
    Vertices with the fan's centre as the last, triangles, and of each the number before; the fan's is that of one held."""
    free = np.setdiff1d(np.arange(len(triangles)), held)
    edges = {edge for edge in boundary(triangles[held])}
    loop = [(b, a) for t in triangles[free].tolist() for a, b in zip(t, t[1:] + t[:1]) if (min(a, b), max(a, b)) in edges]
    centre = vertices[[a for a, _ in loop]].mean(axis=0)
    fan = [(a, b, len(vertices)) for a, b in loop]
    numbers = np.concatenate([free, np.full(len(fan), held[0])])
    return np.vstack([vertices, centre]), np.vstack([triangles[free], fan]), numbers


def run_tetgen(folder, vertices, triangles, largest):
    """Fills a closed surface with tetrahedra of at most `largest` mm3: nodes (the surface's first) and corners."""
    path = os.path.join(folder, "surface.off")
    with open(path, "w") as file:
        file.write(f"OFF\n{len(vertices)} {len(triangles)} 0\n")
        file.writelines("%.17g %.17g %.17g\n" % tuple(v) for v in vertices)
        file.writelines("3 %d %d %d\n" % tuple(t) for t in triangles)
    done = subprocess.run(["tetgen", f"-pYQq1.4a{largest:.6g}", path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    stem = os.path.join(folder, "surface.1.")
    if done.returncode or not os.path.exists(stem + "ele"):
        raise RuntimeError("tetgen failed: " + done.stdout.decode()[-300:])
    rows = {}
    for kind in ("node", "ele"):
        with open(stem + kind) as file:
            lines = [line.split() for line in file if line.strip() and not line.startswith("#")]
        rows[kind] = lines[1:]
    nodes = np.array([[float(x) for x in row[1:4]] for row in rows["node"]])
    tets = np.array([[int(x) for x in row[1:5]] for row in rows["ele"]]) - int(rows["node"][0][0])
    if not np.allclose(nodes[: len(vertices)], vertices, rtol=0, atol=1e-9):
        raise RuntimeError("tetgen moved or renumbered vertices of the surface")
    corner = nodes[tets]
    six = np.einsum("ij,ij->i", np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]),
                    corner[:, 3] - corner[:, 0])
    tets[six < 0] = tets[six < 0][:, [1, 0, 2, 3]]
    return nodes, tets


class TetMesh:
    """Quadratic tetrahedra: nodes (n x 3, mm; the physics mesh's vertices first), tets (t x 10), surface triangles of
    six nodes (corners, then the middles of edges 01, 12, 20) with the physics triangle that each is a part of."""

    def __init__(self, folder, vertices, triangles, grid, held, loaded, cut):
        edge = np.linalg.norm(vertices[triangles] - vertices[triangles[:, [1, 2, 0]]], axis=2).mean() / grid.parts
        self.place = np.arange(len(vertices))  # node of each vertex of the physics mesh; -1 where cut off
        self.whole = volume(vertices, triangles)
        numbers = np.arange(len(triangles))
        if cut:
            vertices, triangles, numbers = cut_off(vertices, triangles, held)
            used = np.unique(triangles)
            compact = np.full(len(vertices), -1)
            compact[used] = np.arange(len(used))
            self.place, vertices, triangles = compact[:-1], vertices[used], compact[triangles]
        surface, small, parent = split(vertices, triangles, grid.parts)
        self.parent = numbers[parent]
        rim = [edge for patch in (held, loaded) for edge in boundary(small[np.isin(self.parent, patch)])]
        surface, small, self.parent = grade(surface, small, self.parent, rim, grid.halvings)
        # Ten regular tetrahedra on the mean edge: inside, edges of twice the length of those on the surface at most.
        nodes, tets = run_tetgen(folder, surface, small, 10 * edge**3 / 8.485)
        points, middle = list(nodes), {}
        self.tets = np.zeros((len(tets), 10), int)
        self.tets[:, :4] = tets
        for k, (i, j) in enumerate(TET_EDGES):
            for t, pair in enumerate(np.sort(tets[:, [i, j]], axis=1).tolist()):
                pair = tuple(pair)
                if pair not in middle:
                    middle[pair] = len(points)
                    points.append(0.5 * (nodes[pair[0]] + nodes[pair[1]]))
                self.tets[t, 4 + k] = middle[pair]
        self.nodes = np.array(points)
        between = lambda a, b: middle[(min(a, b), max(a, b))]
        self.faces = np.array([(a, b, c, between(a, b), between(b, c), between(c, a)) for a, b, c in small.tolist()])
        self.surface_nodes = np.unique(self.faces)

    def at_vertices(self, field):
        """The rows of the nodes (n x 3) that are vertices of the physics mesh; what is cut off stays in place."""
        return np.where(self.place[:, None] < 0, 0, field[self.place])

    def volume_ratio(self, displacement):
        """Of the whole body: each six-node face as four flat triangles."""
        f = self.faces
        flat = np.vstack([f[:, [0, 3, 5]], f[:, [3, 1, 4]], f[:, [5, 4, 2]], f[:, [3, 4, 5]]])
        return 1 + (volume(self.nodes + displacement, flat) - volume(self.nodes, flat)) / self.whole
