"""The bodies and load cases of the references: what is held, what is loaded, how much. Lengths in mm, forces in mN."""

import os
from dataclasses import dataclass, replace

import numpy as np

import meshes
import other_meshes


@dataclass
class Load:
    """A dead load, spread over flat triangles: a uniform traction of this total force, or (turn) the traction
    c axis x (x - centre) of this total moment along the axis, mN mm, about the patch's centroid."""

    patch: str
    force: tuple = (0, 0, 0)
    turn: float = 0
    axis: tuple = (1, 0, 0)


@dataclass
class Case:
    name: str
    fix: str
    load: Load
    increments: int = 2  # least number of load increments


@dataclass
class Body:
    name: str
    mesh: str  # relative to the project
    young: float  # Pa
    density: float  # kg / m3
    regions: dict  # name: set of vertices, as a function of the vertices and their outward normals
    cases: list
    grids: dict  # region held: meshes.Grid of the study of the mesh error, each finer at the region's rim than the last
    kept: dict  # region held: number of the grid whose nonlinear results are written
    poisson: float = 0.45
    cut: tuple = ()  # regions held with all that lies behind them, not by their surface alone
    modes: int = 5  # 0: static cases only
    step: tuple = ("tip", 0.4)  # damped step response: the load of this case times this factor
    vertices: np.ndarray = None
    triangles: np.ndarray = None
    normals: np.ndarray = None

    def kept_grid(self, case):
        return self.kept[case.fix]

    def read(self, project):
        self.vertices, self.triangles = meshes.read_obj(os.path.join(project, self.mesh))
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        area = np.cross(b - a, c - a) / 2
        self.normals = np.zeros_like(self.vertices)
        for k in range(3):
            np.add.at(self.normals, self.triangles[:, k], area)
        self.normals /= np.linalg.norm(self.normals, axis=1)[:, None]

    def patch(self, region):
        """Numbers of the triangles that have all three corners in a region."""
        inside = self.regions[region](self.vertices, self.normals)
        triangles = np.nonzero(inside[self.triangles].all(axis=1))[0]
        if not len(triangles):
            raise RuntimeError(f"{self.name}: no triangle in region {region}")
        return triangles

    def held(self, region):
        """Vertices of the patch of a region."""
        return np.unique(self.triangles[self.patch(region)])

    def area(self, patch):
        a, b, c = (self.vertices[self.triangles[patch, k]] for k in range(3))
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    def traction(self, load):
        """The traction (kPa) as a function of the points (n x 3) of the load's patch."""
        patch = self.patch(load.patch)
        area = self.area(patch)
        corners = self.vertices[self.triangles[patch]]
        centre = (corners.mean(axis=1) * area[:, None]).sum(axis=0) / area.sum()
        axis = np.array(load.axis, float) / np.linalg.norm(load.axis)
        # Second moment of the patch about the axis: edge middles integrate a quadratic over a triangle exactly.
        middle = (corners + corners[:, [1, 2, 0]]) / 2
        lever = np.cross(axis, middle - centre)
        polar = ((lever**2).sum(axis=2).mean(axis=1) * area).sum()
        uniform = np.array(load.force, float) / area.sum()
        return lambda x: uniform + load.turn / polar * np.cross(axis, x - centre)


def within(centre, radius):
    return lambda x, n: np.linalg.norm(x - centre, axis=1) < radius


def beyond(axis, distance):
    return lambda x, n: x @ np.array(axis) > distance


def box(low, high):
    return lambda x, n: ((x > low) & (x < high)).all(axis=1)


def grids(*numbers):
    return [meshes.Grid(m, times) for m, times in zip(numbers[::2], numbers[1::2])]


