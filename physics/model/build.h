#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "physics/model/long_edges.h"
#include "physics/model/mesh_repair.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

enum class BuildMethod {
  cover,     // medial balls, inscribed but for `overshoot`, chosen by set cover
  skeleton,  // the paper's raw result: Li's edge collapse, nodes become spheres (2.1)
};

constexpr int kSpheresMax = 2000;  // the choice of balls needs spheres^2 memory and time

struct BuildSettings {
  BuildMethod method = BuildMethod::cover;
  int spheres = 7;  // 1..kSpheresMax; cover only: the skeleton's node count follows from the mesh
  double gap = 0;   // % of the diagonal; if > 0, cover takes the fewest spheres that leave no larger gap, not `spheres`
  // % of the diagonal, 0..5; cover only: how far balls may stick out of the surface. More fills more, and bodies touch
  // by so much too early instead of sinking in by the gap. Without a value: overshootOf.
  std::optional<double> overshoot;
  // Of the body's mass, carried by the surface nodes, 0..0.4; more allows larger substeps.
  double surfaceMassFraction = 0.2;
  int renderLevels = 2;  // 0..4 Loop subdivisions of the physics mesh for the drawn surface
};

// How good the model is. Lengths in % of the bounding box's diagonal.
struct BuildReport {
  int triangles = 0, skeletonNodes = 0, skeletonLinks = 0, spheres = 0, links = 0;
  double gapMax = 0, gapMean = 0;                           // surface to the nearest ball
  double gapConesMax = 0;                                   // surface to the nearest ball or link cone
  double overshootMax = 0;                                  // of a ball, out of the surface
  double cover = 0, coverCones = 0;                         // % of the volume inside balls; inside balls and cones
  double massError = 0, centreError = 0, inertiaError = 0;  // %, model against mesh (centre: of the diagonal)
  int components = 0, centresOutside = 0, attachmentsCrossing = 0;
  double attachmentMax = 0;
  int degreeMax = 0;
  double drawnInsideMax = 0;           // drawn surface, inside the mesh: so far a tool presses before it is seen to
  int hollowLinks = 0;                 // across which the body is hollow: countHollowLinks()
  int sheetLinks = 0;                  // countSheetLinks()
  std::optional<LongEdges> longEdges;  // where the mesh is too coarse for the body's thickness
  double volume = 0, diagonal = 0;     // m3 of the mesh, m of its bounding box
  double seconds = 0;
};

// FNV-1a over the bits of vertices and triangles. A model records that of its input file, before repair.
std::uint64_t hashMesh(const TriangleMesh& mesh);

// Half the gap where a gap is asked for, else 4.2 % / sqrt(spheres): what balls leave between them shrinks with their
// distance on the surface, and by this much of it they fill best without standing out further than they fall short.
double overshootOf(const BuildSettings& settings);

// The settings as options of the build command that repeat them.
std::string describeSettings(const BuildSettings& settings);

// Builds a model (paper 2). `fine`, if given, is the detailed shape that the drawn surface follows. `progress` is
// called now and then with 0..1. Deterministic to the byte, `seconds` apart.
// `name` is left empty, and `meshHash` is that of the repaired mesh: whoever read the input knows the better ones.
// Throws std::runtime_error on settings out of range and on meshes that hold no ball.
SoftBodyModel buildModel(
    const RepairedMesh& mesh, const TriangleMesh* fine, const BuildSettings& settings, BuildReport& report,
    const std::function<void(double)>& progress = [](double) {});

}  // namespace medulla
