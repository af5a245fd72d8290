#include "render/encoder_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>

extern char** environ;

namespace medulla {
namespace {

std::string findFfmpeg() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::string candidate = (folder.empty() ? "." : folder) + "/ffmpeg";
    if (access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  throw std::runtime_error("ffmpeg not found: install the Debian package ffmpeg");
}

std::vector<std::string> arguments(const std::string& program, const std::string& path, int width, int height,
                                   double fps) {
  std::ostringstream rate;
  rate.precision(10);
  rate << fps;
  std::vector<std::string> a = {program, "-hide_banner", "-loglevel", "error", "-nostdin", "-y"};
  const std::vector<std::string> tags = {"-colorspace", "bt709", "-color_primaries", "bt709",
                                         "-color_trc",  "bt709", "-color_range",     "tv"};
  const auto add = [&a](const std::vector<std::string>& more) { a.insert(a.end(), more.begin(), more.end()); };
  add({"-f", "rawvideo", "-pix_fmt", "yuv420p"});
  add({"-s", std::to_string(width) + "x" + std::to_string(height), "-r", rate.str()});
  add(tags);
  add({"-i", "pipe:0", "-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-pix_fmt", "yuv420p"});
  // Drawing has every core at work: more threads cost a fifth more time in all, and the file would depend on their
  // number.
  add({"-threads", "1"});
  // The preset's finer search of motion saves 5 % of the file for a quarter of the time.
  add({"-x264-params", "subme=1"});
  add(tags);
  add({"-movflags", "+faststart", "-f", "mp4", path});
  return a;
}

}  // namespace

EncoderProcess::EncoderProcess(const std::string& path, int width, int height, double fps) {
  const std::string program = findFfmpeg();
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("no pipe to ffmpeg: ") + std::strerror(errno));
  input_ = ends[1];
  fcntl(input_, F_SETPIPE_SZ, 1 << 20);  // fewer switches between the two programs; a refusal costs only speed
  // A memory file takes what ffmpeg says: a pipe nobody reads could fill and stop it.
  errors_ = memfd_create("ffmpeg-errors", MFD_CLOEXEC);

  std::vector<std::string> words = arguments(program, path, width, height, fps);
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  if (errors_ >= 0) posix_spawn_file_actions_adddup2(&actions, errors_, STDERR_FILENO);
  // A process group of its own: ^C in the terminal must not make ffmpeg close a file that looks whole.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, pipeSignal;
  sigemptyset(&none);
  sigemptyset(&pipeSignal);
  sigaddset(&pipeSignal, SIGPIPE);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &pipeSignal);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  const int failure = posix_spawn(&child_, program.c_str(), &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[0]);
  if (failure == 0) return;
  child_ = -1;
  close(input_);
  if (errors_ >= 0) close(errors_);
  throw std::runtime_error(program + " cannot be started: " + std::strerror(failure));
}

EncoderProcess::~EncoderProcess() {
  if (child_ > 0) {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  if (input_ >= 0) close(input_);
  if (errors_ >= 0) close(errors_);
}

bool EncoderProcess::write(const std::vector<std::uint8_t>& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::write(input_, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

bool EncoderProcess::finish() {
  if (child_ <= 0) return false;
  close(input_);
  input_ = -1;
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::string EncoderProcess::complaint() const {
  std::string text(4096, '\0');
  const ssize_t n = errors_ < 0 ? 0 : pread(errors_, text.data(), text.size(), 0);
  text.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  const std::size_t line = text.rfind('\n');
  if (line != std::string::npos) text.erase(0, line + 1);
  return text.empty() ? "it gave no reason" : text;
}

}  // namespace medulla
