#include "render/video_writer.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "physics/model/surface_samples.h"
#include "render/yuv.h"
#include "tests/complaint.h"
#include "tests/file_size_limit.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

namespace fs = std::filesystem;

class VideoWriterTest : public FolderTest {
 protected:
  static std::string outputOf(const std::string& command) {
    std::string text;
    FILE* pipe = popen(command.c_str(), "r");
    char buffer[4096];
    std::size_t n = 0;
    while ((n = fread(buffer, 1, sizeof buffer, pipe)) > 0) text.append(buffer, n);
    pclose(pipe);
    return text;
  }
};

Image flat(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
  Image image{width, height, std::vector<std::uint8_t>(4ul * width * height, 255)};
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    image.pixels[i] = r;
    image.pixels[i + 1] = g;
    image.pixels[i + 2] = b;
  }
  return image;
}

// ITU-R BT.709, table 4, and BT.601: the corners of the RGB cube in limited range.
TEST_F(VideoWriterTest, I420FollowsBt709AndBt601) {
  const struct {
    YuvMatrix matrix;
    std::uint8_t r, g, b;
    int y, u, v;
  } cases[] = {{YuvMatrix::bt709, 255, 255, 255, 235, 128, 128}, {YuvMatrix::bt709, 0, 0, 0, 16, 128, 128},
               {YuvMatrix::bt709, 255, 0, 0, 63, 102, 240},      {YuvMatrix::bt709, 0, 255, 0, 173, 42, 26},
               {YuvMatrix::bt709, 0, 0, 255, 32, 240, 118},      {YuvMatrix::bt709, 255, 255, 0, 219, 16, 138},
               {YuvMatrix::bt601, 255, 255, 255, 235, 128, 128}, {YuvMatrix::bt601, 255, 0, 0, 81, 90, 240},
               {YuvMatrix::bt601, 0, 255, 0, 145, 54, 34},       {YuvMatrix::bt601, 0, 0, 255, 41, 240, 110}};
  for (const auto& c : cases) {
    std::vector<std::uint8_t> planes;
    rgbaToI420(flat(4, 2, c.r, c.g, c.b), c.matrix, planes);
    ASSERT_EQ(planes.size(), 12u);
    EXPECT_NEAR(planes[0], c.y, 1);
    EXPECT_NEAR(planes[7], c.y, 1);
    EXPECT_NEAR(planes[8], c.u, 1);
    EXPECT_NEAR(planes[10], c.v, 1);
  }
}

TEST_F(VideoWriterTest, FilmHasEveryPictureRightColoursAndTags) {
  {
    VideoWriter writer(path("a.mp4"), 64, 32, 30);
    for (int k = 0; k < 20; ++k) writer.write(flat(64, 32, 200, 60, 40));
    EXPECT_FALSE(fs::exists(path("a.mp4")));
    writer.finish();
    writer.commit();
  }
  ASSERT_TRUE(fs::exists(path("a.mp4")));
  EXPECT_EQ(filesInFolder(), 1u);
  const std::string raw = outputOf("ffmpeg -v error -i " + path("a.mp4") + " -f rawvideo -pix_fmt rgb24 -");
  ASSERT_EQ(raw.size(), 20u * 64 * 32 * 3);
  const std::size_t middle = (16 * 64 + 32) * 3;
  EXPECT_NEAR(std::uint8_t(raw[middle]), 200, 4);
  EXPECT_NEAR(std::uint8_t(raw[middle + 1]), 60, 4);
  EXPECT_NEAR(std::uint8_t(raw[middle + 2]), 40, 4);
  const std::string tags =
      outputOf("ffprobe -v error -show_entries stream=pix_fmt,color_space,color_range,r_frame_rate -of csv=p=0 " +
               path("a.mp4"));
  EXPECT_EQ(tags, "yuv420p,tv,bt709,30/1\n");
}

