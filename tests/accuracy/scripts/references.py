"""Makes the references: python3 references.py PROJECT RESULTS WORK [BODY[_CASE]...]. Called by ../make_references.sh.

Its standard output is the table of ../README.md, its standard error says how far it is.
"""

import os
import sys

import cases
import dynamics
import meshes
import other_meshes
import result_files
import study
from whole_files import publish


def summary(body, case, kept, error):
    change = " ".join("%.2f" % c for c in error.change[:, 0])
    return "| %s | %s | %.2f | %.4f | %d | %s | %.2f | %.2f / %.2f |" % (
        body.name, case.name, study.largest(kept.displacement), kept.volume_ratio, kept.nodes, change, error.order, *error.error)


def timing(body, case, nonlinear, error):
    """What FEM itself took and how far it was off, for the chart: CASE NODES SECONDS ERROR_MAX ERROR_RMS."""
    rows, kept = [], nonlinear[body.kept_grid(case)].displacement
    for _, solved in sorted(nonlinear.items()):
        off = error.error + study.difference(solved.displacement, kept, kept)
        rows.append("%s_%s %d %.1f %.3g %.3g\n" % (body.name, case.name, solved.nodes, solved.seconds, *off))
    return rows


def say(text):
    print(text, file=sys.stderr, flush=True)


def make(project, results, work, wanted):
    meshes.write_obj(os.path.join(project, "tests/accuracy/cylinder.obj"), "cylinder", *meshes.cylinder())
    other_meshes.write_missing(project)
    for body in cases.bodies():
        chosen = lambda name: not wanted or name in wanted or body.name in wanted
        body.read(project)
        solved = study.Study(work, body, say)
        for case in body.cases:
            if not chosen(f"{body.name}_{case.name}"):
                continue
            nonlinear, error = solved.case(case)
            kept = nonlinear[body.kept_grid(case)]
            result_files.write_static(results, body, case, kept, error)
            rows = "".join(timing(body, case, nonlinear, error))
            publish(os.path.join(results, f"{body.name}_{case.name}.time"), rows)
            print(summary(body, case, kept, error), flush=True)
        if body.modes and (chosen(f"{body.name}_modes") or chosen(f"{body.name}_step")):
            dynamics.make(results, solved)


if __name__ == "__main__":
    make(*sys.argv[1:4], set(sys.argv[4:]))
