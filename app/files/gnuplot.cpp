#include "app/files/gnuplot.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "app/files/output_file.h"
#include "app/files/text.h"
#include "app/interrupt.h"
#include "app/standard_streams.h"

extern char** environ;

namespace medulla {

namespace {

// A file in memory takes what a program says: a pipe nobody reads could fill and stop it.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : descriptor_(memfd_create(name, MFD_CLOEXEC)) {
    if (descriptor_ < 0) throw std::runtime_error(std::string("no file in memory: ") + std::strerror(errno));
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int descriptor() const { return descriptor_; }
  void write(const std::string& text) const {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t n = ::pwrite(descriptor_, text.data() + done, text.size() - done, static_cast<off_t>(done));
      if (n < 0) throw std::runtime_error(std::string("no room in memory: ") + std::strerror(errno));
      done += static_cast<std::size_t>(n);
    }
  }
  std::string text() const {
    std::string out(static_cast<std::size_t>(lseek(descriptor_, 0, SEEK_END)), '\0');
    const ssize_t n = pread(descriptor_, out.data(), out.size(), 0);
    out.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return out;
  }

 private:
  int descriptor_;
};

}  // namespace

std::optional<std::string> runGnuplot(const std::string& script) {
  const MemoryFile input("script"), picture("chart"), complaints("gnuplot-errors");
  input.write(script);
  std::string program = "gnuplot";
  char* const argv[] = {program.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input.descriptor(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, picture.descriptor(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, complaints.descriptor(), STDERR_FILENO);
  pid_t child = -1;
  const int failure = posix_spawnp(&child, program.c_str(), &actions, nullptr, argv, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure == ENOENT) return std::nullopt;
  if (failure != 0) throw std::runtime_error(std::string("gnuplot cannot be started: ") + std::strerror(failure));
  int status = 0;
  pid_t ended = -1;
  do ended = waitpid(child, &status, 0);
  while (ended < 0 && errno == EINTR);
  checkInterrupt();  // which ends both where it comes from the keyboard
  if (ended != child) throw std::runtime_error(std::string("gnuplot's end cannot be seen: ") + std::strerror(errno));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return picture.text();
  std::string complaint = complaints.text();
  while (!complaint.empty() && (complaint.back() == '\n' || complaint.back() == ' ')) complaint.pop_back();
  complaint.erase(0, complaint.rfind('\n') + 1);
  throw std::runtime_error("gnuplot failed: " + (complaint.empty() ? "it gave no reason" : complaint));
}

void drawByGnuplot(const std::string& stem, const std::string& script) {
  const std::string source = stem + ".gnuplot", picture = stem + ".svg";
  writeTextFile(source, script);
  if (const std::optional<std::string> svg = runGnuplot(script)) {
    writeTextFile(picture, *svg);
  } else {
    tell("no {}: gnuplot is not installed (Debian package gnuplot-nox); then: gnuplot {} > {}\n",
         std::filesystem::path(picture).filename().string(), shellWord(source), shellWord(picture));
  }
}

}  // namespace medulla
