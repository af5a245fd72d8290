#include <algorithm>

#include "physics/dynamics/angles.h"
#include "physics/dynamics/stages.h"

// Motion that does not come from within: spheres led along a path, and the resistance of the medium around.
namespace medulla {

namespace {

double sineOf(double angle) {
  Lanes c, s;
  cosineSine(splat(angle), c, s);
  return s[0];
}

Lanes pathAt(const SphereDrive& drive, double time) {
  time = std::max(time, 0.0);  // while bodies settle
  const double periods = time * drive.frequency, u = periods < 1 ? periods : 1;
  const double ramp = u * u * (3 - 2 * u);
  const double swing = ramp * sineOf(kTurn * periods + drive.phase);
  return fma(splat(swing), load(drive.swing), fma(splat(time), load(drive.velocity), load(drive.rest)));
}

}  // namespace

// Before, bodies settle: moving along they would leave the driven spheres, which wait.
void startDrivenBodies(WorldData& d) {
  if (d.frame != 0) return;
  for (const SphereDrive& drive : d.drives) {
    const BodyRange& r = d.ranges[drive.body];
    d.spheres.velocity[drive.sphere] = drive.velocity;
    d.ledger[drive.body].begun = false;
    for (const int i : spheresOf(r))
      if (d.spheres.groups[i / 4].inverseMass[i % 4] > 0) d.spheres.velocity[i] = drive.velocity;
    for (const int i : r.node)
      if (d.nodes.inverseMass[i] > 0) setVector(d.nodes.velocity, i, vectorOf(drive.velocity));
  }
}

// The path's secant rather than its derivative: the sphere stays on the path whatever the substep.
void driveSpheres(WorldData& d, double time, double duration) {
  for (const SphereDrive& drive : d.drives)
    store(d.spheres.velocity[drive.sphere],
          (pathAt(drive, time) - load(d.spheres.position[drive.sphere])) / splat(duration));
}

// Linear drag per mass, solved implicitly, so that no drag is too much for a step. A driven sphere is dragged too, and
// then led back to its path.
void dragVelocities(WorldData& d, const Batch& batch) {
  if (d.settings.ambientDrag == 0) return;
  const Lanes kept = splat(d.keptByDrag);
  for (const int i : batch.spheres) {
    store(d.spheres.velocity[i], kept * load(d.spheres.velocity[i]));
    store(d.spheres.angularMomentum[i], kept * load(d.spheres.angularMomentum[i]));
  }
  for (const int g : batch.nodeGroups) d.nodes.velocity[g] = kept * d.nodes.velocity[g];
}

}  // namespace medulla
