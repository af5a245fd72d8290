#pragma once

#include <optional>

#include "physics/dynamics/body_mechanics.h"

// A body linearised at rest: how slowly its links swing and how fast its stiffest parts do. The first sets the damping,
// the second the step.
namespace medulla {

class RestModel;  // rest_model.h

// Raises the moments of inertia of spheres that turn faster than anything moves, until the body's stiffest mode is
// hardly faster than with all turning locked: for a semi-implicit step, which none should shorten. A surface that holds
// on to a light cell of a thin rim would otherwise set the step of the whole body, though nobody sees that cell's own
// turning; where masses sit, statics and slow modes stay (Key and Beisinger 1971; Hughes, Cohen and Haroun 1978 on
// beams and shells).
void raiseRotaryInertia(const RestModel& rest, BodyMechanics& mechanics);

// Sets what damps `mechanics` (both relaxations, massDamping, settlingDamping) from the tissue's damping ratio, and
// lowestFrequency, which it goes by, and returns the largest stable substep (s) of the body under semi-implicit Euler
// with damping taken at the old velocity. For explicit steps moments of inertia are raised before; implicit ones have
// no massDamping, and relaxations that make up for edges, which have no dampers, instead.
double dampBody(const BodyDescription& body, BodyMechanics& mechanics, Integrator integrator);

// s: that substep of explicit steps, of the body as it is.
double explicitLimit(const BodyDescription& body);

// rad/s: the lowest mode of spheres and links that deforms the body, the surface's mass riding along; 0 where none
// exists (a single sphere, everything fixed).
double lowestFrequency(const BodyDescription& body, const BodyMechanics& mechanics);

// Hz, ascending, at most `count`: the modes of spheres and links in which the body deforms, undamped, every surface
// node riding where its host carries it: what the surface adds by giving way lies far above them.
// Dense matrices: memory grows with the square of the spheres, time with the cube.
std::vector<double> naturalFrequencies(const BodyDescription& body, const BodyMechanics& mechanics, int count);

// m, 3 nodes x loads: where small forces on the surface's nodes (N, 3 nodes x loads) bring them through links and
// spheres, the surface itself giving way nowhere but at held nodes, from which the skeleton hangs by their attachments.
// None where what is held leaves the body free to move.
std::optional<Eigen::MatrixXd> skeletonResponse(const BodyDescription& body, const BodyMechanics& mechanics,
                                                const Eigen::MatrixXd& forces);

}  // namespace medulla