def cylinder():
    # Angles are multiples of 20 degrees: the bed is 80 degrees wide, the patches 40 and 80.
    regions = {
        "root": box((-1, -99, -99), (0.1, 99, 99)),
        "tip": beyond((1, 0, 0), 99.9),
        "belt": box((44.9, -99, -99), (55.1, 99, 99)),
        "bed": box((-1, -11, -99), (101, -7, 99)),
        "small": box((44.9, 9.3, -99), (55.1, 11, 99)),
        "large": box((39.9, 7.6, -99), (60.1, 11, 99)),
    }
    cases = [
        Case("tip", "root", Load("tip", (0, 0, 1.2))),
        Case("tip_large", "root", Load("tip", (0, 0, 12)), 4),
        Case("mid", "root", Load("belt", (0, 0, 24)), 4),
        Case("axial", "root", Load("tip", (627, 0, 0)), 4),
        Case("torsion", "root", Load("tip", turn=260), 4),
        Case("poke_small", "bed", Load("small", (0, -200, 0)), 3),
        Case("poke_large", "bed", Load("large", (0, -500, 0)), 3),
    ]
    return Body("cylinder", "tests/accuracy/cylinder.obj", 10e3, 1000, regions, cases, modes=8,
                grids={"root": grids(1, 2, 1, 4, 2, 4), "bed": grids(1, 0, 1, 2, 1, 4)}, kept={"root": 2, "bed": 2})


def gallbladder():
    # The axis from neck to fundus; side points to the patient's left, front away from the liver.
    axis = np.array((-0.4887, -0.6834, 0.5423))
    side = np.array((0.8138, -0.5812, 0.0))
    front = np.cross(axis, side) * np.sign(np.cross(axis, side)[2])
    body, belly = np.array((-55.5, -43.0, 12.0)), np.array((-50.0, -36.5, 24.0))
    regions = {
        "root": lambda x, n: x @ axis < 24,
        "tip": beyond(axis, 89.5),
        "fundus": beyond(axis, 75),
        "flank": within(body - 15 * side, 11),
        "bed": lambda x, n: (n @ front < -0.6) & (x @ axis > 40),
        "small": within(belly, 8),
        "large": within(belly, 13),
    }
    cases = [
        Case("tip", "root", Load("tip", tuple(6 * side))),
        Case("tip_large", "root", Load("tip", tuple(18 * side)), 4),
        Case("mid", "root", Load("flank", tuple(30 * side)), 4),
        Case("axial", "root", Load("tip", tuple(700 * axis)), 4),
        Case("torsion", "root", Load("tip", turn=500, axis=tuple(axis)), 4),
        Case("twist", "root", Load("fundus", turn=600, axis=tuple(axis)), 4),
        Case("poke_small", "bed", Load("small", tuple(-200 * front)), 3),
        Case("poke_large", "bed", Load("large", tuple(-500 * front)), 3),
    ]
    return Body("gallbladder", "assets/gallbladder/gallbladder.obj", 9e3, 1040, regions, cases,
                grids={"root": grids(1, 4, 2, 4, 2, 6), "bed": grids(1, 4, 1, 6, 1, 8)}, kept={"root": 2, "bed": 2},
                cut=("root",))


def liver():
    front = np.array((0.0, 0.0, 1.0))
    regions = {
        "root": box((-130, 20, -80), (-20, 120, -38)),
        "tip": beyond((1, 0, 0), 55),
        "border": within((-29, -30, 15), 20),
        "bed": lambda x, n: n @ front < -0.7,
        "small": within((-73, 33, 30), 16),
        "large": within((-73, 33, 30), 27),
    }
    cases = [
        Case("tip", "root", Load("tip", (0, 0, 300))),
        Case("tip_in_plane", "root", Load("tip", (0, 400, 0))),
        Case("mid", "root", Load("border", (0, 0, 400))),
        Case("axial", "root", Load("tip", (1200, 0, 0))),
        Case("torsion", "root", Load("tip", turn=15000)),
        Case("poke_small", "bed", Load("small", (0, 0, -500)), 4),
        Case("poke_large", "bed", Load("large", (0, 0, -1500)), 4),
    ]
    return Body("liver", "assets/liver/liver.obj", 5e3, 1060, regions, cases,
                grids={"root": grids(1, 2, 1, 4, 1, 6), "bed": grids(1, 0, 1, 2, 1, 4)}, kept={"root": 2, "bed": 2})


