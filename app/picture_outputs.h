#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/files/output_file.h"
#include "render/output_folder.h"
#include "render/picture_queue.h"
#include "render/video_writer.h"

namespace medulla {

// A folder of numbered PNG files. They collect in DIR/A-B.part, on DIR's own disk wherever links to it lie, and move
// up when all are there: a run that ends early harms no earlier picture. Runs of other slices may fill the same folder
// at the same time; one of every picture takes away what a longer run before it has left: the PNG files that follow its
// last without a gap.
class PngFolder {
 public:
  struct Slice {
    int first = 0, last = 0;  // pictures [first, last)
    bool whole = false;       // there are no others
    std::uint64_t run = 0;    // of all that the pictures follow from
    bool resume = false;      // takes over what an ended run left of the same pictures, and leaves its own
  };
  // Throws std::runtime_error where the folder cannot be made or written, where a folder has the name of a picture,
  // where another process of this machine is at this slice (other machines see no lock), and where what is to be
  // resumed belongs to another run.
  PngFolder(const std::string& path, const Slice& slice);
  ~PngFolder();
  PngFolder(const PngFolder&) = delete;
  PngFolder& operator=(const PngFolder&) = delete;
  std::string path() const { return folder_.string(); }
  bool has(int number) const;                  // drawn before, and whole
  void write(int number, const Image& image);  // throws for an earlier one that could not be written
  void finish();                               // they are all written
  int commit();                                // and move up; how many pictures of an earlier run are gone
  const StageTimes::Stage& encoding() const { return queue_.encoding(); }

 private:
  void encode(PictureQueue::Entry& entry) const;
  void requireReplaceable() const;
  bool isPicture(const std::filesystem::path& path) const;  // of the slice, by its name
  bool isOurs(const std::filesystem::path& path) const;
  void takeOver() const;
  int removeLater() const;

  Slice slice_;
  OutputFolder made_;
  std::filesystem::path folder_, collecting_;
  bool keep_;
  std::optional<FolderLock> lock_;
  PictureQueue queue_;
};

// Where pictures go: any number of videos and folders of numbered PNG files; of a still, PNG files. Folders that are
// missing are made, and go again where nothing comes into them.
class PictureOutputs {
 public:
  struct Settings {
    int width = 0, height = 0;
    double fps = 0;
    bool still = false;
    PngFolder::Slice slice;
  };
  // Throws std::runtime_error naming the path that cannot be written or is none of these.
  PictureOutputs(const std::vector<std::string>& paths, const Settings& settings);
  bool has(int number) const;  // nobody needs this picture any more
  void write(int number, const Image& image);
  void finish();                       // throws Interrupted too
  std::vector<std::string> commit();   // then: all appear under their names; returns what users may not expect
  StageTimes::Stage encoding() const;  // of all videos and folders, in threads of their own

 private:
  std::vector<VideoWriter> videos_;
  std::vector<std::unique_ptr<PngFolder>> folders_;
  std::deque<OutputFile> stills_;
  Image still_;
};

}  // namespace medulla
