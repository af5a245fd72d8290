"""Writes the results: text, a header of "# key value" lines and then whitespace columns of integers (../README.md).
Every file is written beside its place and renamed when whole. Here mm and mN become SI."""

import os

import numpy as np

import meshes
import study
from whole_files import publish

UNIT = 1e-7  # m, of the displacement columns: a hundred-thousandth of the largest


def numbers(values, digits=8):
    """Digits that a reader gets back; zero has no sign."""
    return " ".join("%.*g" % (digits, v + 0.0) for v in np.atleast_1d(values))


def clean(vector, scale):
    """Without the rounding of sums that cancel."""
    return np.where(np.abs(vector) < 1e-7 * scale, 0, vector)


def header(entries):
    return "".join(f"# {key} {value}\n" for key, value in entries)


def body_entries(body, case):
    return [
        ("case", f"{body.name}_{case}"),
        ("body", body.name),
        ("mesh", body.mesh),
        ("vertices", len(body.vertices)),
        ("young", numbers(body.young) + " Pa"),
        ("poisson", numbers(body.poisson)),
        ("density", numbers(body.density) + " kg/m3"),
    ]


def columns(values):
    return "".join(" ".join("%d" % v for v in row) + "\n" for row in np.rint(values).astype(int))


def write_fix(folder, body, region):
    name = f"{body.name}_{region}.fix.csv"
    publish(os.path.join(folder, name), "vertex\n" + "".join("%d\n" % v for v in body.held(region)))
    return name


def write_load(folder, body, case):
    """Forces on the vertices, N: the program's own way to name a load."""
    forces = study.vertex_forces(body, case.load) / 1000
    forces = clean(forces, np.abs(forces).max())
    name = f"{body.name}_{case.name}.load.csv"
    rows = ["vertex,fx[N],fy[N],fz[N]\n"]
    for v in np.nonzero(forces.any(axis=1))[0]:
        rows.append("%d,%.10g,%.10g,%.10g\n" % (v, *(forces[v] + 0.0)))
    publish(os.path.join(folder, name), "".join(rows))
    return name, forces


def mesh_entries(error):
    return [
        ("mesh_size_rim", numbers(error.size, 4) + " of the physics mesh's edges"),
        ("mesh_nodes", numbers(error.nodes)),
        ("mesh_change_max", numbers(error.change[:, 0], 3) + " %"),
        ("mesh_order", numbers(error.order, 3) + (" assumed" if len(error.size) < 3 else "")),
        ("mesh_error_max", numbers(error.error[0], 3) + " %"),
        ("mesh_error_rms", numbers(error.error[1], 3) + " %"),
        ("displacement_max_extrapolated", numbers(error.extrapolated / 1000, 6) + " m"),
    ]


def write_static(folder, body, case, kept, error):
    fix, (load, forces) = write_fix(folder, body, case.fix), write_load(folder, body, case)
    u, points = kept.displacement / 1000, body.vertices / 1000
    total, moment = forces.sum(axis=0), np.cross(points, forces).sum(axis=0)
    scale = np.abs(forces).sum()
    turned = np.cross(points + u, forces).sum(axis=0)
    along = (forces * u).sum() / np.linalg.norm(forces, axis=1).sum()
    entries = body_entries(body, case.name) + [
        ("material", "neo-Hooke W = mu/2 (I1 J^(-2/3) - 3) + K/2 (J - 1)^2; large displacements"),
        ("fix", fix + (" and all material behind" if case.fix in body.cut else "")),
        ("load", load + " dead"),
        ("force", numbers(clean(total, scale)) + " N"),
        ("moment", numbers(clean(moment, scale * 0.1)) + " Nm about the origin, at rest"),
        ("moment_deformed", numbers(clean(turned, scale * 0.1)) + " Nm about the origin, vertices displaced"),
        ("reaction_force", numbers(clean(kept.reaction / 1000, scale)) + " N"),
        ("reaction_moment", numbers(clean(kept.reaction_moment / 1e6, scale * 0.1)) + " Nm about the origin"),
        ("strain_energy", numbers(kept.energy / 1e6) + " J"),
        ("work", numbers(kept.work / 1e6, 6) + " J of the load as it grew"),
        ("volume", numbers(meshes.volume(points, body.triangles)) + " m3"),
        ("volume_ratio", numbers(meshes.volume(points + u, body.triangles) / meshes.volume(points, body.triangles), 7)),
        ("volume_ratio_fine", numbers(kept.volume_ratio, 7)),
        ("displacement_max", numbers(study.largest(u)) + " m"),
        ("displacement_load", numbers(along, 5) + " m, along the forces, mean weighted by them"),
    ]
    entries += mesh_entries(error)
    entries += [("mesh_kept", "%d nodes" % kept.nodes), ("unit", "1e-7 m"), ("columns", "ux uy uz")]
    publish(os.path.join(folder, f"{body.name}_{case.name}.txt"), header(entries) + columns(u / UNIT))