def stomach():
    curvature, away = np.array((108.0, -26.0, 25.0)), np.array((0.625, -0.214, 0.751))
    oesophagus, duodenum = within((17, 108, -40), 30), within((-38, -85, -30), 35)
    regions = {
        "root": lambda x, n: oesophagus(x, n) | duodenum(x, n),
        "curvature": within(curvature, 25),
        "front": within((40.0, -60.0, 40.0), 20),
    }
    cases = [
        Case("pull", "root", Load("curvature", tuple(15 * away)), 4),
        Case("press", "root", Load("front", (0, 0, -15)), 4),
    ]
    return Body("stomach", "assets/stomach/stomach.obj", 7e3, 1040, regions, cases,
                grids={"root": grids(1, 4, 1, 6, 1, 8)}, kept={"root": 1}, modes=0)


# The same bodies and loads on meshes that other_meshes.py makes: bending and a pull each.


def liver_stretched():
    stretch = np.array(other_meshes.LIVER_STRETCH)
    body = liver()
    regions = {name: lambda x, n, inside=inside: inside(x / stretch, n) for name, inside in body.regions.items()}
    cases = [Case("tip", "root", Load("tip", (0, 0, 200))), Case("axial", "root", Load("tip", (1000, 0, 0)))]
    return replace(body, name="liver_stretched", mesh="tests/accuracy/liver_stretched.obj", regions=regions, cases=cases,
                   modes=0)


def gallbladder_remeshed(name, rim, kept):
    body = gallbladder()
    along = {case.name: case for case in body.cases}["axial"].load.force
    pull = Case("pull", "root", Load("tip", tuple(np.array(along) / 7)), 4)
    cases = [case for case in body.cases if case.name == "tip_large"] + [pull]
    return replace(body, name=name, mesh=f"tests/accuracy/{name}.obj", cases=cases, grids={"root": rim},
                   kept={"root": kept}, modes=0)


def kidney():
    regions = {"root": within((17, 0, 0), 20), "pole": beyond((0, 1, 0), 44)}
    cases = [Case("tip", "root", Load("pole", (0, 0, 300))), Case("axial", "root", Load("pole", (0, 1000, 0)), 4)]
    return Body("kidney", "tests/accuracy/kidney.obj", 6e3, 1050, regions, cases, grids={"root": grids(1, 2, 1, 3, 1, 4)},
                kept={"root": 1}, modes=0)


def cube():
    # As bulky as bodies get, under loads of half of Young's modulus and of once and a half over the middle of a side.
    middle = lambda axis: box(*(tuple(a if k == axis else b for k in range(3)) for a, b in ((29.9, 8.9), (31, 21.1))))
    regions = {"root": box((-1, -99, -99), (0.1, 99, 99)), "end": middle(0)}
    cases = [
        Case("pull", "root", Load("end", (1500, 0, 0)), 4),
        Case("pull_far", "root", Load("end", (4000, 0, 0)), 4),
        Case("shear", "root", Load("end", (0, 2000, 0)), 4),
    ]
    return Body("cube", "tests/accuracy/cube.obj", 20e3, 1000, regions, cases, grids={"root": grids(1, 0, 1, 2)},
                kept={"root": 1}, modes=0)


def bodies():
    remeshed = [gallbladder_remeshed("gallbladder_halved", grids(2, 4, 2, 6, 2, 8), 2),
                gallbladder_remeshed("gallbladder_doubled", grids(1, 4, 2, 4, 2, 6), 1)]
    return [cylinder(), gallbladder(), liver(), stomach(), liver_stretched(), *remeshed, kidney(), cube()]
