#include <libdeflate.h>

#include <cassert>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <stdexcept>

#include "render/image.h"
#include "render/partial_file.h"

#ifndef __clang_analyzer__  // it would report what it finds in stb
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#endif
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#ifdef __GNUC__
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include <stb/stb_image.h>
#ifdef __GNUC__
#pragma GCC diagnostic pop
#endif

// Chunks are written here around libdeflate at its first level with the "up" filter, which is 8 times as fast as
// stb_image_write and no larger; stb_image reads.
namespace medulla {
namespace {

constexpr std::uint8_t kSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr int kMaxSide = 1 << 15;  // a header that claims more is broken, not a picture

void appendBigEndian(std::string& out, std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(v >> shift & 0xff));
}

std::uint32_t bigEndian(const std::uint8_t* p) {
  return std::uint32_t(p[0]) << 24 | std::uint32_t(p[1]) << 16 | std::uint32_t(p[2]) << 8 | p[3];
}

// Length, type, data, CRC over type and data (PNG specification, 5.3).
void appendChunk(std::string& out, const char* type, const void* data, std::size_t size) {
  appendBigEndian(out, static_cast<std::uint32_t>(size));
  const std::size_t start = out.size();
  out.append(type, 4);
  out.append(static_cast<const char*>(data), size);
  appendBigEndian(out, libdeflate_crc32(0, out.data() + start, out.size() - start));
}

std::vector<std::uint8_t> compressedRows(const Image& image) {
  const std::size_t stride = 4ul * image.width;
  std::vector<std::uint8_t> rows((stride + 1) * image.height);
  for (int y = 0; y < image.height; ++y) {
    std::uint8_t* row = rows.data() + y * (stride + 1);
    const std::uint8_t* now = image.pixels.data() + y * stride;
    *row++ = y == 0 ? 0 : 2;  // filter: none, up
    if (y == 0)
      std::memcpy(row, now, stride);
    else
      for (std::size_t x = 0; x < stride; ++x) row[x] = static_cast<std::uint8_t>(now[x] - (now - stride)[x]);
  }
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(1), &libdeflate_free_compressor);
  if (compressor == nullptr) throw std::bad_alloc();
  std::vector<std::uint8_t> out(libdeflate_zlib_compress_bound(compressor.get(), rows.size()));
  out.resize(libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), out.data(), out.size()));
  return out;
}

std::vector<PngText> readTexts(const std::vector<std::uint8_t>& file) {
  std::vector<PngText> texts;
  for (std::size_t at = sizeof kSignature; at + 12 <= file.size();) {
    const std::size_t size = bigEndian(&file[at]);
    if (size > file.size() - at - 12) break;
    if (std::memcmp(&file[at + 4], "tEXt", 4) == 0) {
      const std::string data(file.begin() + at + 8, file.begin() + at + 8 + size);
      const std::size_t split = data.find('\0');
      if (split != std::string::npos) texts.push_back({data.substr(0, split), data.substr(split + 1)});
    }
    at += size + 12;
  }
  return texts;
}

}  // namespace

std::string encodePng(const Image& image, const std::vector<PngText>& texts) {
  assert(image.width > 0 && image.height > 0 && image.pixels.size() == 4ul * image.width * image.height);
  std::string out(reinterpret_cast<const char*>(kSignature), sizeof kSignature), header;
  appendBigEndian(header, image.width);
  appendBigEndian(header, image.height);
  for (const int v : {8, 6, 0, 0, 0}) header.push_back(static_cast<char>(v));  // 8 bits, RGBA, not interlaced
  appendChunk(out, "IHDR", header.data(), header.size());
  const std::uint8_t perceptual = 0;
  appendChunk(out, "sRGB", &perceptual, 1);
  for (const PngText& t : texts) {
    assert(!t.keyword.empty() && t.keyword.size() < 80);
    const std::string data = t.keyword + '\0' + t.text;
    appendChunk(out, "tEXt", data.data(), data.size());
  }
  const std::vector<std::uint8_t> rows = compressedRows(image);
  appendChunk(out, "IDAT", rows.data(), rows.size());
  appendChunk(out, "IEND", nullptr, 0);
  return out;
}

void writePng(const std::string& path, const Image& image, const std::vector<PngText>& texts) {
  writeFile(path, encodePng(image, texts));
}

bool isPng(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return false;  // a pipe would be waited for
  std::ifstream file(path, std::ios::binary);
  char first[sizeof kSignature] = {};
  return file.read(first, sizeof first) && std::memcmp(first, kSignature, sizeof first) == 0;
}

Image readPng(const std::string& path, std::vector<PngText>* texts) {
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown))
    throw std::runtime_error(path + ": is a folder, expected a PNG file");
  if (std::filesystem::exists(path, unknown) && !std::filesystem::is_regular_file(path, unknown))
    throw std::runtime_error(path + ": is not a regular file, expected a PNG file");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
  const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (bytes.size() < 33 || std::memcmp(bytes.data(), kSignature, sizeof kSignature) != 0)
    throw std::runtime_error(path + ": is no PNG file");
  int width = 0, height = 0, channels = 0;
  const bool known = stbi_info_from_memory(bytes.data(), static_cast<int>(bytes.size()), &width, &height, &channels);
  if (!known || width > kMaxSide || height > kMaxSide) throw std::runtime_error(path + ": broken PNG header");
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(bytes.data(), static_cast<int>(bytes.size()), &width, &height, &channels, 4),
      &stbi_image_free);
  if (!pixels) throw std::runtime_error(path + ": broken PNG: " + stbi_failure_reason());
  if (texts) *texts = readTexts(bytes);
  return {width, height, std::vector<std::uint8_t>(pixels.get(), pixels.get() + 4ul * width * height)};
}

}  // namespace medulla