TEST_F(VideoWriterTest, EveryKindOfVideoHasEveryPicture) {
  for (const char* name : {"a.webm", "a.gif", "a.webp"}) {
    VideoWriter writer(path(name), 64, 32, 25);
    for (int k = 0; k < 10; ++k) writer.write(flat(64, 32, std::uint8_t(200 - 8 * k), 60, 40));
    writer.finish();
    writer.commit();
    EXPECT_GT(fs::file_size(path(name)), 100u) << name;
  }
  EXPECT_EQ(filesInFolder(), 3u);
  for (const char* name : {"a.webm", "a.gif"}) {
    const std::string raw = outputOf("ffmpeg -v error -i " + path(name) + " -f rawvideo -pix_fmt rgb24 -");
    ASSERT_EQ(raw.size(), 10u * 64 * 32 * 3) << name;
    for (int k = 0; k < 10; ++k) {
      const std::size_t middle = (std::size_t(k) * 64 * 32 + 16 * 64 + 32) * 3;
      EXPECT_NEAR(std::uint8_t(raw[middle]), 200 - 8 * k, 8) << name << " picture " << k;
      EXPECT_NEAR(std::uint8_t(raw[middle + 1]), 60, 8) << name << " picture " << k;
    }
  }
  for (const char* name : {"a.webm", "a.gif"})
    EXPECT_EQ(outputOf("ffprobe -v error -show_entries stream=r_frame_rate -of csv=p=0 " + path(name)), "25/1\n");
  // ffmpeg reads no animated WebP: its chunks are counted (RIFF container of Google's WebP specification).
  const std::string webp = readFile(path("a.webp"));
  EXPECT_EQ(webp.substr(0, 4) + webp.substr(8, 4), "RIFFWEBP");
  int pictures = 0;
  for (std::size_t at = webp.find("ANMF"); at != std::string::npos; at = webp.find("ANMF", at + 1)) {
    EXPECT_EQ(std::uint8_t(webp.at(at + 20)), 40) << "ms, behind the size of the chunk, its place and its own size";
    ++pictures;
  }
  EXPECT_EQ(pictures, 10);
}

TEST_F(VideoWriterTest, TheSamePicturesMakeTheSameBytes) {
  for (const std::string kind : {".mp4", ".webm", ".gif", ".webp"}) {
    const auto bytes = [&](const std::string& name) {
      RandomSequence random{1};
      VideoWriter writer(path(name + kind), 64, 32, 25);
      Image noise = flat(64, 32, 0, 0, 0);
      for (int k = 0; k < 10; ++k) {
        for (std::uint8_t& byte : noise.pixels) byte = static_cast<std::uint8_t>(256 * random.uniform());
        writer.write(noise);
      }
      writer.finish();
      writer.commit();
      return readFile(path(name + kind));
    };
    const std::string first = bytes("first");
    EXPECT_GT(first.size(), 100u) << kind;
    EXPECT_TRUE(first == bytes("second")) << kind;
  }
}

TEST_F(VideoWriterTest, WhatAKindCannotHoldIsRefused) {
  EXPECT_EQ(complaintOf([&] { VideoWriter(path("a.mp4"), 65, 32, 30); }),
            path("a.mp4") + ": a video of 65x32 pixels, expected even numbers");
  EXPECT_EQ(complaintOf([&] { VideoWriter(path("a.gif"), 64, 32, 60); }),
            path("a.gif") + ": expected at most 50 pictures per second in a .gif, players slow down more");
  EXPECT_NE(complaintOf([&] { VideoWriter(path("a.webp"), 64, 32, 91); }).find("at most 90"), std::string::npos);
  EXPECT_TRUE(isVideoName("a.webm"));
  EXPECT_FALSE(isVideoName("a.png"));
  EXPECT_EQ(filesInFolder(), 0u);
}

TEST_F(VideoWriterTest, UnfinishedFilmLeavesNothingAndKeepsTheEarlierOne) {
  for (const char* name : {"a.mp4", "a.webm", "a.gif", "a.webp"}) {
    folder_.write(name, "earlier");
    {
      VideoWriter writer(path(name), 64, 32, 30);
      writer.write(flat(64, 32, 1, 2, 3));
    }
    EXPECT_EQ(filesInFolder(), 1u);
    EXPECT_EQ(readFile(path(name)), "earlier");
    fs::remove(path(name));
  }
}

