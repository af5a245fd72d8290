#include "physics/model/identify/parallel.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "physics/model/identify/hex_stiffness.h"
#include "physics/model/identify/multifrontal.h"
#include "physics/model/mass_properties.h"
#include "tests/test_shapes.h"

namespace medulla {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

HexGrid ellipsoidGrid(double cellSize) {
  const TriangleMesh mesh = ellipsoidMesh(3, {0.06, 0.03, 0.03});
  const double volume = massProperties(mesh).volume;
  return makeHexGrid(voxeliseEvenly(mesh, volume, static_cast<int>(volume / std::pow(cellSize / HexGrid::kVoxels, 3))));
}

// With cells enough for halves on threads of their own.
struct Body {
  HexGrid grid = ellipsoidGrid(0.008);
  DissectionPlan plan = planDissection(grid);
  MatrixXd perPoint = stiffnessPerPoint(0.4);

  FrontFactors factors(const std::function<void(double)>& progress = [](double) {}) const {
    const auto matrices = [&](std::span<const int> cells) {
      MatrixXd out = hexStiffness(grid, perPoint, cells);
      for (int k = 0; k < kHexFreedoms; ++k) out.row(k * (kHexFreedoms + 1)).array() += 1e-3 * grid.size;
      return out;
    };
    return factorise(plan, grid, matrices, progress);
  }
};

TEST(Parallel, HalvesAreAllOfIt) {
  for (const Index all : {0, 1, 11, 12, 13, 16, 42, 48, 522}) {
    std::vector<int> seen(all, 0);
    inHalves(all, [&](Index first, Index count) {
      EXPECT_EQ(first % 12, 0);
      for (Index k = first; k < first + count; ++k) ++seen[k];
    });
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), all);
  }
}

TEST(Parallel, EitherHalfMayThrow) {
  for (const Index which : {0, 24})
    EXPECT_THROW(inHalves(48,
                          [&](Index first, Index) {
                            if (first == which) throw std::runtime_error("failed");
                          }),
                 std::runtime_error);
}

TEST(Parallel, WorkAlongsideEndsWhenNobodyWaitsForIt) {
  const auto forever = [](const std::function<void(double)>& goOn) -> int {
    while (true) goOn(0);
  };
  { Alongside<int> work(forever); }
  Alongside<int> fails([](const auto&) -> int { throw std::invalid_argument("failed"); });
  EXPECT_THROW(fails.get(), std::invalid_argument);
}

TEST(Parallel, FactorsAndSolutionsRepeatBitForBit) {
  const Body body;
  ASSERT_GT(body.plan.cellOrder.size(), 400U);
  const Index n = 3 * static_cast<Index>(body.grid.nodes.size());
  RowMatrix loads(n, 41);
  for (Index i = 0; i < loads.size(); ++i) loads.data()[i] = std::sin(static_cast<double>(i));
  const FrontFactors factors = body.factors();
  RowMatrix together = loads;
  solve(body.plan, factors, together);
  for (int k = 0; k < 3; ++k) {
    const FrontFactors again = body.factors();
    for (std::size_t f = 0; f < factors.columns.size(); ++f) {
      const MatrixXd a = factors.columns[f].triangularView<Eigen::Lower>(),
                     b = again.columns[f].triangularView<Eigen::Lower>();
      ASSERT_EQ(a, b) << f;
    }
  }
  // Twelve columns are not divided, and are what they are among others.
  for (Index first = 0; first + 12 <= loads.cols(); first += 12) {
    RowMatrix alone = loads.middleCols(first, 12);
    solve(body.plan, factors, alone);
    EXPECT_EQ(alone, together.middleCols(first, 12)) << first;
  }
}

TEST(Parallel, ProgressIsOfTheCallersThreadAndEndsTheWork) {
  const Body body;
  double last = 0;
  body.factors([&, caller = std::this_thread::get_id()](double part) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_GE(part, last);
    last = part;
  });
  EXPECT_NEAR(last, 1, 1e-9);
  for (const int calls : {1, 10, 40}) {
    int left = calls;
    EXPECT_THROW(body.factors([&](double) {
      if (--left == 0) throw std::invalid_argument("interrupted");
    }),
                 std::invalid_argument);
    EXPECT_EQ(left, 0) << "called again after it threw";
  }
}

TEST(Parallel, AFrontThatFailsOnAnyThreadFailsAll) {
  const Body body;
  for (const std::size_t place : {std::size_t{0}, body.plan.cellOrder.size() / 2, body.plan.cellOrder.size() - 1}) {
    const int bad = body.plan.cellOrder[place];
    const auto matrices = [&](std::span<const int> cells) {
      MatrixXd out = hexStiffness(body.grid, body.perPoint, cells);
      for (std::size_t c = 0; c < cells.size(); ++c)
        if (cells[c] == bad) out.col(static_cast<Index>(c)) *= -1e3;
      return out;
    };
    EXPECT_THROW(factorise(body.plan, body.grid, matrices), std::runtime_error);
  }
}

}  // namespace
}  // namespace medulla
