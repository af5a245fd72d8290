#include "physics/model/identify/necks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "physics/model/mesh_topology.h"
#include "physics/model/plane_section.h"
#include "physics/model/power_cells.h"
#include "physics/model/surface_queries.h"

// A neck is where the least area separates two thick parts: a minimum cut (Ford and Fulkerson 1956) between them in a
// graph of voxels, each joined to its neighbours by the area of their common face. Narrow necks take few augmenting
// paths; a wide one is left as soon as these are more than a neck of interest has faces.
namespace medulla {

namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kVoxelsAcross = 7;  // of the widest neck

class VoxelGraph {
 public:
  VoxelGraph(const TriangleMesh& mesh, double volume, double widest);

  int cores() const { return cores_; }
  std::optional<Neck> around(int core, double widest, double leastPart, const std::function<void()>& goOn);

 private:
  int size() const { return static_cast<int>(middle_.size()); }
  double faceArea() const { return edge_ * edge_; }

  // `visit(voxel, direction)` of the neighbours in the body: twice the axis, and one more upwards.
  template <class Visit>
  void visitNeighbours(int v, const Visit& visit) const {
    for (int direction = 0; direction < 6; ++direction)
      if (const int next = beside_[v][direction]; next >= 0) visit(next, direction);
  }

  void joinVoxels(const VoxelBody& body);
  void findCores(const TriangleMesh& mesh, double widest);
  // What is reached from a core through faces that can take more flow, or, turned round, can reach the other cores.
  // `from_` tells how; the first voxel of the aim that is found, or -1.
  template <class IsSource, class IsAim>
  int search(const IsSource& isSource, const IsAim& isAim, bool turned);
  bool augment(int core);
  std::pair<Vector3d, double> cut() const;  // middle and area of the faces that bound what was reached
  Vector3d gapBetween(const std::vector<int>& part0, const std::vector<int>& part1) const;

  double edge_ = 0;                               // m, of a voxel
  std::vector<Vector3d> middle_;                  // m, of each voxel in the body
  std::vector<std::array<int, 6>> beside_;        // its neighbours by direction, -1 outside the body
  std::vector<std::array<signed char, 3>> flow_;  // to the next voxel along each axis: -1, 0 or 1
  std::vector<int> core_;                         // of each voxel: -1 of none
  std::vector<signed char> from_;                 // the direction that a search came by; kStart, kUnseen
  std::vector<int> queue_;
  int cores_ = 0;
  std::size_t pieces_ = 0;

