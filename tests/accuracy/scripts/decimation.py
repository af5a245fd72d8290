"""Closed triangle surfaces with fewer triangles: edges collapse in the order of the quadric error (Garland and Heckbert
1997). Deterministic: ties go to the lower vertices."""

import heapq

import numpy as np

SHAPE_MIN = 0.2  # of a triangle: area over that of a regular one with the same sum of squared edges
TURN_MIN = 0.3  # cosine: how far a triangle's normal may turn
EVEN = 1e-3  # of the squared edge: where a surface is flat, short edges go first


def plane_quadrics(points, triangles):
    """4 x 4 per triangle, weighted by area: x^T Q x is area times the squared distance of (x, 1) from its plane."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1) / 2
    normal /= 2 * area[:, None]
    plane = np.column_stack([normal, -(normal * a).sum(axis=1)])
    return area[:, None, None] * plane[:, :, None] * plane[:, None, :]


class Collapse:
    """The surface as it shrinks: points, live triangles by vertex, quadrics, and the queue of edges by cost."""

    def __init__(self, points, triangles):
        self.points = [p for p in np.array(points, float)]
        self.triangles = [tuple(t) for t in np.array(triangles).tolist()]
        self.around = [set() for _ in self.points]
        self.quadric = [np.zeros((4, 4)) for _ in self.points]
        for t, (corners, q) in enumerate(zip(self.triangles, plane_quadrics(np.array(points), np.array(triangles)))):
            for v in corners:
                self.around[v].add(t)
                self.quadric[v] = self.quadric[v] + q
        self.version = [0] * len(self.points)
        self.queue = []
        for edge in sorted({(min(a, b), max(a, b)) for t in self.triangles for a, b in zip(t, t[1:] + t[:1])}):
            self.push(*edge)

    def push(self, a, b):
        q = self.quadric[a] + self.quadric[b]
        p0, p1 = self.points[a], self.points[b]
        length = ((p1 - p0) ** 2).sum()
        # The quadric's least point, drawn to the edge's middle where the surface is flat; areas weigh the quadric.
        pull = 1e-3 * np.trace(q[:3, :3])
        middle = (p0 + p1) / 2
        place = np.linalg.solve(q[:3, :3] + pull * np.eye(3), pull * middle - q[:3, 3])
        if ((place - middle) ** 2).sum() > length:
            place = middle
        x = np.append(place, 1)
        cost = x @ q @ x + EVEN * length * np.trace(q[:3, :3])
        heapq.heappush(self.queue, (cost, a, b, self.version[a], self.version[b], tuple(place)))

    def ring(self, v):
        return {w for t in self.around[v] for w in self.triangles[t]} - {v}

    def keeps_shape(self, a, b, place):
        for v in (a, b):
            for t in self.around[v] - (self.around[a] & self.around[b]):
                before = [self.points[w] for w in self.triangles[t]]
                after = [place if w == v else self.points[w] for w in self.triangles[t]]
                m, n = (np.cross(c[1] - c[0], c[2] - c[0]) for c in (before, after))
                size = sum(((after[k] - after[k - 1]) ** 2).sum() for k in range(3))
                if m @ n < TURN_MIN * np.linalg.norm(m) * np.linalg.norm(n):
                    return False
                if np.linalg.norm(n) * 2 * 3**0.5 < SHAPE_MIN * size:
                    return False
        return True

    def step(self):
        """Collapses the cheapest edge that may; whether there was one."""
        while self.queue:
            _, a, b, of_a, of_b, place = heapq.heappop(self.queue)
            if (of_a, of_b) != (self.version[a], self.version[b]) or not self.around[a] or not self.around[b]:
                continue
            # Two common neighbours: any third would leave an edge of four triangles.
            if len(self.ring(a) & self.ring(b)) != 2 or not self.keeps_shape(a, b, np.array(place)):
                continue
            self.merge(a, b, np.array(place))
            return True
        return False

    def merge(self, a, b, place):
        for t in self.around[a] & self.around[b]:
            for v in self.triangles[t]:
                if v != a:
                    self.around[v].discard(t)
            self.around[a].discard(t)
            self.triangles[t] = None
        for t in self.around[b]:
            self.triangles[t] = tuple(a if v == b else v for v in self.triangles[t])
        self.around[a] |= self.around[b]
        self.around[b] = set()
        self.points[a], self.quadric[a] = place, self.quadric[a] + self.quadric[b]
        ring = sorted(self.ring(a))
        for v in ring + [a]:
            self.version[v] += 1
        edges = {(min(v, w), max(v, w)) for v in ring + [a] for w in self.ring(v)}
        for edge in sorted(edges):
            self.push(*edge)


def decimate(points, triangles, count):
    """Vertices and triangles of about the same shape, `count` triangles or one fewer."""
    work = Collapse(points, triangles)
    live = len(triangles)
    while live > count:
        if not work.step():
            raise RuntimeError(f"{live} triangles left of {len(triangles)}: no edge may collapse")
        live -= 2
    used = sorted({v for t in work.triangles if t for v in t})
    number = {v: k for k, v in enumerate(used)}
    return (np.array([work.points[v] for v in used]),
            np.array([[number[v] for v in t] for t in work.triangles if t]))
