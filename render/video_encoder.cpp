#include "render/video_encoder.h"

#include <cassert>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>

#include "render/ffmpeg.h"
#include "render/film_palette.h"

namespace medulla {
namespace {

using Options = std::vector<std::pair<const char*, const char*>>;

struct Encoding {
  const char *muxer, *codec;
  Options codecOptions, muxerOptions;
};

// Encoders of one thread: drawing has every core at work, so that more cost a fifth more time in all, and the file
// would depend on their number.
const Encoding& encodingOf(VideoFormat format) {
  static const Encoding encodings[] = {
      // The preset's finer search of motion saves 5 % of the file for a quarter of the time.
      {"mp4",
       "libx264",
       {{"preset", "veryfast"}, {"crf", "18"}, {"x264-params", "subme=1"}, {"threads", "1"}},
       {{"movflags", "+faststart"}}},
      {"webm",
       "libvpx-vp9",
       {{"deadline", "realtime"}, {"cpu-used", "6"}, {"crf", "24"}, {"b", "0"}, {"threads", "1"}},
       {}},
      {"gif", "gif", {}, {{"loop", "0"}}},
      {"webp", "libwebp_anim", {{"quality", "80"}, {"threads", "1"}}, {{"loop", "0"}}},
  };
  return encodings[static_cast<int>(format)];
}

class Dictionary {
 public:
  explicit Dictionary(const Options& options) {
    for (const auto& [key, value] : options) av_dict_set(&dictionary_, key, value, 0);
  }
  ~Dictionary() { av_dict_free(&dictionary_); }
  Dictionary(const Dictionary&) = delete;
  Dictionary& operator=(const Dictionary&) = delete;
  AVDictionary** get() { return &dictionary_; }
  void requireUsed() const { assert(av_dict_count(dictionary_) == 0); }  // what nobody knows stays in it

 private:
  AVDictionary* dictionary_ = nullptr;
};

template <class T>
T* existing(T* p, const std::string& what) {
  if (p == nullptr) throw std::runtime_error(what);
  return p;
}

}  // namespace

struct VideoEncoder::Data {
  const Encoding& encoding;
  VideoFormat format;
  int width, height;
  AVRational tick{};  // s, of one picture
  std::string partial;
  AVFormatContext* muxer = nullptr;
  AVCodecContext* codec = nullptr;
  AVStream* stream = nullptr;
  AVPacket* packet = nullptr;
  AVFrame* frame = nullptr;
  std::int64_t pictures = 0;
  bool begun = false;  // the header is written, the trailer not yet
  std::optional<FilmPalette> palette;

  Data(VideoFormat f, std::string path, int w, int h, double fps)
      : encoding(encodingOf(f)), format(f), width(w), height(h), partial(std::move(path)) {
    loadEncoders();
    if (format == VideoFormat::gif) loadFilters();
    tick = av_inv_q(av_d2q(fps, 100000));
  }
  ~Data() {
    // Abandoned, the muxer of GIF would keep its last packet for ever; others may take long over a trailer.
    if (begun && format == VideoFormat::gif) av_write_trailer(muxer);
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&codec);
    if (muxer != nullptr) avio_closep(&muxer->pb);
    avformat_free_context(muxer);
  }

  void open();
  void openCodec(int pixelFormat);
  void describeFrame(AVFrame& f) const;
  void encode(AVFrame* picture, const std::function<void()>& goOn);
};

// Opens the file too: one that cannot be written is told before anything is drawn.
void VideoEncoder::Data::open() {
  av_log_set_level(AV_LOG_QUIET);  // errors are told by those who throw them
  // A protocol of its own, or a colon in the name would be taken for one.
  const std::string url = "file:" + partial;
  checkedAv(avformat_alloc_output_context2(&muxer, nullptr, encoding.muxer, url.c_str()));
  muxer->flags |= AVFMT_FLAG_BITEXACT;  // WebM would draw identifiers at random
  checkedAv(avio_open(&muxer->pb, url.c_str(), AVIO_FLAG_WRITE));
  packet = existing(av_packet_alloc(), "no memory for a packet");
  frame = existing(av_frame_alloc(), "no memory for a picture");
  describeFrame(*frame);
  if (format == VideoFormat::gif)
    palette.emplace(*frame, std::filesystem::path(partial).parent_path());
  else
    openCodec(AV_PIX_FMT_YUV420P);
}