  static constexpr signed char kUnseen = -1, kStart = 6;
};

VoxelGraph::VoxelGraph(const TriangleMesh& mesh, double volume, double widest) {
  joinVoxels(voxelise(mesh, volume, static_cast<int>(volume / std::pow(widest / kVoxelsAcross, 3))));
  flow_.resize(middle_.size());
  core_.assign(middle_.size(), -1);
  findCores(mesh, widest);
}

// Of the body's voxels alone: a ring that lies aslant fills a thousandth of its box.
void VoxelGraph::joinVoxels(const VoxelBody& body) {
  edge_ = body.size;
  pieces_ = body.pieces.size();
  const std::array<int, 3>& n = body.count;
  const std::array<int, 3> step = {n[1] * n[2], n[2], 1};
  std::vector<int> numberAt(body.pieceAt.size(), -1);
  for (std::size_t v = 0; v < body.pieceAt.size(); ++v) {
    if (body.pieceAt[v] < 0) continue;
    const int number = numberAt[v] = static_cast<int>(middle_.size());
    middle_.push_back(body.pieces[body.pieceAt[v]].centre);
    beside_.push_back({-1, -1, -1, -1, -1, -1});
    int rest = static_cast<int>(v);
    for (int a = 0; a < 3; ++a) {
      const int before = rest / step[a] > 0 ? numberAt[v - step[a]] : -1;
      rest %= step[a];
      if (before < 0) continue;
      beside_[number][2 * a] = before;
      beside_[before][2 * a + 1] = number;
    }
  }
}

// Connected parts of what lies deeper than half the widest neck.
void VoxelGraph::findCores(const TriangleMesh& mesh, double widest) {
  const SurfaceTree tree = makeSurfaceTree(mesh);
  std::vector<bool> deep(size());
  for (int v = 0; v < size(); ++v) deep[v] = std::isinf(closestPoint(tree, middle_[v], 0.5 * widest).distance);
  for (int first = 0; first < size(); ++first) {
    if (!deep[first] || core_[first] >= 0) continue;
    queue_.assign(1, first);
    core_[first] = cores_;
    for (std::size_t k = 0; k < queue_.size(); ++k) {
      visitNeighbours(queue_[k], [&](int next, int) {
        if (!deep[next] || core_[next] >= 0) return;
        core_[next] = cores_;
        queue_.push_back(next);
      });
    }
    ++cores_;
  }
}

template <class IsSource, class IsAim>
int VoxelGraph::search(const IsSource& isSource, const IsAim& isAim, bool turned) {
  from_.assign(size(), kUnseen);
  queue_.clear();
  for (int v = 0; v < size(); ++v) {
    if (!isSource(v)) continue;
    from_[v] = kStart;
    queue_.push_back(v);
  }
  for (std::size_t k = 0; k < queue_.size(); ++k) {
    const int v = queue_[k];
    if (isAim(v)) return v;
    visitNeighbours(v, [&](int next, int direction) {
      if (from_[next] != kUnseen) return;
      const int axis = direction / 2;
      const bool onward = (direction % 2 == 1) != turned;
      const auto flow = flow_[direction % 2 == 1 ? v : next][axis];
      if (onward ? flow >= 1 : flow <= -1) return;
      from_[next] = static_cast<signed char>(direction);
      queue_.push_back(next);
    });
  }
  return -1;
}

// Sends one face's flow from the core to any other. False where there is no way left.
bool VoxelGraph::augment(int core) {
  int v =
      search([&](int i) { return core_[i] == core; }, [&](int i) { return core_[i] >= 0 && core_[i] != core; }, false);
  if (v < 0) return false;
  while (from_[v] != kStart) {
    const int axis = from_[v] / 2;
    if (from_[v] % 2 == 1) {
      v = beside_[v][2 * axis];
      ++flow_[v][axis];
    } else {
      --flow_[v][axis];
      v = beside_[v][2 * axis + 1];
    }
  }
  return true;
}

std::pair<Vector3d, double> VoxelGraph::cut() const {
  Vector3d sum = Vector3d::Zero();
  int faces = 0;
  for (const int v : queue_) {
    visitNeighbours(v, [&](int next, int) {
      if (from_[next] != kUnseen) return;
      sum += 0.5 * (middle_[v] + middle_[next]);
      ++faces;
    });
  }
  return {sum / std::max(faces, 1), faces * faceArea()};
}

// Midway between their nearest voxels: a neck thinner than these is lost.
Vector3d VoxelGraph::gapBetween(const std::vector<int>& part0, const std::vector<int>& part1) const {
  Vector3d out = Vector3d::Zero();
  double least = std::numeric_limits<double>::infinity();
  const auto isInner = [&](int v) {
    return std::all_of(beside_[v].begin(), beside_[v].end(), [](int next) { return next >= 0; });
  };
  for (const int a : part0) {
    if (isInner(a)) continue;
    for (const int b : part1) {
      const double squared = (middle_[a] - middle_[b]).squaredNorm();
      if (squared >= least || isInner(b)) continue;
      least = squared;
      out = 0.5 * (middle_[a] + middle_[b]);
    }
  }
  return out;
}

// Between the core and all others. The flow leaves a neck's two ends: its place is midway.
std::optional<Neck> VoxelGraph::around(int core, double widest, double leastPart, const std::function<void()>& goOn) {
  const int most = static_cast<int>(pi / 4 * widest * widest / faceArea());
  std::fill(flow_.begin(), flow_.end(), std::array<signed char, 3>{});
  for (int paths = 0; augment(core); ++paths) {
    if (paths >= most) return std::nullopt;
    goOn();
  }
  const auto [end0, area] = cut();
  const std::vector<int> part0 = queue_;
  search([&](int v) { return core_[v] >= 0 && core_[v] != core; }, [](int) { return false; }, true);
  const auto least = static_cast<std::size_t>(leastPart * static_cast<double>(pieces_));
  if (std::min(part0.size(), queue_.size()) < least) return std::nullopt;
  if (area == 0) return Neck{edge_, gapBetween(part0, queue_)};
  return Neck{2 * std::sqrt(area / pi), 0.5 * (end0 + cut().first)};
}

// Faces of voxels are more than an oblique section has, and a few say little of a thin one. So the least of sections
// through the place, as far as the neck may reach, where it lies in the body.
double sectionWidth(const TriangleMesh& mesh, const Neck& neck) {
  const PowerSites near{{neck.place}, {0}, {1.5 * neck.width}};
  double least = std::numeric_limits<double>::infinity();
  for (int k = 1; k < 27; ++k) {
    const Vector3d normal = Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1).cast<double>();
    if (normal.isZero(0)) continue;
    const SectionMoments s = planeSection(mesh, planeAcross(neck.place, normal.normalized()), &near, {0, 0});
    if (s.holdsOrigin) least = std::min(least, s.area);
  }
  return std::isinf(least) ? neck.width : 2 * std::sqrt(least / pi);
}

}  // namespace

std::optional<Neck> narrowestNeck(const TriangleMesh& mesh, double widest, double leastPart,
                                  const std::function<void()>& goOn) {
  VoxelGraph graph(mesh, enclosedVolume(mesh), widest);
  std::optional<Neck> out;
  for (int core = 0; graph.cores() > 1 && core < graph.cores(); ++core) {
    std::optional<Neck> found = graph.around(core, widest, leastPart, goOn);
    if (!found) continue;
    found->width = sectionWidth(mesh, *found);
    if (!out || found->width < out->width) out = found;
  }
  return out;
}

}  // namespace medulla
