#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavfilter/avfilter.h>
#include <libavfilter/buffersink.h>
#include <libavfilter/buffersrc.h>
#include <libavformat/avformat.h>
#include <libavutil/avutil.h>
}

// What is called of FFmpeg's libraries.
#define MEDULLA_AVUTIL_FUNCTIONS(X) \
  X(av_buffer_create)               \
  X(av_buffer_unref)                \
  X(av_d2q)                         \
  X(av_dict_count)                  \
  X(av_dict_free)                   \
  X(av_dict_set)                    \
  X(av_frame_alloc)                 \
  X(av_frame_copy_props)            \
  X(av_frame_free)                  \
  X(av_frame_get_buffer)            \
  X(av_frame_unref)                 \
  X(av_free)                        \
  X(av_log_set_level)               \
  X(av_strerror)
#define MEDULLA_AVCODEC_FUNCTIONS(X) \
  X(av_packet_alloc)                 \
  X(av_packet_free)                  \
  X(av_packet_rescale_ts)            \
  X(avcodec_alloc_context3)          \
  X(avcodec_find_encoder_by_name)    \
  X(avcodec_free_context)            \
  X(avcodec_open2)                   \
  X(avcodec_parameters_from_context) \
  X(avcodec_receive_packet)          \
  X(avcodec_send_frame)
#define MEDULLA_AVFORMAT_FUNCTIONS(X) \
  X(av_interleaved_write_frame)       \
  X(av_write_trailer)                 \
  X(avformat_alloc_output_context2)   \
  X(avformat_free_context)            \
  X(avformat_new_stream)              \
  X(avformat_write_header)            \
  X(avio_closep)                      \
  X(avio_open)
#define MEDULLA_AVFILTER_FUNCTIONS(X) \
  X(av_buffersink_get_frame)          \
  X(av_buffersrc_add_frame_flags)     \
  X(av_buffersrc_parameters_alloc)    \
  X(av_buffersrc_parameters_set)      \
  X(avfilter_get_by_name)             \
  X(avfilter_graph_alloc)             \
  X(avfilter_graph_alloc_filter)      \
  X(avfilter_graph_config)            \
  X(avfilter_graph_create_filter)     \
  X(avfilter_graph_free)              \
  X(avfilter_init_str)                \
  X(avfilter_link)

namespace medulla {

// Within medulla these pointers are found before the functions that the headers declare, which nothing links.
#define MEDULLA_DECLARE(name) extern decltype(&::name) name;  // NOLINT(bugprone-macro-parentheses)
MEDULLA_AVUTIL_FUNCTIONS(MEDULLA_DECLARE)
MEDULLA_AVCODEC_FUNCTIONS(MEDULLA_DECLARE)
MEDULLA_AVFORMAT_FUNCTIONS(MEDULLA_DECLARE)
MEDULLA_AVFILTER_FUNCTIONS(MEDULLA_DECLARE)
#undef MEDULLA_DECLARE

// Before any of them is called; the first time loads libavutil, libavcodec and libavformat of the versions compiled
// for, or libavfilter, which only GIFs need and half of the time goes into. Throw std::runtime_error.
void loadEncoders();
void loadFilters();

// The code, or throws std::runtime_error with FFmpeg's words for it where it is an error.
int checkedAv(int code);

}  // namespace medulla
