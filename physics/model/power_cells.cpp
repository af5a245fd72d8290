#include "physics/model/power_cells.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/model/disjoint_sets.h"

namespace medulla {

using Eigen::Vector3d;

namespace {

// Heights at which the vertical line through every column's centre meets the surface. Column centres sit off the
// mesh's likely coordinates, and an edge belongs to the triangle on one side of it alone (top-left rule of
// rasterisers): no crossing is counted twice or lost.
struct Columns {
  Vector3d origin;  // centre of the column (0, 0) at z of the lowest voxel's floor
  double size;
  int countX, countY;
  std::vector<std::vector<double>> crossings;
};

bool insideHalfOpen(double value, double dx, double dy) {
  return value > 0 || (value == 0 && (dy > 0 || (dy == 0 && dx < 0)));
}

void cutColumns(const std::array<Vector3d, 3>& corners, Columns& columns) {
  std::array<Vector3d, 3> c = corners;
  // Taken from the lexicographically lower end, so that both triangles at an edge see the same number, negated.
  const auto doubleArea = [](const Vector3d& p, const Vector3d& q, double x, double y) {
    const bool swap = q.x() < p.x() || (q.x() == p.x() && q.y() < p.y());
    const Vector3d &a = swap ? q : p, &b = swap ? p : q;
    const double area = (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
    return swap ? -area : area;
  };
  double total = doubleArea(c[0], c[1], c[2].x(), c[2].y());
  if (total == 0) return;
  if (total < 0) {
    std::swap(c[1], c[2]);
    total = -total;
  }
  const auto range = [&](int axis, int count, int& first, int& last) {
    const double low = std::min({c[0][axis], c[1][axis], c[2][axis]}) - columns.origin[axis];
    const double high = std::max({c[0][axis], c[1][axis], c[2][axis]}) - columns.origin[axis];
    first = std::max(0, static_cast<int>(std::floor(low / columns.size)));
    last = std::min(count - 1, static_cast<int>(std::ceil(high / columns.size)));
  };
  int firstX = 0, lastX = 0, firstY = 0, lastY = 0;
  range(0, columns.countX, firstX, lastX);
  range(1, columns.countY, firstY, lastY);
  for (int i = firstX; i <= lastX; ++i) {
    for (int j = firstY; j <= lastY; ++j) {
      const double x = columns.origin.x() + i * columns.size, y = columns.origin.y() + j * columns.size;
      std::array<double, 3> w;  // barycentric, times `total`
      bool inside = true;
      for (int k = 0; k < 3 && inside; ++k) {
        const Vector3d &p = c[(k + 1) % 3], &q = c[(k + 2) % 3];
        w[k] = doubleArea(p, q, x, y);
        inside = insideHalfOpen(w[k], q.x() - p.x(), q.y() - p.y());
      }
      if (!inside) continue;
      columns.crossings[static_cast<std::size_t>(i) * columns.countY + j].push_back(
          (w[0] * c[0].z() + w[1] * c[1].z() + w[2] * c[2].z()) / total);
    }
  }
}

void addSpan(VoxelBody& body, const Columns& columns, int i, int j, double low, double high) {
  const double floor = columns.origin.z();
  const int first = std::max(0, static_cast<int>(std::floor((low - floor) / body.size)));
  const int last = std::min(body.count[2] - 1, static_cast<int>(std::floor((high - floor) / body.size)));
  for (int k = first; k <= last; ++k) {
    const double bottom = std::max(low, floor + k * body.size), top = std::min(high, floor + (k + 1) * body.size);
    if (top <= bottom) continue;
    int& at = body.pieceAt[(static_cast<std::size_t>(i) * body.count[1] + j) * body.count[2] + k];
    if (at < 0) at = static_cast<int>(body.pieces.size());
    body.pieces.push_back({{i, j, k},
                           {columns.origin.x() + i * body.size, columns.origin.y() + j * body.size, (bottom + top) / 2},
                           {body.size, body.size, top - bottom},
                           body.size * body.size * (top - bottom)});
  }
}

// Empty voxels around the mesh, and their columns.
Columns layOutVoxels(const TriangleMesh& mesh, double volume, int target, VoxelBody& body) {
  body.size = voxelSize(volume, target);
  Eigen::AlignedBox3d box;
  for (const std::array<int, 3>& t : mesh.triangles)
    for (const int corner : t) box.extend(mesh.vertices[corner]);
  // 4 GB: a body that fills so little of its box is a spike, a unit or a surface gone wrong.
  constexpr double kMostVoxels = 1e9;
  if (!((box.sizes() / body.size).prod() < kMostVoxels))
    throw std::runtime_error(fmt::format(
        "the body fills a part in {:.2g} of its box: too little to divide it into cells", box.volume() / volume));
  for (int a = 0; a < 3; ++a) body.count[a] = static_cast<int>(box.sizes()[a] / body.size) + 2;
  Columns columns{
      box.min() - Vector3d(0.31, 0.27, 0.5) * body.size, body.size, body.count[0] + 1, body.count[1] + 1, {}};
  body.low = columns.origin - Vector3d(0.5, 0.5, 0) * body.size;
  body.count = {columns.countX, columns.countY, body.count[2] + 1};
  body.pieceAt.assign(static_cast<std::size_t>(body.count[0]) * body.count[1] * body.count[2], -1);
  return columns;
}

// Sorted, pairs of them enclose what is inside.
void cutMesh(const TriangleMesh& mesh, Columns& columns) {
  columns.crossings.resize(static_cast<std::size_t>(columns.countX) * columns.countY);
  for (const std::array<int, 3>& t : mesh.triangles)
    cutColumns({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, columns);
  for (std::vector<double>& z : columns.crossings) std::sort(z.begin(), z.end());
}

// Lines that sample a column of voxels, laid out as rooks of which none attacks another: each has an x and a y of its
// own, so that a face along z, wherever it cuts the column, is found to a part in kRooks. A lattice whose points are
// far apart; its columns stand for strips a part in kRooks wide along x and along y.
constexpr int kRooks = 32, kRookStep = 7;

Vector3d rookOffset(int n) {
  return {(n + 0.5) / kRooks - 0.5, (n * kRookStep % kRooks + 0.5) / kRooks - 0.5, 0};
}

// What of a voxel is inside, in voxels and about the voxel's middle.
struct VoxelSums {
  double part = 0;
  Vector3d first = Vector3d::Zero(), second = Vector3d::Zero();  // integrals of x and x^2 along each axis

  void add(const Vector3d& rook, double bottom, double top) {
    constexpr double strip = 1. / kRooks;
    const double height = top - bottom, share = height * strip;
    const Vector3d at(rook.x(), rook.y(), (bottom + top) / 2);
    part += share;
    first += share * at;
    second += share * (at.cwiseProduct(at) + Vector3d(strip * strip, strip * strip, height * height) / 12);
  }
};

void addSums(const std::vector<double>& crossings, double floor, double size, const Vector3d& rook,
             std::vector<VoxelSums>& sums) {
  for (std::size_t s = 0; s + 1 < crossings.size(); s += 2) {
    const double low = (crossings[s] - floor) / size, high = (crossings[s + 1] - floor) / size;
    const int first = std::max(0, static_cast<int>(std::floor(low)));
    const int last = std::min(static_cast<int>(sums.size()) - 1, static_cast<int>(std::floor(high)));
    for (int k = first; k <= last; ++k) {
      const double bottom = std::max(low - k, 0.) - 0.5, top = std::min(high - k, 1.) - 0.5;
      if (top > bottom) sums[k].add(rook, bottom, top);
    }
  }
}

// A box has a twelfth of its squared extent for variance.
VoxelPiece pieceOf(const VoxelSums& sums, const std::array<int, 3>& index, const VoxelBody& body) {
  const Vector3d middle = body.low + body.size * (Vector3d(index[0], index[1], index[2]) + Vector3d::Constant(0.5));
  const double voxel = body.size * body.size * body.size;
  if (sums.part > 1 - 1e-9) return {index, middle, Vector3d::Constant(body.size), voxel};
  const Vector3d centre = sums.first / sums.part;
  const Vector3d variance = sums.second / sums.part - centre.cwiseProduct(centre);
  const Vector3d extent = (12 * variance).cwiseMax(1e-8).cwiseMin(1).cwiseSqrt();
  return {index, middle + body.size * centre, body.size * extent, sums.part * voxel};
}

}  // namespace

double voxelSize(double volume, int target) {
  return std::cbrt(volume / target);
}

VoxelBody voxelise(const TriangleMesh& mesh, double volume, int target) {
  VoxelBody body;
  Columns columns = layOutVoxels(mesh, volume, target, body);
  cutMesh(mesh, columns);
  for (int i = 0; i < columns.countX; ++i) {
    for (int j = 0; j < columns.countY; ++j) {
      const std::vector<double>& z = columns.crossings[static_cast<std::size_t>(i) * columns.countY + j];
      for (std::size_t s = 0; s + 1 < z.size(); s += 2) addSpan(body, columns, i, j, z[s], z[s + 1]);
    }
  }
  return body;
}

VoxelBody voxeliseEvenly(const TriangleMesh& mesh, double volume, int target) {
  VoxelBody body;
  std::vector<Columns> rooks(kRooks, layOutVoxels(mesh, volume, target, body));
  for (int n = 0; n < kRooks; ++n) {
    rooks[n].origin += body.size * rookOffset(n);
    cutMesh(mesh, rooks[n]);
  }
  std::vector<VoxelSums> sums;
  std::size_t column = 0;
  for (int i = 0; i < body.count[0]; ++i) {
    for (int j = 0; j < body.count[1]; ++j, ++column) {
      sums.assign(body.count[2], {});
      for (int n = 0; n < kRooks; ++n)
        addSums(rooks[n].crossings[column], body.low.z(), body.size, rookOffset(n), sums);
      for (int k = 0; k < body.count[2]; ++k) {
        if (sums[k].part <= 0) continue;
        if (sums[k].part >= 0.5) body.pieceAt[column * body.count[2] + k] = static_cast<int>(body.pieces.size());
        body.pieces.push_back(pieceOf(sums[k], {i, j, k}, body));
      }
    }
  }
  return body;
}

static std::vector<int> leastPower(const VoxelBody& body, const PowerSites& sites) {
  // |x - c|^2 - w = |x|^2 - 2 x.c + |c|^2 - w, of which |x|^2 is common to all. Relative to the first centre, against
  // cancellation far from the origin.
  const auto n = static_cast<Eigen::Index>(sites.centres.size());
  const Vector3d origin = sites.centres[0];
  Eigen::ArrayX3d twice(n, 3);
  Eigen::ArrayXd constant(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d c = sites.centres[i] - origin;
    twice.row(i) = 2 * c.transpose().array();
    constant[i] = c.squaredNorm() - sites.weights[i];
  }
  std::vector<int> least(body.pieces.size());
  Eigen::ArrayXd power(n);
  for (std::size_t p = 0; p < body.pieces.size(); ++p) {
    const Vector3d x = body.pieces[p].centre - origin;
    power = constant - twice.col(0) * x.x() - twice.col(1) * x.y() - twice.col(2) * x.z();
    power.minCoeff(&least[p]);
  }
  return least;
}

static std::vector<double> reachesOf(const VoxelBody& body, const PowerSites& sites,
                                     const std::vector<int>& cellOfPiece) {
  std::vector<double> reaches(sites.centres.size(), 0);
  for (std::size_t p = 0; p < body.pieces.size(); ++p) {
    double& reach = reaches[cellOfPiece[p]];
    reach = std::max(reach, (body.pieces[p].centre - sites.centres[cellOfPiece[p]]).norm());
  }
  for (double& reach : reaches) reach += 2 * body.size;  // thin edges lie beside the voxels' centres
  return reaches;
}

int cellAt(const PowerSites& sites, const Vector3d& point) {
  int best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sites.centres.size(); ++i) {
    const double power = (point - sites.centres[i]).squaredNorm() - sites.weights[i];
    if (power >= least) continue;
    least = power;
    best = static_cast<int>(i);
  }
  return best;
}

PowerSites sitesAround(const PowerSites& sites, std::pair<int, int> pair) {
  PowerSites around;
  const auto take = [&](int k) {
    around.centres.push_back(sites.centres[k]);
    around.weights.push_back(sites.weights[k]);
    around.reaches.push_back(sites.reaches[k]);
  };
  take(pair.first);
  take(pair.second);
  // power(k) - power(i) is linear in space and changes by at most 2 |c_k - c_i| per metre.
  const auto bordersOn = [&](int k, int i) {
    const double distance = (sites.centres[k] - sites.centres[i]).norm();
    const double atCentre = distance * distance - sites.weights[k] + sites.weights[i];
    return atCentre < 2 * distance * sites.reaches[i];
  };
  for (int k = 0; k < static_cast<int>(sites.centres.size()); ++k) {
    if (k == pair.first || k == pair.second) continue;
    if (bordersOn(k, pair.first) || bordersOn(k, pair.second)) take(k);
  }
  return around;
}

static std::vector<MassProperties> integrate(const VoxelBody& body, const std::vector<int>& cellOfPiece,
                                             std::size_t count) {
  std::vector<MassProperties> cells(count);
  for (std::size_t p = 0; p < body.pieces.size(); ++p) {
    const VoxelPiece& piece = body.pieces[p];
    MassProperties& cell = cells[cellOfPiece[p]];
    cell.volume += piece.volume;
    cell.centroid += piece.volume * piece.centre;
  }
  for (MassProperties& cell : cells)
    if (cell.volume > 0) cell.centroid /= cell.volume;
  for (std::size_t p = 0; p < body.pieces.size(); ++p) {
    const VoxelPiece& piece = body.pieces[p];
    MassProperties& cell = cells[cellOfPiece[p]];
    const Vector3d r = piece.centre - cell.centroid;
    const Vector3d own = piece.extent.cwiseProduct(piece.extent) / 12;  // of a box about its centre
    Eigen::Matrix3d moment = r * r.transpose();
    moment.diagonal() += own;
    cell.secondMoment += piece.volume * moment;
  }
  return cells;
}

// Voxels miss the mesh's volume, centre and second moment by up to some parts in a thousand, most where it is thin. The
// affine map that takes their sums to the exact ones takes the cells along.
static void matchExact(const MassProperties& exact, std::vector<MassProperties>& cells) {
  const MassProperties sum = combined(cells);
  const Eigen::Matrix3d from = (sum.secondMoment / sum.volume).llt().matrixL();
  const Eigen::Matrix3d to = (exact.secondMoment / exact.volume).llt().matrixL();
  const Eigen::Matrix3d map = to * from.inverse();
  const double scale = exact.volume / sum.volume;
  for (MassProperties& cell : cells) {
    cell.volume *= scale;
    cell.centroid = exact.centroid + map * (cell.centroid - sum.centroid);
    cell.secondMoment = scale * map * cell.secondMoment * map.transpose();
  }
}

PowerCells divideByPower(const VoxelBody& body, const std::vector<Ball>& balls, const MassProperties& exact) {
  PowerCells result;
  const double smallest = 8 * body.size * body.size * body.size;  // below, a cell is no more than noise of the voxels
  for (const double share : {1., 0.5, 0.25, 0.}) {
    result.sites = {};
    for (const Ball& ball : balls) {
      result.sites.centres.push_back(ball.centre);
      result.sites.weights.push_back(share * ball.radius * ball.radius);
    }
    result.cellOfPiece = leastPower(body, result.sites);
    result.cells = integrate(body, result.cellOfPiece, balls.size());
    if (std::all_of(result.cells.begin(), result.cells.end(),
                    [&](const MassProperties& c) { return c.volume > smallest; }))
      break;
  }
  result.sites.reaches = reachesOf(body, result.sites, result.cellOfPiece);
  matchExact(exact, result.cells);
  return result;
}

// Pairs of pieces in neighbouring voxels.
template <typename Visit>
static void visitFaces(const VoxelBody& body, const Visit& visit) {
  const std::array<std::size_t, 3> stride = {static_cast<std::size_t>(body.count[1]) * body.count[2],
                                             static_cast<std::size_t>(body.count[2]), 1};
  for (std::size_t p = 0; p < body.pieces.size(); ++p) {
    const VoxelPiece& piece = body.pieces[p];
    const std::size_t at = piece.index[0] * stride[0] + piece.index[1] * stride[1] + piece.index[2];
    if (body.pieceAt[at] != static_cast<int>(p)) continue;
    for (int a = 0; a < 3; ++a) {
      if (piece.index[a] + 1 >= body.count[a]) continue;
      const int neighbour = body.pieceAt[at + stride[a]];
      if (neighbour >= 0) visit(static_cast<int>(p), neighbour);
    }
  }
}

ContactAreas contactAreas(const VoxelBody& body, const std::vector<int>& cellOfPiece) {
  ContactAreas areas;
  visitFaces(body, [&](int p, int q) {
    if (cellOfPiece[p] != cellOfPiece[q]) areas[std::minmax(cellOfPiece[p], cellOfPiece[q])] += body.size * body.size;
  });
  return areas;
}

ContactAreas contactAreasWithin(const SurfaceTree& surface, const VoxelBody& body,
                                const std::vector<int>& cellOfPiece) {
  DisjointSets parts(body.pieces.size());
  std::vector<std::array<int, 2>> between;
  visitFaces(body, [&](int p, int q) {
    constexpr int kNoVertex = -1;
    if (segmentCrosses(surface, body.pieces[p].centre, body.pieces[q].centre, kNoVertex)) return;
    if (cellOfPiece[p] == cellOfPiece[q])
      parts.join(p, q);
    else
      between.push_back({p, q});
  });
  const int pieces = static_cast<int>(body.pieces.size());
  std::vector<double> volumes(body.pieces.size(), 0);
  for (int p = 0; p < pieces; ++p) volumes[parts.of(p)] += body.pieces[p].volume;
  std::map<int, int> largest;  // part of every cell
  for (int p = 0; p < pieces; ++p) {
    int& part = largest.try_emplace(cellOfPiece[p], p).first->second;
    if (volumes[p] > volumes[part]) part = p;
  }
  ContactAreas areas;
  for (const auto& [p, q] : between) {
    const int a = cellOfPiece[p], b = cellOfPiece[q];
    if (parts.of(p) == largest[a] && parts.of(q) == largest[b]) areas[std::minmax(a, b)] += body.size * body.size;
  }
  return areas;
}

}  // namespace medulla
