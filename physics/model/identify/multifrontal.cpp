#include "physics/model/identify/multifrontal.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr int kLeafCells = 6;  // smaller ones spend their time in small blocks, larger ones treat zeros as numbers

// Of eliminating `own` of `all` freedoms.
double operations(double own, double all) {
  return own * own * own / 3 + own * own * (all - own) + own * (all - own) * (all - own);
}

class Dissector {
 public:
  explicit Dissector(const HexGrid& grid) : grid_(grid), first_(grid.nodes.size(), -1), last_(grid.nodes.size(), -1) {
    plan_.nodes = static_cast<int>(grid.nodes.size());
    plan_.cellOrder.resize(grid.cells.size());
    std::iota(plan_.cellOrder.begin(), plan_.cellOrder.end(), 0);
    dissect(0, static_cast<int>(grid.cells.size()));
    for (int k = 0; k < static_cast<int>(plan_.cellOrder.size()); ++k) {
      for (const int node : grid.cellNodes[plan_.cellOrder[k]]) {
        if (first_[node] < 0) first_[node] = k;
        last_[node] = k;
      }
    }
    for (Front& front : plan_.fronts) gatherNodes(front);
  }

  DissectionPlan takePlan() { return std::move(plan_); }

 private:
  // Splits along the longest axis by the plane that leaves the halves most equal; returns the first cell beyond it.
  int split(int first, int count) {
    std::array<int, 3> low = grid_.cells[plan_.cellOrder[first]], high = low;
    for (int k = first; k < first + count; ++k) {
      for (int a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], grid_.cells[plan_.cellOrder[k]][a]);
        high[a] = std::max(high[a], grid_.cells[plan_.cellOrder[k]][a]);
      }
    }
    int axis = 0;
    for (int a = 1; a < 3; ++a) axis = high[a] - low[a] > high[axis] - low[axis] ? a : axis;
    std::vector<int> upTo(high[axis] - low[axis] + 2, 0);
    for (int k = first; k < first + count; ++k) ++upTo[grid_.cells[plan_.cellOrder[k]][axis] - low[axis] + 1];
    std::partial_sum(upTo.begin(), upTo.end(), upTo.begin());
    int plane = 1;
    for (int p = 1; p + 1 < static_cast<int>(upTo.size()); ++p) {
      if (std::abs(2 * upTo[p] - count) < std::abs(2 * upTo[plane] - count)) plane = p;
    }
    const auto begin = plan_.cellOrder.begin() + first;
    std::stable_partition(begin, begin + count, [&](int cell) { return grid_.cells[cell][axis] < low[axis] + plane; });
    return first + upTo[plane];
  }

  int dissect(int first, int count) {
    Front front;
    front.firstCell = first;
    front.cellCount = count;
    if (count > kLeafCells) {
      const int middle = split(first, count);
      front.halves[0] = dissect(first, middle - first);
      front.halves[1] = dissect(middle, first + count - middle);
    }
    plan_.fronts.push_back(std::move(front));
    return static_cast<int>(plan_.fronts.size()) - 1;
  }

  // What the halves left, or what a leaf's cells have; first what no cell outside of this part has.
  void gatherNodes(Front& front) {
    std::vector<int>& nodes = front.nodes;
    const int begin = front.firstCell, end = begin + front.cellCount;
    if (front.halves[0] >= 0) {
      for (const int half : front.halves) {
        const Front& part = plan_.fronts[half];
        nodes.insert(nodes.end(), part.nodes.begin() + part.own, part.nodes.end());
      }
    } else {
      for (int k = begin; k < end; ++k) {
        const auto& cell = grid_.cellNodes[plan_.cellOrder[k]];
        nodes.insert(nodes.end(), cell.begin(), cell.end());
      }
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    const auto rest = std::stable_partition(nodes.begin(), nodes.end(),
                                            [&](int node) { return first_[node] >= begin && last_[node] < end; });
    front.own = static_cast<int>(rest - nodes.begin());
    const double own = 3. * front.own, all = 3. * static_cast<double>(nodes.size());
    plan_.factorNumbers += own * all;
    plan_.operations += operations(own, all);
  }

  const HexGrid& grid_;
  DissectionPlan plan_;
  std::vector<int> first_, last_;  // of each node's cells, places in cellOrder
};

// Adds `from`, whose rows are those of `nodes`, to `to` at the places that `place` gives the nodes. Lower triangles.
void addInto(MatrixXd& to, const MatrixXd& from, const int* nodes, std::size_t count, const std::vector<int>& place) {
  for (std::size_t b = 0; b < count; ++b) {
    for (std::size_t a = 0; a < count; ++a) {
      const Index i = place[nodes[a]], j = place[nodes[b]];
      if (i < j) continue;
      if (a >= b) {
        to.block<3, 3>(3 * i, 3 * j) += from.block<3, 3>(3 * static_cast<Index>(a), 3 * static_cast<Index>(b));
      } else {
        to.block<3, 3>(3 * i, 3 * j) +=
            from.block<3, 3>(3 * static_cast<Index>(b), 3 * static_cast<Index>(a)).transpose();
      }
    }
  }
}

