#include "app/picture_outputs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "app/files/number_text.h"
#include "app/files/text_file.h"
#include "app/interrupt.h"

namespace medulla {

namespace {

namespace fs = std::filesystem;

constexpr const char* kRunFile = "run";  // in the folder where pictures collect: which run's they are

std::string pngName(int number) {
  return fmt::format("{:05d}.png", number);
}

// -1: the file is no picture of ours.
int numberOf(const fs::path& path) {
  const int number = parseNumber<int>(path.stem().string()).value_or(-1);
  return number >= 0 && path.filename() == pngName(number) ? number : -1;
}

// A file that a power cut left short has its name already; its last chunk is missing then.
bool isWholePng(const fs::path& path) {
  constexpr char end[] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', '\xae', '\x42', '\x60', '\x82'};
  std::ifstream file(path, std::ios::binary);
  char last[sizeof end] = {};
  return file.seekg(-std::streamoff(sizeof end), std::ios::end) && file.read(last, sizeof last) &&
         std::memcmp(last, end, sizeof end) == 0;
}

}  // namespace

PngFolder::PngFolder(const std::string& path, const Slice& slice)
    : slice_(slice),
      made_(path),
      folder_(path),
      collecting_(folder_ / fmt::format("{}-{}.part", slice.first, slice.last)),
      keep_(slice.resume),
      queue_([this](PictureQueue::Entry& entry) { encode(entry); }) {
  requireReplaceable();
  std::error_code error;
  fs::create_directory(collecting_, error);
  if (error) throw std::runtime_error(fmt::format("{}: cannot be made: {}", collecting_.string(), error.message()));
  lock_.emplace(collecting_.string(), collecting_.string(), "another run is drawing these pictures");
  try {
    takeOver();
  } catch (...) {
    fs::remove(collecting_, error);  // if it is empty
    throw;
  }
}

bool PngFolder::isPicture(const fs::path& path) const {
  const int number = numberOf(path);
  return slice_.first <= number && number < slice_.last;
}

// Noticed before the first picture is drawn, and not when half of them have moved in.
void PngFolder::requireReplaceable() const {
  if (access(folder_.c_str(), W_OK | X_OK) != 0) throw unwritable(folder_.string());
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (isPicture(entry.path()) && fs::is_directory(entry.symlink_status()))
      throw std::runtime_error(
          fmt::format("{}: is a folder, expected the name of a file to write", entry.path().string()));
  }
}

// Of those that collect; also what a writer that was killed has left. Whatever else somebody put there stays.
bool PngFolder::isOurs(const fs::path& path) const {
  return isPicture(path) || path.filename() == kRunFile || path.extension() == ".part";
}

void PngFolder::takeOver() const {
  const std::string run = fmt::format("{:016x}\n", slice_.run);
  const fs::path name = collecting_ / kRunFile;
  const bool same = fs::exists(name) && readTextFile(name.string()) == run;
  if (slice_.resume && fs::exists(name) && !same)
    throw std::runtime_error(fmt::format(
        "{}: holds pictures of another run, by its scene, options or OpenGL: remove it, or render without --resume",
        collecting_.string()));
  for (const auto& entry : fs::directory_iterator(collecting_)) {
    const bool kept = slice_.resume && same && isPicture(entry.path()) && isWholePng(entry.path());
    if (isOurs(entry.path()) && !kept) fs::remove_all(entry.path());
  }
  writeFile(name.string(), run);
}

PngFolder::~PngFolder() {
  queue_.stop();
  if (keep_) return;
  std::error_code ignored;
  for (fs::directory_iterator entry(collecting_, ignored), end; entry != end; entry.increment(ignored))
    if (isOurs(entry->path())) fs::remove_all(entry->path(), ignored);
  fs::remove(collecting_, ignored);  // if it is empty
}

bool PngFolder::has(int number) const {
  return fs::exists(collecting_ / pngName(number));
}

void PngFolder::encode(PictureQueue::Entry& entry) const {
  Image image{entry.width, entry.height, std::move(entry.bytes)};
  writePng((collecting_ / pngName(entry.number)).string(), image);
  entry.bytes = std::move(image.pixels);
}

void PngFolder::write(int number, const Image& image) {
  queue_.push([&](PictureQueue::Entry& entry) {
    entry.number = number;
    entry.width = image.width;
    entry.height = image.height;
    entry.bytes = image.pixels;  // into memory of its own
  });
}

void PngFolder::finish() {
  queue_.finish();
}

int PngFolder::commit() {
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(collecting_))
    if (isPicture(entry.path())) pictures.push_back(entry.path());
  for (const fs::path& picture : pictures) fs::rename(picture, folder_ / picture.filename());
  keep_ = false;
  return slice_.whole ? removeLater() : 0;
}

// Who makes a film of the folder would have their end of another one behind this. A run leaves no gap: what stands
// behind one is somebody's own.
int PngFolder::removeLater() const {
  int number = slice_.last;
  for (; isPng((folder_ / pngName(number)).string()); ++number) fs::remove(folder_ / pngName(number));
  return number - slice_.last;
}

PictureOutputs::PictureOutputs(const std::vector<std::string>& paths, const Settings& settings) {
  std::error_code unknown;
  for (const std::string& path : paths) {
    const std::string extension = fs::path(path).extension().string();
    if (settings.still) {
      if (extension != ".png") throw std::runtime_error(path + ": expected FILE.png for a still");
      stills_.emplace_back(path);
    } else if (isVideoName(path)) {
      videos_.emplace_back(path, settings.width, settings.height, settings.fps);
    } else if (isVideoName("film" + fs::path(path).filename().string())) {
      throw std::runtime_error(path + ": expected a name before the dot");  // a hidden file without an extension
    } else if (!extension.empty() && !fs::is_directory(path, unknown)) {
      throw std::runtime_error(path + ": expected FILE.mp4, .webm, .gif or .webp, or a folder for PNG files");
    } else {
      folders_.push_back(std::make_unique<PngFolder>(path, settings.slice));
    }
  }
}

bool PictureOutputs::has(int number) const {
  return videos_.empty() && stills_.empty() &&
         std::all_of(folders_.begin(), folders_.end(), [number](const auto& folder) { return folder->has(number); });
}

void PictureOutputs::write(int number, const Image& image) {
  for (VideoWriter& video : videos_) video.write(image);
  for (const auto& folder : folders_) folder->write(number, image);
  if (!stills_.empty()) still_ = image;
}

StageTimes::Stage PictureOutputs::encoding() const {
  StageTimes::Stage sum{"encode", 0, 0};
  const auto add = [&sum](const StageTimes::Stage& one) {
    sum.wall += one.wall;
    sum.cpu += one.cpu;
  };
  for (const VideoWriter& video : videos_) add(video.encoding());
  for (const auto& folder : folders_) add(folder->encoding());
  return sum;
}

void PictureOutputs::finish() {
  for (VideoWriter& video : videos_) video.finish(checkInterrupt);
  for (const auto& folder : folders_) folder->finish();
  for (OutputFile& still : stills_) {
    still.write(encodePng(still_));
    still.finish();
  }
}

std::vector<std::string> PictureOutputs::commit() {
  std::vector<std::string> notes;
  for (VideoWriter& video : videos_) video.commit();
  for (const auto& folder : folders_)
    if (const int gone = folder->commit(); gone > 0)
      notes.push_back(fmt::format("{}: {} numbered pictures beyond this run's are gone: they were of an earlier one",
                                  folder->path(), gone));
  for (OutputFile& still : stills_) still.commit();
  return notes;
}

}  // namespace medulla
