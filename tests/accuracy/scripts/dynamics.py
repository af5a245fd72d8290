"""Natural frequencies with their shapes, and the damped response to a load that appears at once. Both linear."""

import os
from dataclasses import replace

import numpy as np

import meshes
import result_files
import study
from result_files import numbers
from whole_files import publish

COMPUTED = 14  # modes: those written, and more for the step response
DAMPING = 0.05  # ratio of the first mode in the step response
PERIODS, ROWS_PER_PERIOD = 4, 50


def align(frequencies, shapes, weights):
    """A body of revolution has its bending modes in pairs, and any mixture of the two is a mode: turned so that the
    first moves its tip along y alone. Signs: the largest component of the whole mode is positive."""
    shapes = shapes.copy()
    i = 0
    while i < len(shapes):
        if i + 1 < len(shapes) and frequencies[i + 1] < 1.005 * frequencies[i]:
            a, b = (np.einsum("v,vx->x", weights, s) for s in shapes[i : i + 2])
            angle = np.arctan2(a[2], b[2])
            c, s = np.cos(angle), np.sin(angle)
            shapes[i], shapes[i + 1] = c * shapes[i] - s * shapes[i + 1], s * shapes[i] + c * shapes[i + 1]
            i += 1
        i += 1
    for s in shapes:
        s *= np.sign(s.flat[np.abs(s).argmax()])
    return shapes


def step_share(frequency, beta, t):
    """Response of a mode to a step, over its static value. Damping by stiffness alone: zeta = beta omega / 2."""
    omega = 2 * np.pi * frequency
    zeta = beta * omega / 2
    if zeta < 1:
        damped = omega * np.sqrt(1 - zeta**2)
        return 1 - np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))
    root = omega * np.sqrt(zeta**2 - 1)
    fast, slow = zeta * omega + root, omega**2 / (zeta * omega + root)
    return 1 - (fast * np.exp(-slow * t) - slow * np.exp(-fast * t)) / (fast - slow)


class MeshError:
    """Of frequencies (Hz, signed: they come from above) and of the static displacement (%), by Richardson."""

    def __init__(self, grids, frequencies, static, nodes):
        self.size, self.nodes = [meshes.rim_size(g) for g in grids], nodes
        self.order = study.observed_order(np.abs(np.diff(frequencies, axis=0)).max(axis=1), self.size)
        self.frequencies = study.remaining(frequencies[-2] - frequencies[-1], *self.size[-2:], self.order)
        self.static = 100 * abs(study.remaining(static[-1] - static[-2], *self.size[-2:], self.order)) / static[-1]


def write_modes(folder, body, frequencies, error, shapes, fix):
    count = body.modes
    frequencies = frequencies[:count]
    scale = np.linalg.norm(shapes, axis=2).max(axis=1)
    entries = result_files.body_entries(body, "modes") + [
        ("material", "linear elastic, small displacements"),
        ("fix", fix),
        ("modes", count),
        ("frequencies", numbers(frequencies, 7) + " Hz"),
        ("modal_masses", numbers(1 / scale**2, 6) + " kg of the shapes below"),
        ("mesh_size_rim", numbers(error.size, 4) + " of the physics mesh's edges"),
        ("mesh_nodes", numbers(error.nodes)),
        ("mesh_order", numbers(error.order, 3)),
        ("mesh_error", numbers(100 * error.frequencies / frequencies, 3) + " %"),
        ("frequencies_extrapolated", numbers(frequencies - error.frequencies, 7) + " Hz"),
        ("unit", "1e-4 of the largest displacement of the mode"),
        ("columns", "ux uy uz of every mode in turn"),
    ]
    table = np.concatenate([s / c for s, c in zip(shapes, scale)], axis=1)
    publish(os.path.join(folder, f"{body.name}_modes.txt"),
            result_files.header(entries) + result_files.columns(table / 1e-4))


