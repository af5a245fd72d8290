#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/descriptor.h"
#include "render/partial_file.h"

namespace medulla {

// Of a file or folder, which need not exist: absolute, links and "./" seen through, without a slash at its end. Two
// paths lead to one place where these are equal.
std::filesystem::path placeOf(const std::string& path);

// A file's path without "./" and "..": as it is called, or, where links in it make that another place, in the folder
// where it is.
std::filesystem::path normalised(const std::filesystem::path& path);

// Throws std::runtime_error when a command would write one file twice, or over a file that it reads, by their
// places; empty names are skipped.
void requireDistinctFiles(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs);

// Written bit by bit, a file appears under its name only when whole (render/partial_file.h); ^C becomes an exception
// (app/interrupt.h), and so leaves nothing either. The constructor throws what PartialFile's throws, write(), finish()
// and commit() std::runtime_error with path and reason where the system fails (disk full).
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  void write(const std::string& bytes);
  void finish();  // the last byte is written: of several files one that is full keeps all from appearing
  void commit();  // once, last

 private:
  void flush();

  std::string path_;
  PartialFile file_;
  Descriptor to_;
  std::string buffer_;
};

// Before work whose results they are to take: throws what OutputFile throws for the first that cannot be written. Empty
// names are skipped.
void requireWritable(const std::vector<std::string>& paths);

// Keeps a folder from others who ask, until it is destroyed or the process ends. Throws std::runtime_error
// "NAME: TAKEN" where somebody has it.
class FolderLock {
 public:
  FolderLock(const std::string& folder, const std::string& name, const std::string& taken);

 private:
  Descriptor folder_;
};

}  // namespace medulla
