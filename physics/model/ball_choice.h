#pragma once

#include <functional>
#include <vector>

#include "physics/model/ball_cover.h"
#include "physics/model/mass_properties.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// A closed mesh and what the choice of balls measures against.
struct BodyShape {
  const TriangleMesh& mesh;
  SurfaceTree tree;
  MassProperties exact;  // volume > 0
  double diagonal = 0;   // m, of the bounding box
  double overshoot = 0;  // m, that balls may stick out of the surface
};

// Keeps a reference to the mesh; the overshoot is in % of the diagonal. Throws std::runtime_error on a mesh without
// triangles or volume.
BodyShape measureShape(const TriangleMesh& mesh, double overshoot);

// `count` balls that fill the body (ball_cover.h). Throws std::runtime_error where fewer inscribed balls are to be had.
std::vector<Ball> chooseBalls(
    const BodyShape& shape, int count, CoverGoal goal, const std::function<void(double)>& progress = [](double) {});

// The fewest balls that leave no gap from the surface to the nearest ball above `gap` (% of the diagonal). Counts are
// tried from that of a greedy set cover on, by bisection and a look at the next few below, each with all the
// improvement that chooseBalls gives: gaps shrink with the count but for small jumps. Throws std::runtime_error where
// `most` balls do not reach it.
std::vector<Ball> fewestBalls(
    const BodyShape& shape, double gap, int most, const std::function<void(double)>& progress = [](double) {});

// Largest gap from the surface to the nearest ball, % of the diagonal, on points other than those of the choice.
double largestGap(const BodyShape& shape, const std::vector<Ball>& balls);

// How many of `count` spheres each body gets so that the largest gap, in metres, is the same for all: as many as greedy
// set cover takes for the smallest gap that they suffice for. Filling greedily, each next sphere where the gap is
// largest, leaves most of them in folds that no candidate reaches well: 287 of 411 in a colon. At least one each.
// Throws std::runtime_error where there are fewer spheres than bodies.
std::vector<int> shareSpheres(
    const std::vector<BodyShape>& shapes, int count, const std::function<void(double)>& progress = [](double) {});

}  // namespace medulla
