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

using Words = std::vector<std::string>;

// Encoders of one thread: drawing has every core at work, so that more cost a fifth more time in all, and the file
// would depend on their number.
Words encodingOf(VideoFormat format) {
  switch (format) {
    case VideoFormat::mp4:
      // The preset's finer search of motion saves 5 % of the file for a quarter of the time.
      return {"-c:v",    "libx264",  "-preset", "veryfast",     "-crf",    "18",        "-pix_fmt",
              "yuv420p", "-threads", "1",       "-x264-params", "subme=1", "-movflags", "+faststart"};
    case VideoFormat::webm:
      return {"-c:v", "libvpx-vp9", "-deadline", "realtime", "-cpu-used", "6",        "-crf",
              "24",   "-b:v",       "0",         "-pix_fmt", "yuv420p",   "-threads", "1"};
    case VideoFormat::gif:
      return {"-filter_complex",
              "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode="
              "rectangle",
              "-loop", "0"};
    case VideoFormat::webp:
      return {"-c:v", "libwebp_anim", "-quality", "80", "-pix_fmt", "yuv420p", "-loop", "0"};
  }
  return {};
}

const char* muxerOf(VideoFormat format) {
  constexpr const char* names[] = {"mp4", "webm", "gif", "webp"};
  return names[static_cast<int>(format)];
}

Words arguments(const std::string& program, VideoFormat format, const std::string& path, int width, int height,
                double fps) {
  std::ostringstream rate;
  rate.precision(10);
  rate << fps;
  // Without -xerror a full disk at the end of the file is told, and yet success.
  Words a = {program, "-hide_banner", "-loglevel", "error", "-xerror", "-nostdin", "-y"};
  const Words tags = {"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"};
  const auto add = [&a](const Words& more) { a.insert(a.end(), more.begin(), more.end()); };
  add({"-f", "rawvideo", "-pix_fmt", "yuv420p"});
  add({"-s", std::to_string(width) + "x" + std::to_string(height), "-r", rate.str()});
  add(tags);
  add({"-i", "pipe:0", "-an"});
  add(encodingOf(format));
  if (format != VideoFormat::gif) add(tags);  // its pictures are RGB
  add({"-f", muxerOf(format), path});
  return a;
}

}  // namespace

EncoderProcess::EncoderProcess(VideoFormat format, const std::string& path, int width, int height, double fps) {
  const std::string program = findFfmpeg();
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("no pipe to ffmpeg: ") + std::strerror(errno));
  input_ = ends[1];
  fcntl(input_, F_SETPIPE_SZ, 1 << 20);  // fewer switches between the two programs; a refusal costs only speed
  // A memory file takes what ffmpeg says: a pipe nobody reads could fill and stop it.
  errors_ = memfd_create("ffmpeg-errors", MFD_CLOEXEC);

  std::vector<std::string> words = arguments(program, format, path, width, height, fps);
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
  return WIFEXITED(status) && WEXITSTATUS(status) == 0 && complaint().empty();
}

std::string EncoderProcess::complaint() const {
  std::string text(4096, '\0');
  const ssize_t n = errors_ < 0 ? 0 : pread(errors_, text.data(), text.size(), 0);
  text.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  const std::size_t line = text.rfind('\n');
  if (line != std::string::npos) text.erase(0, line + 1);
  return text;
}

}  // namespace medulla
