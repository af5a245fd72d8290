#include "physics/model/identify/multifrontal.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>

#include "physics/model/identify/hex_stiffness.h"
#include "physics/model/identify/parallel.h"
#include "physics/sort_unique.h"

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
    for (int p = 1; p + 1 < static_cast<int>(upTo.size()); ++p)
      if (std::abs(2 * upTo[p] - count) < std::abs(2 * upTo[plane] - count)) plane = p;
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
    sortUnique(nodes);
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

using Block = Eigen::Map<MatrixXd>;
using ConstBlock = Eigen::Map<const MatrixXd>;

// Adds `from`, whose rows are those of `nodes`, to `to` at the places that `place` gives the nodes. Lower triangles.
void addInto(Block& to, const ConstBlock& from, std::span<const int> nodes, const std::vector<int>& place) {
  const auto count = static_cast<Index>(nodes.size());
  for (Index b = 0; b < count; ++b) {
    const Index j = place[nodes[b]];
    for (Index a = b; a < count; ++a) {
      const Index i = place[nodes[a]];
      if (i >= j)
        to.block<3, 3>(3 * i, 3 * j) += from.block<3, 3>(3 * a, 3 * b);
      else
        to.block<3, 3>(3 * j, 3 * i) += from.block<3, 3>(3 * a, 3 * b).transpose();
    }
  }
}

// Calls use(column, its first row) for the lower triangle, whole blocks of 3 x 3 on the diagonal.
template <typename Use>
void overLower(Index size, const Use& use) {
  for (Index j = 0; j < size; ++j) use(j, j - j % 3);
}

// Eliminates the first `own` freedoms; leaves their columns in `columns` and the rest's matrix in the lower right
// corner.
void eliminate(Block& matrix, Index own, MatrixXd& columns) {
  const Index rest = matrix.rows() - own;
  columns = matrix.leftCols(own);
  if (own == 0) return;
  Eigen::Ref<MatrixXd> square = columns.topRows(own);
  const Eigen::LLT<Eigen::Ref<MatrixXd>> cholesky(square);
  if (cholesky.info() != Eigen::Success) throw std::runtime_error("the stiffness matrix is not positive definite");
  if (rest == 0) return;
  columns.topRows(own).transpose().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(
      columns.bottomRows(rest));
  matrix.bottomRightCorner(rest, rest).selfadjointView<Eigen::Lower>().rankUpdate(columns.bottomRows(rest), -1);
}