// Eliminates the first `own` freedoms; leaves their columns in `columns` and the rest's matrix in `matrix`.
void eliminate(MatrixXd& matrix, Index own, MatrixXd& columns) {
  const Index rest = matrix.rows() - own;
  columns = matrix.leftCols(own);
  if (own == 0) return;
  Eigen::Ref<MatrixXd> square = columns.topRows(own);
  const Eigen::LLT<Eigen::Ref<MatrixXd>> cholesky(square);
  if (cholesky.info() != Eigen::Success) throw std::runtime_error("the stiffness matrix is not positive definite");
  if (rest == 0) return;
  columns.topRows(own).transpose().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(
      columns.bottomRows(rest));
  MatrixXd update = matrix.bottomRightCorner(rest, rest);
  update.selfadjointView<Eigen::Lower>().rankUpdate(columns.bottomRows(rest), -1);
  matrix = std::move(update);
}

// Rows of the front's nodes, gathered from and scattered to those of the whole grid.
void gather(const RowMatrix& x, const int* nodes, Index count, RowMatrix& rows) {
  for (Index a = 0; a < count; ++a) rows.middleRows<3>(3 * a) = x.middleRows<3>(3 * static_cast<Index>(nodes[a]));
}

}  // namespace

DissectionPlan planDissection(const HexGrid& grid) {
  return Dissector(grid).takePlan();
}

FrontFactors factorise(const DissectionPlan& plan, const HexGrid& grid,
                       const std::function<void(int, MatrixXd&)>& cellStiffness,
                       const std::function<void(double)>& progress) {
  FrontFactors factors;
  factors.columns.resize(plan.fronts.size());
  std::vector<MatrixXd> rest(plan.fronts.size());
  std::vector<int> place(plan.nodes, -1);
  MatrixXd cellMatrix(3 * kHexNodes, 3 * kHexNodes);
  double done = 0;
  for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
    const Front& front = plan.fronts[f];
    const auto size = static_cast<Index>(front.nodes.size());
    for (Index a = 0; a < size; ++a) place[front.nodes[a]] = static_cast<int>(a);
    MatrixXd& matrix = rest[f];
    matrix.setZero(3 * size, 3 * size);
    if (front.halves[0] >= 0) {
      for (const int half : front.halves) {
        const Front& part = plan.fronts[half];
        addInto(matrix, rest[half], part.nodes.data() + part.own, part.nodes.size() - part.own, place);
        rest[half].resize(0, 0);
      }
    } else {
      for (int k = front.firstCell; k < front.firstCell + front.cellCount; ++k) {
        const int cell = plan.cellOrder[k];
        cellStiffness(cell, cellMatrix);
        addInto(matrix, cellMatrix, grid.cellNodes[cell].data(), kHexNodes, place);
      }
    }
    eliminate(matrix, 3 * static_cast<Index>(front.own), factors.columns[f]);
    done += operations(3. * front.own, 3. * static_cast<double>(size));
    if (progress) progress(done / plan.operations);
  }
  return factors;
}

void solve(const DissectionPlan& plan, const FrontFactors& factors, RowMatrix& x) {
  RowMatrix own, rest, change;
  const auto sizes = [&](std::size_t f) {
    const Front& front = plan.fronts[f];
    own.resize(3 * static_cast<Index>(front.own), x.cols());
    rest.resize(3 * static_cast<Index>(front.nodes.size() - front.own), x.cols());
    gather(x, front.nodes.data(), front.own, own);
    return front.nodes.data() + front.own;
  };
  const auto scatterOwn = [&](const Front& front) {
    for (Index a = 0; a < front.own; ++a)
      x.middleRows<3>(3 * static_cast<Index>(front.nodes[a])) = own.middleRows<3>(3 * a);
  };
  for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
    const Front& front = plan.fronts[f];
    if (front.own == 0) continue;
    const int* outer = sizes(f);
    const MatrixXd& columns = factors.columns[f];
    columns.topRows(own.rows()).triangularView<Eigen::Lower>().solveInPlace(own);
    scatterOwn(front);
    if (rest.rows() == 0) continue;
    rest.noalias() = columns.bottomRows(rest.rows()) * own;
    for (Index a = 0; 3 * a < rest.rows(); ++a)
      x.middleRows<3>(3 * static_cast<Index>(outer[a])) -= rest.middleRows<3>(3 * a);
  }
  for (std::size_t f = plan.fronts.size(); f-- > 0;) {
    const Front& front = plan.fronts[f];
    if (front.own == 0) continue;
    const int* outer = sizes(f);
    const MatrixXd& columns = factors.columns[f];
    gather(x, outer, rest.rows() / 3, rest);
    if (rest.rows() > 0) own.noalias() -= columns.bottomRows(rest.rows()).transpose() * rest;
    columns.topRows(own.rows()).transpose().triangularView<Eigen::Upper>().solveInPlace(own);
    scatterOwn(front);
  }
}

}  // namespace medulla
