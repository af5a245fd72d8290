#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "physics/model/identify/cell_frames.h"

namespace medulla {

// Six scalars along the link's axes; any positive semidefinite matrix; and a strain of each cell besides, which couples
// its links: nearer, and stiffer in its fastest motions.
enum class LinkForm { diagonal, uncoupled, full };

// Links between cells that share a face worth the name, and from cells to the patches that hold them, without
// stiffness. `patchTriangles`: held triangles of each patch.
std::vector<IdentifiedLink> layOutLinks(const TriangleMesh& mesh, const CellFrames& cells,
                                        const std::vector<FixedPatch>& patches,
                                        const std::vector<std::vector<int>>& patchTriangles);

// The measures of a link at rest, linear in the motions (u, lengthScale theta) of its two frames; a patch does not
// move.
Eigen::Matrix<double, 6, 12> linkMeasures(const IdentifiedLink& link, double lengthScale);

// Stiffness matrix of the network, the cells' strains included, 6 frames square.
Eigen::MatrixXd networkStiffness(const std::vector<IdentifiedLink>& links, double lengthScale, int frames);

// Loads on the frames (6 frames x 6 per cell) that stand in for unit loads on these cells, and the motions of all
// frames that finite elements find under them.
struct LoadsOnCells {
  std::vector<int> cells;
  Eigen::MatrixXd loads, motions;
};

// Sets the links' stiffness, and their parts in the cells' strains, so that the network answers loads on its frames as
// finite elements do: `compliance` (6 frames square). Minimises the relative error of the responses to single loads,
// kept together by the Kullback-Leibler divergence of the two normal distributions that have these stiffnesses.
// `grounding`, if not empty, is added to the network's stiffness: what the compliance has on rigid motions of a free
// body. `progress` gets 0..1.
void fitLinks(
    const Eigen::MatrixXd& compliance, const Eigen::MatrixXd& grounding, const LoadsOnCells& ends, double lengthScale,
    LinkForm form, std::vector<IdentifiedLink>& links, const std::function<void(double)>& progress = [](double) {});

// Moves the point at which a link to a patch is held to where it makes a bar of the link: clamped there, with the
// middle between its two ends its centre of stiffness. In small displacements that changes nothing; in large ones the
// arc that the measures expect is that of the body, wherever the patch's nearest point.
void centreClamp(double lengthScale, IdentifiedLink& link);

}  // namespace medulla
