"""Solves the cases of one body on its meshes, and says how far the meshes are from the truth."""

import numpy as np

import calculix
import meshes

# Points and weights of a rule of degree 4 on a triangle (Dunavant 1985): exact for linear traction and quadratic shapes.
POINTS = [(1 - 2 * a, a, a) for a in (0.445948490915965, 0.091576213509771)]
RULE = [(np.roll(p, k), w) for p, w in zip(POINTS, (0.223381589678011, 0.109951743655322)) for k in range(3)]


def largest(vectors):
    return np.linalg.norm(vectors, axis=1).max()


def difference(a, b, scale):
    """Largest and root mean square distance of two fields in percent of the largest displacement of `scale`."""
    distance = np.linalg.norm(a - b, axis=1)
    return 100 * np.array((distance.max(), np.sqrt((distance**2).mean()))) / largest(scale)


def vertex_forces(body, load):
    """The load on the vertices of the physics mesh (n x 3, mN): the integral of traction times linear shape."""
    patch = body.patch(load.patch)
    area, traction, forces = body.area(patch), body.traction(load), np.zeros_like(body.vertices)
    for shape, weight in RULE:
        corners = body.triangles[patch]
        t = traction(np.einsum("k,nkx->nx", shape, body.vertices[corners]))
        for k in range(3):
            np.add.at(forces, corners[:, k], (weight * area * shape[k])[:, None] * t)
    return forces