void VideoEncoder::Data::describeFrame(AVFrame& f) const {
  f.format = AV_PIX_FMT_YUV420P;
  f.width = width;
  f.height = height;
  f.colorspace = matrixOf(format) == YuvMatrix::bt709 ? AVCOL_SPC_BT709 : AVCOL_SPC_SMPTE170M;
  f.color_primaries = AVCOL_PRI_BT709;
  f.color_trc = AVCOL_TRC_BT709;
  f.color_range = AVCOL_RANGE_MPEG;
  f.chroma_location = AVCHROMA_LOC_CENTER;
}

void VideoEncoder::Data::openCodec(int pixelFormat) {
  const std::string name = encoding.codec;
  const AVCodec* known = existing(avcodec_find_encoder_by_name(name.c_str()), "libavcodec has no encoder " + name);
  codec = existing(avcodec_alloc_context3(known), "no memory for an encoder");
  codec->width = width;
  codec->height = height;
  codec->pix_fmt = static_cast<AVPixelFormat>(pixelFormat);
  codec->time_base = tick;
  codec->framerate = av_inv_q(tick);
  if (pixelFormat == AV_PIX_FMT_YUV420P) {  // else the pictures are RGB
    codec->colorspace = frame->colorspace;
    codec->color_primaries = frame->color_primaries;
    codec->color_trc = frame->color_trc;
    codec->color_range = frame->color_range;
    codec->chroma_sample_location = frame->chroma_location;
  }
  if ((muxer->oformat->flags & AVFMT_GLOBALHEADER) != 0) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  Dictionary codecOptions(encoding.codecOptions), muxerOptions(encoding.muxerOptions);
  checkedAv(avcodec_open2(codec, known, codecOptions.get()));
  codecOptions.requireUsed();
  stream = existing(avformat_new_stream(muxer, nullptr), "no memory for a stream");
  stream->time_base = tick;
  stream->avg_frame_rate = stream->r_frame_rate = codec->framerate;
  checkedAv(avcodec_parameters_from_context(stream->codecpar, codec));
  checkedAv(avformat_write_header(muxer, muxerOptions.get()));
  begun = true;
  muxerOptions.requireUsed();
}

// nullptr: no more pictures.
void VideoEncoder::Data::encode(AVFrame* picture, const std::function<void()>& goOn) {
  checkedAv(avcodec_send_frame(codec, picture));
  for (;;) {
    goOn();
    const int code = avcodec_receive_packet(codec, packet);
    if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return;
    checkedAv(code);
    if (packet->duration == 0) packet->duration = 1;
    av_packet_rescale_ts(packet, tick, stream->time_base);
    packet->stream_index = 0;
    checkedAv(av_interleaved_write_frame(muxer, packet));
  }
}

VideoEncoder::VideoEncoder(VideoFormat format, const std::string& path, int width, int height, double fps)
    : data_(std::make_unique<Data>(format, path, width, height, fps)) {
  data_->open();
}
VideoEncoder::VideoEncoder(VideoEncoder&&) noexcept = default;
VideoEncoder::~VideoEncoder() = default;

void VideoEncoder::write(std::vector<std::uint8_t>& planes) {
  Data& d = *data_;
  AVFrame& f = *d.frame;
  const std::size_t luma = std::size_t(d.width) * d.height;
  assert(planes.size() == luma * 3 / 2);
  // Lent, not copied: encoders and filters have done with a picture when they ask for the next.
  f.buf[0] = existing(av_buffer_create(
                          planes.data(), planes.size(), [](void*, std::uint8_t*) {}, nullptr, AV_BUFFER_FLAG_READONLY),
                      "no memory for a picture");
  f.data[0] = planes.data();
  f.data[1] = f.data[0] + luma;
  f.data[2] = f.data[1] + luma / 4;
  f.linesize[0] = d.width;
  f.linesize[1] = f.linesize[2] = d.width / 2;
  f.pts = d.pictures++;
  if (d.palette)
    d.palette->add(f);
  else
    d.encode(&f, [] {});
  av_buffer_unref(&f.buf[0]);
}

void VideoEncoder::finish(const std::function<void()>& goOn) {
  Data& d = *data_;
  if (d.palette) {
    const auto take = [&](AVFrame& picture) {
      if (d.codec == nullptr) d.openCodec(picture.format);
      d.encode(&picture, goOn);
    };
    d.palette->finish(take, goOn);
  }
  d.encode(nullptr, goOn);
  d.begun = false;
  checkedAv(av_write_trailer(d.muxer));
  checkedAv(avio_closep(&d.muxer->pb));
}

}  // namespace medulla
