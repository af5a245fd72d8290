#include "render/film_palette.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "render/ffmpeg.h"

namespace medulla {

namespace {

struct FreeFrame {
  void operator()(AVFrame* f) const { av_frame_free(&f); }
};
using FramePointer = std::unique_ptr<AVFrame, FreeFrame>;

FramePointer newFrame() {
  FramePointer frame(av_frame_alloc());
  if (!frame) throw std::runtime_error("no memory for a picture");
  return frame;
}

struct FreeGraph {
  void operator()(AVFilterGraph* g) const { avfilter_graph_free(&g); }
};
struct FreeMemory {
  void operator()(void* p) const { av_free(p); }
};
struct CloseFile {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using FilePointer = std::unique_ptr<std::FILE, CloseFile>;

// Without a name from here on: it goes with its last handle, whatever fails.
FilePointer openScratch(const std::filesystem::path& folder) {
  std::string path = folder / ".pictures-XXXXXX";
  const int descriptor = ::mkstemp(path.data());
  if (descriptor < 0) throw std::runtime_error(std::strerror(errno));
  ::unlink(path.c_str());
  FilePointer file(::fdopen(descriptor, "w+b"));
  if (!file) {
    const int error = errno;
    ::close(descriptor);
    throw std::runtime_error(std::strerror(error));
  }
  return file;
}

// One filter between as many sources as it has inputs, and a sink. Time is counted in pictures.
class OneFilter {
 public:
  OneFilter(const char* name, const char* options, const std::vector<const AVFrame*>& inputs) {
    if (!graph_) throw std::runtime_error("no memory for a filter");
    graph_->nb_threads = 1;
    AVFilterContext* filter = nullptr;
    checkedAv(avfilter_graph_create_filter(&filter, known(name), name, options, nullptr, graph_.get()));
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      AVFilterContext*& source = sources_.at(k);
      source = avfilter_graph_alloc_filter(graph_.get(), known("buffer"), nullptr);
      const std::unique_ptr<AVBufferSrcParameters, FreeMemory> p(av_buffersrc_parameters_alloc());
      if (source == nullptr || !p) throw std::runtime_error("no memory for a filter");
      p->format = inputs[k]->format;
      p->width = inputs[k]->width;
      p->height = inputs[k]->height;
      p->time_base = {1, 1};
      checkedAv(av_buffersrc_parameters_set(source, p.get()));
      checkedAv(avfilter_init_str(source, nullptr));
      checkedAv(avfilter_link(source, 0, filter, static_cast<unsigned>(k)));
    }
    checkedAv(avfilter_graph_create_filter(&sink_, known("buffersink"), nullptr, nullptr, nullptr, graph_.get()));
    checkedAv(avfilter_link(filter, 0, sink_, 0));
    checkedAv(avfilter_graph_config(graph_.get(), nullptr));
  }

  void give(std::size_t source, AVFrame* frame) {  // nullptr: no more
    checkedAv(av_buffersrc_add_frame_flags(sources_.at(source), frame, AV_BUFFERSRC_FLAG_KEEP_REF));
  }
  bool take(AVFrame& out) {
    const int code = av_buffersink_get_frame(sink_, &out);
    if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return false;
    checkedAv(code);
    return true;
  }

 private:
  static const AVFilter* known(const char* name) {
    const AVFilter* filter = avfilter_get_by_name(name);
    if (filter == nullptr) throw std::runtime_error(std::string("libavfilter has no ") + name);
    return filter;
  }

  std::unique_ptr<AVFilterGraph, FreeGraph> graph_{avfilter_graph_alloc()};
  std::array<AVFilterContext*, 2> sources_{};
  AVFilterContext* sink_ = nullptr;
};

}  // namespace

struct FilmPalette::Data {
  FilePointer waiting;  // the pictures; before what may fail, so that its name is gone by then
  FramePointer like = newFrame();
  OneFilter generator;
  std::size_t bytes;  // of a picture
  int pictures = 0;

  Data(const AVFrame& frame, const std::string& folder)
      : waiting(openScratch(folder)),
        generator("palettegen", "stats_mode=diff", {&frame}),
        bytes(std::size_t(frame.width) * frame.height * 3 / 2) {
    checkedAv(av_frame_copy_props(like.get(), &frame));
    like->format = frame.format;
    like->width = frame.width;
    like->height = frame.height;
  }
  // A buffer of a picture as those that were added.
  FramePointer pictureBuffer() const {
    FramePointer frame = newFrame();
    checkedAv(av_frame_copy_props(frame.get(), like.get()));
    frame->format = like->format;
    frame->width = like->width;
    frame->height = like->height;
    checkedAv(av_frame_get_buffer(frame.get(), 1));
    return frame;
  }
  void readInto(AVFrame& frame) const {
    for (int plane = 0; plane < 3; ++plane) {
      const int columns = plane == 0 ? frame.width : frame.width / 2,
                rows = plane == 0 ? frame.height : frame.height / 2;
      for (int y = 0; y < rows; ++y)
        requireFile(std::fread(frame.data[plane] + std::ptrdiff_t(y) * frame.linesize[plane], 1, columns,
                               waiting.get()) == std::size_t(columns));
    }
  }
  void requireFile(bool done) const {
    if (!done) throw std::runtime_error(errno != 0 ? std::strerror(errno) : "its pictures have gone");
  }
};

FilmPalette::FilmPalette(const AVFrame& frame, const std::string& folder)
    : data_(std::make_unique<Data>(frame, folder)) {}
FilmPalette::~FilmPalette() = default;

void FilmPalette::add(AVFrame& frame) {
  errno = 0;
  data_->requireFile(std::fwrite(frame.data[0], 1, data_->bytes, data_->waiting.get()) == data_->bytes);
  data_->generator.give(0, &frame);
  const FramePointer none = newFrame();
  data_->generator.take(*none);  // lets it look at the picture; its palette comes at the end
  ++data_->pictures;
}

void FilmPalette::finish(const std::function<void(AVFrame&)>& take, const std::function<void()>& goOn) {
  Data& d = *data_;
  const FramePointer palette = newFrame(), shown = newFrame();
  d.generator.give(0, nullptr);
  if (!d.generator.take(*palette)) throw std::runtime_error("a film without pictures");
  palette->pts = 0;
  errno = 0;
  d.requireFile(std::fflush(d.waiting.get()) == 0);
  std::rewind(d.waiting.get());
  std::unique_ptr<OneFilter> mapper;
  for (int k = 0; k < d.pictures; ++k) {
    goOn();
    const FramePointer frame = d.pictureBuffer();
    d.readInto(*frame);
    frame->pts = k;
    if (!mapper) {
      mapper = std::make_unique<OneFilter>("paletteuse", "dither=bayer:bayer_scale=4:diff_mode=rectangle",
                                           std::vector<const AVFrame*>{frame.get(), palette.get()});
      mapper->give(1, palette.get());
      mapper->give(1, nullptr);
    }
    mapper->give(0, frame.get());
    for (; mapper->take(*shown); av_frame_unref(shown.get())) take(*shown);
  }
  mapper->give(0, nullptr);
  for (; mapper->take(*shown); av_frame_unref(shown.get())) take(*shown);
}

}  // namespace medulla
