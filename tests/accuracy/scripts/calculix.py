"""CalculiX decks, runs and results. Units of the decks: mm, s, mN, kPa (= mN/mm2), kg, so that every number is near
one: the solver's tolerances know no units."""

import os
import re
import subprocess
import time

import numpy as np


def lists(numbers):
    """Node or element numbers for a set, from 1, eight to a line."""
    numbers = [str(n + 1) for n in numbers]
    return "".join(",".join(numbers[i : i + 8]) + ",\n" for i in range(0, len(numbers), 8))


def model_text(mesh, material, fixed, printed, linear):
    text = ["*NODE,NSET=NALL\n"]
    text += ["%d,%.12g,%.12g,%.12g\n" % (i + 1, *p) for i, p in enumerate(mesh.nodes)]
    text.append("*ELEMENT,TYPE=C3D10,ELSET=EALL\n")
    text += ["%d," % (i + 1) + ",".join(str(n + 1) for n in tet) + "\n" for i, tet in enumerate(mesh.tets)]
    text += ["*NSET,NSET=FIXED\n", lists(fixed), "*NSET,NSET=PRINTED\n", lists(printed)]
    young, poisson = material.young / 1000, material.poisson
    text.append("*MATERIAL,NAME=TISSUE\n")
    if linear:
        text.append("*ELASTIC\n%.12g,%.12g\n" % (young, poisson))
    else:
        # W = C10 (I1 J^(-2/3) - 3) + (J - 1)^2 / D1 with C10 = mu / 2 and D1 = 2 / K.
        shear, bulk = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))
        text.append("*HYPERELASTIC,NEO HOOKE\n%.12g,%.12g\n" % (shear / 2, 2 / bulk))
    text.append("*DENSITY\n%.12g\n*SOLID SECTION,ELSET=EALL,MATERIAL=TISSUE\n" % (material.density * 1e-9))
    text.append("*BOUNDARY\nFIXED,1,3\n")
    return "".join(text)


def static_step(forces, increments):
    """One step under dead forces (n x 3, mN). increments: 0 for small displacements (linear), else the least number of
    load increments of a geometrically nonlinear step."""
    if increments:
        # Fifty times tighter than the solver's own tolerance on forces: reactions and energies shall balance.
        text = ["*STEP,NLGEOM,INC=200\n*CONTROLS,PARAMETERS=FIELD\n1e-4,1e-3,,,1e-3\n*STATIC\n"]
        text.append("%g,1.,1e-4,%g\n" % (1 / increments, 1 / increments))
    else:
        text = ["*STEP\n*STATIC\n"]
    text.append("*CLOAD,OP=NEW\n")
    for node, axis in zip(*np.nonzero(forces)):
        text.append("%d,%d,%.12g\n" % (node + 1, axis + 1, forces[node, axis]))
    text.append("*NODE PRINT,NSET=PRINTED\nU\n*NODE PRINT,NSET=FIXED\nRF\n")
    text.append("*EL PRINT,ELSET=EALL,TOTALS=ONLY\nELSE\n*END STEP\n")
    return "".join(text)


def frequency_step(count):
    return "*STEP\n*FREQUENCY\n%d\n*NODE PRINT,NSET=PRINTED\nU\n*END STEP\n" % count


def run(folder, deck):
    """The text that CalculiX prints for a deck, and the seconds of its processor that it took."""
    with open(os.path.join(folder, "deck.inp"), "w") as file:
        file.write(deck)
    threads = {"OMP_NUM_THREADS": "1", "CCX_NPROC_RESULTS": "1", "OPENBLAS_NUM_THREADS": "1"}
    before = os.times()
    done = subprocess.run(["ccx", "deck"], cwd=folder, env=dict(os.environ, **threads), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
    after = os.times()
    log = done.stdout.decode(errors="replace")
    if done.returncode or "*ERROR" in log or "Job finished" not in log:
        raise RuntimeError("CalculiX failed: " + log[-600:])
    with open(os.path.join(folder, "deck.dat")) as file:
        return file.read(), after.children_user - before.children_user + after.children_system - before.children_system


def blocks(text):
    """The tables of a .dat file in their order: (title, rows of numbers)."""
    result = []
    for line in text.splitlines():
        word = line.split()
        if not word:
            continue
        if re.match(r"^[-+0-9.]", word[0]):
            if result:
                result[-1][1].append([float(x) for x in word])
        else:
            result.append((line.strip(), []))
    return result


class StaticState:
    """One load increment: share of the load, displacements (n x 3, mm; not a number where not printed), reactions
    (n x 3, mN), strain energy (uJ)."""

    def __init__(self, time):
        self.time, self.displacement, self.reaction, self.energy = time, None, None, None


def static_states(text, nodes):
    """Increments of all steps of a run in their order."""
    states = []
    for title, rows in blocks(text):
        if title.startswith("displacements"):
            states.append(StaticState(float(title.split()[-1])))
            states[-1].displacement = vectors(rows, nodes, np.nan)
        elif title.startswith("forces"):
            states[-1].reaction = vectors(rows, nodes, 0)
        elif title.startswith("total internal energy"):
            states[-1].energy = rows[0][0]
    return states


def vectors(rows, nodes, otherwise):
    result = np.full((nodes, 3), otherwise, float)
    for row in rows:
        result[int(row[0]) - 1] = row[1:4]
    return result


def modes(text, nodes):
    """Frequencies (Hz) and mass-normalised shapes (n x 3 each, 1 / sqrt(kg))."""
    frequencies, shapes = [], []
    for title, rows in blocks(text):
        if title.startswith("MODE NO") or title.startswith("(RAD/TIME)"):
            frequencies += [row[3] for row in rows if len(row) == 5]
        elif title.startswith("displacements"):
            shapes.append(vectors(rows, nodes, np.nan))
    return frequencies[: len(shapes)], shapes
