#include "physics/model/identify/cell_frames.h"

#include <Eigen/LU>
#include <cmath>

#include "physics/model/cross_matrix.h"

namespace medulla {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// Integrals over what a frame's cell and a grid cell share.
struct SharedPart {
  int frame = 0;
  std::array<double, kHexNodes> shape{};               // m3
  std::array<Vector3d, kHexNodes> shapeTimesPosition;  // m4
};

struct RawCell {
  double volume = 0;
  Vector3d centroid = Vector3d::Zero();
  Matrix3d secondMoment = Matrix3d::Zero();  // about the origin first, about the centroid in the end
};

SharedPart& partOf(std::vector<SharedPart>& parts, int frame) {
  for (SharedPart& part : parts)
    if (part.frame == frame) return part;
  SharedPart& fresh = parts.emplace_back();
  fresh.frame = frame;
  fresh.shapeTimesPosition.fill(Vector3d::Zero());
  return fresh;
}

// Positions from `origin`, against cancellation. `held`: of the pieces behind what is held, the integrals of 1, r, r
// r^T.
void integrate(const VoxelSolid& solid, const std::vector<int>& frameOfPiece, const Vector3d& origin,
               std::vector<std::vector<SharedPart>>& parts, std::vector<RawCell>& cells, std::vector<RawCell>& held) {
  for (std::size_t p = 0; p < solid.voxels.pieces.size(); ++p) {
    const VoxelPiece& piece = solid.voxels.pieces[p];
    const double volume = piece.volume;
    const Vector3d x = piece.centre - origin;
    const auto sum = [&](RawCell& cell) {
      cell.volume += volume;
      cell.centroid += volume * x;
      cell.secondMoment += volume * x * x.transpose();
    };
    sum(cells[frameOfPiece[p]]);
    if (solid.isBehind[p]) {
      sum(held[frameOfPiece[p]]);
      continue;
    }
    const HexPoint at = locate(solid.grid, piece.centre);
    SharedPart& part = partOf(parts[at.cell], frameOfPiece[p]);
    for (int a = 0; a < kHexNodes; ++a) {
      part.shape[a] += volume * at.shape[a];
      part.shapeTimesPosition[a] += volume * at.shape[a] * x;
    }
  }
  for (RawCell& cell : cells) {
    cell.centroid /= cell.volume;
    cell.secondMoment -= cell.volume * cell.centroid * cell.centroid.transpose();
  }
}

// The cell's motion N = (1 / V; lengthScale J^-1 r x) of its held pieces' displacements: integral N N^T over stiffness.
Matrix6d giveOf(const RawCell& cell, const RawCell& held, double stiffness, double lengthScale) {
  const Matrix3d inverse = lengthScale * inertia(cell.secondMoment).inverse();
  const Vector3d first = held.centroid - held.volume * cell.centroid;  // about the cell's centroid
  const Matrix3d second = held.secondMoment - held.centroid * cell.centroid.transpose() -
                          cell.centroid * held.centroid.transpose() +
                          held.volume * cell.centroid * cell.centroid.transpose();
  Matrix6d out;
  out.topLeftCorner<3, 3>() = held.volume / (cell.volume * cell.volume) * Matrix3d::Identity();
  out.bottomLeftCorner<3, 3>() = inverse * crossMatrix(first) / cell.volume;
  out.topRightCorner<3, 3>() = out.bottomLeftCorner<3, 3>().transpose();
  out.bottomRightCorner<3, 3>() = inverse * inertia(second) * inverse;
  return out / stiffness;
}

}  // namespace

CellFrames makeCellFrames(const TriangleMesh& mesh, const std::vector<Ball>& balls, const VoxelSolid& solid) {
  CellFrames out;
  PowerCells cells = divideByPower(solid.voxels, balls, massProperties(mesh));
  const std::size_t count = balls.size();
  double volume = 0;
  for (const MassProperties& cell : cells.cells) {
    out.frames.push_back({cell.centroid, cell.volume, cell.secondMoment});
    volume += cell.volume;
  }
  out.lengthScale = std::cbrt(volume / static_cast<double>(count));

  const Vector3d origin = out.frames[0].restPosition;
  std::vector<std::vector<SharedPart>> parts(solid.grid.cells.size());
  std::vector<RawCell> raw(count), held(count);
  integrate(solid, cells.cellOfPiece, origin, parts, raw, held);
  out.heldGive.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double perVolume = kHeldPenalty / (solid.grid.size * solid.grid.size);
    out.heldGive.push_back(giveOf(raw[i], held[i], perVolume, out.lengthScale));
    out.heldShare.push_back(held[i].volume / raw[i].volume);
  }
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Matrix3d> inverseInertia;
  inverseInertia.reserve(raw.size());
  for (const RawCell& cell : raw) inverseInertia.push_back(inertia(cell.secondMoment).inverse());
  for (std::size_t c = 0; c < parts.size(); ++c) {
    for (const SharedPart& part : parts[c]) {
      const RawCell& cell = raw[part.frame];
      // The voxels' centroid is not quite the frame's place: t is carried over by theta.
      const Matrix3d carry = crossMatrix(origin + cell.centroid - out.frames[part.frame].restPosition);
      for (int a = 0; a < kHexNodes; ++a) {
        const Matrix3d turn =
            inverseInertia[part.frame] * crossMatrix(part.shapeTimesPosition[a] - part.shape[a] * cell.centroid);
        const Matrix3d move = part.shape[a] / cell.volume * Matrix3d::Identity() + carry * turn;
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) {
            const int column = 3 * solid.grid.cellNodes[c][a] + j;
            entries.emplace_back(6 * part.frame + i, column, move(i, j));
            entries.emplace_back(6 * part.frame + 3 + i, column, out.lengthScale * turn(i, j));
          }
        }
      }
    }
  }
  out.motion.resize(6 * static_cast<Index>(count), 3 * static_cast<Index>(solid.grid.nodes.size()));
  out.motion.setFromTriplets(entries.begin(), entries.end());
  out.sites = std::move(cells.sites);
  out.contactArea = contactAreas(solid.voxels, cells.cellOfPiece);
  return out;
}

}  // namespace medulla