class Factorisation {
 public:
  Factorisation(const DissectionPlan& plan, const HexGrid& grid, const CellMatrices& cellMatrices,
                const std::function<void(double)>& progress)
      : plan_(plan), grid_(grid), cellMatrices_(cellMatrices), progress_(progress), stackSize_(plan.fronts.size()) {
    factors_.columns.resize(plan.fronts.size());
    for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
      const auto& [first, second] = plan.fronts[f].halves;
      stackSize_[f] = square(plan.fronts[f].nodes.size());
      if (first < 0) continue;
      stackSize_[f] = std::max({stackSize_[f] + restSize(first) + restSize(second), stackSize_[first],
                                restSize(first) + stackSize_[second]});
    }
  }

  FrontFactors run() {
    const int root = static_cast<int>(plan_.fronts.size()) - 1;
    Workspace workspace = makeWorkspace(root);
    workspace.reports = true;
    eliminateTree(root, 0, workspace);
    return std::move(factors_);
  }

 private:
  static constexpr int kCellBatch = 32;   // cells' matrices at once, by one large product
  static constexpr int kForks = 1;        // of the topmost front: two threads
  static constexpr int kForkCells = 100;  // below, threads cost more than they bring

  // Of one thread. Matrices of fronts lie on a stack, above those that their halves left.
  struct Workspace {
    std::unique_ptr<double[]> stack;
    std::size_t top = 0;
    std::vector<int> place;  // of the grid's nodes in the front at work
    int batch = -1;          // the number of the one in cellMatrices
    MatrixXd cellMatrices;
    bool reports = false;  // the caller's thread
  };

  static std::size_t square(std::size_t nodes) { return 9 * nodes * nodes; }
  std::size_t restSize(int front) const { return square(plan_.fronts[front].nodes.size() - plan_.fronts[front].own); }

  Workspace makeWorkspace(int root) const {
    Workspace w;
    w.stack.reset(new double[stackSize_[root]]);
    w.place.resize(plan_.nodes);
    return w;
  }

  // Leaves the rest's matrix on top of the stack. Once a thread has failed all return early, to where it throws.
  void eliminateTree(int f, int forks, Workspace& w) {
    const Front& front = plan_.fronts[f];
    const std::size_t begin = w.top;
    Workspace other;
    std::future<void> first;  // outside of the block below: it is awaited after the others know that this one failed
    try {
      if (front.halves[0] >= 0 && forks < kForks && front.cellCount > kForkCells) {
        other = makeWorkspace(front.halves[0]);
        first = std::async(std::launch::async | std::launch::deferred,
                           [&] { eliminateTree(front.halves[0], forks + 1, other); });
        eliminateTree(front.halves[1], forks + 1, w);
        awaitWhileReporting(first, w);
      } else if (front.halves[0] >= 0) {
        eliminateTree(front.halves[0], kForks, w);
        eliminateTree(front.halves[1], kForks, w);
      }
      if (stopped_) return;
      eliminateFront(f, begin, other.stack.get(), w);
      report(w);
    } catch (...) {
      stopped_ = true;
      throw;
    }
  }

  void awaitWhileReporting(std::future<void>& other, const Workspace& w) {
    while (w.reports && other.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout) report(w);
    other.get();
  }

  // The halves' rests lie on the stack from `begin`; the first's elsewhere if `first` is given.
  void eliminateFront(int f, std::size_t begin, const double* first, Workspace& w) {
    const Front& front = plan_.fronts[f];
    const auto size = 3 * static_cast<Index>(front.nodes.size()), own = 3 * static_cast<Index>(front.own);
    for (std::size_t a = 0; a < front.nodes.size(); ++a) w.place[front.nodes[a]] = static_cast<int>(a);
    Block matrix(w.stack.get() + w.top, size, size);
    overLower(size, [&](Index column, Index row) { matrix.col(column).tail(size - row).setZero(); });
    if (front.halves[0] >= 0) {
      const double* const second = w.stack.get() + begin + (first ? 0 : restSize(front.halves[0]));
      addRest(matrix, front.halves[0], first ? first : w.stack.get() + begin, w.place);
      addRest(matrix, front.halves[1], second, w.place);
    } else {
      addCells(matrix, front, w);
    }
    eliminate(matrix, own, factors_.columns[f]);
    done_ += operations(static_cast<double>(own), static_cast<double>(size));
    const Index rest = size - own;
    double* const to = w.stack.get() + begin;
    overLower(rest, [&](Index column, Index row) {
      const double* const from = matrix.data() + (own + column) * size + own;
      std::copy(from + row, from + rest, to + column * rest + row);
    });
    w.top = begin + restSize(f);
  }

  void addRest(Block& matrix, int half, const double* numbers, const std::vector<int>& place) const {
    const auto nodes = std::span(plan_.fronts[half].nodes).subspan(plan_.fronts[half].own);
    const auto size = 3 * static_cast<Index>(nodes.size());
    addInto(matrix, ConstBlock(numbers, size, size), nodes, place);
  }

  // Batches begin at multiples of their size in cellOrder whichever thread asks: products' bits depend on the columns.
  void addCells(Block& matrix, const Front& front, Workspace& w) const {
    for (int k = front.firstCell; k < front.firstCell + front.cellCount; ++k) {
      if (k / kCellBatch != w.batch) {
        w.batch = k / kCellBatch;
        const auto rest = std::span(plan_.cellOrder).subspan(static_cast<std::size_t>(w.batch) * kCellBatch);
        w.cellMatrices = cellMatrices_(rest.first(std::min<std::size_t>(kCellBatch, rest.size())));
      }
      const ConstBlock cell(w.cellMatrices.col(k % kCellBatch).data(), kHexFreedoms, kHexFreedoms);
      addInto(matrix, cell, grid_.cellNodes[plan_.cellOrder[k]], w.place);
    }
  }

  void report(const Workspace& w) const {
    if (w.reports) progress_(done_ / plan_.operations);
  }

  const DissectionPlan& plan_;
  const HexGrid& grid_;
  const CellMatrices& cellMatrices_;
  const std::function<void(double)>& progress_;
  std::vector<std::size_t> stackSize_;  // of each front's tree, in numbers
  FrontFactors factors_;                // threads write to different fronts'
  std::atomic<double> done_ = 0;        // operations
  std::atomic<bool> stopped_ = false;
};