TEST_F(VideoWriterTest, FinishingCanBeBrokenOff) {
  struct Stop {};
  for (const char* name : {"a.mp4", "a.webm", "a.gif", "a.webp"}) {
    int asked = 0;
    {
      VideoWriter writer(path(name), 64, 32, 30);
      for (int k = 0; k < 5; ++k) writer.write(flat(64, 32, std::uint8_t(20 * k), 2, 3));
      EXPECT_THROW(writer.finish([&] {
        if (++asked == 2) throw Stop();
      }),
                   Stop)
          << name;
    }
    EXPECT_EQ(asked, 2) << name;
    EXPECT_EQ(filesInFolder(), 0u) << name;
  }
}

TEST_F(VideoWriterTest, AFullDiskIsToldAndLeavesNothing) {
  RandomSequence random{1};
  Image noise = flat(320, 160, 0, 0, 0);
  for (const char* name : {"a.mp4", "a.webm", "a.gif", "a.webp"}) {
    const FileSizeLimit limit(30000);
    const std::string message = complaintOf([&] {
      VideoWriter writer(path(name), 320, 160, 30);
      for (int k = 0; k < 40; ++k) {
        for (std::uint8_t& byte : noise.pixels) byte = static_cast<std::uint8_t>(256 * random.uniform());
        writer.write(noise);
      }
      writer.finish();
      writer.commit();
    });
    EXPECT_EQ(message, path(name) + ": cannot be written: File too large");
    EXPECT_EQ(filesInFolder(), 0u) << name;
  }
}

// At its very end, where the muxer moves its tables to the front.
TEST_F(VideoWriterTest, ADiskThatIsFullAtTheEndIsTold) {
  const auto write = [&](const std::string& name) {
    VideoWriter writer(path(name), 64, 32, 30);
    for (int k = 0; k < 10; ++k) writer.write(flat(64, 32, std::uint8_t(20 * k), 2, 3));
    writer.finish();
    writer.commit();
  };
  for (const char* name : {"a.mp4", "a.webm", "a.gif", "a.webp"}) {
    write(name);
    const auto size = fs::file_size(path(name));
    fs::remove(path(name));
    const FileSizeLimit limit(std::string(name) == "a.gif" ? 64 * 32 * 15 - 1 : size - 1);  // of a GIF: what waits
    EXPECT_EQ(complaintOf([&] { write(name); }), path(name) + ": cannot be written: File too large");
    EXPECT_EQ(filesInFolder(), 0u) << name;
  }
}

TEST_F(VideoWriterTest, ANameMayLookLikeAnAddress) {
  {
    VideoWriter writer(path("http:a%03d.mp4"), 64, 32, 30);
    writer.write(flat(64, 32, 1, 2, 3));
    writer.finish();
    writer.commit();
  }
  EXPECT_TRUE(fs::exists(path("http:a%03d.mp4")));
  EXPECT_EQ(filesInFolder(), 1u);
}

TEST_F(VideoWriterTest, WhatEncodingTookIsKnown) {
  VideoWriter writer(path("a.mp4"), 640, 320, 30);
  for (int k = 0; k < 20; ++k) writer.write(flat(640, 320, std::uint8_t(10 * k), 2, 3));
  writer.finish();
  EXPECT_GT(writer.encoding().cpu, 0);
}

TEST_F(VideoWriterTest, UnwritableTargetIsRefusedAtOnce) {
  folder_.write("file", "");
  EXPECT_NE(complaintOf([&] { VideoWriter(path("file/a.mp4"), 64, 32, 30); }).find("cannot be made: Not a directory"),
            std::string::npos);
  fs::create_directories(path("b.mp4"));
  EXPECT_NE(complaintOf([&] { VideoWriter(path("b.mp4"), 64, 32, 30); }).find("folder"), std::string::npos);
}

}  // namespace
}  // namespace medulla
