#include "render/video_writer.h"

#include <algorithm>
#include <cassert>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "render/partial_file.h"
#include "render/video_encoder.h"
#include "render/yuv.h"

namespace medulla {
namespace {

// Enough that neither side waits for the other's jitter; more only costs memory (1.4 MB each at 720p).
constexpr std::size_t kQueuedPictures = 3;

struct FormatName {
  const char* extension;
  VideoFormat format;
};
constexpr FormatName kFormats[] = {
    {".mp4", VideoFormat::mp4}, {".webm", VideoFormat::webm}, {".gif", VideoFormat::gif}, {".webp", VideoFormat::webp}};

const FormatName* findFormat(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  const auto* found = std::find_if(std::begin(kFormats), std::end(kFormats),
                                   [&](const FormatName& f) { return extension == f.extension; });
  return found == std::end(kFormats) ? nullptr : found;
}

VideoFormat checkedFormat(const std::string& path, int width, int height, double fps) {
  const FormatName* format = findFormat(path);
  assert(format && width > 0 && height > 0 && fps > 0);
  if (width % 2 != 0 || height % 2 != 0)
    throw std::runtime_error(path + ": a video of " + std::to_string(width) + "x" + std::to_string(height) +
                             " pixels, expected even numbers");
  constexpr double gifMost = 50;
  if (format->format == VideoFormat::gif && fps > gifMost)
    throw std::runtime_error(path + ": more than 50 pictures per second, which no GIF can show");
  return format->format;
}

// What the encoder complains of, if it does.
template <class F>
std::string reasonOf(const F& encode) {
  try {
    encode();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

VideoEncoder openEncoder(const std::string& path, const PartialFile& partial, int width, int height, double fps) {
  const VideoFormat format = checkedFormat(path, width, height, fps);
  try {
    return {format, partial.path(), width, height, fps};
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": cannot be written: " + error.what());
  }
}

}  // namespace

// The caller queues pictures; one thread encodes them, so that encoding overlaps drawing.
struct VideoWriter::Data {
  std::string path;
  PartialFile partial;
  int width, height;
  VideoEncoder encoder;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::vector<std::uint8_t>> waiting, spare;  // 4:2:0 planes
  bool ended = false, abandoned = false;
  std::string failure;                         // why it stopped; empty: it has not
  StageTimes::Stage encoding{"encode", 0, 0};  // up to the last picture
  std::thread feeder;

  Data(const std::string& p, int w, int h, double fps)
      : path(p), partial(p), width(w), height(h), encoder(openEncoder(p, partial, w, h, fps)), spare(kQueuedPictures) {
    feeder = std::thread([this] { feed(); });
  }

  ~Data() {
    {
      const std::lock_guard lock(mutex);
      abandoned = true;  // such a film is not encoded to its end
    }
    end();
  }

  void end() {
    {
      const std::lock_guard lock(mutex);
      ended = true;
    }
    changed.notify_all();
    if (feeder.joinable()) feeder.join();
  }

  void feed() {
    for (;;) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [this] { return ended || !waiting.empty(); });
      if (waiting.empty() || abandoned || !failure.empty()) return;
      std::vector<std::uint8_t> planes = std::move(waiting.front());
      waiting.pop_front();
      lock.unlock();
      const double start = wallSeconds();
      const std::string reason = reasonOf([&] { encoder.write(planes); });
      lock.lock();
      encoding.wall += wallSeconds() - start;
      encoding.cpu = threadCpuSeconds();
      spare.push_back(std::move(planes));
      failure = reason;
      lock.unlock();
      changed.notify_all();
    }
  }

  [[noreturn]] void fail(const std::string& reason) const {
    throw std::runtime_error(path + ": cannot be written: " + reason);
  }
};

bool isVideoName(const std::string& path) {
  return findFormat(path) != nullptr;
}

VideoWriter::VideoWriter(const std::string& path, int width, int height, double fps) {
  data_ = std::make_unique<Data>(path, width, height, fps);
}
VideoWriter::~VideoWriter() = default;
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;

void VideoWriter::write(const Image& image) {
  assert(image.width == data_->width && image.height == data_->height);
  std::unique_lock lock(data_->mutex);
  assert(!data_->ended);
  data_->changed.wait(lock, [this] { return !data_->failure.empty() || !data_->spare.empty(); });
  if (!data_->failure.empty()) data_->fail(data_->failure);
  std::vector<std::uint8_t> planes = std::move(data_->spare.front());
  data_->spare.pop_front();
  lock.unlock();
  rgbaToI420(image, planes);
  lock.lock();
  data_->waiting.push_back(std::move(planes));
  lock.unlock();
  data_->changed.notify_all();
}

StageTimes::Stage VideoWriter::encoding() const {
  const std::lock_guard lock(data_->mutex);
  return data_->encoding;
}

void VideoWriter::finish(const std::function<void()>& goOn) {
  data_->end();
  try {
    if (data_->failure.empty()) data_->encoder.finish(goOn);
  } catch (const std::runtime_error& error) {
    data_->failure = error.what();
  }
  if (!data_->failure.empty()) data_->fail(data_->failure);
  data_->partial.commit();
}

}  // namespace medulla
