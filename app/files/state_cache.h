#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "app/files/output_file.h"
#include "app/simulation.h"

// What every picture of a run shows, so that pictures can be drawn without simulating: `medulla replay --cache` writes
// it, `medulla render --cache` reads it, any slice at once. Binary, for this machine's byte order:
//
//   "medulla cache", format, motion hash, pictures per second, bodies and tools with their names   the head
//   time, state hash, poses of spheres (double), nodes (float), tools and inputs, checksum        one per picture
//   number of pictures, state hash at the end, checksum over head and tail                        the tail
//
// Nodes are floats because that is what drawing takes; all else is exact. So pictures from a cache equal those of the
// run to the bit.
namespace medulla {

struct CacheLayout {
  struct Body {
    std::string name;
    int spheres = 0, nodes = 0;
    bool operator==(const Body&) const = default;
  };
  std::uint64_t motionHash = 0;  // of all that the run's motion follows from
  double fps = 30;               // picture k shows the time k / fps
  std::vector<Body> bodies;
  std::vector<std::string> tools;
};

class CacheWriter {
 public:
  CacheWriter(const std::string& path, const CacheLayout& layout);  // throws as OutputFile does
  // The next picture; `stateHash` is that of the dynamics frame which it lies in.
  void write(const PictureState& state, std::uint64_t stateHash);
  void finish(std::uint64_t finalHash);  // once, after the last picture
  void commit() { file_.commit(); }      // then: the file appears

 private:
  OutputFile file_;
  std::string head_;
  std::uint64_t pictures_ = 0;
};

class CacheReader {
 public:
  // Throws std::runtime_error naming the file where it is no cache, of another format, cut off or broken. Counts in it
  // are held against its length before anything is made of them.
  explicit CacheReader(const std::string& path);
  const CacheLayout& layout() const { return layout_; }
  int pictures() const { return pictures_; }
  std::uint64_t finalHash() const { return finalHash_; }
  // Picture `number` of 0 to pictures() - 1, at once; `state` is reused. Returns its state hash. Throws where its
  // checksum does not hold.
  std::uint64_t read(int number, PictureState& state);

 private:
  std::string path_;
  std::ifstream file_;
  CacheLayout layout_;
  std::size_t headSize_ = 0, recordSize_ = 0;
  int pictures_ = 0;
  std::uint64_t finalHash_ = 0;
  std::string record_;
};

// Whether a file begins as a cache does; false where it cannot be read.
bool isCache(const std::string& path);

}  // namespace medulla
