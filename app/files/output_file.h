#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "render/partial_file.h"

namespace medulla {

// Of a file or folder, which need not exist: absolute, links and "./" seen through, without a slash at its end. Two
// paths lead to one place where these are equal.
std::filesystem::path placeOf(const std::string& path);

// Throws std::runtime_error when a command would write one file twice, or over a file that it reads, by their
// places; empty names are skipped.
void requireDistinctFiles(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs);

// A text file that appears under its name only when whole (render/partial_file.h); ^C becomes an exception
// (app/interrupt.h), and so leaves nothing either. The constructor throws what PartialFile's throws, write() and
// commit() std::runtime_error with path and reason where the system fails (disk full).
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  void write(const std::string& text);
  void commit();  // once, last

 private:
  void flush();

  std::string path_;
  PartialFile file_;
  int descriptor_;
  std::string buffer_;
};

// A whole OutputFile in one call.
void writeTextFile(const std::string& path, const std::string& text);

// Before work whose results they are to take: throws what OutputFile throws for the first that cannot be written. Empty
// names are skipped.
void requireWritable(const std::vector<std::string>& paths);

// All of it, where the system takes less at a time. Throws unwritable().
void writeAll(int descriptor, std::string_view text, const std::string& path);

// Keeps a folder from others who ask, until it is destroyed or the process ends. Throws std::runtime_error
// "NAME: TAKEN" where somebody has it.
class FolderLock {
 public:
  FolderLock(const std::string& folder, const std::string& name, const std::string& taken);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace medulla
