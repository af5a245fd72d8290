#include "render/video_writer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "render/partial_file.h"
#include "render/picture_queue.h"
#include "render/video_encoder.h"
#include "render/yuv.h"

namespace medulla {
namespace {

struct FormatName {
  const char* extension;
  VideoFormat format;
  double most;  // pictures per second that players show
};
constexpr FormatName kFormats[] = {{".mp4", VideoFormat::mp4, 1e9},
                                   {".webm", VideoFormat::webm, 1e9},
                                   {".gif", VideoFormat::gif, 50},
                                   {".webp", VideoFormat::webp, 90}};

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
  if (fps > format->most)
    throw std::runtime_error(path + ": expected at most " + std::to_string(std::lround(format->most)) +
                             " pictures per second in a " + format->extension + ", players slow down more");
  return format->format;
}

// What the encoder complains of is the file's.
template <class Work>
auto named(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": cannot be written: " + error.what());
  }
}

VideoEncoder openEncoder(const std::string& path, const PartialFile& partial, int width, int height, double fps) {
  const VideoFormat format = checkedFormat(path, width, height, fps);
  return named(path, [&] { return VideoEncoder(format, partial.path(), width, height, fps); });
}

}  // namespace

struct VideoWriter::Data {
  std::string path;
  PartialFile partial;
  int width, height;
  YuvMatrix matrix;
  VideoEncoder encoder;
  PictureQueue queue;  // of 4:2:0 planes; before what it encodes with goes

  Data(const std::string& p, int w, int h, double fps)
      : path(p),
        partial(p),
        width(w),
        height(h),
        matrix(matrixOf(findFormat(p)->format)),
        encoder(openEncoder(p, partial, w, h, fps)),
        queue([this](PictureQueue::Entry& entry) { encoder.write(entry.bytes); }) {}
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
  named(data_->path,
        [&] { data_->queue.push([&](PictureQueue::Entry& entry) { rgbaToI420(image, data_->matrix, entry.bytes); }); });
}

const StageTimes::Stage& VideoWriter::encoding() const {
  return data_->queue.encoding();
}

void VideoWriter::finish(const std::function<void()>& goOn) {
  named(data_->path, [&] {
    data_->queue.finish();
    data_->encoder.finish(goOn);
  });
}

void VideoWriter::commit() {
  data_->partial.commit();
}

}  // namespace medulla