def step_response(body, mesh, load, static, frequencies, shapes, beta):
    """Times (s) and displacement of the loaded vertices (mm, mean weighted by the load). The static solution stands in
    for the modes that were not computed: at great stiffness beta governs alone, and a mode tends to
    1 - exp(-t / beta)."""
    forces, nodal = study.vertex_forces(body, load), study.node_forces(body, mesh, load)
    weights = np.linalg.norm(forces, axis=1) / np.linalg.norm(forces, axis=1).sum()
    # mN on shapes of 1 / sqrt(kg): 1e-3; the square of the frequency in rad/s; metres to mm: 1e3.
    amplitudes = np.einsum("nx,mnx->m", nodal, shapes) / (2 * np.pi * frequencies) ** 2
    mean = np.array([weights @ mesh.at_vertices(s) for s in shapes]) * amplitudes[:, None]
    final = weights @ static
    t = np.round(np.arange(PERIODS * ROWS_PER_PERIOD + 1) / ROWS_PER_PERIOD / frequencies[0], 5)
    response = (final - mean.sum(axis=0)) * (1 - np.exp(-t / beta))[:, None]
    for amplitude, f in zip(mean, frequencies):
        response = response + amplitude * step_share(f, beta, t)[:, None]
    return t, response, final, mean.sum(axis=0)


def write_step(folder, body, case, fix, load, beta, frequencies, response, error):
    t, u, final, modal = response
    along = u @ final / np.linalg.norm(final)
    peak = along.argmax()
    entries = result_files.body_entries(body, "step") + [
        ("material", "linear elastic, small displacements"),
        ("fix", fix),
        ("load", load + " dead, whole from t = 0; at rest before"),
        ("force", numbers(np.array(case.load.force) / 1000) + " N"),
        ("rayleigh_alpha", "0 1/s"),
        ("rayleigh_beta", numbers(beta) + f" s, ratio {DAMPING:g} of the first mode"),
        ("frequencies", numbers(frequencies, 7) + " Hz of the modes summed; the static rest follows beta"),
        ("static", numbers(final / 1000, 7) + " m"),
        ("static_share_of_modes", numbers(modal @ final / (final @ final), 6)),
        ("peak", numbers(along[peak] / 1000, 6) + f" m along the static displacement at {t[peak]:g} s"),
        ("mesh_error_static", numbers(error.static, 3) + " %"),
        ("mesh_error_time", numbers(100 * error.frequencies[0] / frequencies[0], 3) + " % of the first period"),
        ("unit", "1e-5 s, then 1e-7 m"),
        ("columns", "t ux uy uz of the loaded vertices, mean weighted by the load"),
    ]
    rows = np.column_stack([t / 1e-5, u / 1000 / result_files.UNIT])
    publish(os.path.join(folder, f"{body.name}_step.txt"),
            result_files.header(entries) + result_files.columns(rows))


def make(folder, solved):
    body, (name, factor) = solved.body, solved.body.step
    case = next(c for c in body.cases if c.name == name)
    small = solved.small(case)  # linear: a factor scales it
    case = replace(case, name="step", load=replace(case.load, force=tuple(factor * f for f in case.load.force)))
    fix, (load, forces) = result_files.write_fix(folder, body, case.fix), result_files.write_load(folder, body, case)
    grids = body.grids[case.fix]
    found = [solved.modes(case, grid, COMPUTED) for grid in grids]
    frequencies, shapes = [f for f, _, _ in found], found[-1][1]
    error = MeshError(grids, np.array(frequencies)[:, : body.modes], [study.largest(s.displacement) for s in small],
                      [s.nodes for s in small])
    beta = DAMPING / (np.pi * frequencies[-1][0])
    mesh, final = solved.mesh(case, grids[-1]), factor * small[-1].displacement
    response = step_response(body, mesh, case.load, final, frequencies[-1], shapes, beta)
    write_step(folder, body, case, fix, load, beta, frequencies[-1], response, error)
    weights = np.linalg.norm(forces, axis=1)
    shapes = align(frequencies[-1], np.array([mesh.at_vertices(s) for s in shapes[: body.modes]]), weights)
    write_modes(folder, body, frequencies[-1], error, shapes, fix)
