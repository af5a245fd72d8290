#include "app/files/trial_journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <limits>
#include <stdexcept>

#include "app/files/csv_rows.h"
#include "app/files/text_file.h"

namespace medulla {

namespace {

// What tells a trial from the others, as the tables write it.
std::string trialKey(const StabilityPoint& p) {
  return fmt::format("{},{},{:.12g},{:.12g}", p.method, p.trial, p.young, p.step);
}

StabilityPoint pointOf(const CsvRows& row) {
  row.requireCells(7, "the seven of a trial");
  StabilityPoint p;
  p.method = row.cells()[0];
  p.trial = row.cells()[1];
  p.young = row.number(2, "young");
  p.step = row.number(3, "step");
  p.survived = row.index(4, "survived", 2) == 1;
  if (!row.cells()[5].empty()) p.recoveredAt = row.number(5, "recovered_at");
  p.energyRatio = row.cells()[6] == "inf" ? std::numeric_limits<double>::infinity() : row.number(6, "largest_energy");
  return p;
}

}  // namespace

TrialJournal::TrialJournal(std::string path, std::uint64_t run)
    : path_(std::move(path)),
      head_(fmt::format("# medulla stability {:016x}\n", run)),
      lock_(std::filesystem::absolute(path_).parent_path().string(), path_, "another run is filling it") {
  if (fileExists(path_)) read();
  writeAnew();  // without a row's beginning
}

TrialJournal::~TrialJournal() {
  if (known_.empty()) ::unlink(path_.c_str());
}

void TrialJournal::read() {
  std::string text = readTextFile(path_);
  text.erase(text.rfind('\n') + 1);                // all of it where there is none
  if (text.find('\n') + 1 == text.size()) return;  // no more than a head, whoever's
  if (!text.starts_with(head_))
    throw std::runtime_error(
        fmt::format("{}: holds trials of another run: the command that began them goes on there; or remove it", path_));
  CsvRows rows(text, path_);
  while (rows.next()) {
    const StabilityPoint point = pointOf(rows);
    known_[trialKey(point)] = point;
  }
}

bool TrialJournal::find(StabilityPoint& point) const {
  const auto found = known_.find(trialKey(point));
  if (found != known_.end()) point = found->second;
  return found != known_.end();
}

void TrialJournal::add(const StabilityPoint& point) {
  try {
    writeAll(rows_, stabilityRow(point), path_);
  } catch (...) {
    rows_.close();  // a row behind a half one would spoil the file
    throw;
  }
  known_[trialKey(point)] = point;
}

void TrialJournal::forget(const std::vector<StabilityPoint>& done) {
  for (const StabilityPoint& point : done) known_.erase(trialKey(point));
  writeAnew();
}

void TrialJournal::writeAnew() {
  std::string text = head_;
  for (const auto& [key, point] : known_) text += stabilityRow(point);
  writeFile(path_, text);
  rows_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  if (!rows_.isOpen()) throw unwritable(path_);
}

}  // namespace medulla
