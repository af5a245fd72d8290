#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/files/output_file.h"
#include "app/files/stability_file.h"

namespace medulla {

// Trials as they end, a row each, for runs of hours: what an ended run of the same trials left is not run again. The
// file has a name that looks unfinished; whoever has all trials writes the tables and calls forget(). A row is in the
// file when add() returns; one that a killed run left half written is dropped.
class TrialJournal {
 public:
  // `run` is all that the trials' outcomes follow from. Throws std::runtime_error where the file cannot be read or
  // written, holds trials of another run, or another run keeps one in the same folder.
  TrialJournal(std::string path, std::uint64_t run);
  ~TrialJournal();  // without trials there is no file

  // Fills in how `point`'s trial ended. False where it is not known.
  bool find(StabilityPoint& point) const;
  void add(const StabilityPoint& point);
  void forget(const std::vector<StabilityPoint>& done);  // those of a longer run that was interrupted stay
  std::size_t size() const { return known_.size(); }
  const std::string& path() const { return path_; }

 private:
  void read();
  void writeAnew();

  std::string path_, head_;
  FolderLock lock_;  // not of the file, which is replaced
  Descriptor rows_;  // at the file's end
  std::map<std::string, StabilityPoint> known_;
};

}  // namespace medulla