// Of columns first to first + count of x; the others are not touched.
class HalfSolver {
 public:
  HalfSolver(const DissectionPlan& plan, const FrontFactors& factors, RowMatrix& x, Index first, Index count)
      : plan_(plan), factors_(factors), x_(x), first_(first), count_(count) {
    std::size_t own = 0, rest = 0;
    for (const Front& front : plan.fronts) {
      own = std::max<std::size_t>(own, front.own);
      rest = std::max(rest, front.nodes.size() - front.own);
    }
    own_.resize(3 * static_cast<Index>(own), count);
    rest_.resize(3 * static_cast<Index>(rest), count);
  }

  void run() {
    for (std::size_t f = 0; f < plan_.fronts.size(); ++f)
      if (plan_.fronts[f].own > 0) forward(plan_.fronts[f], factors_.columns[f]);
    for (std::size_t f = plan_.fronts.size(); f-- > 0;)
      if (plan_.fronts[f].own > 0) backward(plan_.fronts[f], factors_.columns[f]);
  }

 private:
  void forward(const Front& front, const MatrixXd& columns) {
    const auto nodes = std::span(front.nodes);
    auto own = own_.topRows(columns.cols()), rest = rest_.topRows(columns.rows() - columns.cols());
    gather(nodes.first(front.own), own_);
    if ((own.array() == 0).all()) return;  // no load on this front's tree
    columns.topRows(own.rows()).triangularView<Eigen::Lower>().solveInPlace(own);
    scatter(nodes.first(front.own), own_);
    if (rest.rows() == 0) return;
    rest.noalias() = columns.bottomRows(rest.rows()) * own;
    const auto outer = nodes.subspan(front.own);
    for (std::size_t a = 0; a < outer.size(); ++a) rowsOf(outer[a]) -= rest.middleRows<3>(3 * static_cast<Index>(a));
  }

  void backward(const Front& front, const MatrixXd& columns) {
    const auto nodes = std::span(front.nodes);
    auto own = own_.topRows(columns.cols()), rest = rest_.topRows(columns.rows() - columns.cols());
    gather(nodes.first(front.own), own_);
    gather(nodes.subspan(front.own), rest_);
    if (rest.rows() > 0) own.noalias() -= columns.bottomRows(rest.rows()).transpose() * rest;
    columns.topRows(own.rows()).transpose().triangularView<Eigen::Upper>().solveInPlace(own);
    scatter(nodes.first(front.own), own_);
  }

  Eigen::Block<RowMatrix> rowsOf(int node) { return x_.block(3 * static_cast<Index>(node), first_, 3, count_); }
  void gather(std::span<const int> nodes, RowMatrix& rows) {
    for (std::size_t a = 0; a < nodes.size(); ++a) rows.middleRows<3>(3 * static_cast<Index>(a)) = rowsOf(nodes[a]);
  }
  void scatter(std::span<const int> nodes, const RowMatrix& rows) {
    for (std::size_t a = 0; a < nodes.size(); ++a) rowsOf(nodes[a]) = rows.middleRows<3>(3 * static_cast<Index>(a));
  }

  const DissectionPlan& plan_;
  const FrontFactors& factors_;
  RowMatrix& x_;
  const Index first_, count_;
  RowMatrix own_, rest_;  // rows of a front's nodes
};

}  // namespace

DissectionPlan planDissection(const HexGrid& grid) {
  return Dissector(grid).takePlan();
}

FrontFactors factorise(const DissectionPlan& plan, const HexGrid& grid, const CellMatrices& cellMatrices,
                       const std::function<void(double)>& progress) {
  return Factorisation(plan, grid, cellMatrices, progress).run();
}

void solve(const DissectionPlan& plan, const FrontFactors& factors, RowMatrix& x) {
  inHalves(x.cols(), [&](Index first, Index count) { HalfSolver(plan, factors, x, first, count).run(); });
}

}  // namespace medulla
