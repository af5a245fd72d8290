#include "app/files/gnuplot.h"

#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string_view>

#include "app/files/text.h"
#include "app/interrupt.h"
#include "app/standard_streams.h"
#include "render/descriptor.h"
#include "render/partial_file.h"

extern char** environ;

namespace medulla {

namespace {

// A file in memory takes what a program says: a pipe nobody reads could fill and stop it.
Descriptor memoryFile(const char* name) {
  Descriptor file(memfd_create(name, MFD_CLOEXEC));
  if (!file.isOpen()) throw std::runtime_error(std::string("no file in memory: ") + std::strerror(errno));
  return file;
}

std::string contentOf(const Descriptor& file) {
  std::string out(static_cast<std::size_t>(lseek(file.value(), 0, SEEK_END)), '\0');
  const ssize_t n = pread(file.value(), out.data(), out.size(), 0);
  out.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  return out;
}

// gnuplot ignores what its output cannot take, and ends with 0.
bool isWhole(std::string_view picture) {
  const std::string_view end = picture.starts_with("\x89PNG") ? "IEND" : "</svg>";
  return picture.substr(picture.size() - std::min<std::size_t>(picture.size(), 16)).find(end) != picture.npos;
}

}  // namespace

std::optional<std::string> runGnuplot(const std::string& script) {
  const Descriptor input = memoryFile("script"), picture = memoryFile("chart"), complaints = memoryFile("complaints");
  writeAll(input, script, "a file in memory");
  lseek(input.value(), 0, SEEK_SET);
  std::string program = "gnuplot", options = "--default-settings";  // whatever the user's own are
  char* const argv[] = {program.data(), options.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input.value(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, picture.value(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, complaints.value(), STDERR_FILENO);
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
  const bool ok = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  if (std::string drawn = ok ? contentOf(picture) : ""; isWhole(drawn)) return drawn;
  if (ok) throw std::runtime_error("gnuplot failed: its picture ends early");
  std::string complaint = contentOf(complaints);
  while (!complaint.empty() && (complaint.back() == '\n' || complaint.back() == ' ')) complaint.pop_back();
  complaint.erase(0, complaint.rfind('\n') + 1);
  throw std::runtime_error("gnuplot failed: " + (complaint.empty() ? "it gave no reason" : complaint));
}

void drawByGnuplot(const std::string& stem, const std::string& script) {
  const std::string source = stem + ".gnuplot", picture = stem + ".svg";
  std::filesystem::remove(picture);  // whatever comes, no earlier run's stands beside this one's script
  writeFile(source, script);
  if (const std::optional<std::string> svg = runGnuplot(script)) {
    writeFile(picture, *svg);
  } else {
    tell("no {}: gnuplot is not installed (Debian package gnuplot-nox); then: gnuplot {} > {}\n",
         std::filesystem::path(picture).filename().string(), shellWord(source), shellWord(picture));
  }
}

}  // namespace medulla
