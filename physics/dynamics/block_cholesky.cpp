#include "physics/dynamics/block_cholesky.h"

#include <algorithm>
#include <set>

namespace medulla {

namespace {

// Columns of the factor, by elimination of the row with fewest neighbours; between equals of the one that elimination
// last changed the longest ago, then of the lowest number. So chains go from both ends and bodies by turns: as little
// fills in, or less, and a row seldom has to wait for the one just before it.
std::vector<std::vector<int>> eliminate(int rows, const std::vector<std::array<int, 2>>& blocks,
                                        std::vector<int>& order) {
  std::vector<std::set<int>> neighbours(rows);
  for (const auto& [a, b] : blocks) {
    neighbours[a].insert(b);
    neighbours[b].insert(a);
  }
  std::vector<int> changed(rows, 0);
  const auto rankOf = [&](int i) { return std::array<int, 3>{static_cast<int>(neighbours[i].size()), changed[i], i}; };
  std::set<std::array<int, 3>> ranks;
  for (int i = 0; i < rows; ++i) ranks.insert(rankOf(i));
  std::vector<std::vector<int>> columns;
  order.clear();
  while (!ranks.empty()) {
    const int pivot = (*ranks.begin())[2];
    ranks.erase(ranks.begin());
    order.push_back(pivot);
    const std::vector<int> column(neighbours[pivot].begin(), neighbours[pivot].end());
    for (const int i : column) {
      ranks.erase(rankOf(i));
      neighbours[i].erase(pivot);
      for (const int k : column)
        if (k != i) neighbours[i].insert(k);
      changed[i] = static_cast<int>(order.size());
      ranks.insert(rankOf(i));
    }
    columns.push_back(column);
  }
  return columns;
}

}  // namespace

void BlockCholesky::analyse(int rows, const std::vector<std::array<int, 2>>& blocks) {
  std::vector<std::vector<int>> columns = eliminate(rows, blocks, order_);
  position_.resize(rows);
  for (int p = 0; p < rows; ++p) position_[order_[p]] = p;
  firstEntry_.assign(1, 0);
  entryRow_.clear();
  for (std::vector<int>& column : columns) {
    for (int& i : column) i = position_[i];
    std::sort(column.begin(), column.end());
    entryRow_.insert(entryRow_.end(), column.begin(), column.end());
    firstEntry_.push_back(static_cast<int>(entryRow_.size()));
  }
  const auto find = [&](int row, int column) {
    const auto begin = entryRow_.begin() + firstEntry_[column], end = entryRow_.begin() + firstEntry_[column + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - entryRow_.begin());
  };
  updates_.clear();
  firstUpdate_.assign(1, 0);
  for (int p = 0; p < rows; ++p) {
    for (int k = firstEntry_[p]; k < firstEntry_[p + 1]; ++k)
      for (int i = k; i < firstEntry_[p + 1]; ++i)
        updates_.push_back({i, k, i == k ? -1 - entryRow_[i] : find(entryRow_[i], entryRow_[k])});
    firstUpdate_.push_back(static_cast<int>(updates_.size()));
  }
  slot_.clear();
  turned_.clear();
  isFirst_.clear();
  std::vector<char> given(entryRow_.size(), 0);
  for (const auto& [a, b] : blocks) {
    const int row = std::max(position_[a], position_[b]), column = std::min(position_[a], position_[b]);
    slot_.push_back(find(row, column));
    turned_.push_back(position_[a] < position_[b]);
    isFirst_.push_back(!given[slot_.back()]);
    given[slot_.back()] = 1;
  }
  fill_.clear();
  for (std::size_t k = 0; k < given.size(); ++k)
    if (!given[k]) fill_.push_back(static_cast<int>(k));
  entry_.resize(entryRow_.size());
  diagonal_.resize(rows);
  work_.resize(rows);
}

void BlockCholesky::clear() {
  for (const int k : fill_) entry_[k].setZero();
}

void BlockCholesky::addBlock(int k, const Block6& block) {
  Block6& to = entry_[slot_[k]];
  if (!isFirst_[k])
    to += turned_[k] ? Block6(block.transpose()) : block;
  else if (turned_[k])
    to = block.transpose();
  else
    to = block;
}

bool BlockCholesky::factorise() {
  for (std::size_t p = 0; p < diagonal_.size(); ++p) {
    if (!invertFactor(diagonal_[p])) return false;
    for (int i = firstEntry_[p]; i < firstEntry_[p + 1]; ++i) multiplyByUpper(diagonal_[p], entry_[i]);
    for (int u = firstUpdate_[p]; u < firstUpdate_[p + 1]; ++u) {
      const Update& update = updates_[u];
      Block6& target = update.target < 0 ? diagonal_[-1 - update.target] : entry_[update.target];
      subtractProductWithTransposed(entry_[update.i], entry_[update.k], target);
    }
  }
  return true;
}

void BlockCholesky::solve(std::vector<Vector6>& x) const {
  const std::size_t rows = order_.size();
  for (std::size_t p = 0; p < rows; ++p) work_[p] = x[order_[p]];
  for (std::size_t p = 0; p < rows; ++p) {
    double* own = work_[p].data();
    storeSix(own, transposedProduct(diagonal_[p], own));
    for (int i = firstEntry_[p]; i < firstEntry_[p + 1]; ++i) {
      double* other = work_[entryRow_[i]].data();
      storeSix(other, loadSix(other) - product(entry_[i], own));
    }
  }
  for (std::size_t p = rows; p-- > 0;) {
    double* own = work_[p].data();
    for (int i = firstEntry_[p]; i < firstEntry_[p + 1]; ++i)
      storeSix(own, loadSix(own) - transposedProduct(entry_[i], work_[entryRow_[i]].data()));
    storeSix(own, product(diagonal_[p], own));
  }
  for (std::size_t p = 0; p < rows; ++p) x[order_[p]] = work_[p];
}

}  // namespace medulla