def node_forces(body, mesh, load):
    """The same load, consistent with the mesh's quadratic faces (n x 3, mN)."""
    faces = mesh.faces[np.isin(mesh.parent, body.patch(load.patch))]
    a, b, c = (mesh.nodes[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    traction, forces = body.traction(load), np.zeros_like(mesh.nodes)
    for (p, q, r), weight in RULE:
        t = traction(p * a + q * b + r * c)
        for k, shape in enumerate((p * (2 * p - 1), q * (2 * q - 1), r * (2 * r - 1), 4 * p * q, 4 * q * r, 4 * r * p)):
            np.add.at(forces, faces[:, k], (weight * area * shape)[:, None] * t)
    return forces


def fixed_nodes(body, mesh, region):
    return np.unique(mesh.faces[np.isin(mesh.parent, body.patch(region))])


class Solved:
    """A case on one mesh: displacements of the vertices (mm), reactions, energies and volume."""

    def __init__(self, body, mesh, case, states, seconds):
        last, forces = states[-1], node_forces(body, mesh, case.load)
        self.displacement, self.seconds, self.nodes = mesh.at_vertices(last.displacement), seconds, len(mesh.nodes)
        self.reaction = last.reaction.sum(axis=0)
        self.reaction_moment = np.cross(mesh.nodes, last.reaction).sum(axis=0)
        self.energy = last.energy
        # The load does the work of its share s(t) along the path: polynomial through the increments, W = int s dw.
        share = np.array([0] + [s.time for s in states])
        path = np.array([0] + [(forces * np.nan_to_num(s.displacement)).sum() for s in states])
        fit = np.polynomial.polynomial.polyfit(share, path, len(states))
        self.work = path[-1] - np.polynomial.polynomial.polyval(1, np.polynomial.polynomial.polyint(fit))
        self.volume_ratio = mesh.volume_ratio(np.nan_to_num(last.displacement))


def solve(folder, body, mesh, case, linear):
    fixed = fixed_nodes(body, mesh, case.fix)
    deck = calculix.model_text(mesh, body, fixed, mesh.surface_nodes, linear)
    deck += calculix.static_step(node_forces(body, mesh, case.load), 0 if linear else case.increments)
    text, seconds = calculix.run(folder, deck)
    states = calculix.static_states(text, len(mesh.nodes))
    if abs(states[-1].time - 1) > 1e-9:
        raise RuntimeError(f"{body.name} {case.name}: the load was not reached")
    return Solved(body, mesh, case, states, seconds)


def observed_order(change, size):
    """p of u(h) = u + C h^p from the changes between three sizes h; between 0.5 (worse than any theory) and 4."""
    a, b, c = size
    model = lambda p: (a**p - b**p) / (b**p - c**p)
    low, high = 0.5, 4.0
    for _ in range(60):
        p = (low + high) / 2
        low, high = (p, high) if model(p) * change[1] < change[0] else (low, p)
    return low


def remaining(change, coarse, fine, order):
    """Richardson: the error of the finer of two sizes from the change between them."""
    return change * fine**order / (coarse**order - fine**order)


# Where there are two grids only: that of a surface held up to a rim, whose singularity holds any element back.
ASSUMED_ORDER = 1.0


class MeshError:
    """The mesh error of a case, in percent of its largest displacement: at most, and root mean square. The order comes
    from small displacements on all grids; the error is that of the grid whose results are kept."""

    def __init__(self, grids, kept, linear, nonlinear):
        self.size = [meshes.rim_size(g) for g in grids]
        self.nodes = [s.nodes for s in linear]
        fields = [s.displacement for s in linear]
        self.change = np.array([difference(a, b, fields[-1]) for a, b in zip(fields, fields[1:])])
        self.order = observed_order(self.change[:, 1], self.size) if len(grids) == 3 else ASSUMED_ORDER
        finest = remaining(self.change[-1], *self.size[-2:], self.order)
        self.error = finest + difference(fields[kept], fields[-1], fields[-1])
        if kept:
            # The nonlinear solutions have a change of their own: the larger estimate counts.
            coarse, fine = (nonlinear[i].displacement for i in (kept - 1, kept))
            own = remaining(difference(coarse, fine, fine), *self.size[kept - 1 : kept + 1], self.order)
            self.error = np.maximum(self.error, own)
        large = [largest(f) for f in fields]
        limit = large[-1] + remaining(large[-1] - large[-2], *self.size[-2:], self.order)
        self.extrapolated = largest(nonlinear[kept].displacement) * limit / large[kept]


class Study:
    """Meshes of one body, made once each, and what is solved on them."""

    def __init__(self, folder, body, say):
        self.folder, self.body, self.say, self.meshes, self.linear = folder, body, say, {}, {}

    def mesh(self, case, grid):
        body, key = self.body, (case.fix, case.load.patch, grid)
        if key not in self.meshes:
            self.meshes[key] = meshes.TetMesh(self.folder, body.vertices, body.triangles, grid, body.patch(case.fix),
                                              body.patch(case.load.patch), case.fix in body.cut)
        return self.meshes[key]

    def small(self, case):
        """Small displacements on every grid. Cases that differ by the size of the load share them, up to this size."""
        direction = np.array(case.load.force) / (np.linalg.norm(case.load.force) or 1)
        key = (case.fix, case.load.patch, tuple(direction.round(9)), case.load.turn)
        if key not in self.linear:
            self.linear[key] = []
            for grid in self.body.grids[case.fix]:
                solved = solve(self.folder, self.body, self.mesh(case, grid), case, True)
                self.say(f"{self.body.name} {case.name} small, {solved.nodes} nodes: {solved.seconds:.1f} s, "
                         f"{largest(solved.displacement):.4f} mm")
                self.linear[key].append(solved)
        return self.linear[key]

    def case(self, case):
        """The nonlinear solution that is kept, by grid number with the one before it, and its mesh error."""
        grids, kept, nonlinear = self.body.grids[case.fix], self.body.kept_grid(case), {}
        linear = self.small(case)
        for i in range(max(0, kept - 1), kept + 1):
            nonlinear[i] = solve(self.folder, self.body, self.mesh(case, grids[i]), case, False)
            self.say(f"{self.body.name} {case.name}, {nonlinear[i].nodes} nodes: {nonlinear[i].seconds:.1f} s, "
                     f"{largest(nonlinear[i].displacement):.4f} mm")
        return nonlinear, MeshError(grids, kept, linear, nonlinear)

    def modes(self, case, grid, count):
        """Frequencies (Hz), mass-normalised shapes at the nodes (modes x n x 3, 1 / sqrt(kg); zero inside), seconds."""
        mesh = self.mesh(case, grid)
        deck = calculix.model_text(mesh, self.body, fixed_nodes(self.body, mesh, case.fix), mesh.surface_nodes, True)
        text, seconds = calculix.run(self.folder, deck + calculix.frequency_step(count))
        frequencies, shapes = calculix.modes(text, len(mesh.nodes))
        found = " ".join(f"{f:.4f}" for f in frequencies)
        self.say(f"{self.body.name} modes, {len(mesh.nodes)} nodes: {seconds:.1f} s, {found} Hz")
        return np.array(frequencies), np.nan_to_num(shapes), seconds
